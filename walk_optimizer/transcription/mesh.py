"""The mesh of a refined step, and the values on it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.model.parameters import KneeSpring
from walk_optimizer.transcription.phases import Phase, phase_shares
from walk_optimizer.transcription.tableau import NODES_WITH_START

FloatArray = NDArray[np.float64]

# No phase is shorter, in [s].
SHORTEST_PHASE = 1e-3
_INTERVALS_OF_STEP = 24


@dataclass(frozen=True, eq=False)
class RefinedPoints:
    """Values of all variables of the refined grid in SI units.

    Attributes:
        states: At the start of each interval and at its nodes, (n, 4, 12): q, then p.
        torques: At the nodes of each interval in [N m], (n, 3, 3).
        forces: Ground reactions at the nodes in [N], (n, 3, 4): x, y of foot 1, then of foot 2.
        durations: Of each phase in [s].
        impulses: Of each phase's impact in [N s], (phases, 4); zero where there is none.
        spring: K and q_eq.
    """

    states: FloatArray
    torques: FloatArray
    forces: FloatArray
    durations: FloatArray
    impulses: FloatArray
    spring: KneeSpring


@dataclass(frozen=True, eq=False)
class Mesh:
    """Phases with their intervals.

    Attributes:
        phases: The contact phases of the step.
        parts: For each phase the lengths of its intervals as parts of it; they add up to 1.
    """

    phases: tuple[Phase, ...]
    parts: tuple[FloatArray, ...]

    @property
    def intervals(self) -> int:
        """Number of intervals of the step."""
        return sum(part.size for part in self.parts)

    @property
    def layout(self) -> tuple[tuple[Phase, int], ...]:
        """Phases with their numbers of intervals."""
        return tuple((phase, part.size) for phase, part in zip(self.phases, self.parts, strict=True))

    @property
    def phase_of_interval(self) -> NDArray[np.int64]:
        """Index of the phase of each interval, (n,)."""
        return np.repeat(np.arange(len(self.phases)), [part.size for part in self.parts])

    @property
    def first_intervals(self) -> NDArray[np.int64]:
        """Index of the first interval of each phase."""
        return self.phase_of_interval.searchsorted(np.arange(len(self.phases)))

    def node_times(self, durations: FloatArray) -> FloatArray:
        """Return the times of the start and the nodes of each interval in [s], (n, 4)."""
        lengths = self.lengths(durations)
        starts = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
        times: FloatArray = starts[:, None] + lengths[:, None] * NODES_WITH_START
        return times

    def divided(self, counts: NDArray[np.int64]) -> "Mesh":
        """Return the mesh with each interval cut into equal parts; `counts` is (n,)."""
        of_phases = np.split(counts, self.first_intervals[1:])
        pairs = zip(self.parts, of_phases, strict=True)
        return Mesh(self.phases, tuple(np.repeat(part / count, count) for part, count in pairs))

    def lengths(self, durations: FloatArray) -> FloatArray:
        """Return the lengths of all intervals in [s], (n,), for durations of the phases in [s]."""
        return np.concatenate([part * time for part, time in zip(self.parts, durations, strict=True)])


def even_mesh(steps: Sequence[tuple[Phase, ...]], fewest: int) -> Mesh:
    """Return a mesh of even intervals in each phase of each step, in proportion to their lengths.

    Args:
        steps: Phases of each step.
        fewest: Fewest intervals of a phase.
    """
    shares = np.concatenate([phase_shares(phases) for phases in steps]).tolist()
    counts = [max(fewest, round(share * _INTERVALS_OF_STEP)) for share in shares]
    return Mesh(tuple(chain.from_iterable(steps)), tuple(np.full(count, 1 / count) for count in counts))


def without_vanished(mesh: Mesh, breaks: FloatArray) -> tuple[Phase, ...]:
    """Return the phases without those that are as short as may be, of a solution on the mesh.

    Phases that begin with an impact stay. Where the feet then do the same in two phases without an
    impact between them, these become one.

    Args:
        mesh: Phases and intervals.
        breaks: Ends of the solution's intervals in [s], (n + 1,).
    """
    starts = breaks[mesh.first_intervals]
    durations = np.diff([*starts, breaks[-1]])
    kept: list[Phase] = []
    for phase, start, duration in zip(mesh.phases, starts, durations, strict=True):
        vanished = duration < 2 * SHORTEST_PHASE or bool(kept and kept[-1].modes == phase.modes)
        if phase.begins_with_impact or not vanished:
            kept.append(replace(phase, start=float(start / breaks[-1])))
    if len(kept) == len(mesh.phases):
        return mesh.phases
    return tuple(kept)
