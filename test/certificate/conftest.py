"""One solved gait, for all tests of this folder to break."""

from types import SimpleNamespace

import numpy as np
import pytest

from walk_optimizer.model.parameters import WalkerParameters
from walk_optimizer.optimizer import optimize
from walk_optimizer.request import GaitRequest


@pytest.fixture(scope="session")
def solved():
    """Walker, request, spring and trajectory of a gait, its points (23, N) with friction on one side only.

    The solver may choose lambda_x+ and lambda_x- both above zero: only their difference matters.
    """
    outcome = optimize(GaitRequest.for_speed(0.42, "stiffness", 25), WalkerParameters())
    assert outcome.gait is not None, outcome.report.message
    gait = outcome.gait
    points = gait.trajectory.stacked()
    for forward, backward in ((15, 16), (18, 19)):
        net = points[forward] - points[backward]
        points[forward], points[backward] = np.maximum(net, 0.0), np.maximum(-net, 0.0)
    return SimpleNamespace(
        gait=gait, walker=gait.walker, request=gait.request, spring=gait.spring, points=points
    )
