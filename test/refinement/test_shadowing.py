"""The start from which torques alone lead through a step."""

from dataclasses import replace
from itertools import count
from typing import Any

import numpy as np
import pytest

from walk_optimizer.certificate import shadowing
from walk_optimizer.certificate.replay import interval_states, replay_step
from walk_optimizer.certificate.shadowing import with_replayable_start
from walk_optimizer.gait import FloatArray, Gait
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters

TABLE = GaitLibrary(WalkerParameters.from_yaml()).gaits()


def end_error(gait: Gait, tolerance: float) -> float:
    """Return how far the replay of a refined step ends from its solution, in [rad] and [m]."""
    assert gait.refined is not None
    trajectory = gait.refined.trajectory
    end = replay_step(gait.walker, gait.refined.spring, trajectory, tolerance)
    return float(np.abs(end - trajectory.states[-1, -1])[:6].max())


def spoiled(gait: Gait) -> Gait:
    """Return the gait with a first interval that is off by as little as a mesh leaves, 1e-8 rad at a knee."""
    assert gait.refined is not None
    states = gait.refined.trajectory.states.copy()
    states[0, :, 3] -= 1e-8
    trajectory = replace(gait.refined.trajectory, states=states)
    return replace(gait, refined=replace(gait.refined, trajectory=trajectory))


@pytest.mark.parametrize("gait", TABLE, ids=lambda gait: f"{gait.request.spring_mode}-{gait.speed:.4f}")
def test_the_torques_of_every_shipped_gait_lead_through_the_whole_step(gait: Gait) -> None:
    assert end_error(gait, tolerance=1e-13) < 1e-4


@pytest.mark.parametrize("gait", TABLE[:3], ids=lambda gait: f"{gait.speed:.4f}")
def test_a_start_that_is_off_a_little_is_put_right(gait: Gait) -> None:
    off = spoiled(gait)
    assert end_error(off, tolerance=1e-13) > 1e-2
    assert off.refined is not None
    right = with_replayable_start(gait.walker, gait.request, off.refined)
    assert right.certificate.certified
    assert end_error(replace(gait, refined=right), tolerance=1e-13) < 1e-4
    for name in ("breaks", "torques", "impulses"):
        np.testing.assert_array_equal(getattr(right.trajectory, name), getattr(off.refined.trajectory, name))
    np.testing.assert_array_equal(right.trajectory.states[1:], off.refined.trajectory.states[1:])


def test_a_step_whose_torques_lead_through_it_stays_as_it_is(gait: Gait) -> None:
    assert gait.request.spring_mode is SpringMode.STIFFNESS_AND_EQUILIBRIUM
    assert gait.refined is not None
    assert with_replayable_start(gait.walker, gait.request, gait.refined) is gait.refined


def test_a_start_that_would_cost_the_certificate_is_not_taken() -> None:
    (gait, *_) = TABLE
    assert gait.refined is not None
    demanding = replace(gait.request, step_length=gait.request.step_length + 0.01)
    off = spoiled(gait).refined
    assert off is not None
    assert with_replayable_start(gait.walker, demanding, off) is off


@pytest.mark.parametrize("ends", [1, 2, 4])
def test_an_integration_that_comes_to_no_end_leaves_the_step_as_it_is(
    monkeypatch: pytest.MonkeyPatch, ends: int
) -> None:
    off, calls = spoiled(TABLE[0]), count(1)

    def ending(*arguments: Any, **options: Any) -> FloatArray:
        states = interval_states(*arguments, **options)
        return np.full_like(states, np.inf) if next(calls) >= ends else states

    monkeypatch.setattr(shadowing, "interval_states", ending)
    assert off.refined is not None
    assert with_replayable_start(off.walker, off.request, off.refined) is off.refined


def test_intervals_of_several_walkers_are_replayed_like_those_of_one(gait: Gait) -> None:
    assert gait.refined is not None
    trajectory = gait.refined.trajectory
    starts = trajectory.states[:, 0] + 1e-3 * np.arange(2)[:, None, None]
    replayed = gait.walker, gait.refined.spring, trajectory
    together = interval_states(*replayed, starts, np.array([0.5, 1.0]))
    for one, alone in zip(together, starts, strict=True):
        expected = interval_states(*replayed, alone[None])[0, :, 0]
        np.testing.assert_allclose(one[:, 1], expected, rtol=0, atol=1e-7)
