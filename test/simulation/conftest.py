"""Shipped gaits with their feedback, made once for all tests here."""

import pytest

from walk_optimizer.gait import Gait
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.simulation.closed_loop import ClosedLoop, closed_loop
from walk_optimizer.simulation.settings import simulation_settings


@pytest.fixture(scope="session")
def gait() -> Gait:
    walker = WalkerParameters.from_yaml()
    return GaitLibrary(walker).find(1.5 / 3.6, SpringMode.STIFFNESS_AND_EQUILIBRIUM)[0]


@pytest.fixture(scope="session")
def loop(gait: Gait) -> ClosedLoop:
    return closed_loop(gait, simulation_settings())
