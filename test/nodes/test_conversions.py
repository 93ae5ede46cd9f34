"""Gaits survive being messages, and messages that don't fit are refused."""

from array import array
from dataclasses import fields

import pytest

pytest.importorskip("rclpy")

from library.made_up_gait import made_up_gait, with_refinement
from rclpy.serialization import deserialize_message, serialize_message
from walk_optimizer_interfaces.msg import Gait, SolverReport

from walk_optimizer.errors import GaitFileError
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.conversions import gait_from_message, gait_to_message, request_of_message
from walk_optimizer.nodes.streamed_gait import ReceivedGait
from walk_optimizer.refined_trajectory import RefinedTrajectory

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


def test_what_is_streamed_is_refined_only_where_that_is_certified():
    gaits = (with_refinement(made_up_gait(), certified=certified) for certified in (True, False))
    streamed = [ReceivedGait.from_message(gait_to_message(gait), WalkerParameters()) for gait in gaits]
    assert [str(one) for one in streamed] == ["0.3185 m/s (radau)", "0.3185 m/s (implicit_euler)"]
