"""Draw what RViz shows of a walk, from messages of the running nodes.

    .venv/bin/python tools/draw_displays docs/images

Starts the nodes as processes, has them walk, records what they publish, and draws the last instant as
rviz/walker.rviz says: its topics, camera, colours, panels. RViz is not run; fonts and shading are
matplotlib's.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from pages import draw_rviz
from recording import record


def main() -> None:
    """Record, and draw the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, help="where rviz.png goes")
    folder = parser.parse_args().folder
    recording = record()
    if not recording.markers:
        raise SystemExit("nothing was received")
    path = folder / "rviz.png"
    draw_rviz(recording, path)
    print(path)


if __name__ == "__main__":
    main()
