"""The table that ships with the package: complete, certified anew, and in order."""

import math
from itertools import product

import pytest

from walk_optimizer.library import GaitLibrary, table_folder
from walk_optimizer.library.verification import verify_file, verify_folder
from walk_optimizer.model.parameters import SpringMode, WalkerParameters
from walk_optimizer.request import gait_table_settings

WALKER = WalkerParameters.from_yaml()
SPEEDS = gait_table_settings().table_speeds()
# What is still counted as equal: two solves of one optimum end this close together.
SAME = 1 + 1e-4


@pytest.fixture(scope="module")
def shipped(tmp_path_factory):
    return GaitLibrary(WALKER, tmp_path_factory.mktemp("empty"))


def test_every_shipped_file_is_certified_anew():
    found = verify_folder(table_folder(), WALKER)
    assert [each.problem for each in found if not each.passed] == []
    assert len(found) == 21


def test_what_is_stored_about_a_gait_is_what_is_computed_anew(shipped):
    for entry in shipped.entries():
        again = verify_file(entry.path, WALKER).certificate
        stored = {each.family: each for each in entry.gait.certificate.entries}
        assert {each.family for each in again.entries} == set(stored)
        for each in again.entries:
            assert math.isclose(each.violation, stored[each.family].violation, abs_tol=each.tolerance / 100)


@pytest.mark.parametrize(("speed", "mode"), list(product(SPEEDS, SpringMode)))
def test_every_speed_and_mode_is_there_on_the_reports_grid(shipped, speed, mode):
    gait, source = shipped.find(speed, mode)
    assert source.value == "table"
    assert gait.request.points == 200
    assert gait.speed >= speed - 1e-6
    if mode is SpringMode.NONE:
        assert gait.spring.stiffness == 0
    if mode is not SpringMode.STIFFNESS_AND_EQUILIBRIUM:
        assert gait.spring.equilibrium == math.pi


@pytest.mark.parametrize("speed", SPEEDS)
def test_more_freedom_never_costs_more(shipped, speed):
    none, stiffness, both = (shipped.find(speed, mode)[0].objective for mode in SpringMode)
    assert stiffness <= none * SAME
    assert both <= stiffness * SAME


def test_the_table_is_not_for_another_walker(tmp_path):
    library = GaitLibrary(WalkerParameters(gravity=1.62), tmp_path)
    assert (library.gaits(), library.problems()) == ([], [])
