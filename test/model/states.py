"""Walkers and states that hypothesis draws, far beyond what a gait visits."""

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st

from walk_optimizer.model.parameters import DYNAMIC_PARAMETERS, WalkerParameters

# No deadline: how fast the machine is says nothing about the code.
patient = settings(deadline=None, max_examples=40)

WALKERS = st.fixed_dictionaries({name: st.floats(0.5, 2.0) for name in DYNAMIC_PARAMETERS}).map(
    lambda factors: WalkerParameters(
        **{name: factor * getattr(WalkerParameters(), name) for name, factor in factors.items()}
    )
)
COORDINATES = st.lists(st.floats(-4.0, 4.0), min_size=6, max_size=6).map(np.array)
VELOCITIES = st.lists(st.floats(-5.0, 5.0), min_size=6, max_size=6).map(np.array)
SPRINGS = st.tuples(st.floats(0.0, 500.0), st.floats(0.0, np.pi))


def relative_error(value, expected):
    """Largest difference in units of the largest expected number."""
    return np.abs(np.asarray(value) - expected).max() / np.abs(expected).max()
