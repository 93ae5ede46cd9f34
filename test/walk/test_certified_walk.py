"""A walk over packaged gaits by packaged transitions: start, speed up, slow down, stop."""

import math
from itertools import pairwise

import numpy as np
import pytest

from walk_optimizer.jobs.transitions import TransitionJob, planned
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.references.profile import RefinedProfile, profile_of
from walk_optimizer.transition.table import packaged_stand
from walk_optimizer.walk.phase_clock import PhaseClock
from walk_optimizer.walk.stand import StandProfile
from walk_optimizer.walk.walk import StepPlan, Walk

MODE = SpringMode.STIFFNESS_AND_EQUILIBRIUM
PERIOD = 1e-3


@pytest.fixture(scope="module")
def walker():
    return WalkerParameters.from_yaml()


@pytest.fixture(scope="module")
def plans(walker, tmp_path_factory):
    """Plans along a stand, two gaits and a stand again, with their paces."""
    folder = tmp_path_factory.mktemp("transitions")
    gaits = GaitLibrary(walker, tmp_path_factory.mktemp("gaits")).gaits()
    slow, fast = [gait for gait in gaits if gait.request.spring_mode is MODE][1:3]
    stand = packaged_stand(walker)
    last = stand.on(slow.refined.spring)
    chain = [(stand, StandProfile(stand)), *((gait, profile_of(gait)) for gait in (slow, fast, slow))]
    chain.append((last, StandProfile(last)))
    found = []
    for (source, begins), (target, leads_to) in pairwise(chain):
        answer = planned(TransitionJob(source, target, math.inf, 60.0, folder))
        assert (answer.message, answer.problem) == ("from the table", "")
        steps = tuple(RefinedProfile.of(step) for step in answer.steps)
        found.append(StepPlan(begins, steps, leads_to))
    return found


def test_nothing_jumps_but_velocities_where_a_foot_lands(plans):
    walk, time = Walk(plans[0].begins, PhaseClock()), 0.0
    references = [walk.advance(time)]
    for plan in plans:
        walk.follow(plan)
        end = time + sum(step.step_time for step in plan.steps) + 2.0
        while time < end:
            time += PERIOD
            references.append(walk.advance(time))
    assert walk.pace is plans[-1].leads_to
    position = np.array([reference.position for reference in references])
    velocity = np.array([reference.velocity for reference in references])
    landing = np.diff([reference.step for reference in references]) > 0
    assert landing.sum() > 8
    assert np.abs(np.diff(position, axis=0)).max() <= np.abs(velocity).max() * PERIOD * 1.01
    jumps = np.abs(np.diff(velocity, axis=0)).max(axis=1)
    # A leg swings at some hundred rad/s^2 at the most.
    assert jumps[~landing].max() < 1.0
    assert not velocity[-1].any()
    base = np.array([reference.base for reference in references])
    assert np.all(np.diff(base[:, 0]) > -1e-3)
    assert np.abs(np.diff(base, axis=0)).max() < 2e-3


def test_a_leg_is_never_left_behind_by_its_name(plans):
    """Left and right exchange the roles at each step, also from the stand on and into it."""
    walk, time, feet = Walk(plans[0].begins, PhaseClock()), 0.0, []
    walk.advance(time)
    walk.follow(plans[0])
    while time < 4.0:
        time += PERIOD
        reference = walk.advance(time)
        left_hip, left_knee = reference.position[:2]
        lower = left_hip + left_knee - math.pi
        feet.append(reference.base[0] + 0.5 * math.sin(left_hip) + 0.5 * math.sin(lower))
    # The left foot is where it was, or on its way forwards.
    assert np.abs(np.diff(feet)).max() < 5e-3
