"""The floating base is found from joint positions alone, and feet, paths and forces are the gait's."""

from dataclasses import replace

import numpy as np
import pytest
from library.made_up_gait import made_up_gait, with_refinement

from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.mechanics import foot_arm
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.references import cycle_reference
from walk_optimizer.scene.gait import Place, ShownGait
from walk_optimizer.scene.paths import Trail, paths_ahead
from walk_optimizer.scene.tracking import GAIT_TOLERANCE, WalkTracker

WALKER = WalkerParameters()
SPEED, MODE = 0.32, "stiffness_and_equilibrium"


@pytest.fixture(scope="module", params=["refined", "euler"])
def solved(request):
    """A packaged gait, and it as displays show it, with and without its refinement."""
    gait, _ = GaitLibrary(WALKER).find(SPEED, MODE, "nearest")
    shown = ShownGait(gait if request.param == "refined" else replace(gait, refined=None))
    return gait, shown


def walk(profile, rate, duration, begin=0.0):
    """References of an endless walk, and where its base is."""
    for time in begin + np.arange(0.0, duration, 1 / rate):
        cycles, rest = divmod(time, 2 * profile.step_time)
        reference = cycle_reference(profile, rest)
        yield reference, reference.base + 2 * cycles * np.array([profile.step_length, profile.rise])


@pytest.mark.parametrize("rate", [100.0, 30.0, 3.1])
def test_the_base_is_the_walks_over_ten_steps_at_any_rate(solved, rate):
    _, shown = solved
    tracker = WalkTracker(WALKER)
    tracker.follow(shown)
    offsets = []
    for reference, base in walk(shown.profile, rate, 10 * shown.profile.step_time, begin=0.123):
        pose = tracker.take(reference.position)
        # The end of a step is the start of the next.
        late = pose.place.time - reference.time + (pose.stance - reference.step % 2) * shown.profile.step_time
        assert (late + 0.1) % (2 * shown.profile.step_time) == pytest.approx(0.1, abs=1e-4)
        offsets.append(pose.base - base)
    # The tracker begins where it is told nothing of, and does not drift from there.
    assert np.ptp(offsets, axis=0).max() < 1e-4


@pytest.fixture(scope="module")
def shipped(tmp_path_factory):
    """The gaits that ship, as displays show them."""
    library = GaitLibrary(WalkerParameters.from_yaml(), tmp_path_factory.mktemp("empty"))
    return [ShownGait(gait) for gait in library.gaits()]


def place_at(shown, time):
    """The place at a time in [s] of an endless walk."""
    step, rest = divmod(time, shown.profile.step_time)
    return Place(rest, int(step) % 2, 0.0)


def passing_time(shown):
    """The time in [s] of a step when the legs pass each other: there the mirrored posture is nearest."""
    references = [one for one, _ in walk(shown.profile, 2000.0, shown.profile.step_time)]
    return min(references, key=lambda one: np.abs(one.position[:2] - one.position[2:]).max()).time


# What is known besides positions: the scale of the velocity, and how many cycles ago the place before was.
KNOWLEDGE = {
    "velocity": (1.0, None),
    "velocity on the way to a pause": (1e-3, None),
    "place before": (None, 0.2),
    "place before in a pause": (0.0, 0.0),
    "velocity after lost references": (1.0, 0.5),
}


def locate_late(shown, time, scale, ago, noise=0.0):
    """Where a reference is found that is as much as `noise` off in [rad], and by how much too late in [s]."""
    cycle = 2 * shown.profile.step_time
    reference = cycle_reference(shown.profile, time)
    velocity = None if scale is None else scale * reference.velocity
    before = None if ago is None else place_at(shown, time - ago * cycle)
    found = shown.locate(reference.position + noise, velocity, before)
    late = found.time + found.stance * shown.profile.step_time - time
    # The end of a cycle is the start of the next.
    return found, (late + 0.1) % cycle - 0.1


@pytest.mark.parametrize(("scale", "ago"), KNOWLEDGE.values(), ids=list(KNOWLEDGE))
def test_no_place_of_a_shipped_gait_is_taken_for_the_mirrored_one(shipped, scale, ago):
    assert len(shipped) == 21
    for shown in shipped:
        cycle = 2 * shown.profile.step_time
        for time in np.linspace(0.0, cycle, 1001)[:-1].tolist():
            found, late = locate_late(shown, time, scale, ago)
            assert abs(late) < 3e-4, (shown.profile.step_time, time)
            assert found.deviation < GAIT_TOLERANCE / 20


@pytest.mark.parametrize(("scale", "ago"), KNOWLEDGE.values(), ids=list(KNOWLEDGE))
@pytest.mark.parametrize("speed", [1.92, 2.44, 3.913], ids="{} km/h".format)
def test_noise_where_the_legs_pass_each_other_mirrors_no_place(speed, scale, ago):
    gait, _ = GaitLibrary(WALKER).find(speed / 3.6, "stiffness", "nearest")
    shown = ShownGait(gait)
    close = passing_time(shown) + np.linspace(-2e-3, 2e-3, 101)
    # More than the mirrored posture is off: positions alone take some of these places for mirrored ones.
    noises = np.random.default_rng(1).uniform(-3e-4, 3e-4, (2, close.size, 4))
    for step, noise in enumerate(noises):
        for time, off in zip((close + step * shown.profile.step_time).tolist(), noise, strict=True):
            found, late = locate_late(shown, time, scale, ago, off)
            assert abs(late) < 1e-3, time
            assert found.deviation < GAIT_TOLERANCE / 2


@pytest.mark.parametrize("told", [True, False], ids=["velocities", "positions alone"])
@pytest.mark.parametrize("speed", [1.92, 2.44, 3.913], ids="{} km/h".format)
def test_for_minutes_no_stride_is_made_up_where_the_legs_pass_each_other(speed, told):
    gait, _ = GaitLibrary(WALKER).find(speed / 3.6, "stiffness", "nearest")
    shown, tracker = ShownGait(gait), WalkTracker(WALKER)
    tracker.follow(shown)
    # Pictures fall anywhere in an interval of the stream: no place of the cycle is left out.
    late = np.random.default_rng(1).uniform(0.0, 2e-3, 5400)
    offsets = []
    for time in np.arange(5400) / 30.0 + late:
        ((reference, base),) = walk(shown.profile, 1.0, 0.5, begin=time)
        offsets.append(tracker.take(reference.position, reference.velocity if told else None).base - base)
    assert np.ptp(offsets, axis=0).max() < 1e-3


def test_a_pause_where_the_legs_pass_each_other_moves_nothing():
    gait, _ = GaitLibrary(WALKER).find(2.44 / 3.6, "stiffness", "nearest")
    shown = ShownGait(gait)
    for pause in passing_time(shown) + np.linspace(-0.01, 0.01, 41):
        tracker = WalkTracker(WALKER)
        tracker.follow(shown)
        offsets = []
        # The walk slows down to a hold, and runs again.
        for ahead in (-0.05, -0.02, -0.001, 0.0, 0.0, 0.0, 0.001, 0.02, 0.05):
            ((reference, base),) = walk(shown.profile, 1.0, 0.5, begin=pause + ahead)
            offsets.append(tracker.take(reference.position, abs(ahead) * reference.velocity).base - base)
        assert np.ptp(offsets, axis=0).max() < 1e-3


def test_noise_at_the_exchange_of_the_legs_makes_no_stride_up(solved):
    _, shown = solved
    tracker = WalkTracker(WALKER)
    tracker.follow(shown)
    bases = []
    for time in shown.profile.step_time * np.array([0.9, 1.0, 1.0 - 1e-4, 1.0 + 1e-4, 1.0 - 1e-4, 1.0]):
        reference = cycle_reference(shown.profile, float(time))
        bases.append(tracker.take(reference.position).base - reference.base)
    assert np.ptp(bases, axis=0).max() < 1e-3


@pytest.mark.parametrize("rate", [1.0, 1.08, 1.2, 2.0])
def test_few_pictures_a_second_lose_no_step_of_the_fastest_gait(shipped, rate):
    shown = min(shipped, key=lambda one: one.profile.step_time)
    tracker = WalkTracker(WALKER)
    tracker.follow(shown)
    offsets, looks, last, pictured = [], 0, -np.inf, -np.inf
    for number, (reference, base) in enumerate(walk(shown.profile, 500.0, 10.0)):
        due = number / 500.0 - pictured >= 1 / rate
        if due or number / 500.0 - last >= tracker.patience:
            pose = tracker.take(reference.position, reference.velocity)
            last, looks = number / 500.0, looks + 1
        if due:
            pictured = last
            offsets.append(pose.base - base)
    assert np.ptp(offsets, axis=0).max() < 1e-3
    assert looks < 10 * 4 / (2 * shown.profile.step_time) + len(offsets) + 1, "no more than is needed"


def test_nothing_may_be_left_out_while_no_gait_tells_where_the_references_lead(solved):
    _, shown = solved
    tracker = WalkTracker(WALKER)
    reference = cycle_reference(shown.profile, 0.1)
    tracker.take(reference.position)
    assert tracker.patience == 0.0
    tracker.follow(shown)
    assert tracker.patience == 0.0
    tracker.take(reference.position)
    assert 0.0 < tracker.patience <= shown.profile.step_time / 2
    tracker.take(reference.position + 0.1)
    assert tracker.patience == 0.0


def test_the_standing_foot_stands_and_a_foot_lands_a_step_ahead(solved):
    _, shown = solved
    tracker = WalkTracker(WALKER)
    tracker.follow(shown)
    stood = {}
    for reference, _ in walk(shown.profile, 200.0, 4 * shown.profile.step_time, begin=0.01):
        pose = tracker.take(reference.position)
        stood.setdefault(round(pose.feet[pose.stance, 0], 3), pose.feet[pose.stance])
        assert pose.feet[:, 1].min() > -1e-4
    places = np.array(list(stood.values()))
    assert places[:, 0] == pytest.approx(shown.profile.step_length * np.arange(len(places)), abs=1e-3)
    assert places[:, 1] == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("terrain", [Terrain(slope=0.0873), Terrain(step_up=-0.04)], ids=str)
def test_up_a_slope_and_down_stairs_the_base_is_the_walks(terrain):
    walker = WalkerParameters(terrain=terrain)
    shown = ShownGait(with_refinement(made_up_gait(walker=walker), intervals=20))
    tracker = WalkTracker(walker)
    tracker.follow(shown)
    offsets = [
        tracker.take(reference.position).base - base
        for reference, base in walk(shown.profile, 30.0, 6 * shown.profile.step_time, begin=0.123)
    ]
    assert np.ptp(offsets, axis=0).max() < 1e-3


def test_without_a_gait_the_lowest_foot_carries_the_walker(solved):
    _, shown = solved
    tracker = WalkTracker(WALKER)
    poses = [tracker.take(one.position) for one, _ in walk(shown.profile, 500.0, 3 * shown.profile.step_time)]
    assert all(pose.place is None for pose in poses)
    walked = poses[-1].base[0] - poses[0].base[0]
    assert walked == pytest.approx(3 * shown.profile.step_length, rel=0.03)


def test_references_off_the_gait_have_no_place_in_it_and_the_base_goes_on(solved):
    _, shown = solved
    tracker = WalkTracker(WALKER)
    tracker.follow(shown)
    references = [one for one, _ in walk(shown.profile, 500.0, shown.profile.step_time / 2)]
    before = [tracker.take(reference.position) for reference in references][-1]
    bent = references[-1].position + np.array([0.0, 0.0, 0.01, 0.0])
    after = tracker.take(bent)
    assert after.place is None
    assert after.base == pytest.approx(before.base, abs=1e-9)


def test_ground_reaction_is_the_gaits(solved):
    gait, shown = solved
    if "radau" in shown.profile.method:
        trajectory = gait.refined.trajectory
        for time in np.linspace(0.01, trajectory.step_time - 0.01, 7):
            assert shown.reaction(time).ravel() == pytest.approx(trajectory.force(*trajectory.locate(time)))
    else:
        for index in (1, 50, 199):
            time = gait.trajectory.time[index] - 1e-6
            assert shown.reaction(time).ravel() == pytest.approx(gait.trajectory.net_reaction()[:, index])


def test_ground_reaction_on_a_slope_is_told_along_the_way_and_up():
    slope = 0.2
    gait = made_up_gait(walker=WalkerParameters(terrain=Terrain(slope=slope)))
    index = 5
    along, normal = gait.trajectory.net_reaction()[:2, index]
    cosine, sine = np.cos(slope), np.sin(slope)
    found = ShownGait(gait).reaction(gait.trajectory.time[index] - 1e-6)
    assert found[0] == pytest.approx([cosine * along - sine * normal, sine * along + cosine * normal])
    assert not found[1].any()


def test_paths_ahead_begin_at_the_feet_and_end_where_they_land(solved):
    _, shown = solved
    tracker = WalkTracker(WALKER)
    tracker.follow(shown)
    for reference, _ in walk(shown.profile, 30.0, 3 * shown.profile.step_time, begin=0.05):
        pose = tracker.take(reference.position)
        paths = paths_ahead(shown, pose, pose.place)
        stride = shown.profile.step_length
        standing = pose.feet[pose.stance, 0]
        for side, path in enumerate(paths):
            assert path[:, 0] == pytest.approx(pose.feet[side], abs=1e-4)
            steps = 2 if side == pose.stance else 1
            assert path[:, -1] == pytest.approx([standing + steps * stride, 0.0], abs=1e-3)
            assert path[1].min() > -1e-3


def test_the_swing_path_is_that_of_the_model(solved):
    _, shown = solved
    time = shown.path_times[20]
    q = shown.profile.sample(time).q[:, None]
    expected = foot_arm(WALKER, q, 1).position - foot_arm(WALKER, q, 0).position
    assert shown.swing_path[:, 20] == pytest.approx(expected[:, 0])


def test_a_trail_forgets_what_is_old_and_a_clock_that_went_back(solved):
    _, shown = solved
    tracker, trail = WalkTracker(WALKER), Trail(0.5)
    times = np.arange(0.0, 2.0, 0.1)
    for time in times:
        trail.add(time, tracker.take(shown.profile.sample(time % 0.5).q[2:]))
    left, right = trail.paths()
    assert left.shape == right.shape == (2, 6)
    trail.add(0.0, tracker.take(shown.profile.sample(0.0).q[2:]))
    assert trail.paths()[0].shape == (2, 1)
