"""`walk-optimizer transitions` in processes of its own."""

from cli.console import walk_optimizer
from library.made_up_gait import made_up_gait

from walk_optimizer.library import GaitLibrary
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.transition.files import TransitionName
from walk_optimizer.transition.table import TransitionTable, table_folder


def test_list_names_every_transition_that_is_solved(tmp_path, monkeypatch):
    # Gaits of the user's own are none of the table's.
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    own = GaitLibrary(WalkerParameters.from_yaml())
    for speed, points in ((0.25 / 0.785, 50), (0.4, 200)):
        own.store(made_up_gait(speed, points=points, walker=own.walker))
    done = walk_optimizer("transitions", "list", home=tmp_path)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].split()[:2] == ["from", "to"]
    assert len(lines) - 1 == len(list(table_folder().glob("*.npz")))
    assert any(line.split()[0] == "stand" for line in lines)


def test_nothing_verified_is_no_success(tmp_path):
    other = tmp_path / "walker.yaml"
    other.write_text("hip_mass: 50.0\n")
    done = walk_optimizer("transitions", "verify", "--walker", other, home=tmp_path)
    assert done.returncode == 2
    assert "no gaits of the table for this walker; solve them with `library build`" in done.stderr


def test_every_packaged_file_is_named_after_what_it_joins(walker: WalkerParameters):
    names = {TransitionName.parse(path, walker) for path in table_folder().glob("*.npz")}
    assert None not in names
    assert names <= set(TransitionTable(walker).names())
