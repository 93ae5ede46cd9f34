"""Imports run downwards only: what a module may import stands above it in this list."""

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

import walk_optimizer

ROOT = Path(walk_optimizer.__file__).parent

# Each line is a layer: its modules may import each other and the layers above, nothing below.
LAYERS = (
    ("errors", "__init__"),
    ("resources", "compiler"),
    ("multifrontal",),
    ("model",),
    ("request",),
    ("contact",),
    ("transcription",),
    ("guess",),
    ("solve",),
    ("condensed",),
    ("gait",),
    ("certificate",),
    ("refinement",),
    ("optimizer",),
    ("gait_files",),
    ("library",),
    ("transition",),
    ("references",),
    ("walk",),
    ("jobs",),
    ("description", "scene"),
    ("figures",),
    ("simulation",),
    ("examples",),
    ("recording",),
    ("nodes", "cli"),
)
RANK = {module: rank for rank, layer in enumerate(LAYERS) for module in layer}


def top(module: str) -> str:
    """Return the folder or file of the package that a dotted module name lies in."""
    parts = module.split(".")
    return "__init__" if len(parts) == 1 or parts[1] == "__version__" else parts[1]


def imports_of(path: Path) -> set[str]:
    """Return the dotted names that a file imports, those for type checkers included."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{alias.name}" for alias in node.names}
    return names


FILES = sorted(ROOT.rglob("*.py"))


def own_top(path: Path) -> str:
    first = path.relative_to(ROOT).parts[0]
    return first.removesuffix(".py")


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_imports_run_downwards(path):
    own = own_top(path)
    assert own in RANK, f"{own} has no layer in this test"
    for name in imports_of(path):
        if name.split(".")[0] == "walk_optimizer":
            assert RANK[top(name)] <= RANK[own], f"{path} imports {name}, which stands below it"


def test_the_table_of_the_architecture_names_every_part():
    table = (ROOT.parent / "docs" / "architecture.md").read_text()
    rows = [line for line in table.splitlines() if line.startswith("| `")]
    named = {name for row in rows for name in re.findall(r"`(\w+)(?:/|\.py)`", row.split("|")[1])}
    assert named == set(RANK) - {"__init__"}


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))
def test_only_the_nodes_know_ros(path):
    ros = {"rclpy", "std_msgs", "sensor_msgs", "trajectory_msgs", "walk_optimizer_interfaces", "launch"}
    ros |= {"geometry_msgs", "tf2_msgs", "visualization_msgs"}
    allowed = own_top(path) in {"nodes", "recording"} or path == ROOT / "cli" / "demo.py"
    if not allowed:
        assert not {name.split(".")[0] for name in imports_of(path)} & ros


OUTSIDE_THE_CORE = {"figures", "simulation", "examples", "recording", "nodes", "cli"}
OF_EXTRAS = {Path("solve/uno.py"), Path("solve/snopt.py")}
CORE = sorted(
    ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
    for path in FILES
    if own_top(path) not in OUTSIDE_THE_CORE and path.relative_to(ROOT) not in OF_EXTRAS
)


def test_the_core_works_without_ros_and_matplotlib():
    code = (
        "import sys, importlib\n"
        "for name in ('rclpy', 'std_msgs', 'sensor_msgs', 'matplotlib', 'walk_optimizer_interfaces'):\n"
        "    sys.modules[name] = None\n"
        f"for name in {CORE!r}:\n"
        "    importlib.import_module(name)\n"
        "import walk_optimizer.figures, walk_optimizer.recording, walk_optimizer.cli.main\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_importing_the_package_is_quick():
    import time

    times = []
    for _ in range(3):
        begin = time.monotonic()
        subprocess.run([sys.executable, "-c", "import walk_optimizer"], check=True)
        times.append(time.monotonic() - begin)
    assert min(times) < 0.5
