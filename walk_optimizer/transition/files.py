"""Transition files: one transition a file, checked as gait files are (docs/transitions.md)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.errors import GaitFileError
from walk_optimizer.gait import Certificate, RefinedGait
from walk_optimizer.gait.refined_trajectory import RefinedTrajectory
from walk_optimizer.gait_files.access import read_limited, replace_file
from walk_optimizer.gait_files.checks import check_shape, positive
from walk_optimizer.gait_files.container import LARGEST_FILE, FileFormat, packed, unpacked
from walk_optimizer.gait_files.files import check_walker, transition_file_name, transition_name_parts
from walk_optimizer.gait_files.header import from_plain, to_plain
from walk_optimizer.gait_files.refined import REFINED_PREFIX, refined_trajectory
from walk_optimizer.model.parameters import KneeSpring, WalkerParameters
from walk_optimizer.transition.certificate import JOINT_TOLERANCE
from walk_optimizer.transition.paces import Pace, border_state, pace_name
from walk_optimizer.transition.torque_limit import TorqueLimit, hip_and_knee
from walk_optimizer.transition.transition import Transition

TRANSITION_FORMAT = FileFormat(
    "walk_optimizer.transition",
    1,
    "transition file",
    frozenset({"walker", "source", "target", "torque_limit", "steps", "certificate"}),
)
_BORDERS = ("source_state", "target_state")
_ARRAYS = tuple(field.name for field in fields(RefinedTrajectory))
_MOST_STEPS = 8
# Momenta of a border are of the order of the walker's mass times 1 m/s; they may differ by this part.
_MOMENTUM_TOLERANCE = 1e-8


@dataclass(frozen=True)
class _Step:
    """What the header says about a step."""

    spring: KneeSpring
    step_length: float
    certificate: Certificate


@dataclass(frozen=True)
class TransitionName:
    """What the name of a transition file says.

    Attributes:
        source: Name of the pace that is left.
        target: Name of the pace that is reached.
        steps: Number of steps.
    """

    source: str
    target: str
    steps: int

    @classmethod
    def of(cls, transition: Transition) -> "TransitionName":
        """Return the name of a transition."""
        return cls(pace_name(transition.source), pace_name(transition.target), len(transition.steps))

    @classmethod
    def parse(cls, path: Path, walker: WalkerParameters) -> "TransitionName | None":
        """Return what a path says; None for files that are none of this walker's transitions."""
        parts = transition_name_parts(path.name)
        if parts is None or parts[3] != walker.fingerprint()[:8]:
            return None
        return cls(*parts[:3])

    def file_name(self, walker: WalkerParameters) -> str:
        """Return the name of the file for a walker."""
        return transition_file_name(self.source, self.target, self.steps, walker.fingerprint()[:8])


def write_transition_file(transition: Transition, folder: Path) -> Path:
    """Write a transition into a folder under its own name and return the path.

    Raises:
        GaitFileError: it can't be written, or a number is not finite.
    """
    name = TransitionName.of(transition)
    steps = [_Step(step.spring, step.step_length, step.certificate) for step in transition.steps]
    entries = {
        "walker": to_plain(transition.walker),
        "source": name.source,
        "target": name.target,
        "torque_limit": _plain_limit(transition.torque_limit),
        "steps": [to_plain(step) for step in steps],
        "certificate": to_plain(transition.certificate),
    }
    arrays = dict(zip(_BORDERS, map(border_state, (transition.source, transition.target)), strict=True))
    for number, step in enumerate(transition.steps):
        arrays |= {_array_name(number, each): getattr(step.trajectory, each) for each in _ARRAYS}
    path = folder / name.file_name(transition.walker)
    replace_file(path, packed(TRANSITION_FORMAT, entries, arrays))
    return path


def read_transition_file(path: Path, source: Pace, target: Pace) -> Transition:
    """Read a transition and check that it leads from one pace to another, to the last digit that counts.

    Raises:
        GaitFileError: the file is missing, damaged, of another version, or for another walker or other
            gaits; the message begins with the path.
    """
    data = read_limited(path, LARGEST_FILE)
    try:
        return _transition(*unpacked(TRANSITION_FORMAT, data), source, target)
    except GaitFileError as error:
        raise GaitFileError(f"{path}: {error}") from error


def _array_name(number: int, name: str) -> str:
    return f"step{number + 1}_{name}"


def _transition(
    header: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]], source: Pace, target: Pace
) -> Transition:
    """Return the transition of a header and its arrays."""
    walker = source.walker
    check_walker(from_plain(WalkerParameters, header["walker"], "walker"), walker)
    for place, pace in (("source", source), ("target", target)):
        _check_border(place, header[place], arrays, pace)
    plain = header["steps"]
    if not isinstance(plain, list) or not 1 <= len(plain) <= _MOST_STEPS:
        raise GaitFileError(f"steps has no list of 1 to {_MOST_STEPS} entries")
    names = {*_BORDERS, *(_array_name(k, each) for k in range(len(plain)) for each in _ARRAYS)}
    wrong = sorted(set(arrays) ^ names)
    if wrong:
        raise GaitFileError(f"missing or unknown arrays: {', '.join(wrong)}")
    return Transition(
        walker=walker,
        source=source,
        target=target,
        steps=tuple(_step(number, entry, arrays) for number, entry in enumerate(plain)),
        torque_limit=_limit(header["torque_limit"]),
        certificate=from_plain(Certificate, header["certificate"], "certificate"),
    )


def _plain_limit(limit: TorqueLimit) -> Any:
    """Return a torque limit for a header: one number, or that of the hips and of the knees; null for none."""
    numbers = [one if math.isfinite(one) else None for one in hip_and_knee(limit)]
    return numbers[0] if numbers[0] == numbers[1] else numbers


def _limit(plain: Any) -> TorqueLimit:
    """Return the torque limit of a header."""
    if isinstance(plain, list) and len(plain) == 2:
        hip, knee = map(_one_limit, plain)
        return hip, knee
    return _one_limit(plain)


def _one_limit(plain: Any) -> float:
    return math.inf if plain is None else positive(plain, "torque_limit")


def _check_border(place: str, name: Any, arrays: Mapping[str, NDArray[Any]], pace: Pace) -> None:
    """Raise GaitFileError unless a pace is the one that a transition was solved for."""
    if name != pace_name(pace):
        raise GaitFileError(f"{place} is {name!r}, expected {pace_name(pace)!r}")
    state = arrays.get(f"{place}_state", np.zeros(0))
    check_shape(f"{place}_state", state, (12,))
    apart = np.abs(state - border_state(pace))
    momentum = _MOMENTUM_TOLERANCE * pace.walker.total_mass
    if apart[:6].max() > JOINT_TOLERANCE or apart[6:].max() > momentum:
        raise GaitFileError(
            f"{place} is another solution of {name}: it is {apart[:6].max():.2g} m or rad from that of the "
            f"file, allowed is {JOINT_TOLERANCE:g}; solve the transition again"
        )


def _step(number: int, plain: Any, arrays: Mapping[str, NDArray[Any]]) -> RefinedGait:
    """Return a step of a file."""
    described = from_plain(_Step, plain, f"steps[{number}]")
    own = {REFINED_PREFIX + each: arrays[_array_name(number, each)] for each in _ARRAYS}
    breaks = own[f"{REFINED_PREFIX}breaks"]
    return RefinedGait(
        trajectory=refined_trajectory(own, float(breaks.flat[-1]) if breaks.size else 0.0),
        spring=described.spring,
        step_length=described.step_length,
        certificate=described.certificate,
    )
