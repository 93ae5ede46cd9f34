"""Gaits of the packaged table, the stand, and one transition solved for all tests here."""

import pytest

from walk_optimizer.gait import Gait
from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.transition.solve import plan_transition
from walk_optimizer.transition.standing import Standing
from walk_optimizer.transition.table import TransitionTable, packaged_stand
from walk_optimizer.transition.transition import Transition


@pytest.fixture(scope="session")
def walker() -> WalkerParameters:
    return WalkerParameters.from_yaml()


@pytest.fixture(scope="session")
def gaits(walker: WalkerParameters, tmp_path_factory: pytest.TempPathFactory) -> dict[SpringMode, list[Gait]]:
    """Return the packaged gaits of each mode, slowest first."""
    library = GaitLibrary(walker, tmp_path_factory.mktemp("no_own_gaits"))
    return {mode: [g for g in library.gaits() if g.request.spring_mode is mode] for mode in SpringMode}


@pytest.fixture(scope="session")
def stand(walker: WalkerParameters) -> Standing:
    return packaged_stand(walker)


@pytest.fixture
def table(walker: WalkerParameters, tmp_path_factory: pytest.TempPathFactory) -> TransitionTable:
    """Return the packaged transitions, with an empty folder of one's own."""
    return TransitionTable(walker, tmp_path_factory.mktemp("own_transitions"))


@pytest.fixture(scope="session")
def solved(walker: WalkerParameters, gaits: dict[SpringMode, list[Gait]]) -> Transition:
    """Return two steps from the slowest gait to the next, solved now."""
    slow, faster = gaits[SpringMode.NONE][:2]
    outcome = plan_transition(walker, slow, faster)
    assert outcome.transition is not None, outcome.report.message
    return outcome.transition
