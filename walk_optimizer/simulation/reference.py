"""The gait as a path: states and torques of a step against how far the hip has come.

The hip of a gait moves forward all the time, so its distance s from the stance foot tells the place in
the step without a clock: a phase variable [Westervelt2007] section 4.1. States at s follow x*(s), torques
u*(s).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from walk_optimizer.certificate.replay import contact_modes
from walk_optimizer.contact.schedule import FootMode
from walk_optimizer.errors import InvalidRequestError
from walk_optimizer.gait import Gait, RefinedGait
from walk_optimizer.model.mechanics import mechanics_at
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.simulation.pinned_walker import STATE_WIDTH, PinnedWalker

FloatArray = NDArray[np.float64]

# Splines through so many places of the step are as exact as the refined gait.
PLACES = 401


@dataclass(frozen=True, eq=False)
class StepReference:
    """A step of a gait as its feedback sees it.

    Attributes:
        model: The walker of the gait, without knee stops: the gait needs none.
        step_length: In [m].
        torque_effort: Integral over the step of 1/2 |u|^2 in [(N m)^2 s].
        time: From 0 to the step time in [s], (PLACES,).
        states: (PLACES, 8).
        torques: In [N m], (PLACES, 3).
    """

    model: PinnedWalker
    step_length: float
    torque_effort: float
    time: FloatArray
    states: FloatArray
    torques: FloatArray

    @property
    def step_time(self) -> float:
        """Duration of the step in [s]."""
        return float(self.time[-1])

    @cached_property
    def progress(self) -> FloatArray:
        """Horizontal distance s of the hip from the stance foot in [m], increasing, (PLACES,)."""
        return np.array([self.model.hip(state)[0] for state in self.states])

    @cached_property
    def path_slopes(self) -> tuple[FloatArray, FloatArray]:
        """Derivatives by s of the states, (PLACES, 8), and of the torques, (PLACES, 3)."""
        path = CubicSpline(self.progress, np.hstack([self.states, self.torques]))
        slopes = path(self.progress, 1)
        return slopes[:, :STATE_WIDTH], slopes[:, STATE_WIDTH:]


def step_reference(gait: Gait) -> StepReference:
    """Return the step of a gait that is walked: of its accurate solution.

    Raises:
        InvalidRequestError: the gait has none, or is no plain walking: one foot at a time, the hip
            always going forward.
    """
    refined = gait.refined
    if refined is None:
        raise InvalidRequestError("only refined gaits are simulated, and this one could not be refined")
    _require_plain_walking(gait.walker, refined)
    trajectory = refined.trajectory
    time = np.linspace(0.0, trajectory.step_time, PLACES)
    places = [trajectory.locate(instant) for instant in time]
    nodes = np.array([trajectory.state(*place) for place in places]).T
    velocities = mechanics_at(gait.walker, refined.spring, nodes[:6], nodes[6:]).qdot
    if velocities[0].min() <= 0:
        raise InvalidRequestError("the hip of this gait goes backward, which its feedback does not cover")
    return StepReference(
        PinnedWalker(gait.walker, refined.spring),
        refined.step_length,
        trajectory.torque_effort,
        time,
        np.vstack([nodes[2:6], velocities[2:6]]).T,
        np.array([trajectory.torque(*place) for place in places]),
    )


def _require_plain_walking(walker: WalkerParameters, refined: RefinedGait) -> None:
    """Refuse gaits whose feet do anything but stand and swing."""
    trajectory = refined.trajectory
    modes = set(contact_modes(walker, refined.spring, trajectory))
    if modes != {(FootMode.STICK, FootMode.FREE)} or trajectory.impulses[1:].any():
        raise InvalidRequestError(
            "only plain walking is simulated, one foot on the ground at a time; in this gait feet slip, "
            "stand together or strike within the step"
        )
