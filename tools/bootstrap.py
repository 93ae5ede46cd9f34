"""Make `.venv`: ROS 2 from wheels, the built interfaces, and this checkout installed editable.

`make` runs this before every target. Each step leaves a stamp with the digest of what it depends on,
so a second run only compares digests.

The wheels bring the whole of rclpy, but four things are left to do:

- their CMake files name the include folders of the machine that built them (`rewrite_include_paths`);
- `walk_optimizer_interfaces` has to be generated and compiled (`build_interfaces`), and so has the message
  of tf2_msgs, which no wheel holds (`build_missing_messages`);
- an editable install leaves out data files, so the share folder is made of links (`link_share_files`);
- processes need AMENT_PREFIX_PATH to find packages (`write_environment_hook`). LD_LIBRARY_PATH is set
  by a start-up hook of the wheels themselves.
"""

from __future__ import annotations  # lets a Python that is too old reach check_python

import hashlib
import os
import re
import shutil
import subprocess
import sys
import venv
from collections.abc import Iterable
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VENV = ROOT / ".venv"
PYTHON = VENV / "bin" / "python"
INTERFACES = ROOT / "walk_optimizer_interfaces"
TF2_MESSAGES = ROOT / "tools" / "tf2_msgs"
SHARED_FOLDERS = ("config", "foxglove", "launch", "rviz", "security", "urdf")

# The wheels exist for these versions of Python.
OLDEST = (3, 11)
NEWEST = (3, 13)

# The folders that hold Python's and NumPy's headers on the machine that built the wheels.
FOREIGN_PYTHON = re.compile(r"/opt/python/cp\d+-cp\d+/include/python3\.\d+")
FOREIGN_NUMPY = re.compile(r"/opt/python/cp\d+-cp\d+/lib/python3\.\d+/site-packages/numpy/_?core/include")

# AMENT_PREFIX_PATH stays as it is when a ROS installation has been sourced.
ENVIRONMENT_HOOK = 'import os, sys; os.environ.setdefault("AMENT_PREFIX_PATH", sys.prefix)\n'


def main() -> int:
    """Bring the environment up to date and return the exit status."""
    try:
        check_python()
        make_environment()
        install_packages()
        build_interfaces()
        build_missing_messages()
        link_share_files()
    except BootstrapError as error:
        print(f"bootstrap: {error}", file=sys.stderr)
        return 1
    except subprocess.CalledProcessError as error:
        print(f"bootstrap: failed with status {error.returncode}: {error.cmd[0]}", file=sys.stderr)
        return 1
    return 0


class BootstrapError(Exception):
    """The machine lacks something that a person has to provide."""


def check_python() -> None:
    """Stop with advice when no ROS wheels exist for the running Python."""
    if not OLDEST <= sys.version_info[:2] <= NEWEST:
        raise BootstrapError(
            f"Python {sys.version_info[0]}.{sys.version_info[1]} is running, but the ROS 2 wheels need "
            f"3.{OLDEST[1]} to 3.{NEWEST[1]}. Name another one: make PYTHON=python3.12"
        )


def make_environment() -> None:
    """Create `.venv`, or create it anew when it belongs to another Python or was moved."""
    identity = f"{sys.version} {sys.base_prefix} {VENV}"
    if PYTHON.exists() and is_done("environment", identity):
        return
    say(f"creating {VENV} with Python {sys.version.split()[0]}")
    if sys.prefix != sys.base_prefix and Path(sys.prefix).resolve() == VENV.resolve():
        raise BootstrapError("this Python lives in .venv itself: run `deactivate`, then make again")
    venv.create(VENV, clear=True, with_pip=True)
    mark_done("environment", identity)


def install_packages() -> None:
    """Install the checkout editable with everything that developing it needs."""
    state = digest([ROOT / "setup.py", ROOT / "pyproject.toml", Path(__file__)])
    if is_done("packages", state):
        return
    say("installing the packages that setup.py names")
    pip("--upgrade", "setuptools>=64")
    pip("--no-build-isolation", "--editable", f"{ROOT}[dev]")
    rewrite_include_paths()
    write_environment_hook()
    mark_done("packages", state)


def rewrite_include_paths() -> None:
    """Point the wheels' CMake files at this environment's headers."""
    question = "import numpy, sysconfig; print(sysconfig.get_path('include')); print(numpy.get_include())"
    answer = subprocess.run([PYTHON, "-c", question], check=True, capture_output=True, text=True)
    python_headers, numpy_headers = answer.stdout.splitlines()
    if not Path(python_headers, "Python.h").exists():
        raise BootstrapError(f"no Python.h in {python_headers}: install Python's development files")
    for file in (VENV / "share").rglob("*.cmake"):
        old = file.read_text(encoding="utf-8")
        new = FOREIGN_NUMPY.sub(numpy_headers, FOREIGN_PYTHON.sub(python_headers, old))
        if new != old:
            file.write_text(new, encoding="utf-8")


def write_environment_hook() -> None:
    """Let every Python of `.venv` find the environment's ROS packages from any shell.

    A console script has no place to source a setup file. A `.pth` file is read when Python starts,
    before rclpy, and only in this environment, so a sourced ROS installation is never touched.
    """
    (site_packages,) = VENV.glob("lib/python3.*/site-packages")
    (site_packages / "walk_optimizer_ament_prefix.pth").write_text(ENVIRONMENT_HOOK, encoding="utf-8")


def build_interfaces() -> None:
    """Generate, compile and install walk_optimizer_interfaces into `.venv`."""
    build_package(INTERFACES, "interfaces")


def build_missing_messages() -> None:
    """Do the same with our copy of tf2_msgs, unless a package of that name is there from elsewhere."""
    ours = (VENV / ".tf2_msgs.stamp").exists()
    if ours or not (VENV / "share" / TF2_MESSAGES.name).exists():
        build_package(TF2_MESSAGES, "tf2_msgs")


def build_package(package: Path, step: str) -> None:
    """Generate, compile and install an interface package into `.venv`.

    Args:
        package: Its folder.
        step: Name of its stamp.
    """
    files = [path for path in package.rglob("*") if path.is_file()]
    state = digest([*files, ROOT / "setup.py"])
    if is_done(step, state):
        return
    cmake = require("cmake")
    require("c++")
    say(f"building {package.name}")
    environment = os.environ | {
        "AMENT_PREFIX_PATH": str(VENV),
        "CMAKE_PREFIX_PATH": str(VENV),
        "PATH": f"{VENV / 'bin'}{os.pathsep}{os.environ['PATH']}",
    }
    options = [f"-DCMAKE_INSTALL_PREFIX={VENV}", f"-DPython3_EXECUTABLE={PYTHON}", "-DBUILD_TESTING=OFF"]
    build = VENV / "build" / package.name
    for arguments in (
        ["-S", package, "-B", build, *options],
        ["--build", build, "--parallel", str(os.cpu_count() or 1)],
        ["--install", build],
    ):
        run_quietly([cmake, *arguments], environment)
    mark_done(step, state)


def link_share_files() -> None:
    """Fill `share/walk_optimizer` and the package index with links to the checkout.

    The links are to files, not to folders: a later `pip install` replaces a link to a file, but
    would write through a link to a folder into the checkout.
    """
    share = Path("share", "walk_optimizer")
    files = [path for folder in SHARED_FOLDERS for path in (ROOT / folder).glob("*") if path.is_file()]
    links = {share / path.relative_to(ROOT): path for path in [*files, ROOT / "package.xml"]}
    links[Path("share/ament_index/resource_index/packages/walk_optimizer")] = ROOT / "resource/walk_optimizer"
    shutil.rmtree(VENV / share, ignore_errors=True)
    for link, target in links.items():
        (VENV / link).parent.mkdir(parents=True, exist_ok=True)
        (VENV / link).unlink(missing_ok=True)
        (VENV / link).symlink_to(target)


def require(program: str) -> str:
    """Return the path of a program of the system."""
    path = shutil.which(program)
    if path is None:
        raise BootstrapError(f"{program} not found: install CMake 3.20 or newer and a C++ compiler")
    return path


def pip(*arguments: str) -> None:
    """Run `pip install` of the environment."""
    command = [PYTHON, "-m", "pip", "install", "-qq", "--disable-pip-version-check"]
    subprocess.run([*command, *arguments], check=True)


def run_quietly(command: list[str | Path], environment: dict[str, str]) -> None:
    """Run a command and show its output only when it fails."""
    result = subprocess.run(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False
    )
    if result.returncode != 0:
        print(result.stdout, file=sys.stderr)
        result.check_returncode()


def digest(files: Iterable[Path]) -> str:
    """Return one digest of the names and contents of files."""
    total = hashlib.sha256()
    for file in sorted(files):
        total.update(f"{file.relative_to(ROOT)}\n".encode())
        total.update(file.read_bytes())
    return total.hexdigest()


def is_done(step: str, state: str) -> bool:
    """Return whether a step was done last time with the same state."""
    stamp = VENV / f".{step}.stamp"
    return stamp.exists() and stamp.read_text(encoding="utf-8") == state


def mark_done(step: str, state: str) -> None:
    """Remember the state with which a step was done."""
    (VENV / f".{step}.stamp").write_text(state, encoding="utf-8")


def say(text: str) -> None:
    """Print a line of progress at once, also into a pipe."""
    print(f"bootstrap: {text}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
