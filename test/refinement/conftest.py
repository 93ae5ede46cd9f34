"""A shipped gait and its refinement, solved once for all tests here."""

import pytest

from walk_optimizer.gait import Gait, RefinedGait
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.refinement.refine import refined_gait
from walk_optimizer.solve.session import SolveSession
from walk_optimizer.solve.settings import solver_settings


@pytest.fixture(scope="session")
def gait() -> Gait:
    walker = WalkerParameters.from_yaml()
    return GaitLibrary(walker).find(1.5 / 3.6, SpringMode.STIFFNESS_AND_EQUILIBRIUM)[0]


@pytest.fixture
def session() -> SolveSession:
    return SolveSession(solver_settings(), 300.0, None)


@pytest.fixture(scope="session")
def refined(gait: Gait) -> RefinedGait:
    result = refined_gait(gait, SolveSession(solver_settings(), 300.0, None))
    assert result is not None
    return result
