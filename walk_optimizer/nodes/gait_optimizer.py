"""Node `gait_optimizer`: solves for gaits in worker processes, by service and by action."""

import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rclpy.action import ActionServer, CancelResponse
from rclpy.action.server import ServerGoalHandle
from walk_optimizer_interfaces.action import OptimizeGait as OptimizeGaitAction
from walk_optimizer_interfaces.srv import OptimizeGait

from walk_optimizer.errors import InvalidRequestError, SolveFailedError, WalkOptimizerError
from walk_optimizer.jobs.gaits import GaitJob, outcome_of, solve_job, submit_gait
from walk_optimizer.nodes.conversions import (
    gait_to_message,
    progress_to_message,
    refusal_to_message,
    report_to_message,
)
from walk_optimizer.nodes.optimizer_health import OptimizerHealth
from walk_optimizer.nodes.parameters import Setting
from walk_optimizer.nodes.running import run_node
from walk_optimizer.nodes.suite_node import SuiteNode
from walk_optimizer.nodes.walker_setting import WALKER_FILE, walker_of
from walk_optimizer.request import GaitRequest, gait_table_settings
from walk_optimizer.solve.settings import solver_settings
from walk_optimizer.solve.status import Progress, SolveReport, Status
from walk_optimizer.solve.worker import WorkerPool
from walk_optimizer.solve.worker_task import Ticket

LONGEST_TIME_LIMIT = 86_400.0
# Ends that no request is to blame for: operators shall know.
_TROUBLE = (Status.WORKER_LOST, Status.EVALUATION_ERROR, Status.SOLVER_ERROR)
# A client hears of its goal at least this often, also while the solver is silent, in [s].
_FEEDBACK_PERIOD = 0.5


def _settings() -> list[Setting]:
    table, solver = gait_table_settings(), solver_settings()
    return [
        WALKER_FILE,
        Setting(
            "points",
            table.points,
            "Grid points N of a step, for requests that name none [-].",
            table.minimum_points,
            table.maximum_points,
        ),
        Setting(
            "time_limit",
            solver.time_limit,
            "Longest solve, for requests that name no limit [s].",
            0.1,
            LONGEST_TIME_LIMIT,
        ),
        Setting("workers", 1, "Worker processes, so solves at the same time [-].", 1, 64, read_only=True),
        Setting(
            "queue_limit",
            16,
            "Requests that may wait for a worker; further ones are told busy [-].",
            1,
            1000,
            read_only=True,
        ),
    ]


class InternalError(WalkOptimizerError):
    """Something that nobody foresaw ended a request."""


class GaitOptimizerNode(SuiteNode):
    """Offers `~/optimize_gait` and, with progress and cancelling, the action `~/optimize`.

    Owns the worker processes. Does not own the queue's rules (`solve.worker`) nor what a solve is
    (`jobs.gaits`).
    """

    def __init__(self) -> None:
        """Start the workers and offer the services."""
        super().__init__("gait_optimizer", _settings())
        self._walker = walker_of(self.parameters["walker_file"])
        self._pool = WorkerPool(solve_job, self.parameters["workers"], self.parameters["queue_limit"])
        self._tickets: dict[bytes, Ticket] = {}
        self._health = OptimizerHealth(
            self._pool.state, self.parameters["workers"], self.parameters["queue_limit"]
        )
        self._health.join(self.diagnostics)
        self.serve(OptimizeGait, "~/optimize_gait", self._answer)
        self._action = ActionServer(
            self,
            OptimizeGaitAction,
            "~/optimize",
            self._execute,
            callback_group=self.group,
            cancel_callback=self._cancel,
        )
        self.get_logger().info("ready")

    def close(self) -> None:
        """End the workers; those who wait are told that their solve was cancelled."""
        self._pool.close()

    def destroy_node(self) -> None:
        """Give back all ROS entities."""
        self._action.destroy()
        super().destroy_node()

    async def _answer(self, request: OptimizeGait.Request, response: OptimizeGait.Response) -> None:
        with self._reported(response):
            await self._fill(response, submit_gait(self._pool, self._job(request)))

    def _job(self, request: Any) -> GaitJob:
        """Return the job of a service request or an action goal."""
        points = request.points or self.parameters["points"]
        limit = request.time_limit if request.time_limit != 0 else self.parameters["time_limit"]
        if not 0 < limit <= LONGEST_TIME_LIMIT:
            raise InvalidRequestError(
                f"time limit is {limit:g} s, allowed is above 0 to {LONGEST_TIME_LIMIT:g} s; 0 is the default"
            )
        return GaitJob(GaitRequest.for_speed(request.speed, request.spring_mode, points), self._walker, limit)

    async def _fill(self, answer: Any, ticket: Ticket) -> None:
        """Wait for the solve and fill a service response or an action result.

        Raises:
            SolveFailedError: there is no gait.
        """
        await self.finished(ticket.future)
        outcome = outcome_of(ticket.future)
        self._health.note(outcome.report)
        if outcome.report.status in _TROUBLE:
            self.get_logger().warning(outcome.report.message)
        answer.report = report_to_message(outcome.report)
        if outcome.gait is None:
            raise SolveFailedError(f"{outcome.report.status.value}: {outcome.report.message}")
        answer.gait = gait_to_message(outcome.gait)
        answer.message = outcome.report.message

    async def _execute(self, goal: ServerGoalHandle) -> OptimizeGaitAction.Result:
        result = OptimizeGaitAction.Result()
        try:
            with self._reported(result):
                await self._pursue(goal, result)
            result.success = True
            goal.succeed()
        except WalkOptimizerError as error:
            result.message = str(error)
            cancelled = result.report.status == Status.CANCELLED and goal.is_cancel_requested
            goal.canceled() if cancelled else goal.abort()
        return result

    async def _pursue(self, goal: ServerGoalHandle, result: OptimizeGaitAction.Result) -> None:
        """Solve for a goal, and tell how far it is: when the solver does, and regularly.

        Raises:
            WalkOptimizerError: there is no gait.
        """
        job = self._job(goal.request)

        def tell(progress: Progress) -> None:
            goal.publish_feedback(progress_to_message(progress, job.time_limit))

        ticket = submit_gait(self._pool, job, lambda progress: self.later(tell, progress))
        key = bytes(goal.goal_id.uuid)
        self._tickets[key] = ticket
        timer = self.repeat(_FEEDBACK_PERIOD, lambda: tell(ticket.progress))
        try:
            if goal.is_cancel_requested:  # Between being accepted and getting here.
                ticket.cancel()
            await self._fill(result, ticket)
        finally:
            self.destroy_timer(timer)
            del self._tickets[key]

    def _cancel(self, goal: ServerGoalHandle) -> CancelResponse:
        ticket = self._tickets.get(bytes(goal.goal_id.uuid))
        if ticket is not None:
            ticket.cancel()
        return CancelResponse.ACCEPT

    @contextmanager
    def _reported(self, answer: Any) -> Iterator[None]:
        """Have the report of a service response or an action result say how it ended, whatever happened.

        Raises:
            WalkOptimizerError: there is no gait.
        """
        try:
            yield
        except WalkOptimizerError as error:
            if not answer.report.status:  # No solve was started.
                answer.report = refusal_to_message(error)
            raise
        except Exception as error:
            self.get_logger().error(f"a request failed: {traceback.format_exc()}")
            text = f"internal error: {error!r}; the log of gait_optimizer tells where"
            report = SolveReport(Status.SOLVER_ERROR, text, back_end="")
            self._health.note(report)
            answer.report = report_to_message(report)
            raise InternalError(text) from error


def main() -> int:
    """Run the node."""
    return run_node(GaitOptimizerNode)


if __name__ == "__main__":
    sys.exit(main())
