"""The packaged transitions join stand and gaits, and files that don't fit are set aside."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from walk_optimizer.errors import GaitFileError, GaitNotFoundError
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.mechanics import mechanics_at
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.references import make_reference
from walk_optimizer.references.profile import RefinedProfile, StepSample
from walk_optimizer.transition.builder import table_pairs
from walk_optimizer.transition.certificate import certify_steps
from walk_optimizer.transition.files import TransitionName, read_transition_file
from walk_optimizer.transition.paces import Pace, pace_name, refined_of
from walk_optimizer.transition.standing import Standing
from walk_optimizer.transition.table import TransitionTable, cache_folder, packaged_stand, table_folder
from walk_optimizer.transition.transition import Transition

SPRUNG = SpringMode.STIFFNESS_AND_EQUILIBRIUM


@pytest.fixture(scope="session")
def own_folder(tmp_path_factory):
    return tmp_path_factory.mktemp("nothing_of_ones_own")


def begun(pace: Pace) -> StepSample:
    """Return where a pace begins."""
    if isinstance(pace, Standing):
        return StepSample(pace.q, np.zeros(6), pace.torques)
    return RefinedProfile.of(refined_of(pace)).sample(0.0)


def ended(pace: Pace) -> StepSample:
    """Return where a pace, a stand being no step, is left."""
    if isinstance(pace, Standing):
        return begun(pace)
    step = RefinedProfile.of(refined_of(pace))
    return step.sample(step.step_time)


def assert_joints_are_continuous(transition: Transition) -> None:
    """Compare what a listener sees of left and right legs right before and right after each border."""
    standing = isinstance(transition.source, Standing)
    # A stand keeps its legs, a step exchanges them: the number tells left from right.
    seen = [(ended(transition.source), ended(transition.source), 0)]
    for number, step in enumerate(transition.steps, start=0 if standing else 1):
        profile = RefinedProfile.of(step)
        seen.append((profile.sample(0.0), profile.sample(profile.step_time), number))
    seen.append((begun(transition.target), begun(transition.target), seen[-1][2] + 1))
    # Gaits begin where a replay of their torques does best, as close to where they end as certified.
    tolerances = [*[1e-8] * len(transition.steps), 1e-6]
    for ((_, before, one), (after, _, other)), tolerance in zip(pairwise(seen), tolerances, strict=True):
        left = make_reference(before, one, 0.0, np.zeros(2))
        right = make_reference(after, other, 0.0, np.zeros(2))
        np.testing.assert_allclose(left.position, right.position, rtol=0, atol=tolerance)


@given(data=st.data())
@settings(max_examples=6, deadline=None)
def test_packaged_transitions_join_what_they_lead_from_and_to(walker, stand, gaits, own_folder, data):
    table = TransitionTable(walker, own_folder)
    pairs = table_pairs(stand, [gait for own in gaits.values() for gait in own])
    solved = {(name.source, name.target) for name in table.names()}
    known = [pair for pair in pairs if (pace_name(pair[0]), pace_name(pair[1])) in solved]
    source, target = data.draw(st.sampled_from(known))
    transition = table.find(source, target)
    assert transition is not None
    assert transition.certificate.certified
    assert_joints_are_continuous(transition)
    # Replaying all intervals takes seconds: the command `transitions verify` does it for every file.
    _, certificate = certify_steps(
        walker, source, target, transition.steps, transition.torque_limit, replay=False
    )
    assert certificate.certified


def test_every_pair_of_the_table_is_solved(table, stand, gaits):
    every = [gait for own in gaits.values() for gait in own]
    pairs = {(pace_name(one), pace_name(other)) for one, other in table_pairs(stand, every)}
    assert len(pairs) == len(SpringMode) * (2 * 7 + 2 * 6)
    assert {(name.source, name.target) for name in table.names()} == pairs


def test_gaits_that_are_not_refined_have_no_transitions(stand, gaits):
    assert table_pairs(stand, [replace(gait, refined=None) for gait in gaits[SPRUNG]]) == []


def test_every_speed_on_springs_is_reached_from_the_stand_and_left_to_it(table, stand, gaits):
    for gait in gaits[SPRUNG]:
        start, stop = table.find(stand, gait), table.find(gait, stand)
        assert start is not None
        assert stop is not None
        assert start.spring == stop.spring == refined_of(gait).spring
    assert table.problems() == []


def test_a_start_begins_and_a_stop_ends_at_rest_on_both_feet(table, stand, gaits):
    start = table.find(stand, gaits[SPRUNG][0])
    stop = table.find(gaits[SPRUNG][0], stand)
    first, last = start.steps[0].trajectory, stop.steps[-1].trajectory
    for state, forces, spring in (
        (first.states[0, 0], first.forces[0, 0], start.spring),
        (last.states[-1, -1], last.forces[-1, -1], stop.spring),
    ):
        mechanics = mechanics_at(stand.walker, spring, state[:6, None], state[6:, None])
        np.testing.assert_allclose(mechanics.qdot, 0.0, atol=1e-9)
        assert np.all(forces[[1, 3]] > 0)


def test_a_path_has_the_fewest_steps_and_joins_its_transitions(table, stand, gaits):
    slowest, fastest = gaits[SPRUNG][0], gaits[SPRUNG][-1]
    straight = table.path(stand, fastest, gaits[SPRUNG])
    assert len(straight) == 1
    there = table.path(slowest, fastest, [*gaits[SPRUNG], stand])
    assert all(before.target is after.source for before, after in pairwise(there))
    assert (there[0].source, there[-1].target) == (slowest, fastest)


def test_known_steps_are_measured_joint_by_joint(table, stand, gaits):
    gait = gaits[SPRUNG][-1]
    known = table.find(stand, gait)
    hip, knee = known.peak_torques
    assert min(hip, knee) < 0.9 * max(hip, knee)
    assert table.find(stand, gait, (hip, knee)) is not None
    assert table.find(stand, gait, min(hip, knee)) is None
    assert table.find(stand, gait, (hip, 0.99 * knee)) is None


def test_a_path_keeps_a_torque_limit_by_way_of_slower_gaits(table, stand, gaits):
    limit = 60.0
    fast = gaits[SPRUNG][5]
    direct = table.find(stand, fast)
    assert direct.peak_torques.max() > limit
    detour = table.path(stand, fast, gaits[SPRUNG], limit)
    assert len(detour) > 1
    assert all(each.peak_torques.max() <= limit for each in detour)
    assert table.find(stand, fast, limit) is None


def test_what_leads_nowhere_says_what_to_do(table, stand, gaits):
    fastest = gaits[SPRUNG][-1]
    for limit, within in ((1.0, " within 1 N m"), ((1.0, 50.0), " within 1 N m at the hips and 50 N m at")):
        with pytest.raises(GaitNotFoundError, match=f"{pace_name(fastest)}{within}.*; solve one with plan_"):
            table.path(stand, fastest, (), torque_limit=limit)
    with pytest.raises(GaitNotFoundError, match=f"from stand to {pace_name(stand)}; solve one with plan_"):
        table.path(stand, stand)


def test_a_stored_transition_is_the_same_when_it_is_read(table, solved, walker):
    path = table.store(solved)
    again = TransitionTable(walker, table.folder).find(solved.source, solved.target)
    assert path.name == TransitionName.of(solved).file_name(walker)
    assert again.certificate == solved.certificate
    for one, other in zip(again.steps, solved.steps, strict=True):
        assert (one.spring, one.step_length, one.certificate) == (
            other.spring,
            other.step_length,
            other.certificate,
        )
        np.testing.assert_array_equal(one.trajectory.states, other.trajectory.states)


def test_a_damaged_file_is_set_aside_with_its_path(table, solved, walker):
    path = table.store(solved)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    own = TransitionTable(walker, table.folder)
    found = own.find(solved.source, solved.target)
    assert found is None or found.steps[0].trajectory is not solved.steps[0].trajectory
    assert str(path) in own.problems()[0]


def test_a_file_for_another_solution_of_the_gait_is_refused(table, solved):
    path = table.store(solved)
    trajectory = solved.target.refined.trajectory
    other = replace(solved.target.refined, trajectory=replace(trajectory, states=trajectory.states * 1.0001))
    with pytest.raises(GaitFileError, match="another solution of none_0"):
        read_transition_file(path, solved.source, replace(solved.target, refined=other))


def test_only_what_is_certified_is_stored(table, solved):
    failing = replace(solved.certificate.entries[0], violation=1.0)
    uncertified = replace(solved, certificate=replace(solved.certificate, entries=(failing,)))
    with pytest.raises(GaitFileError, match="only certified transitions are stored"):
        table.store(uncertified)


def test_walkers_do_not_meet_in_the_cache():
    assert cache_folder(WalkerParameters()) != cache_folder(WalkerParameters(hip_mass=50.0))
    assert cache_folder(WalkerParameters()).parent.name == "transitions"


def test_a_file_of_ones_own_that_no_longer_fits_leaves_the_packaged_one(tmp_path):
    walker = WalkerParameters.from_yaml()
    gait = GaitLibrary(walker, tmp_path).find(0.25 / 0.785, SPRUNG)[0]
    stand = packaged_stand(walker)
    packaged = TransitionTable(walker, tmp_path).find(stand, gait)
    assert packaged is not None
    # Of the same names, but into a gait with the end of another one.
    (name,) = (path.name for path in table_folder().glob(f"stand__{pace_name(gait)}__*"))
    (other,) = table_folder().glob(
        f"stand__{pace_name(gait).replace('0.2500m_0.7850s', '0.3000m_0.7200s')}__*"
    )
    (tmp_path / name).write_bytes(other.read_bytes())
    table = TransitionTable(walker, tmp_path)
    found = table.find(stand, gait)
    assert found is not None
    np.testing.assert_array_equal(found.peak_torques, packaged.peak_torques)
    assert [str(tmp_path / name) in problem for problem in table.problems()] == [True]
