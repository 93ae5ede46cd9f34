"""Solves in worker processes that can be killed, so that cancel and time limits are real.

Owns the queue, the processes and who waits for what. Does not own what a job is: any picklable,
hashable value, handed to a module-level function in the process (`worker_process`).
"""

import atexit
import contextlib
import threading
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from typing import Any

from walk_optimizer.errors import SolveFailedError, WalkOptimizerError
from walk_optimizer.solve.status import Progress, Status
from walk_optimizer.solve.worker_handle import WorkerHandle, WorkerLostError, WorkerOverdueError
from walk_optimizer.solve.worker_process import Failed, Finished, Function
from walk_optimizer.solve.worker_task import Task, Ticket

# A solve ends itself at its time limit; one that still has not after this time in [s] is killed.
GRACE = 2.0
_SHUTTING_DOWN = "the solver is shutting down; ask again when it runs"


class BusyError(WalkOptimizerError):
    """Too many solves are waiting already."""


@dataclass(frozen=True)
class PoolState:
    """What a pool is doing.

    Attributes:
        workers: Processes that live.
        running: Jobs that are being done.
        waiting: Jobs that wait for a process.
    """

    workers: int
    running: int
    waiting: int


class WorkerPool:
    """A bounded queue in front of a few worker processes; equal jobs are done once."""

    def __init__(
        self, function: Function, workers: int = 1, queue_limit: int = 16, grace: float = GRACE
    ) -> None:
        """Start the workers.

        Args:
            function: Does a job; a module-level function.
            workers: Number of processes.
            queue_limit: Jobs that may wait for a process.
            grace: How far a job may exceed its time limit before it is killed, in [s].
        """
        self._function, self._queue_limit, self._grace = function, queue_limit, grace
        self._queue: deque[Task] = deque()
        self._tasks: dict[tuple[Hashable, float], Task] = {}
        self._workers: dict[int, WorkerHandle] = {}
        self._changed = threading.Condition()
        self._closed = False
        self._threads = [
            threading.Thread(target=self._serve, args=(index,), name=f"solve_worker_{index}", daemon=True)
            for index in range(workers)
        ]
        # Before multiprocessing's own exit hook, which would wait for the processes for ever.
        atexit.register(self.close)
        for thread in self._threads:
            thread.start()

    def submit(
        self, job: Hashable, time_limit: float, on_progress: Callable[[Progress], None] | None = None
    ) -> Ticket:
        """Queue a job, or join those who wait for the same one.

        Args:
            job: Picklable and hashable.
            time_limit: From the start of the job in [s].
            on_progress: Called in a thread of the pool; must return soon.

        Raises:
            BusyError: the queue is full, or the pool closed.
        """
        with self._changed:
            if self._closed:
                raise BusyError(_SHUTTING_DOWN)
            task = self._tasks.get((job, time_limit))
            if task is None:
                task = self._enqueue(job, time_limit)
            ticket = Ticket(task, self.give_up, on_progress)
            task.tickets.append(ticket)
            self._changed.notify()
        return ticket

    def give_up(self, ticket: Ticket) -> None:
        """End a ticket as cancelled; nothing happens when it has its answer."""
        self._end(ticket)

    def _end(self, ticket: Ticket, reason: str = "") -> None:
        with self._changed:
            task = next((task for task in self._tasks.values() if ticket in task.tickets), None)
            if task is None:
                return
            task.tickets.remove(ticket)
            if not task.tickets:
                self._drop(task)
        ticket.future.set_exception(task.stopped(Status.CANCELLED, reason))

    def state(self) -> PoolState:
        """Return what the pool is doing now."""
        with self._changed:
            running = sum(task.worker is not None for task in self._tasks.values())
            alive = sum(worker.alive for worker in tuple(self._workers.values()))
            return PoolState(alive, running, len(self._queue))

    def close(self) -> None:
        """Cancel everything, end the processes and wait for them; again is harmless."""
        with self._changed:
            self._closed = True
            tickets = [ticket for task in self._tasks.values() for ticket in task.tickets]
            self._changed.notify_all()
        for ticket in tickets:
            self._end(ticket, _SHUTTING_DOWN)
        for worker in tuple(self._workers.values()):
            worker.kill()
        for thread in self._threads:
            thread.join()
        atexit.unregister(self.close)

    def _enqueue(self, job: Hashable, time_limit: float) -> Task:
        if len(self._queue) >= self._queue_limit:
            raise BusyError(
                f"busy: {len(self._queue)} solves are waiting, no more than {self._queue_limit} may; "
                "ask again later"
            )
        task = Task(job, time_limit)
        self._tasks[job, time_limit] = task
        self._queue.append(task)
        return task

    def _drop(self, task: Task) -> None:
        """Forget a task that nobody waits for."""
        del self._tasks[task.job, task.time_limit]
        if task.handed_over and task.worker is not None:
            task.worker.kill()
        elif task in self._queue:  # Otherwise a thread has taken it, and will see that it is off.
            self._queue.remove(task)

    def _serve(self, index: int) -> None:
        """Body of a thread: one worker process, renewed whenever it is lost."""
        # At once, so that the first job finds it ready; if that fails, it is the job that is told.
        with contextlib.suppress(OSError):
            self._living_worker(index)
        while (task := self._next_task()) is not None:
            try:
                worker = self._living_worker(index)
            except OSError as error:
                self._finish(task, error=SolveFailedError(f"no process for the solve: {error.strerror}"))
            else:
                self._do(task, worker)
        if index in self._workers:
            self._workers[index].end()

    def _living_worker(self, index: int) -> WorkerHandle:
        """Return the process of a thread; a new one where there is none, or it has ended.

        Raises:
            OSError: it can't be started.
        """
        worker = self._workers.get(index)
        if worker is not None and worker.alive:
            return worker
        if worker is not None:
            worker.end()
        worker = self._workers[index] = WorkerHandle(self._function)
        return worker

    def _next_task(self) -> Task | None:
        """Wait for a task; None when the pool is closed."""
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._queue)
            return None if self._closed else self._queue.popleft()

    def _do(self, task: Task, worker: WorkerHandle) -> None:
        with self._changed:
            if not task.tickets:
                return
            task.start(worker)
        try:
            worker.wait_until_ready()
            if not self._hand_over(task):
                return
            answer = worker.run(task.job, task.time_limit + self._grace, task.tell)
        except WorkerOverdueError:
            self._finish(task, error=task.stopped(Status.TIME_LIMIT))
        except WorkerLostError:
            self._finish(task, error=task.stopped(Status.WORKER_LOST))
        else:
            self._answer(task, answer)

    def _hand_over(self, task: Task) -> bool:
        """Note that the worker gets a job, and return whether anybody still wants it.

        Until then a job that is given up leaves its process alone: jobs that follow each other faster than a
        process starts would never be done otherwise.
        """
        with self._changed:
            task.handed_over = bool(task.tickets)
            return task.handed_over

    def _answer(self, task: Task, answer: Finished | Failed) -> None:
        if isinstance(answer, Finished):
            self._finish(task, result=answer.result)
        else:
            self._finish(task, error=SolveFailedError(answer.message))

    def _finish(self, task: Task, result: Any = None, error: Exception | None = None) -> None:
        """Answer everyone who still waits."""
        with self._changed:
            tickets, task.tickets = task.tickets, []
            if self._tasks.get((task.job, task.time_limit)) is task:
                del self._tasks[task.job, task.time_limit]
        for ticket in tickets:
            if error is not None:
                ticket.future.set_exception(error)
            else:
                ticket.future.set_result(result)
