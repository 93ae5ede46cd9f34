"""Transitions that are solved already: the packaged ones, a user's own, and paths over several of them."""

import heapq
from collections.abc import Sequence
from itertools import count, pairwise
from pathlib import Path

import numpy as np

from walk_optimizer.errors import GaitFileError, GaitNotFoundError
from walk_optimizer.gait_files import SUFFIX
from walk_optimizer.gait_files.access import files_in, writable_folder
from walk_optimizer.library import cache_folder as gait_cache_folder
from walk_optimizer.library import existing_folder
from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.resources import data_folder
from walk_optimizer.transition.files import TransitionName, read_transition_file, write_transition_file
from walk_optimizer.transition.paces import Pace, pace_name
from walk_optimizer.transition.settings import transition_settings
from walk_optimizer.transition.standing import Standing, standing_pose
from walk_optimizer.transition.torque_limit import TorqueLimit, exceeds, limit_in_words
from walk_optimizer.transition.transition import Transition


def table_folder() -> Path:
    """Return the folder of the packaged transitions, which is only read."""
    return data_folder() / "transitions"


def cache_folder(walker: WalkerParameters) -> Path:
    """Return the user's folder of transitions of a walker, beside that of its gaits."""
    gaits = gait_cache_folder(walker)
    return gaits.parent.with_name("transitions") / gaits.name


def packaged_stand(walker: WalkerParameters) -> Standing:
    """Return the stand of the settings, which the packaged transitions begin and end in."""
    settings = transition_settings()
    return standing_pose(walker, settings.feet_distance, settings.knee_bend)


class TransitionTable:
    """Solved transitions of one walker, read from their files when they are asked for.

    A file that can't be used is set aside: it is left as it is, named by `problems`, and counts as
    missing.
    """

    def __init__(self, walker: WalkerParameters, folder: Path | str | None = None) -> None:
        """Look at which files there are.

        Args:
            walker: The walker of all transitions.
            folder: Folder of this walker's stored transitions; None means the user's cache, which is
                created when something is written. A folder that is named has to exist.

        Raises:
            GaitFileError: a folder that is named is missing, or none.
        """
        self.walker = walker
        self.folder = cache_folder(walker) if folder is None else existing_folder(folder)
        self._create = folder is None
        # The user's own come first; one that no longer fits its gaits leaves the packaged one to serve.
        self._files: dict[TransitionName, tuple[Path, ...]] = {}
        self._problems: dict[Path, str] = {}
        for place in (table_folder(), self.folder):
            try:
                paths = files_in(place, SUFFIX)
            except GaitFileError as error:
                self._problems[place] = str(error)
                continue
            for path in paths:
                name = TransitionName.parse(path, walker)
                if name is not None:
                    self._files[name] = (path, *self._files.get(name, ()))

    def names(self) -> tuple[TransitionName, ...]:
        """Return which transitions there are, by source, target and number of steps."""
        return tuple(sorted(self._files, key=lambda name: (name.source, name.target, name.steps)))

    def problems(self) -> list[str]:
        """Return a sentence for each file that was set aside; it begins with the path."""
        return list(self._problems.values())

    def find(self, source: Pace, target: Pace, torque_limit: TorqueLimit = np.inf) -> Transition | None:
        """Return the transition of fewest steps from one pace to another; None where there is none.

        Args:
            source: What is left.
            target: What is reached.
            torque_limit: Largest magnitude of each torque in [N m], or that of the hips and that of the
                knees; others are left out.
        """
        wanted = (pace_name(source), pace_name(target))
        names = [name for name in self._files if (name.source, name.target) == wanted]
        ordered = sorted(names, key=lambda one: one.steps)
        for path in (path for name in ordered for path in self._files[name]):
            try:
                transition = read_transition_file(path, source, target)
            except GaitFileError as error:
                self._problems[path] = str(error)
                continue
            if not exceeds(transition.steps, torque_limit):
                return transition
        return None

    def store(self, transition: Transition) -> Path:
        """Write a transition into the folder and serve it from now on.

        Raises:
            GaitFileError: it is not certified or for another walker, or can't be written.
        """
        if not transition.certificate.certified:
            raise GaitFileError(f"only certified transitions are stored: {transition.certificate.worst}")
        if transition.walker != self.walker:
            raise GaitFileError("the transition is for another walker than the table")
        writable_folder(self.folder, self._create)
        path = write_transition_file(transition, self.folder)
        name = TransitionName.of(transition)
        others = (one for one in self._files.get(name, ()) if one != path)
        self._files = {**self._files, name: (path, *others)}
        self._problems.pop(path, None)
        return path

    def path(
        self, source: Pace, target: Pace, between: Sequence[Pace] = (), torque_limit: TorqueLimit = np.inf
    ) -> tuple[Transition, ...]:
        """Return transitions that lead one after the other from one pace to another in the fewest steps.

        Args:
            source: What is left.
            target: What is reached.
            between: Paces that may be walked on the way; source and target need not be among them.
            torque_limit: As for `find`.

        Raises:
            GaitNotFoundError: no such transitions are solved; the message names both paces and the limit.
        """
        paces = {pace_name(pace): pace for pace in (*between, source, target)}
        unusable: set[tuple[str, str]] = set()
        while True:
            names = self._fewest_steps(pace_name(source), pace_name(target), set(paces), unusable)
            if not names:
                raise GaitNotFoundError(
                    f"no solved transitions lead from {pace_name(source)} to {pace_name(target)}"
                    f"{limit_in_words(torque_limit)}; solve one with plan_transition"
                )
            found = []
            for pair in pairwise(names):
                transition = self.find(paces[pair[0]], paces[pair[1]], torque_limit)
                if transition is None:
                    unusable.add(pair)
                    break
                found.append(transition)
            else:
                return tuple(found)

    def _fewest_steps(
        self, source: str, target: str, allowed: set[str], unusable: set[tuple[str, str]]
    ) -> list[str]:
        """Return the names of the paces on the way (Dijkstra's algorithm, the steps being lengths).

        There are none where there is no way.
        """
        order = count()
        waiting = [(0, next(order), [source])]
        seen: set[str] = set()
        while waiting:
            steps, _, names = heapq.heappop(waiting)
            here = names[-1]
            if here == target and len(names) > 1:
                return names
            if here in seen:
                continue
            seen.add(here)
            for name in self._files:
                if name.source == here and name.target in allowed and (here, name.target) not in unusable:
                    heapq.heappush(waiting, (steps + name.steps, next(order), [*names, name.target]))
        return []
