"""Gaits survive being messages, and messages that don't fit are refused."""

import math
from array import array
from dataclasses import fields

import pytest

pytest.importorskip("rclpy")

from library.made_up_gait import made_up_gait, with_refinement
from rclpy.serialization import deserialize_message, serialize_message
from walk_optimizer_interfaces.msg import Gait, SolverReport

from walk_optimizer.errors import GaitFileError, SolveFailedError
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.conversions import gait_from_message, gait_to_message, request_of_message
from walk_optimizer.nodes.streamed_gait import ReceivedGait

MODE = "stiffness_and_equilibrium"


def received(message):
    """Return the gait of a message that has travelled as bytes."""
    message = deserialize_message(serialize_message(message), Gait)
    report = SolverReport(status="solved")
    return gait_from_message(message, report, WalkerParameters(), request_of_message(message))


def test_a_gait_survives_the_message():
    gait = made_up_gait(mode=MODE)
    back = received(gait_to_message(gait))
    for name in ("time", "q", "p", "u", "reaction", "slip_speed"):
        assert (getattr(back.trajectory, name) == getattr(gait.trajectory, name)).all()
    assert (back.spring, back.certificate, back.speed) == (gait.spring, gait.certificate, gait.speed)
    assert back.refined is None


def test_its_refined_part_survives_too():
    refined = with_refinement(made_up_gait(mode=MODE)).refined
    message = gait_to_message(with_refinement(made_up_gait(mode=MODE)))
    back = received(message).refined
    for name in (entry.name for entry in fields(RefinedTrajectory)):
        assert (getattr(back.trajectory, name) == getattr(refined.trajectory, name)).all()
    assert (back.spring, back.step_length) == (refined.spring, refined.step_length)
    assert back.certificate == refined.certificate
    assert message.refined[0].torque_effort == refined.trajectory.torque_effort


@pytest.mark.parametrize(
    "walker", [WalkerParameters(hip_mass=90.0), WalkerParameters(friction_coefficient=0.3)]
)
def test_a_gait_of_another_walker_is_refused(walker):
    message = gait_to_message(made_up_gait())
    with pytest.raises(GaitFileError, match=r"the gait is for a walker with .* the same walker_file"):
        ReceivedGait.from_message(message, walker)


@pytest.mark.parametrize("number", [0.0, -1.0, math.nan, math.inf])
@pytest.mark.parametrize("field", ["step_time", "step_length"])
@pytest.mark.parametrize("whole", [with_refinement(made_up_gait()), made_up_gait()])
def test_steps_without_length_or_duration_are_refused(whole, field, number):
    message = gait_to_message(whole)
    setattr(message, field, number)
    with pytest.raises(GaitFileError, match=f"{field} is {number}"):
        ReceivedGait.from_message(message, WalkerParameters())


@pytest.mark.parametrize("field", ["stiffness", "equilibrium"])
def test_springs_that_are_no_numbers_are_refused(field):
    message = gait_to_message(with_refinement(made_up_gait()))
    for part in (message, message.refined[0]):
        former = getattr(part, field)
        setattr(part, field, math.nan)
        with pytest.raises(GaitFileError, match="expected finite numbers"):
            ReceivedGait.from_message(message, WalkerParameters())
        setattr(part, field, former)


def cut(name):
    return lambda step: setattr(step, name, getattr(step, name)[:-1])


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (cut("breaks"), "gait message: refined breaks has 5 numbers, expected 6"),
        (cut("states"), "gait message: refined states has 239 numbers, expected 5 x 4 x 12"),
        (lambda step: setattr(step, "intervals", 4_000_000_000), "6 numbers, expected 4000000001"),
        (
            lambda step: setattr(step, "torques", array("d", [float("nan")] * 45)),
            "array refined_torques has 45",
        ),
        (
            lambda step: setattr(step, "breaks", array("d", range(6))),
            "array refined_breaks leads from 0 s to 5 s",
        ),
        (lambda step: setattr(step, "step_length", -0.1), "step_length of the refined part is -0.1"),
        (lambda step: setattr(step.certificate, "unit", []), "columns of a certificate are not equally long"),
    ],
)
def test_a_refined_part_that_does_not_fit_is_refused(change, problem):
    message = gait_to_message(with_refinement(made_up_gait()))
    change(message.refined[0])
    with pytest.raises(GaitFileError) as error:
        ReceivedGait.from_message(message, WalkerParameters())
    assert problem in str(error.value)


def false_claim(certificate):
    certificate.violation = [1e9] * len(certificate.violation)


def no_number(certificate):
    certificate.violation = [math.nan] * len(certificate.violation)


def nothing_claimed(certificate):
    for column in ("family", "violation", "tolerance", "unit"):
        setattr(certificate, column, [])


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        (
            false_claim,
            "this one is not: dynamics is off by 1e+09 N, allowed is 0.0007; penetration is off by",
        ),
        (no_number, "this one is not: dynamics is off by nan N"),
        (nothing_claimed, "this one is not: its certificate has no entries"),
    ],
)
def test_a_certificate_is_judged_by_its_entries_whatever_it_claims(change, problem):
    message = gait_to_message(with_refinement(made_up_gait()))
    change(message.refined[0].certificate)
    assert message.refined[0].certificate.certified
    assert ReceivedGait.from_message(message, WalkerParameters()).profile.method == "implicit_euler"
    change(message.certificate)
    with pytest.raises(SolveFailedError) as error:
        ReceivedGait.from_message(message, WalkerParameters())
    assert problem in str(error.value)


def test_what_is_streamed_is_refined_only_where_that_is_certified():
    gaits = (with_refinement(made_up_gait(), certified=certified) for certified in (True, False))
    streamed = [ReceivedGait.from_message(gait_to_message(gait), WalkerParameters()) for gait in gaits]
    assert [str(one) for one in streamed] == ["0.3185 m/s (radau)", "0.3185 m/s (implicit_euler)"]
