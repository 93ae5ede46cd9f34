"""The table's bookkeeping, on a pool that solves nothing."""

from concurrent.futures import Future
from types import SimpleNamespace

import pytest

from walk_optimizer import table_builder
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer import Outcome
from walk_optimizer.request import gait_table_settings
from walk_optimizer.solve.status import SolveReport, Status


@pytest.fixture
def pool(monkeypatch):
    """Takes the place of the processes: every solve ends at once without a gait."""

    told = SimpleNamespace(requests=[], shutdowns=[])

    def submit(_, job):
        told.requests.append(job.request)
        future = Future()
        future.set_result(Outcome(None, SolveReport(Status.INFEASIBLE, "none", "ipopt")))
        return future

    told.submit, told.shutdown = submit, lambda **options: told.shutdowns.append(options)
    monkeypatch.setattr(table_builder, "ProcessPoolExecutor", lambda *_, **__: told)
    return told


def test_modes_may_be_any_iterable(pool):
    modes = [SpringMode.NONE, SpringMode.STIFFNESS]
    assert table_builder.build_table(WalkerParameters(), modes=iter(modes)) == {}
    assert len(pool.requests) == gait_table_settings().gaits * len(modes)
    assert {request.spring_mode for request in pool.requests} == set(modes)


def test_an_interrupted_build_drops_its_queue(pool):
    def interrupt(progress):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        table_builder.build_table(WalkerParameters(), on_progress=interrupt)
    assert pool.shutdowns == [{"cancel_futures": True}]
