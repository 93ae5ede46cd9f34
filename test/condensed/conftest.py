"""Shipped gaits, and what a condensed solve takes of them."""

from dataclasses import dataclass

import numpy as np
import pytest

from walk_optimizer.condensed.ends import Ends
from walk_optimizer.condensed.kernel import kernel
from walk_optimizer.condensed.solve import begin
from walk_optimizer.condensed.step import CondensedStep, Unknowns
from walk_optimizer.gait import Gait
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.refinement.mesh_adaptation import resampled
from walk_optimizer.refinement.resolve import mesh_of
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints

needs_compiler = pytest.mark.skipif(kernel() is None, reason="no C compiler")


@dataclass(frozen=True, eq=False)
class Start:
    """A shipped gait as a start for others."""

    gait: Gait
    mesh: Mesh
    points: RefinedPoints

    @property
    def lengths(self) -> np.ndarray:
        return self.mesh.lengths(self.points.durations)

    def step(self, threads: int = 1) -> tuple[CondensedStep, Ends]:
        """Return a condensed step with this gait as its iterate, and its ends."""
        gait = self.gait
        ends = Ends(gait.request, gait.walker)
        unknowns = Unknowns(self.lengths.size, len(ends.equations), ends.size)
        length = gait.request.step_length
        step = CondensedStep(kernel(), gait.walker, length, self.lengths, unknowns, threads)
        begin(step, ends, gait.walker, self.points)
        return step, ends


@pytest.fixture(scope="session")
def library() -> GaitLibrary:
    return GaitLibrary(WalkerParameters.from_yaml())


def start_of(library: GaitLibrary, speed: float, mode: str) -> Start:
    """Return the shipped gait nearest to a speed in [m/s]."""
    fitting = [one for one in library.gaits() if one.request.spring_mode == mode]
    gait = min(fitting, key=lambda one: abs(one.request.speed - speed))
    mesh = mesh_of(gait, gait.refined)
    return Start(gait, mesh, resampled(gait.refined.trajectory, gait.refined.spring, mesh, mesh))


@pytest.fixture(scope="session", params=["none", "stiffness", "stiffness_and_equilibrium"])
def start(request, library) -> Start:
    return start_of(library, 0.53, request.param)
