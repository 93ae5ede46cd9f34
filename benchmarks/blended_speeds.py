"""Which speeds are served by blending neighbours of the packaged table, and how good the blends are.

    .venv/bin/python benchmarks/blended_speeds.py

Prints the table of docs/any_speed.md.
"""

import argparse
import time
from itertools import pairwise

import numpy as np
from packaged import packaged_library

from walk_optimizer.errors import GaitNotFoundError
from walk_optimizer.library import EXACT_SPEED_TOLERANCE
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import gait_table_settings

FAMILIES = ("dynamics", "kinematics", "interval_replay", "landing", "impact")
PER_GAP = 9


def main():
    """Ask for speeds between those of the table, in every mode."""
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    speeds = gait_table_settings().table_speeds()
    print(f"| springs | blended between | of {PER_GAP} speeds | time [s] | {' | '.join(FAMILIES)} |")
    print("| --- | --- | --- | --- |" + " --- |" * len(FAMILIES))
    library = packaged_library()
    for mode in SpringMode:
        for low, high in pairwise(speeds):
            print(row(library, mode, low, high))


def row(library, mode, low, high):
    """Return the line of one pair of neighbours: how many blends, and their largest residuals."""
    blends, begin = [], time.perf_counter()
    for speed in np.linspace(low, high, PER_GAP + 2)[1:-1]:
        try:
            found = library.find(speed, mode, "interpolated", tolerance=EXACT_SPEED_TOLERANCE)
        except GaitNotFoundError:
            continue
        blends.append({entry.family: entry.violation for entry in found[0].certificate.entries})
    elapsed = (time.perf_counter() - begin) / PER_GAP
    worst = [f"{max(one[name] for one in blends):.2g}" if blends else "" for name in FAMILIES]
    return f"| {mode} | {low:.3f}, {high:.3f} m/s | {len(blends)} | {elapsed:.1f} | {' | '.join(worst)} |"


if __name__ == "__main__":
    main()
