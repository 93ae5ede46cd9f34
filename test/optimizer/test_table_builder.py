"""The table's bookkeeping, on a pool that solves nothing."""

from concurrent.futures import Future
from dataclasses import replace
from types import SimpleNamespace

import pytest

from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer import Outcome, table_builder
from walk_optimizer.request import gait_table_settings
from walk_optimizer.solve.status import SolveReport, Status

KEY = (0, SpringMode.NONE)


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


def test_a_build_begins_with_the_refinements_of_the_former_table():
    walker = WalkerParameters.from_yaml()
    former = GaitLibrary(walker).find(0.32, "none", "nearest")[0]
    bare = replace(former, refined=None)

    def submit(run, _):
        """Find the former gait again, and no refinement of it."""
        future = Future()
        future.set_result(Outcome(bare if run is table_builder._run else None, former.report))
        return future

    pool = SimpleNamespace(submit=submit)
    builder = table_builder._Builder(walker, {KEY: former.request}, [former], pool, None)
    assert builder.build()[KEY].refined is former.refined


def test_refinements_are_continued_until_none_improves(monkeypatch):
    walker = WalkerParameters.from_yaml()
    gaits = [one for one in GaitLibrary(walker).gaits() if one.request.spring_mode is SpringMode.NONE]
    table = {
        (index, SpringMode.NONE): gait for index, gait in enumerate(sorted(gaits, key=lambda g: g.speed))
    }
    third = table[2, SpringMode.NONE]
    trajectory = third.refined.trajectory
    better = replace(
        third, refined=replace(third.refined, trajectory=replace(trajectory, torques=trajectory.torques / 2))
    )
    asked = []

    def submit(_, job):
        asked.append((job.gait.request, [seed.request for seed in job.seeds]))
        future = Future()
        future.set_result(Outcome(better if job.gait is third else job.gait, job.gait.report))
        return future

    builder = table_builder._Builder(
        walker, {key: gait.request for key, gait in table.items()}, [], SimpleNamespace(submit=submit), None
    )
    builder.table = dict(table)
    builder._continue_refinements()
    assert builder.table == table | {(2, SpringMode.NONE): better}
    requests = [gait.request for gait in table.values()]
    assert [request for request, _ in asked[:7]] == requests
    assert asked[7:] == [(requests[1], [requests[2]]), (requests[3], [requests[2]])]
