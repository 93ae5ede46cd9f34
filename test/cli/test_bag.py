"""`walk-optimizer bag`: exit codes and one-line refusals."""

import pytest
from recording.samples import write_bag

from walk_optimizer.cli.main import main


def test_a_whole_bag_ends_with_0_and_one_that_readers_stumble_over_with_1_until_it_is_repaired(
    tmp_path, capsys
):
    bag = write_bag(tmp_path / "walk", range(10))
    assert main(["bag", "info", str(bag)]) == 0
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("message_count: 11", "message_count: 5"))
    assert main(["bag", "info", str(bag)]) == 1
    assert (
        "metadata.yaml is out of date: it tells of 5 messages, the files hold 11" in capsys.readouterr().out
    )
    assert main(["bag", "repair", str(bag)]) == 0
    assert main(["bag", "info", f"{bag}_repaired"]) == 0


@pytest.mark.parametrize("action", ["info", "repair", "play"])
@pytest.mark.parametrize("name", ["nowhere", "text", "folder", "name" * 100])
def test_what_is_no_bag_is_one_line(tmp_path, capsys, action, name):
    (tmp_path / "text").write_text("a shopping list")
    (tmp_path / "folder").mkdir()
    assert main(["bag", action, str(tmp_path / name)]) == 2
    printed = capsys.readouterr()
    assert (printed.out, printed.err.count("\n")) == ("", 1)
    assert printed.err.startswith("walk-optimizer: ")
