"""Which walkers `reference_publisher` takes, and which of its parameters go together or may be changed."""

from collections.abc import Mapping
from typing import Any

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.nodes.parameters import NodeParameters
from walk_optimizer.nodes.publisher_settings import LEAST_PERIODS

RATE_SETTINGS = {"rate", "longest_gap"}
# What a message says with six digits is to be allowed when it is followed.
_ROUNDING = 1e-5


def require_level_ground(walker: WalkerParameters) -> None:
    """Refuse a walker on a slope or stairs: it could neither stand there nor change its speed.

    Raises:
        ConfigurationError: says what can be done with its gaits.
    """
    if not walker.terrain.is_flat:
        raise ConfigurationError(
            "the walker's terrain is a slope or stairs; gaits there are solved, exported and simulated, but "
            "not streamed, for stands and the steps between paces are for level ground"
        )


def require_no_late_start(parameters: NodeParameters, changes: Mapping[str, Any]) -> None:
    """Refuse to change the speed at activation while a node is active.

    It would do nothing now, and have the walker set off when nobody thinks of it any more.

    Raises:
        ConfigurationError: says what would do.
    """
    if changes.get("initial_speed", parameters["initial_speed"]) != parameters["initial_speed"]:
        raise ConfigurationError(
            "it only counts when the node is activated, and it is active; send the speed to ~/target_speed, "
            "or deactivate the node before"
        )


def require_steady(parameters: NodeParameters, changes: Mapping[str, Any] | None = None) -> None:
    """Refuse references so far apart that the walk would hold at each of them.

    Args:
        parameters: Of the node.
        changes: Values that count instead of the parameters.

    Raises:
        ConfigurationError: says what would do.
    """
    rate, gap = ((changes or {}).get(name, parameters[name]) for name in ("rate", "longest_gap"))
    if rate * gap < LEAST_PERIODS * (1 - _ROUNDING):
        raise ConfigurationError(
            f"longest_gap is {gap:g} s and rate {rate:g} Hz, so the walk would hold at references that come "
            f"in time; allowed is a longest_gap of at least {LEAST_PERIODS / rate:g} s at this rate, or a "
            f"rate of at least {LEAST_PERIODS / gap:g} Hz with this gap"
        )
