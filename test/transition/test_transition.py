"""Solved steps join their gaits, obey the mechanics, and say why where there are none."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.model.mechanics import foot_arm, mechanics_at
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.references.profile import RefinedProfile, join_error
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.status import Status
from walk_optimizer.transition.builder import recomputed
from walk_optimizer.transition.certificate import certify_steps
from walk_optimizer.transition.files import read_transition_file, write_transition_file
from walk_optimizer.transition.paces import refined_of
from walk_optimizer.transition.solve import plan_transition
from walk_optimizer.transition.transition import Transition


def joined(transition: Transition) -> list[RefinedProfile]:
    """Return the gait before, the steps, and the gait after."""
    steps = (refined_of(transition.source), *transition.steps, refined_of(transition.target))
    return [RefinedProfile.of(step) for step in steps]


def energy(transition: Transition, step: int, interval: int, place: int) -> float:
    """Return kinetic and potential energy in [J] at a node, potential energy from the hip up left out."""
    state = transition.steps[step].trajectory.states[interval, place]
    mechanics = mechanics_at(transition.walker, transition.spring, state[:6, None], state[6:, None])
    return float(state[6:] @ mechanics.qdot[:, 0] / 2)


def test_positions_are_continuous_from_gait_to_gait(solved):
    *steps, target = joined(solved)
    for before, after in pairwise(steps):
        assert join_error(before, after) < 1e-8
    # Gaits begin where a replay of their torques does best, as close to where they end as certified.
    assert join_error(steps[-1], target) < 1e-6


def test_velocities_agree_where_the_target_takes_over(solved):
    """Right before the foot lands; in the impact they jump, as in every step of a gait."""
    last, target = solved.steps[-1], refined_of(solved.target)
    ends = [
        mechanics_at(solved.walker, one.spring, state[:6, None], state[6:, None]).qdot
        for one in (last, target)
        for state in (one.trajectory.states[-1, -1],)
    ]
    np.testing.assert_allclose(*ends, atol=1e-8)


def test_it_has_the_spring_of_the_target(solved):
    assert solved.spring == refined_of(solved.target).spring


def test_impacts_take_energy_away(solved):
    for number, step in enumerate(solved.steps):
        before = refined_of(solved.source) if number == 0 else solved.steps[number - 1]
        state = before.trajectory.states[-1, -1]
        mechanics = mechanics_at(solved.walker, step.spring, state[:6, None], state[6:, None])
        assert energy(solved, number, 0, 0) < state[6:] @ mechanics.qdot[:, 0] / 2


def test_its_certificate_holds_and_is_that_of_its_steps(solved):
    assert solved.certificate.certified
    assert all(step.certificate.certified for step in solved.steps)
    assert recomputed(solved) == solved.certificate


def landing_speed(walker, step):
    """Speed of foot 2 towards level ground as a step ends, in [m/s]."""
    state = step.trajectory.states[-1, -1][:, None]
    return -mechanics_at(walker, step.spring, state[:6], state[6:]).foot_velocity(1)[1, 0]


def test_steps_on_the_way_land_as_fast_as_the_walker_asks(solved):
    first = solved.steps[0]
    walker = replace(solved.walker, landing_speed=landing_speed(solved.walker, first) + 0.1)
    _, refused = certify_steps(walker, solved.source, solved.target, solved.steps, solved.torque_limit)
    assert [entry.family for entry in refused.failures()] == ["landing_speed"]
    source, target = (replace(gait, walker=walker) for gait in (solved.source, solved.target))
    outcome = plan_transition(walker, source, target, steps=len(solved.steps))
    assert outcome.transition is not None, outcome.report.message
    landing = landing_speed(walker, outcome.transition.steps[0])
    assert landing == pytest.approx(walker.landing_speed, abs=1e-6)


@pytest.mark.parametrize(
    ("change", "family"),
    [
        ({"torques": 1.001}, "dynamics"),
        ({"forces": 1.001}, "dynamics"),
        ({"impulses": 1.01}, "impact"),
        ({"states": 1.000001}, "departure"),
        ({"breaks": 1.001}, "kinematics"),
    ],
)
def test_what_is_broken_is_found(solved, change, family):
    ((name, factor),) = change.items()
    first, last = solved.steps
    values = getattr(first.trajectory, name) * factor
    broken = replace(first, trajectory=replace(first.trajectory, **{name: values}))
    certificate = recomputed(replace(solved, steps=(broken, last)))
    assert family in {entry.family for entry in certificate.failures()}


def test_steps_that_lead_elsewhere_are_found(solved, gaits):
    other = gaits[SpringMode.NONE][2]
    failures = {entry.family for entry in recomputed(replace(solved, target=other)).failures()}
    assert {"arrival_joints", "arrival_velocity"} <= failures


def test_torques_beyond_the_limit_are_found(solved):
    certificate = recomputed(replace(solved, torque_limit=float(solved.peak_torques.max()) / 2))
    assert {entry.family for entry in certificate.failures()} == {"torque_limit"}


def test_one_step_keeps_its_torque_limit(walker, gaits):
    slow, faster = gaits[SpringMode.NONE][:2]
    outcome = plan_transition(walker, slow, faster, steps=1, torque_limit=20.0)
    assert outcome.transition is not None
    assert outcome.transition.certificate.certified
    # Streamed at whatever rate, not only at the nodes of the solve.
    (step,) = outcome.transition.steps
    places = np.linspace(0, 1, 50)
    torques = [step.trajectory.torque(k, s) for k in range(step.trajectory.intervals) for s in places]
    assert 19.5 < np.abs(torques).max() <= 20.0


def test_hips_and_knees_have_limits_of_their_own(walker, gaits, tmp_path):
    slow, faster = gaits[SpringMode.NONE][:2]
    free = plan_transition(walker, slow, faster, steps=1).transition
    hip, knee = free.peak_torques
    assert hip > knee
    bounded = plan_transition(walker, slow, faster, steps=1, torque_limit=(0.9 * hip, np.inf)).transition
    assert bounded.certificate.certified
    assert bounded.peak_torques[0] <= 0.9 * hip
    assert bounded.torque_effort > free.torque_effort
    tight = replace(bounded, torque_limit=(0.9 * hip, bounded.peak_torques[1] / 2))
    assert [entry.family for entry in recomputed(tight).failures()] == ["torque_limit"]
    read = read_transition_file(write_transition_file(bounded, tmp_path), slow, faster)
    assert read.torque_limit == bounded.torque_limit


def test_torques_that_are_too_small_for_it_end_in_a_status_with_a_reason(walker, stand, gaits):
    outcome = plan_transition(
        walker, stand, gaits[SpringMode.NONE][-1], steps=1, torque_limit=3.0, time_limit=20
    )
    assert outcome.transition is None
    assert outcome.report.status is not Status.SOLVED
    assert "is off by" in outcome.report.message


def test_a_cancel_is_obeyed(walker, gaits):
    slow, faster = gaits[SpringMode.NONE][:2]
    outcome = plan_transition(walker, slow, faster, progress=lambda progress: progress.iteration < 3)
    assert outcome.transition is None
    assert outcome.report.status is Status.CANCELLED


def test_the_report_names_the_solver_that_was_used(walker, gaits):
    slow, faster = gaits[SpringMode.NONE][:2]
    uno = replace(solver_settings(), back_end="uno")
    outcome = plan_transition(walker, slow, faster, solver=uno, progress=lambda _: False)
    assert outcome.report.back_end == "uno"


def test_requests_that_make_no_sense_are_refused(walker, stand, gaits):
    gait = gaits[SpringMode.NONE][0]
    uphill = WalkerParameters(terrain=Terrain(slope=0.05))
    for arguments, options, text in (
        ((walker, stand, stand), {}, "both are stands"),
        ((walker, stand, gait), {"steps": 0}, "steps is 0, allowed is 1 to 4"),
        (
            (walker, stand, gait),
            {"torque_limit": 0.0},
            r"torque limit is 0\.0 N m, allowed is a number above 0",
        ),
        ((walker, stand, gait), {"torque_limit": (9.0, -1.0)}, r"limit is \(9\.0, -1\.0\) N m, allowed is"),
        (
            (walker, stand, gait),
            {"torque_limit": (1, 2, 3)},
            r"limit is \(1, 2, 3\) N m, allowed is a number",
        ),
        ((walker, stand, gait), {"torque_limit": "9"}, "limit is '9' N m, allowed is a number above 0, or"),
        ((walker, stand, gait), {"time_limit": -1.0}, r"time limit is -1\.0 s, allowed is above 0"),
        ((walker, stand, replace(gait, refined=None)), {}, "no certified refined part"),
        ((uphill, stand, gait), {}, "level ground"),
        ((WalkerParameters(hip_mass=50.0), stand, gait), {}, "for the walker of the transition"),
    ):
        with pytest.raises(InvalidRequestError, match=text):
            plan_transition(*arguments, **options)


def test_a_swing_foot_stays_in_the_air_and_lands_where_the_step_ends(solved):
    for step in solved.steps:
        nodes = step.trajectory.states[:, 1:].reshape(-1, 12).T
        heights = foot_arm(solved.walker, nodes[:6], 1).position[1]
        assert heights.min() > -1e-6
        assert heights.max() > 5e-3
        assert foot_arm(solved.walker, nodes[:6, -1:], 1).position[0, 0] == pytest.approx(step.step_length)
