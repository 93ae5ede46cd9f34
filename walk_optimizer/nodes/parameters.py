"""Parameters with descriptions and ranges, validated when set, applied after it."""

import difflib
import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.exceptions import NameValidationException
from rclpy.expand_topic_name import expand_topic_name
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.validate_full_topic_name import validate_full_topic_name

from walk_optimizer.errors import ConfigurationError, WalkOptimizerError, quoted, shortened


@dataclass(frozen=True)
class Setting:
    """One parameter of a node.

    Attributes:
        name: Of the parameter.
        default: Value when nobody sets it; its type is the parameter's type.
        description: What it means, with its unit.
        low: Least value of a number.
        high: Largest value of a number.
        read_only: Whether it can only be set at the start.
        check: Raises a WalkOptimizerError for a value that is not allowed.
        choices: Texts that are allowed; a list has to hold each of them once. None for any.
    """

    name: str
    default: bool | int | float | str | list[str] | list[float]
    description: str
    low: float | None = None
    high: float | None = None
    read_only: bool = False
    check: Callable[[Any], object] | None = None
    choices: Sequence[str] | None = None

    def descriptor(self) -> ParameterDescriptor:
        """Return what `ros2 param describe` shows."""
        descriptor = ParameterDescriptor(
            description=self.description, read_only=self.read_only, additional_constraints=self.constraint
        )
        if self.low is None or self.high is None:
            return descriptor
        if isinstance(self.default, int):
            bounds = IntegerRange(from_value=int(self.low), to_value=int(self.high), step=1)
            descriptor.integer_range = [bounds]
        else:
            bounds = FloatingPointRange(from_value=float(self.low), to_value=float(self.high), step=0.0)
            descriptor.floating_point_range = [bounds]
        return descriptor

    @property
    def constraint(self) -> str:
        """What `ros2 param describe` says of the choices."""
        if self.choices is None:
            return ""
        names = ", ".join(self.choices)
        return f"each of {names} once" if isinstance(self.default, list) else f"one of {names}"

    def require(self, value: Any) -> None:
        """Refuse a value.

        Raises:
            WalkOptimizerError: it is not finite, none of the choices, or `check` refuses it.
        """
        if isinstance(value, float) and not math.isfinite(value):
            raise ConfigurationError(f"{value} is not finite")
        if self.choices is not None:
            self._require_choice(value, self.choices)
        if self.check is not None:
            self.check(value)

    def _require_choice(self, value: Any, choices: Sequence[str]) -> None:
        names = ", ".join(choices)
        if isinstance(self.default, list):
            if sorted(value) != sorted(choices):
                raise ConfigurationError(f"{quoted(list(value))} is no order of {names}")
        elif value not in choices:
            raise ConfigurationError(f"{quoted(value)} is none of {names}")


def require_name(name: str) -> None:
    """Refuse what is no name of a topic or service.

    Raises:
        ConfigurationError: says what is wrong with it.
    """
    try:
        validate_full_topic_name(expand_topic_name(name, "node", "/"))
    except (NameValidationException, ValueError, RuntimeError) as error:
        # Without the name once more with a mark below, and without a place in rcl's sources.
        reason = str(error).split("\n")[0].split(", at /")[0].rstrip(":").rpartition(" is invalid: ")[2]
        raise ConfigurationError(
            f"{quoted(name)} is no name of a topic or service: {shortened(reason)}"
        ) from error


def require_frame(name: str) -> None:
    """Refuse what is no name of a frame.

    Raises:
        ConfigurationError: says what is allowed.
    """
    if not re.fullmatch(r"[^\s/]\S*", name):
        raise ConfigurationError(
            f"{quoted(name)} is no frame: give a name without spaces or a leading slash, such as odom"
        )


class NodeParameters:
    """The parameters of a node: declared, validated together, applied once they are set."""

    def __init__(self, node: Node, settings: Sequence[Setting]) -> None:
        """Declare the parameters.

        Args:
            node: That has them.
            settings: The parameters.

        Raises:
            ParameterException: a value given at the start is of the wrong type or out of range; the
                message names the parameter.
        """
        self._node = node
        self._settings = {setting.name: setting for setting in settings}
        node.add_on_set_parameters_callback(self._validate)
        for setting in settings:
            node.declare_parameter(setting.name, setting.default, setting.descriptor())
        self._tell_unknown()

    def __getitem__(self, name: str) -> Any:
        """Return the value of a parameter."""
        return self._node.get_parameter(name).value

    def apply_changes(self, apply: Callable[[set[str]], None]) -> None:
        """Have a function called with the names of the parameters that were set."""
        self._node.add_post_set_parameters_callback(
            lambda parameters: apply({parameter.name for parameter in parameters})
        )

    def _tell_unknown(self) -> None:
        """Warn of values for parameters that there are not, which ROS ignores in silence."""
        for name in self._node._parameter_overrides:  # noqa: SLF001  # rclpy tells nobody else
            if not self._node.has_parameter(name):
                similar = difflib.get_close_matches(name, self._settings, 1)
                advice = f"did you mean {similar[0]}?" if similar else "`ros2 param list` names all"
                self._node.get_logger().warning(f"unknown parameter {name} is ignored; {advice}")

    def _validate(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            setting = self._settings.get(parameter.name)
            try:
                if setting is not None:
                    setting.require(parameter.value)
            except WalkOptimizerError as error:
                return SetParametersResult(successful=False, reason=f"{parameter.name}: {error}")
        return SetParametersResult(successful=True)
