"""Settings of the search and of the solvers (config/solver.yaml)."""

from dataclasses import dataclass
from functools import cache

from walk_optimizer.errors import ConfigurationError
from walk_optimizer.resources import config_file, require_positive, settings_from_yaml
from walk_optimizer.solve.registry import BACK_ENDS


@dataclass(frozen=True)
class SolverSettings:
    """How gaits are searched for and solved.

    Attributes:
        back_end: Name of the solver of nonlinear programs.
        coarse_points: Grid of the search over starts.
        kept_starts: Best distinct coarse optima that go on to the requested grid.
        freed_optima: Best distinct optima whose contacts are then set free.
        contact_rounds: Most rounds in which complementarity looks for other contacts.
        contact_iterations: Of the relaxed problem in such a round.
        tolerance: Scaled optimality error at which a program counts as solved.
        maximum_iterations: Of one program.
        relaxation: Bound on each complementarity product, in units of weight times 1 m or 1 m/s.
        time_limit: Of one request in [s].
    """

    back_end: str
    coarse_points: int
    kept_starts: int
    freed_optima: int
    contact_rounds: int
    contact_iterations: int
    tolerance: float
    maximum_iterations: int
    relaxation: float
    time_limit: float

    def __post_init__(self) -> None:
        """Refuse values that no solve can use."""
        if self.back_end not in BACK_ENDS:
            known = ", ".join(f"{name} ({entry.method})" for name, entry in BACK_ENDS.items())
            raise ConfigurationError(f"unknown back_end {self.back_end!r}; known are {known}")
        require_positive(self, "solver setting ")


@cache
def solver_settings() -> SolverSettings:
    """Return the packaged settings of single requests, read once."""
    return settings_from_yaml(SolverSettings, config_file("solver.yaml"))


@cache
def table_solver_settings() -> SolverSettings:
    """Return the packaged settings of the table's gaits (`config/table_solver.yaml`), read once."""
    return settings_from_yaml(SolverSettings, config_file("table_solver.yaml"))
