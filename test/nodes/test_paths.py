"""Files and folders that users name, as `~` too: no shell expands that behind `:=`."""

from pathlib import Path
from types import SimpleNamespace

import pytest

pytest.importorskip("rclpy")

from walk_optimizer_interfaces.srv import ListGaits

from walk_optimizer.errors import ConfigurationError, GaitFileError
from walk_optimizer.nodes.bag import named_folder
from walk_optimizer.nodes.paths import named_path
from walk_optimizer.nodes.transition_planner import TransitionPlanner
from walk_optimizer.nodes.walker_setting import walker_of
from walk_optimizer.recording.errors import BagNotWritableError

NOBODY = "~nobody_of_that_name/place"


@pytest.fixture
def home(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    return tmp_path


@pytest.mark.parametrize(
    ("name", "path"), [("~/gaits", "gaits"), ("~", "."), ("/gaits", "/gaits"), ("a/~", None)]
)
def test_a_tilde_at_the_begin_is_the_home(home, name, path):
    assert named_path(name) == (Path(name) if path is None else home / path)


def test_a_home_that_is_not_there_is_told():
    with pytest.raises(ConfigurationError, match=f"^{NOBODY}: no such home; name another place$"):
        walker_of(NOBODY)
    with pytest.raises(
        BagNotWritableError, match=f"^Cannot write {NOBODY}: no such home; name another place$"
    ):
        named_folder(NOBODY)


def planner(cache_folder):
    return TransitionPlanner(SimpleNamespace(parameters={"cache_folder": cache_folder, "walker_file": ""}))


def test_a_cache_of_transitions_may_lie_in_the_home(home):
    with pytest.raises(GaitFileError, match=f"^{home / 'steps'}: the folder is missing"):
        planner("~/steps")
    (home / "steps").mkdir()
    planner("~/steps").close()
    with pytest.raises(ConfigurationError, match="no such home"):
        planner(NOBODY)


@pytest.mark.ros
def test_a_library_takes_walker_and_gaits_from_the_home(graph, start, stocked, home):
    walker = home / "walker.yaml"
    walker.write_bytes(stocked["walker_file"].read_bytes())
    gaits = Path("~") / stocked["cache_folder"].relative_to(home)
    start("gait_library", **stocked | {"walker_file": "~/walker.yaml", "cache_folder": gaits})
    assert len(graph.call(ListGaits, "gait_library/list_gaits").table.gaits) == 2
