"""What the publisher says of parameters that do not go together is to be of use."""

import re

import pytest

pytest.importorskip("rclpy")

from hypothesis import given
from hypothesis import strategies as st

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.model.terrain import Terrain
from walk_optimizer.nodes.publisher_checks import require_level_ground, require_steady


@given(rate=st.floats(1.0, 1000.0), gap=st.floats(0.002, 1.0))
def test_what_is_advised_is_allowed(rate, gap):
    try:
        require_steady({"rate": rate, "longest_gap": gap})
    except ConfigurationError as refusal:
        text = str(refusal)
        least_gap, least_rate = re.search(r"at least (\S+) s at this rate.* at least (\S+) Hz", text).groups()
        require_steady({"rate": rate, "longest_gap": float(least_gap)})
        require_steady({"rate": float(least_rate), "longest_gap": gap})
    else:
        assert rate * gap > 1.99


@pytest.mark.parametrize("terrain", [Terrain(slope=-0.05), Terrain(step_up=0.03)], ids=str)
def test_what_is_possible_on_slopes_and_stairs_is_said(terrain):
    require_level_ground(WalkerParameters())
    with pytest.raises(ConfigurationError, match="exported and simulated, but not streamed, for stands"):
        require_level_ground(WalkerParameters(terrain=terrain))
