"""Table I of the report, number for number, to be shown beside ours."""

from dataclasses import dataclass

from walk_optimizer.model.parameters import SpringMode
from walk_optimizer.request import KMH_PER_MS, TABLE_SPEED_TOLERANCE


@dataclass(frozen=True)
class ReportResult:
    """What the report found for a speed and a spring mode.

    Attributes:
        stiffness: K in [N m/rad].
        equilibrium: q_eq in [rad]; None where it was fixed at pi.
        relative_objective: F% = 100 F / F_nom.
    """

    stiffness: float
    equilibrium: float | None
    relative_objective: float


@dataclass(frozen=True)
class ReportRow:
    """One speed of Table I.

    Attributes:
        speed_kmh: As printed, in [km/h].
        results: By spring mode; the nominal gait is 100 by definition.
    """

    speed_kmh: float
    results: dict[SpringMode, ReportResult]

    def distance(self, speed: float) -> float:
        """Return how far a speed in [m/s] is from that of the row, in [m/s]."""
        return abs(speed - self.speed_kmh / KMH_PER_MS)

    def is_of(self, speed: float) -> bool:
        """Return whether the row is that of a speed in [m/s], within the decimals that are printed."""
        return self.distance(speed) <= TABLE_SPEED_TOLERANCE


def _row(speed: float, stiffness: tuple[float, float], both: tuple[float, float, float]) -> ReportRow:
    """Return a row from (K, F%) and (K, q_eq, F%)."""
    return ReportRow(
        speed,
        {
            SpringMode.STIFFNESS: ReportResult(stiffness[0], None, stiffness[1]),
            SpringMode.STIFFNESS_AND_EQUILIBRIUM: ReportResult(*both),
        },
    )


TABLE_I = (
    _row(0.84, (7.98, 93), (8.00, 3.09, 64)),
    _row(1.15, (16.21, 74), (12.40, 3.11, 52)),
    _row(1.50, (23.46, 66), (19.14, 3.12, 40)),
    _row(1.92, (23.82, 38), (40.50, 3.12, 17)),
    _row(2.44, (0.21, 93), (7.65, 3.03, 53)),
    _row(3.09, (0.01, 111), (4.19, 3.04, 79)),
    _row(3.92, (0.00, 100), (0.73, 0.00, 9)),
)


def reported(speed: float) -> ReportRow | None:
    """Return the row of a speed in [m/s]; None where the report has none."""
    return next((row for row in TABLE_I if row.is_of(speed)), None)
