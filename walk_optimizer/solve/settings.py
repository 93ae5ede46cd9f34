"""Settings of the search and of the solvers (config/solver.yaml)."""

from dataclasses import dataclass, fields
from functools import cache
from pathlib import Path

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.resources import config_file, read_yaml

BACK_ENDS = ("ipopt",)


@dataclass(frozen=True)
class SolverSettings:
    """How gaits are searched for and solved.

    Attributes:
        back_end: Name of the solver of nonlinear programs.
        coarse_points: Grid of the search over starts.
        kept_starts: Best distinct coarse optima that go on to the requested grid.
        tolerance: Scaled optimality error at which a program counts as solved.
        maximum_iterations: Of one program.
        relaxation: Bound on each complementarity product, in units of weight times 1 m or 1 m/s.
        time_limit: Of one request in [s].
    """

    back_end: str
    coarse_points: int
    kept_starts: int
    tolerance: float
    maximum_iterations: int
    relaxation: float
    time_limit: float

    def __post_init__(self) -> None:
        """Refuse values that no solve can use."""
        if self.back_end not in BACK_ENDS:
            raise ConfigurationError(f"unknown back_end {self.back_end!r}; known are {', '.join(BACK_ENDS)}")
        for field in fields(self)[1:]:
            value = getattr(self, field.name)
            if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0:
                raise ConfigurationError(
                    f"solver setting {field.name} is {value!r}, expected a positive number"
                )

    @classmethod
    def from_yaml(cls, path: Path | None = None) -> "SolverSettings":
        """Read the settings, by default the packaged `config/solver.yaml`.

        Raises:
            ConfigurationError: an entry is missing, unknown or impossible.
        """
        source = path or config_file("solver.yaml")
        entries = read_yaml(source)
        wrong = sorted(set(entries) ^ {field.name for field in fields(cls)})
        if wrong:
            raise ConfigurationError(f"{source}: missing or unknown entries: {', '.join(wrong)}")
        return cls(**entries)


@cache
def solver_settings() -> SolverSettings:
    """Return the packaged settings, read once."""
    return SolverSettings.from_yaml()
