"""A walk: standing, gaits, and the steps that lead from one to another without a jump.

What can go on without end, a gait that repeats its step or a stand, is a *pace* here. A `StepPlan` is the
steps from one pace to another. A walk keeps its pace until it has both another goal and a plan that leads
there from where it is; it leaves a gait at the end of a step, and a stand at once. A stand is no step: it
has no end, and the legs keep their names where it is left.
"""

import math
import threading
from collections import deque
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from walk_optimizer.errors import WalkOptimizerError
from walk_optimizer.references import Reference, make_reference
from walk_optimizer.references.profile import StepProfile, join_error
from walk_optimizer.walk.phase_clock import PhaseClock

# Two steps whose ends are further apart are no walk, [m] or [rad]. Certified steps are far closer.
LARGEST_JUMP = 1e-3


class DiscontinuousPlanError(WalkOptimizerError):
    """Steps that don't begin where the ones before them end."""


@dataclass(frozen=True, eq=False)
class StepPlan:
    """The steps that lead from one pace to another.

    Attributes:
        begins: The pace that it leaves.
        steps: What is walked between, in this order.
        leads_to: The pace that follows.
    """

    begins: StepProfile
    steps: tuple[StepProfile, ...]
    leads_to: StepProfile

    def __post_init__(self) -> None:
        """Refuse steps that jump.

        Raises:
            DiscontinuousPlanError: says where, and by how much.
        """
        chain = (self.begins, *self.steps, self.leads_to)
        for number, (before, after) in enumerate(pairwise(chain)):
            jump = join_error(before, after)
            if not jump <= LARGEST_JUMP:
                raise DiscontinuousPlanError(
                    f"step {number} of {len(self.steps)} of the transition ends {jump:.2g} m or rad from "
                    f"where the next one begins, allowed is {LARGEST_JUMP:g}"
                )


class Walk:
    """The walk as a clock moves it on.

    One thread advances; any thread may give it a goal, pause it or stop it.
    """

    def __init__(self, pace: StepProfile, clock: PhaseClock) -> None:
        """Be at the start of a pace's step.

        Args:
            pace: A gait or a stand.
            clock: That moves the walk.
        """
        self.clock = clock
        self._pace = self._former = self._current = pace
        self._remaining: deque[StepProfile] = deque()
        self._plan: StepPlan | None = None
        self._lock = threading.Lock()
        self._step, self._time, self._origin = 0, 0.0, np.zeros(2)

    @property
    def pace(self) -> StepProfile:
        """The pace that is kept, or that the running steps lead to."""
        return self._pace

    @property
    def former(self) -> StepProfile:
        """The pace before the present one."""
        return self._former

    @property
    def goal(self) -> StepProfile:
        """The pace that is kept once all that is planned has been walked."""
        plan = self._plan
        return self._pace if plan is None else plan.leads_to

    @property
    def is_changing(self) -> bool:
        """Whether the running step is one between two paces."""
        return self._current is not self._pace

    @property
    def step(self) -> int:
        """Number of the running step, from 0."""
        return self._step

    def follow(self, plan: StepPlan) -> bool:
        """Take a plan as soon as its pace is walked; of several, the last one counts.

        Returns:
            Whether it begins at the present pace; if not, nothing has changed.
        """
        with self._lock:
            if plan.begins is not self._pace:
                return False
            self._plan = plan
            return True

    def stay(self, pace: StepProfile) -> bool:
        """Keep the present pace, whatever was planned.

        Returns:
            Whether it is the one that is meant; if not, nothing has changed.
        """
        with self._lock:
            if pace is not self._pace:
                return False
            self._plan = None
            return True

    def advance(self, clock: float) -> Reference:
        """Move on to a time of the clock in [s] and return the reference there."""
        moved = self.clock.advance(clock)
        self._time += moved.phase
        while self._time >= self._current.step_time or self._leaves_stand(moved.rate):
            self._next_step()
        sample = self._current.sample(self._time)
        return make_reference(sample, self._step, self._time, self._origin, moved.rate)

    def _leaves_stand(self, rate: float) -> bool:
        """Whether a stand ends now: it has no end of its own."""
        return self._plan is not None and rate > 0 and math.isinf(self._current.step_time)

    def _next_step(self) -> None:
        ended = self._current
        if math.isinf(ended.step_time):
            self._time = 0.0
        else:
            self._time -= ended.step_time
            self._step += 1
            self._origin += (ended.step_length, ended.rise)
        with self._lock:
            if not self._remaining and self._plan is not None:
                self._remaining.extend(self._plan.steps)
                self._former = self._pace
                self._pace, self._plan = self._plan.leads_to, None
            self._current = self._remaining.popleft() if self._remaining else self._pace
