"""The start from which the torques of a refined step lead through it by themselves.

Collocation follows the motion but for the local error of each interval. A straight knee under load is so
unstable that such errors, some 1e-8 rad, grow to radians before the step ends when its torques are replayed
from its first state. Close to the states of the solution the same torques make a motion without errors. The
closest one is found by least squares [Wang2014]. The step then begins where that motion does; behind its
first interval nothing changes.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.certificate.refined import certify_refined
from walk_optimizer.certificate.replay import inner_jumps, interval_states
from walk_optimizer.gait import RefinedGait
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.request import GaitRequest
from walk_optimizer.transcription.tableau import DIFFERENTIATION, NODES

FloatArray = NDArray[np.float64]

# A step whose replay is expected to end no further from the solution is left as it is, in [rad] and [m].
_GOOD_END = 1e-5
# Of the integrator: the errors that are left grow as well.
_TOLERANCE = 1e-13
# Of states, for derivatives, in [rad], [m], [kg m/s]; and the tolerance of what is differentiated.
_DIFFERENCE, _DIFFERENCE_TOLERANCE = 1e-5, 1e-6
# Each round leaves a hundred-thousandth of the errors: the matrices are those of the first.
_ROUNDS = 3


def with_replayable_start(walker: WalkerParameters, request: GaitRequest, gait: RefinedGait) -> RefinedGait:
    """Return the gait with a start from which a replay of its torques ends where it does.

    The gait itself is returned if its replay does so already, if the other start would cost it the
    certificate, or if the integrator gives up.

    Args:
        walker: The walker.
        request: Speed and step that the gait has to meet.
        gait: A certified gait.
    """
    try:
        shadow = _Shadow(walker, gait.spring, gait.trajectory)
        if shadow.end_error() <= _GOOD_END:
            return gait
        moved = replace(gait, trajectory=shadow.trajectory())
    except _NoEndError:
        return gait
    certificate = certify_refined(walker, request, moved)
    return replace(moved, certificate=certificate) if certificate.certified else gait


class _NoEndError(Exception):
    """An integration came to no end."""


class _Shadow:
    """The motion that the torques of a step make, close to the states of its intervals."""

    def __init__(self, walker: WalkerParameters, spring: KneeSpring, trajectory: RefinedTrajectory) -> None:
        self._replayed = walker, spring, trajectory
        self._solution = trajectory
        self._jumps = inner_jumps(trajectory)[1:]
        self._transitions = self._transition_matrices()

    def end_error(self) -> float:
        """Return how far from the solution a replay of the whole step ends, to first order, in [rad], [m]."""
        error = np.zeros(12)
        defects = self._defects(self._solution.states[:, 0])
        for matrix, defect in zip(self._transitions[1:], defects, strict=True):
            error = matrix @ (error + defect)
        return float(np.abs(error[:6]).max())

    def trajectory(self) -> RefinedTrajectory:
        """Return the step with the start of the closest motion; its first interval is moved along."""
        solution, starts = self._solution, self._closest_starts()
        both = np.stack([starts, solution.states[:, 0]])
        moved, former = self._states(both, NODES, _TOLERANCE)[:, 0]
        shift = np.vstack([starts[0] - solution.states[0, 0], moved - former])
        states, forces = solution.states.copy(), solution.forces.copy()
        states[0] += shift
        # The reaction of foot 1 is what moves the walker as a whole: the momenta of the hip's rows.
        forces[0, :, :2] += DIFFERENTIATION @ shift[:, 6:8] / solution.lengths[0]
        return replace(solution, states=states, forces=forces)

    def _closest_starts(self) -> FloatArray:
        """Return the states at the start of all intervals, (n, 12), of the closest motion."""
        # Here, not above: loading SciPy takes longer than all the rest of the optimiser.
        from scipy.sparse import block_array, eye_array
        from scipy.sparse.linalg import splu

        starts = self._solution.states[:, 0].copy()
        blocks: list[list[object]] = [[None] * len(starts) for _ in starts[1:]]
        for index, row in enumerate(blocks):
            row[index : index + 2] = self._transitions[index], -eye_array(12)
        linear = block_array(blocks, format="csc")
        factors = splu((linear @ linear.T).tocsc())
        for _ in range(_ROUNDS):
            defects = self._defects(starts)
            starts -= (linear.T @ factors.solve(defects.ravel())).reshape(-1, 12)
        return starts

    def _defects(self, starts: FloatArray) -> FloatArray:
        """Return how far from the next start each interval but the last ends, (n - 1, 12)."""
        ends = self._states(starts[None], NODES[-1:], _TOLERANCE)[0, :-1, 0]
        defects: FloatArray = ends + self._jumps - starts[1:]
        return defects

    def _transition_matrices(self) -> FloatArray:
        """Return how the end of each interval depends on its start, (n, 12, 12)."""
        shifts = _DIFFERENCE * np.vstack([np.zeros(12), np.eye(12)])
        starts = self._solution.states[:, 0] + shifts[:, None]
        ends = self._states(starts, NODES[-1:], _DIFFERENCE_TOLERANCE)[:, :, 0]
        return np.moveaxis((ends[1:] - ends[0]) / _DIFFERENCE, 0, -1)

    def _states(self, starts: FloatArray, places: FloatArray, tolerance: float) -> FloatArray:
        """Return where all intervals lead from starts (k, n, 12) at m places, (k, n, m, 12).

        Raises:
            _NoEndError: the integrator gives up.
        """
        states = interval_states(*self._replayed, starts, places, tolerance)
        if not np.isfinite(states).all():
            raise _NoEndError
        return states
