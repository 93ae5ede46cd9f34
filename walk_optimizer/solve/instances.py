"""Keeps solver objects for as long as their program is: building one costs more than a few iterations."""

import weakref
from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

from walk_optimizer.transcription.program import Nlp

_One = TypeVar("_One")


class Instances(Generic[_One]):
    """Solver objects by program, and by whatever else they were built for."""

    def __init__(self) -> None:
        """Begin with none."""
        self._of: weakref.WeakKeyDictionary[Nlp, dict[Hashable, _One]] = weakref.WeakKeyDictionary()

    def of(self, nlp: Nlp, key: Hashable, build: Callable[[], _One]) -> _One:
        """Return the object of a program and a key, built where there is none."""
        of_program = self._of.setdefault(nlp, {})
        if key not in of_program:
            of_program[key] = build()
        return of_program[key]
