"""Which first guesses a search tries: the families of optima differ in the spring they begin with."""

import math
from itertools import product

from walk_optimizer.guess.kinematic import GuessShape, Start
from walk_optimizer.model.parameters import KneeSpring, SpringMode, WalkerParameters

_SHAPES = {
    "low": GuessShape(clearance=0.02, flexion=0.002),
    "high": GuessShape(clearance=0.15, flexion=0.002),
    "bent": GuessShape(clearance=0.05, flexion=0.03),
}
# Stiffness in units of weight times leg length per radian: soft, middle and stiff springs.
_STIFFNESSES = {"soft": 0.01, "medium": 0.1, "stiff": 0.25, "very_stiff": 0.5}
_EQUILIBRIA = {"stretched": math.pi, "flexed": math.pi - 0.1}


def kinematic_starts(walker: WalkerParameters, mode: SpringMode) -> list[Start]:
    """Return the kinematic first guesses of a spring mode, most promising first."""
    if mode is SpringMode.NONE:
        return [Start(name, shape, KneeSpring()) for name, shape in _SHAPES.items()]
    moment = walker.weight * walker.leg_length
    equilibria = _EQUILIBRIA if mode is SpringMode.STIFFNESS_AND_EQUILIBRIUM else {"stretched": math.pi}
    return [
        Start(f"{stiffness}-{equilibrium}-{shape}", _SHAPES[shape], KneeSpring(fraction * moment, angle))
        for (stiffness, fraction), (equilibrium, angle), shape in product(
            reversed(_STIFFNESSES.items()), equilibria.items(), _SHAPES
        )
    ]
