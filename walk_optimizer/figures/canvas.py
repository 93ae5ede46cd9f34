"""Where figures are drawn and how they look; matplotlib is imported here, when it is needed."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walk_optimizer.errors import GaitFileError, InvalidRequestError, MissingDependencyError
from walk_optimizer.gait_files.access import writable_target

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = (".png", ".pdf", ".svg")
STANCE_COLOUR = "#1f3b5c"
SWING_COLOUR = "#d9722b"
FAINT = "#8a8f98"
STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#e4e6ea",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "legend.frameon": False,
    "legend.fontsize": 8.5,
    "lines.linewidth": 1.6,
    "svg.hashsalt": "walk_optimizer",
}


def picture_target(path: Path) -> None:
    """Make sure, before any work, that a picture can be drawn and put there.

    Raises:
        InvalidRequestError: the name ends in no format of pictures.
        MissingDependencyError: matplotlib is not installed.
        GaitFileError: the place is not writable.
    """
    if path.suffix.lower() not in FORMATS:
        raise InvalidRequestError(f"{path}: a picture's name ends in {', '.join(FORMATS)}")
    writable_target(path)
    new_figure(1, 1)


def new_figure(width: float, height: float) -> "Figure":
    """Return an empty figure of a size in [inch] that needs no display.

    Raises:
        MissingDependencyError: matplotlib is not installed.
    """
    try:
        from matplotlib.backends.backend_agg import FigureCanvasAgg
        from matplotlib.figure import Figure
    except ImportError as error:
        raise MissingDependencyError(
            "pictures need matplotlib; install it with: pip install 'walk-optimizer[figures]'"
        ) from error
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def save(figure: "Figure", path: Path) -> None:
    """Write a figure in the format that the name's ending says.

    Raises:
        GaitFileError: the file can't be written.
    """
    try:
        figure.savefig(path, dpi=150, metadata=_without_date(path))
    except OSError as error:
        raise GaitFileError(f"{path}: can't be written: {error.strerror}") from error


@contextmanager
def house_style() -> Iterator[None]:
    """Draw with the project's look, and leave matplotlib's settings as they were."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        yield


def _without_date(path: Path) -> dict[str, Any]:
    """Return metadata that leaves the date out, so that the same gait gives the same file."""
    return {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}.get(path.suffix.lower(), {})
