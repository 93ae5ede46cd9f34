"""Gaits and transitions may be kept in one folder: each kind passes over the other."""

from walk_optimizer.library import GaitLibrary
from walk_optimizer.transition.table import TransitionTable


def test_each_kind_passes_over_the_other_and_tells_of_what_is_damaged(table, solved, walker):
    stored = table.store(solved)
    library = GaitLibrary(walker, table.folder)
    assert library.problems() == []
    library.store(solved.source)
    damaged = table.folder / "none_0.3000m_0.9000s_n200_e3fd61db.npz"
    damaged.write_bytes(stored.read_bytes()[:1000])
    assert [str(damaged) in problem for problem in GaitLibrary(walker, table.folder).problems()] == [True]
    again = TransitionTable(walker, table.folder)
    assert again.find(solved.source, solved.target) is not None
    assert again.problems() == []
