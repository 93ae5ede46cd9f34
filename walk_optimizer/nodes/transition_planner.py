"""Plans the steps between paces in a process of its own: they may take long, and the stream never waits."""

from collections import OrderedDict
from typing import TypeAlias

from walk_optimizer.errors import InvalidRequestError, SolveFailedError, WalkOptimizerError
from walk_optimizer.gait import RefinedGait
from walk_optimizer.gait_files.access import writable_folder
from walk_optimizer.jobs.transitions import TransitionJob, transition_job
from walk_optimizer.model.parameters import KneeSpring
from walk_optimizer.nodes.paths import named_path
from walk_optimizer.nodes.publisher_settings import BLENDED
from walk_optimizer.nodes.streamed_gait import Goal, Way, pace_of_goal, profile_of_goal
from walk_optimizer.nodes.suite_node import SuiteNode
from walk_optimizer.nodes.walker_setting import walker_of
from walk_optimizer.references.profile import RefinedProfile
from walk_optimizer.solve.worker import BusyError, WorkerPool
from walk_optimizer.solve.worker_task import Ticket
from walk_optimizer.transition.paces import Pace, border_state, pace_name, spring_of
from walk_optimizer.transition.standing import Standing
from walk_optimizer.transition.table import cache_folder
from walk_optimizer.transition.torque_limit import TorqueLimit, exceeds, limit_in_words
from walk_optimizer.walk.blending import blended
from walk_optimizer.walk.joint_limits import peaks_of, peaks_of_solved
from walk_optimizer.walk.stand import StandProfile
from walk_optimizer.walk.walk import StepPlan

# Transitions that are kept in memory; they take about 100 kB each.
_KEPT = 64
_WORKERS = 1
# Names, knee springs and states of both ends.
_Ends: TypeAlias = tuple[tuple[str, KneeSpring, bytes], ...]


class NoTransitionError(WalkOptimizerError):
    """There are no certified steps between two paces."""


class TransitionPlanner:
    """Finds certified steps: in memory, in the user's cache, or by a solve in a worker process.

    Owns the process. Does not own what a solve is (`jobs.transitions`), nor what is walked.
    """

    def __init__(self, node: SuiteNode) -> None:
        """Begin without a process.

        Args:
            node: Whose parameters count, and whose executor waits.

        Raises:
            ConfigurationError: the walker's file can't be used, or the cache folder is in no home.
            GaitFileError: the cache folder is missing, a symbolic link or not writable.
        """
        self._node = node
        named = node.parameters["cache_folder"]
        walker = walker_of(node.parameters["walker_file"])
        self._folder = named_path(named) if named else None
        writable_folder(self._folder or cache_folder(walker), create=self._folder is None)
        self._known: OrderedDict[_Ends, tuple[RefinedGait, ...]] = OrderedDict()
        self._pool: WorkerPool | None = None
        self._ticket: Ticket | None = None

    def close(self) -> None:
        """End the process."""
        if self._pool is not None:
            self._pool.close()
        self._pool = None

    def give_up(self) -> None:
        """Cancel what is being solved: nobody wants it any more."""
        if self._ticket is not None:
            self._ticket.cancel()

    async def plan(self, begins: Goal, leads_to: Goal, torque_limit: TorqueLimit) -> Way:
        """Return the steps from one pace to another.

        Args:
            begins: The pace that is left.
            leads_to: The pace that follows.
            torque_limit: Largest torque in [N m], or that of the hips and that of the knees; may be infinite.

        Raises:
            NoTransitionError: certified steps are wanted, and there are none.
        """
        if self._node.parameters["transitions"] == BLENDED:
            plan = blended(profile_of_goal(begins), profile_of_goal(leads_to))
            # Sampled. Torques, which may peak between the samples, are those of the pace that follows.
            return Way(plan, leads_to, peaks_of(plan.steps))
        try:
            steps = await self._steps(begins, leads_to, torque_limit)
        except (InvalidRequestError, SolveFailedError, BusyError) as error:
            within = limit_in_words(torque_limit)
            raise NoTransitionError(
                f"no certified steps from {_name(begins)} to {_name(leads_to)}{within}: {error}; "
                "try a nearer speed, or set transitions to blended"
            ) from error
        profiles = tuple(RefinedProfile.of(step) for step in steps)
        plan = StepPlan(profile_of_goal(begins), profiles, profile_of_goal(leads_to))
        return Way(plan, leads_to, peaks_of_solved(steps))

    async def _steps(
        self, begins: Goal, leads_to: Goal, torque_limit: TorqueLimit
    ) -> tuple[RefinedGait, ...]:
        """Return certified steps.

        Raises:
            InvalidRequestError: there can't be any, whatever is computed.
            SolveFailedError: none were found.
            BusyError: the process is ending.
        """
        ends = _ends(begins, leads_to)
        steps = self._known.get(ends)
        if steps is None or exceeds(steps, torque_limit):
            steps = self._known[ends] = await self._solve(begins, leads_to, torque_limit)
        self._known.move_to_end(ends)
        while len(self._known) > _KEPT:
            self._known.popitem(last=False)
        return steps

    async def _solve(
        self, begins: Goal, leads_to: Goal, torque_limit: TorqueLimit
    ) -> tuple[RefinedGait, ...]:
        source, target = _paces(begins, leads_to)
        limit = self._node.parameters["transition_time_limit"]
        job = TransitionJob(
            source=source,
            target=target,
            torque_limit=torque_limit,
            time_limit=limit,
            folder=self._folder,
        )
        if self._pool is None:
            self._pool = WorkerPool(transition_job, _WORKERS)
        self._ticket = ticket = self._pool.submit(job, limit)
        await self._node.finished(ticket.future)
        answer = ticket.future.result()
        if answer.problem:
            self._node.get_logger().warning(f"transition cache: {answer.problem}")
        if not answer.steps:
            raise SolveFailedError(answer.message)
        self._node.get_logger().debug(f"{_name(begins)} to {_name(leads_to)}: {answer.message}")
        return tuple(answer.steps)


def _ends(begins: Goal, leads_to: Goal) -> _Ends:
    """Return what tells one pair of paces from another.

    Raises:
        InvalidRequestError: a gait is not refined, so it has no end that steps could lead to.
    """
    return tuple(
        (pace_name(pace), spring_of(pace), border_state(pace).tobytes()) for pace in _paces(begins, leads_to)
    )


def _paces(begins: Goal, leads_to: Goal) -> tuple[Pace, Pace]:
    """Return what a solve leads from and to; a stand is left with the knee springs of what follows."""
    source, target = pace_of_goal(begins), pace_of_goal(leads_to)
    return (source.on(spring_of(target)) if isinstance(source, Standing) else source), target


def _name(goal: Goal) -> str:
    """Return a goal in words."""
    return "a stand" if isinstance(goal, StandProfile) else f"{goal.speed:.4f} m/s"
