"""Solutions of fixed schedules as solutions of the report's problem."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer.search import completed

FORWARD, BACKWARD = [15, 18], [16, 19]
POINTS = arrays(float, (23, 3), elements=st.floats(-1.0, 1.0))


@given(POINTS)
def test_net_forces_are_kept_and_split_into_the_least_forward_and_backward_ones(points):
    complete = completed(WalkerParameters(), points)
    forward, backward = complete[FORWARD], complete[BACKWARD]
    np.testing.assert_allclose(forward - backward, points[FORWARD] - points[BACKWARD], atol=1e-15)
    assert (forward >= 0).all()
    assert (backward >= 0).all()
    assert (forward * backward == 0).all()


@given(POINTS)
def test_nothing_else_changes_but_the_slip_speeds(points):
    complete = completed(WalkerParameters(), points)
    same = [*range(15), 17, 20]
    np.testing.assert_array_equal(complete[same], points[same])
    assert (complete[21:] >= 0).all()
