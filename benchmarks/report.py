"""Markdown of the benchmarks: tables, the machine, and pages whose sections are renewed one at a time."""

import os
import platform
import re
import subprocess
from collections.abc import Iterable, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path


def table(header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a Markdown table."""
    lines = [header, ["---"] * len(header), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines)


def seconds(value: float) -> str:
    """Return a duration in [s] with three digits and a unit."""
    if value >= 100:
        return f"{value:.0f} s"
    return f"{value:.3g} s" if value >= 0.1 else f"{1000 * value:.3g} ms"


def ratio(theirs: float | None, ours: float | None) -> str:
    """Return how many times faster ours is; a dash where either is missing."""
    return "-" if not theirs or not ours else f"{theirs / ours:.1f}"


def package_version(name: str) -> str:
    """Return the version of an installed package, or that it is missing."""
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def machine(packages: Sequence[str] = ("casadi", "numpy", "scipy")) -> str:
    """Return a line on processor, load, versions and commit."""
    versions = ", ".join(f"{name} {package_version(name)}" for name in packages)
    return (
        f"*{_processor()}, {os.cpu_count()} cores, load {os.getloadavg()[0]:.1f} as it began; "
        f"Python {platform.python_version()}, {versions}; commit {_commit()}.*"
    )


def _processor() -> str:
    match = re.search(r"model name\s*:\s*(.*)", Path("/proc/cpuinfo").read_text(encoding="utf-8"))
    return match[1].strip() if match else platform.machine()


def _commit() -> str:
    command = ["git", "describe", "--always", "--dirty"]
    run = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=False)
    return run.stdout.strip() or "unknown"


def save_section(page: Path, title: str, order: Sequence[str], heading: str, text: str) -> None:
    """Replace or add a section of a page; the sections stand in a given order.

    Args:
        page: Markdown file, which need not exist.
        title: First lines of the page.
        order: All headings that it may have.
        heading: That of this section.
        text: Its text.
    """
    old = page.read_text(encoding="utf-8") if page.is_file() else ""
    parts = re.split(r"^## (.*)\n", old, flags=re.MULTILINE)[1:]
    sections = {**dict(zip(parts[::2], parts[1::2], strict=True)), heading: text}
    body = [f"## {one}\n\n{sections[one].strip()}\n" for one in order if one in sections]
    page.parent.mkdir(parents=True, exist_ok=True)
    page.write_text("\n".join([title.strip() + "\n", *body]), encoding="utf-8")
