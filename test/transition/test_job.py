"""What a worker process does for a walk: known steps, or solved ones, which are kept where they may be."""

import pytest

from walk_optimizer.jobs.transitions import TransitionJob, planned
from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.transition.table import TransitionTable
from walk_optimizer.transition.transition import Transition


@pytest.fixture
def plan(gaits, walker, tmp_path):
    """Plans steps that do not ship within a limit, and returns what is kept of them."""
    source, target = (gaits[SpringMode.NONE][number] for number in (0, 2))

    def plan(limit: float) -> Transition | None:
        answer = planned(TransitionJob(source, target, limit, 60.0, tmp_path))
        assert answer.steps, answer.message
        return TransitionTable(walker, tmp_path).find(source, target)

    return plan


def test_a_walk_goes_on_with_what_ships_when_its_folder_has_gone(gaits, stand, tmp_path):
    gone = tmp_path / "gone"
    answer = planned(TransitionJob(stand, gaits[SpringMode.NONE][0], 50.0, 60.0, gone))
    assert answer.steps
    assert answer.problem == f"{gone}: the folder is missing; create it or name another"


def test_solved_steps_are_kept_unless_a_limit_holds_them_back(plan):
    assert plan(12.0) is None  # Without a limit they need 13.3 N m.
    kept = plan(50.0)
    assert kept.peak_torques.max() > 12.0
    assert plan(kept.peak_torques.max()).peak_torques.max() == kept.peak_torques.max()
