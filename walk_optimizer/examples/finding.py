"""What an example found: its contacts in words and its residuals."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from walk_optimizer.contact.schedule import FootMode, Schedule
from walk_optimizer.examples.relaxed_solve import RelaxedSolve
from walk_optimizer.gait import Certificate

_WORDS = {
    FootMode.FREE: "free",
    FootMode.STICK: "sticks",
    FootMode.SLIP_FORWARD: "slips forward",
    FootMode.SLIP_BACKWARD: "slips backward",
}


@dataclass(frozen=True, eq=False)
class Finding:
    """What an example found.

    Attributes:
        title: What was asked.
        points: Name of each point of contact.
        schedule: What each of them does at each grid point, (points, N).
        interval: Time step h in [s].
        effort: Integral of 1/2 |u|^2 dt in [(N m)^2 s].
        solves: The relaxed solves.
        seconds: Time of all solves in [s].
        certificate: Residuals, computed apart from the solver.
    """

    title: str
    points: tuple[str, ...]
    schedule: Schedule
    interval: float
    effort: float
    solves: tuple[RelaxedSolve, ...]
    seconds: float
    certificate: Certificate

    @property
    def rank(self) -> tuple[bool, float]:
        """What sorts findings: certified ones come first, of them those of less effort."""
        return not self.certificate.certified, self.effort

    @property
    def iterations(self) -> int:
        """Number of iterations of all solves."""
        return sum(one.iterations for one in self.solves)

    def lines(self) -> list[str]:
        """Return what was found, for people."""
        ends = ", ".join(f"{one.relaxation:g}: {one.iterations} ({one.status.value})" for one in self.solves)
        work = f"{self.iterations} iterations, {self.seconds:.1f} s"
        return [
            self.title,
            *(f"  {line}" for line in self.contact_lines()),
            f"  torque effort {self.effort:.4g} (N m)^2 s, {work}",
            f"  iterations by bound on the products: {ends}",
        ]

    def contact_lines(self) -> list[str]:
        """Return for each point of contact what it does, and from when to when in [s]."""
        lines = []
        for name, modes in zip(self.points, self.schedule, strict=True):
            parts = (
                f"{_WORDS[mode]} {begin * self.interval:.2f}-{end * self.interval:.2f}"
                for begin, end, mode in runs(modes)
            )
            lines.append(f"{name}: {', '.join(parts)} s")
        return lines


def runs(modes: Schedule) -> list[tuple[int, int, FootMode]]:
    """Return begin, end and mode of each run of equal modes of one point of contact, (N,)."""
    bounds = [0, *(np.flatnonzero(np.diff(modes)) + 1).tolist(), modes.size]
    return [(begin, end, FootMode(modes[begin])) for begin, end in pairwise(bounds)]
