"""Blended gaits keep their bounds, or there is none; what is said about them is true."""

from dataclasses import replace

import numpy as np
import pytest

from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.errors import ConfigurationError, GaitNotFoundError
from walk_optimizer.library import EXACT_SPEED_TOLERANCE, GaitLibrary, Source
from walk_optimizer.library.interpolation import interpolated
from walk_optimizer.library.interpolation_bounds import InterpolationBounds, interpolation_bounds
from walk_optimizer.model.functions import evaluate
from walk_optimizer.model.mechanics import mechanics_at
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.references.profile import profile_of
from walk_optimizer.request import GaitRequest, gait_table_settings
from walk_optimizer.transcription.tableau import DIFFERENTIATION

WALKER = WalkerParameters.from_yaml()
MODE = "stiffness_and_equilibrium"
SPEEDS = gait_table_settings().table_speeds()
BETWEEN = 0.36


@pytest.fixture(scope="module")
def shipped(tmp_path_factory):
    return GaitLibrary(WALKER, tmp_path_factory.mktemp("empty"))


@pytest.fixture(scope="module")
def neighbours(shipped):
    return [shipped.find(speed, MODE)[0] for speed in SPEEDS[1:3]]


@pytest.fixture(scope="module")
def blend(shipped):
    gait, source = shipped.find(BETWEEN, MODE, "interpolated")
    assert source is Source.INTERPOLATED
    return gait


def profile(gait):
    return profile_of(gait)


def test_a_blend_walks_at_the_speed_that_was_asked_for_and_keeps_the_bounds(blend):
    assert blend.speed == pytest.approx(BETWEEN, abs=1e-8)
    assert profile(blend).step_length / profile(blend).step_time == pytest.approx(BETWEEN, abs=1e-8)
    stretched = interpolation_bounds().by_family(WALKER)
    again = certify_refined(WALKER, blend.request, blend.refined)
    for stated, found in zip(blend.refined.certificate.entries, again.entries, strict=True):
        assert (stated.family, stated.violation) == (found.family, pytest.approx(found.violation))
        assert stated.tolerance == stretched.get(found.family, found.tolerance)
        assert stated.met
    assert "interpolated between 0.3185 and 0.4167 m/s, not solved" in blend.report.message


def test_a_blend_is_the_mean_of_its_neighbours_at_the_same_fraction_of_the_step(blend, neighbours):
    lengths = [gait.step_length for gait in neighbours]
    share = (blend.step_length - lengths[0]) / (lengths[1] - lengths[0])
    for fraction in np.linspace(0.05, 0.95, 7):
        one, other, mixed = (
            profile(gait).sample(fraction * gait.request.step_time) for gait in (*neighbours, blend)
        )
        angles = (1 - share) * one.q + share * other.q
        np.testing.assert_allclose(mixed.q[2:], angles[2:], atol=1e-9)
        np.testing.assert_allclose(mixed.q[:2], angles[:2], atol=1e-3)


def test_the_torques_of_a_blend_drive_it_but_for_a_moment_about_the_standing_foot(blend):
    """Only the two upper legs' equations have anything left, and both the same."""
    trajectory = blend.refined.trajectory
    nodes = trajectory.states[:, 1:].reshape(-1, 12).T
    mechanics = mechanics_at(WALKER, blend.spring, nodes[:6], nodes[6:])
    rates = np.einsum("ij,njs->nis", DIFFERENTIATION, trajectory.states) / trajectory.lengths[:, None, None]
    acting = mechanics.momentum_rate(trajectory.torques.reshape(-1, 3).T, trajectory.forces.reshape(-1, 4).T)
    left = rates.reshape(-1, 12).T[6:] - acting
    np.testing.assert_allclose(left[[0, 1, 3, 5]], 0, atol=1e-9)
    np.testing.assert_allclose(left[2], left[4], atol=1e-9)
    assert 0 < np.abs(left[2]).max() < interpolation_bounds().force * WALKER.weight


def test_the_standing_foot_of_a_blend_stands(blend):
    states = blend.refined.trajectory.states.reshape(-1, 12).T
    assert np.abs(evaluate("feet", WALKER, states[:6], states[6:])[:, :, 0]).max() < 1e-12
    assert np.abs(evaluate("foot_velocities", WALKER, states[:6], states[6:])[:, :, 0]).max() < 1e-12


def test_a_blend_is_as_continuous_as_a_solved_gait(blend):
    times = np.linspace(0, blend.request.step_time, 2001)
    q = np.array([profile(blend).sample(time).q for time in times])
    assert np.abs(np.diff(q, axis=0)).max() < 20 * times[1]


def test_at_a_neighbour_the_blend_is_that_gait(neighbours):
    lower, upper = neighbours
    same = interpolated(lower, upper, lower.request)
    assert same.spring.stiffness == pytest.approx(lower.refined.spring.stiffness)
    middle = lower.request.step_time / 2
    np.testing.assert_allclose(profile(same).sample(middle).q, profile(lower).sample(middle).q, atol=1e-9)
    # Where nothing is blended, only the places differ at which the solver's polynomials are judged.
    residuals = {one.family: one.violation for one in same.certificate.entries}
    assert residuals["dynamics"] < 0.1
    assert residuals["interval_replay"] < interpolation_bounds().replay / 100


def test_the_grid_holds_samples_of_the_blend(blend):
    trajectory = blend.trajectory
    assert trajectory.points == blend.request.points
    sample = profile(blend).sample(float(trajectory.time[99]))
    np.testing.assert_allclose(trajectory.q[:, 99], sample.q)
    np.testing.assert_allclose(trajectory.u[:, 99], sample.u)
    assert trajectory.reaction.min() >= -1e-6
    weight = trajectory.reaction[[2, 5]].sum(axis=0).mean()
    assert weight == pytest.approx(WALKER.weight, rel=0.2)


def test_neighbours_that_walk_differently_are_not_blended(shipped):
    with pytest.raises(GaitNotFoundError, match=r"no gait of 0\.4500 m/s .*not interpolated between 0\.4167"):
        shipped.find(0.45, "none", "interpolated")


def test_the_refusal_names_residual_and_bound(neighbours):
    request = GaitRequest.for_speed(BETWEEN, MODE)
    tight = replace(interpolation_bounds(), force=1e-6)
    with pytest.raises(
        GaitNotFoundError, match=r"not interpolated between .*: dynamics is off by .* N or N m, allowed is"
    ):
        interpolated(*neighbours, request, tight)


def test_outside_the_table_and_without_refinement_there_is_nothing_to_blend(shipped, neighbours):
    with pytest.raises(GaitNotFoundError, match="no refined gaits on both sides"):
        shipped.find(1.15, MODE, "interpolated")
    bare = replace(neighbours[0], refined=None)
    with pytest.raises(GaitNotFoundError, match="a neighbour has no refinement"):
        interpolated(bare, neighbours[1], GaitRequest.for_speed(BETWEEN, MODE))


def test_a_gait_of_the_library_goes_before_a_blend(shipped):
    gait, source = shipped.find(SPEEDS[1] + 5e-5, MODE, "interpolated", tolerance=EXACT_SPEED_TOLERANCE)
    assert (source, gait.request.speed) == (Source.TABLE, SPEEDS[1])


def test_bounds_are_above_zero():
    with pytest.raises(ConfigurationError, match="force is 0"):
        replace(InterpolationBounds.from_yaml(), force=0)
