"""Gaits of three speeds in all modes, solved once for all tests of this folder."""

import pytest
from optimizer.grids import GRIDS

from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.optimizer import optimize
from walk_optimizer.request import GaitRequest


@pytest.fixture(scope="session")
def walker():
    return WalkerParameters()


@pytest.fixture(scope="session")
def outcomes(walker):
    """Outcome by speed and mode; each is solved when it is first asked for."""

    class Solved(dict):
        def __missing__(self, key):
            speed, mode = key
            self[key] = optimize(GaitRequest.for_speed(speed, mode, GRIDS[speed]), walker)
            return self[key]

    return Solved()


@pytest.fixture(scope="session")
def plain_gait(outcomes):
    """The middle speed without springs."""
    return outcomes[0.42, SpringMode.NONE].gait
