"""First guesses of refined solutions: contact phases and states of a gait on the report's grid."""

import numpy as np
from numpy.typing import NDArray

from walk_optimizer.contact.observation import schedule_of
from walk_optimizer.contact.schedule import single_impact
from walk_optimizer.gait import Gait
from walk_optimizer.model.mechanics import horizontal_and_vertical
from walk_optimizer.transcription.mesh import Mesh, RefinedPoints, even_mesh
from walk_optimizer.transcription.phases import (
    INSTANT_POINTS,
    Phase,
    phase_shares,
    phases_of,
    with_steady_end,
    without_brief_modes,
)

FloatArray = NDArray[np.float64]

FEWEST_INTERVALS = 3
_MOST_PHASES = 6


class FirstGuess:
    """What the report's grid knows of the refined solution."""

    def __init__(self, gait: Gait) -> None:
        """Take a gait on the report's grid."""
        self.gait, self.walker, self.request = gait, gait.walker, gait.request

    @property
    def single_support(self) -> tuple[Phase, ...]:
        """The one phase of a step in single support."""
        return phases_of(single_impact(self.gait.trajectory.points))

    def meshes(self) -> list[Mesh]:
        """Return even meshes of the gait's own phases, of those without brief ones, and of single support.

        Contacts of the report's grid that last an instant, and the brushing of a swing foot, are often
        made by its coarseness: what is left without them may be as good or better.
        """
        trajectory = self.gait.trajectory
        schedule = schedule_of(
            self.walker, self.request.step_length, trajectory.q, trajectory.p, trajectory.reaction
        )
        steady = (with_steady_end(schedule), without_brief_modes(schedule))
        plans = dict.fromkeys([*(phases_of(one) for one in (schedule, *steady)), self.single_support])
        return [even_mesh([phases], FEWEST_INTERVALS) for phases in plans if len(phases) <= _MOST_PHASES]

    def points(self, mesh: Mesh) -> RefinedPoints:
        """Interpolate the grid's states, torques and forces onto the mesh.

        The forces of the first points are impulses of the impact spread over an interval: the points
        after them take their place.
        """
        trajectory = self.gait.trajectory
        durations = phase_shares(mesh.phases) * self.request.step_time
        nodes = mesh.node_times(durations)
        forces = horizontal_and_vertical(self.walker, trajectory.net_reaction())
        forces[:, :INSTANT_POINTS] = forces[:, INSTANT_POINTS : INSTANT_POINTS + 1]

        def at(rows: FloatArray, when: FloatArray) -> FloatArray:
            return np.stack([np.interp(when, trajectory.time, row) for row in rows], axis=-1)

        return RefinedPoints(
            states=at(np.vstack([trajectory.q, trajectory.p]), nodes),
            torques=at(trajectory.u, nodes[:, 1:]),
            forces=at(forces, nodes[:, 1:]),
            durations=durations,
            impulses=np.zeros((len(mesh.phases), 4)),
            spring=self.gait.spring,
        )
