"""Faults of requests, processes and files that the optimizer and the library have to survive."""

import os
import signal
from dataclasses import replace

import pytest
import yaml

pytest.importorskip("rclpy")

from diagnostic_msgs.msg import DiagnosticArray
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from library.made_up_gait import made_up_gait
from nodes.conftest import FAST, HIP_MASS, SLOW
from nodes.graph import children_of, exists, workers_of
from rclpy.parameter import Parameter
from walk_optimizer_interfaces.msg import GaitTable
from walk_optimizer_interfaces.srv import GetGait, ListGaits, OptimizeGait, Rebuild

from walk_optimizer.gait_files import codec, gait_file_name, write_gait_file
from walk_optimizer.library import GaitLibrary, Selection
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.nodes.conversions import gait_to_message, report_to_message
from walk_optimizer.nodes.qos import LATCHED
from walk_optimizer.nodes.qos import SERVICE as SERVICE_QOS
from walk_optimizer.request import gait_table_settings

pytestmark = pytest.mark.ros

GET, LIST = "gait_library/get_gait", "gait_library/list_gaits"
OPTIMIZE = "gait_optimizer/optimize_gait"
# Namespace of the nodes that all tests of requests share.
LASTING = "lasting"
MODE = "stiffness_and_equilibrium"
LIMITS = gait_table_settings()
FLOOD = 1000
# So fine a grid that the solve lasts until it is stopped.
ENDLESS = 2000

many = settings(
    max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture], database=None
)
# ROS strings end at a zero, and are UTF-8.
texts = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0"), max_size=40)
modes, selections = st.sampled_from(list(SpringMode)), st.sampled_from(["", *Selection])
numbers = st.floats(width=64)
impossible_speeds = numbers.filter(lambda v: not LIMITS.minimum_speed <= v <= LIMITS.maximum_speed)
possible_speeds = st.floats(LIMITS.minimum_speed, LIMITS.maximum_speed)
impossible_points = st.integers(1, LIMITS.minimum_points - 1) | st.integers(
    LIMITS.maximum_points + 1, 2**32 - 1
)
impossible_limits = numbers.filter(lambda v: not 0 <= v <= 86_400)


def fields(**strategies):
    return st.fixed_dictionaries(strategies)


bad_for_library = (
    fields(speed=impossible_speeds, spring_mode=modes | texts, selection=selections | texts)
    | fields(speed=possible_speeds, spring_mode=texts.filter(lambda t: t not in list(SpringMode)))
    | fields(
        speed=possible_speeds,
        spring_mode=modes,
        selection=texts.filter(lambda t: t not in ["", *Selection]),
    )
)
bad_for_optimizer = (
    fields(speed=impossible_speeds, spring_mode=modes | texts)
    | fields(speed=possible_speeds, spring_mode=modes, points=impossible_points)
    | fields(speed=possible_speeds, spring_mode=modes, time_limit=impossible_limits)
)


@pytest.fixture(scope="module")
def nodes(start_for_module, tmp_path_factory):
    """Both nodes for all requests and parameters: whatever they are given, they have to go on."""
    folder = tmp_path_factory.mktemp("gaits")
    GaitLibrary(WalkerParameters(), folder).store(made_up_gait(speed=0.4, mode="none"))
    return (
        start_for_module("gait_library", namespace=LASTING, cache_folder=folder),
        start_for_module("gait_optimizer", namespace=LASTING),
    )


@many
@given(request=bad_for_library)
def test_the_library_refuses_whatever_it_cannot_serve(graph, nodes, request):
    answer = graph.call(GetGait, f"{LASTING}/{GET}", **request)
    assert not answer.success
    assert "allowed" in answer.message


@many
@given(request=bad_for_optimizer)
def test_the_optimizer_refuses_whatever_it_cannot_solve(graph, nodes, request):
    answer = graph.call(OptimizeGait, f"{LASTING}/{OPTIMIZE}", **request)
    assert not answer.success
    assert "allowed" in answer.message
    assert nodes[1].exit_code is None


values = (
    st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | numbers
    | texts
    | st.lists(numbers, min_size=1, max_size=3)
    | st.lists(texts, min_size=1, max_size=3)
)
PARAMETERS = {
    "gait_library": {"points": 200, "optimizer_timeout": 900.0, "cache_folder": None, "autostart": True},
    "gait_optimizer": {"points": 200, "time_limit": 300.0, "workers": 1, "walker_file": ""},
}


@many
@given(name=st.sampled_from([(node, name) for node in PARAMETERS for name in PARAMETERS[node]]), value=values)
def test_a_parameter_takes_a_value_in_its_range_or_keeps_the_one_it_has(graph, nodes, name, value):
    node, parameter = name
    default = PARAMETERS[node][parameter]
    node = f"{LASTING}/{node}"
    before = graph.get_parameter(node, parameter)
    (answer,) = graph.set_parameters(node, Parameter(parameter, value=value))
    if answer.successful:
        assert type(value) is type(default)
        graph.set_parameters(node, Parameter(parameter, value=default))
    else:
        assert answer.reason
    assert graph.get_parameter(node, parameter) == before


@pytest.mark.parametrize("selection", ["exact", "interpolated"])
def test_a_flood_of_requests_to_the_library_is_answered_to_the_last(graph, nodes, selection):
    """Every tenth for a gait that is there; the rest can't be met, and are told so at once or after a try."""
    graph.client(GetGait, f"{LASTING}/{GET}")
    client = graph.node.create_client(GetGait, f"{LASTING}/{GET}", qos_profile=SERVICE_QOS)
    graph.spin_until(client.service_is_ready, "the service")
    graph.spin_for(0.5)
    speeds = [0.4 if number % 10 == 0 else 9.0 for number in range(FLOOD)]
    requests = [GetGait.Request(speed=speed, spring_mode="none", selection=selection) for speed in speeds]
    answers = [client.call_async(request) for request in requests]
    graph.spin_until(lambda: all(answer.done() for answer in answers), "all answers")
    assert [answer.result().success for answer in answers] == [speed == 0.4 for speed in speeds]


@pytest.fixture
def library_of(graph, start):
    """Return what starts a library and an optimizer for a walker, and the library's folder."""

    def begin(folder, walker, **optimizer):
        path = folder.parent / "walker.yaml"
        path.write_text(yaml.safe_dump(walker))
        start("gait_library", cache_folder=folder, walker_file=path, points=20)
        start("gait_optimizer", walker_file=path, **optimizer)
        graph.client(OptimizeGait, OPTIMIZE)

    return begin


@pytest.mark.parametrize(
    ("walker", "optimizer", "words"),
    [
        ({"upper_leg_length": 0.1, "lower_leg_length": 0.1}, {}, "infeasible: no gait meets all constraints"),
        ({"hip_mass": HIP_MASS}, {"time_limit": 0.1}, "time_limit: stopped at the time limit"),
    ],
)
def test_a_solve_without_a_gait_says_why_and_leaves_the_library_as_it_was(
    graph, library_of, tmp_path, walker, optimizer, words
):
    folder = tmp_path / "gaits"
    folder.mkdir()
    library_of(folder, walker, **optimizer)
    answer = graph.call(GetGait, GET, speed=0.8, spring_mode="none")
    assert not answer.success
    assert words in answer.message
    assert list(folder.iterdir()) == []
    assert len(graph.call(ListGaits, LIST).table.gaits) == 0


@pytest.mark.slow
def test_damaged_files_are_set_aside_and_solved_again(graph, start, stocked, monkeypatch):
    folder = stocked["cache_folder"]
    walker = WalkerParameters(hip_mass=HIP_MASS)
    torn = made_up_gait(speed=0.4, mode="none", walker=walker)
    newer = made_up_gait(speed=0.5, mode="none", walker=walker)
    others = made_up_gait(speed=0.6, mode="none", walker=replace(walker, gravity=1.62))
    paths = [folder / gait_file_name(gait) for gait in (torn, newer, others)]
    write_gait_file(torn, paths[0])
    write_gait_file(others, paths[2])
    with monkeypatch.context() as patch:
        patch.setattr(codec, "GAIT_FORMAT", replace(codec.GAIT_FORMAT, version=9))
        write_gait_file(newer, paths[1])
    paths[0].write_bytes(paths[0].read_bytes()[:-500])
    node = start("gait_library", **stocked)
    start("gait_optimizer", walker_file=stocked["walker_file"])
    assert len(graph.call(ListGaits, LIST).table.gaits) == 2
    for path, words in zip(
        paths, ("truncated or damaged", "format version is 9", "for another walker: gravity"), strict=True
    ):
        assert f"gait file set aside: {path}: " in node.output()
        assert words in node.output()
    graph.client(OptimizeGait, OPTIMIZE)
    answer = graph.call(GetGait, GET, speed=0.4, spring_mode="none")
    assert (answer.success, answer.source) == (True, "optimizer"), answer.message
    mended = GaitLibrary(walker, folder)
    assert mended.find(0.4, "none")[0].certificate.certified
    assert str(paths[0]) not in "\n".join(mended.problems())
    # A file that is of no use here may be of use elsewhere.
    assert [str(path) in "\n".join(mended.problems()) for path in paths[1:]] == [True, True]


def test_a_folder_that_cannot_be_written_stops_the_start(start, tmp_path):
    link, file = tmp_path / "link", tmp_path / "file"
    link.symlink_to(tmp_path)
    file.touch()
    places = {link: "is a symbolic link", file: "is a file", "/proc/1": "is not writable"}
    started = {place: start("gait_library", cache_folder=place) for place in places}
    for place, node in started.items():
        assert node.process.wait(60) == 1
        assert f"can't start: {place}: the folder {places[place]}" in node.output()
        assert "Traceback" not in node.output()


def test_gaits_of_an_optimizer_with_another_walker_are_refused(graph, start, stocked):
    """Nothing of it gets into the cache, where it would be for good."""
    heavy = made_up_gait(speed=0.4, mode="none", walker=WalkerParameters(hip_mass=HIP_MASS + 1))

    def solve(_request, response):
        response.success = True
        response.gait, response.report = gait_to_message(heavy), report_to_message(heavy.report)
        return response

    graph.node.create_service(OptimizeGait, OPTIMIZE, solve, qos_profile=SERVICE_QOS)
    start("gait_library", **stocked)
    before = sorted(stocked["cache_folder"].iterdir())
    answer = graph.call(GetGait, GET, speed=0.4, spring_mode="none", selection="exact")
    assert not answer.success
    assert "give all nodes the same walker_file" in answer.message
    assert sorted(stocked["cache_folder"].iterdir()) == before


def test_a_solved_gait_that_can_not_be_stored_is_served_and_told(graph, start, stocked):
    """With an optimizer that answers at once, and a folder that goes away like a full disk."""
    gait = made_up_gait(speed=0.4, mode="none", walker=WalkerParameters(hip_mass=HIP_MASS))

    def solve(_request, response):
        response.success = True
        response.gait, response.report = gait_to_message(gait), report_to_message(gait.report)
        return response

    graph.node.create_service(OptimizeGait, OPTIMIZE, solve, qos_profile=SERVICE_QOS)
    heard = graph.subscribe(DiagnosticArray, "/diagnostics")
    start("gait_library", **stocked)
    graph.client(GetGait, GET)
    folder = stocked["cache_folder"]
    away = folder.rename(folder.with_name("away"))
    wanted = {"speed": 0.4, "spring_mode": "none", "selection": "exact"}
    answer = graph.call(GetGait, GET, **wanted)
    assert (answer.success, answer.source) == (True, "optimizer"), answer.message
    assert f"the gait is kept in memory only, and lost when this process ends: {folder}" in answer.message
    assert graph.call(GetGait, GET, **wanted).gait == answer.gait

    def told(words):
        return any(words in one.message for array in heard for one in array.status if one.level == b"\x01")

    graph.spin_until(lambda: told("1 gaits are in memory only"), "the finding")
    rebuild = {"speeds": [0.4], "spring_modes": ["none"]}
    refused = graph.call(Rebuild, "gait_library/rebuild", **rebuild)
    assert (refused.success, "kept in memory only" in refused.message) == (False, True)
    away.rename(folder)
    assert graph.call(Rebuild, "gait_library/rebuild", **rebuild).success
    assert (folder / gait_file_name(gait)).is_file()
    heard.clear()
    graph.spin_until(
        lambda: any(one.message == "3 gaits" for array in heard for one in array.status), "all well"
    )


@pytest.mark.slow
def test_an_optimizer_that_is_killed_is_told_and_its_successor_is_asked(graph, start, stocked):
    library = start("gait_library", **stocked | {"points": ENDLESS})
    optimizer = start("gait_optimizer", walker_file=stocked["walker_file"])
    graph.spin_until(lambda: "ready" in optimizer.output(), "the optimizer")
    waiting = graph.send(GetGait, GET, speed=0.4, spring_mode="none")
    graph.spin_until(lambda: workers_of(optimizer.process.pid), "the worker")
    # Longer than the library looks for the optimizer: now it waits for the answer.
    graph.spin_for(4.0)
    # The library answers others while it waits.
    assert graph.call(GetGait, GET, speed=SLOW, spring_mode=MODE).success
    workers = children_of(optimizer.process.pid)
    optimizer.kill()
    answer = graph.result(waiting, "the answer", patience=15.0)
    assert "gait_optimizer/optimize_gait went away; ask again" in answer.message
    graph.spin_until(lambda: not any(map(exists, workers)), "the workers' end")
    successor = start("gait_optimizer", walker_file=stocked["walker_file"])
    graph.spin_until(lambda: "ready" in successor.output(), "the successor")
    graph.set_parameters("gait_library", Parameter("points", value=20))
    again = graph.call(GetGait, GET, speed=0.4, spring_mode="none")
    assert (again.success, again.source) == (True, "optimizer"), again.message
    assert library.exit_code is None


@pytest.mark.slow
def test_a_library_that_is_killed_while_it_waits_leaves_nothing_half_done(graph, start, stocked):
    optimizer = start("gait_optimizer", walker_file=stocked["walker_file"])
    library = start("gait_library", **stocked | {"points": ENDLESS})
    graph.client(OptimizeGait, OPTIMIZE)
    graph.send(GetGait, GET, speed=0.4, spring_mode="none")
    graph.spin_until(lambda: "asking" in library.output(), "the question")
    os.kill(library.process.pid, signal.SIGKILL)
    library.process.wait()
    assert sorted(path.suffix for path in stocked["cache_folder"].iterdir()) == [".npz", ".npz"]
    start("gait_library", **stocked)
    tables = graph.subscribe(GaitTable, "gait_library/table", LATCHED)
    graph.spin_until(lambda: tables, "the table, for a late joiner")
    assert sorted(row.speed for row in tables[-1].gaits) == pytest.approx([SLOW, FAST])
    graph.forget(GET)
    assert graph.call(GetGait, GET, speed=SLOW, spring_mode=MODE).success
    assert optimizer.exit_code is None
