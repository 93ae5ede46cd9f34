"""At a solution the interior-point method is Newton's method, with all derivatives of second order."""

import numpy as np
from condensed.conftest import needs_compiler

from walk_optimizer.condensed.interior_point import InteriorPoint
from walk_optimizer.solve.status import Status
from walk_optimizer.transcription.tableau import BUTCHER

pytestmark = needs_compiler

PRIMAL = ("omega", "momenta", "torques", "start", "springs")
SIZE = 1e-5


def disturbance(step, ends):
    """Return random changes of the iterate that leave the step closed and fixed springs alone."""
    rng, unknowns = np.random.default_rng(5), step.unknowns
    change = np.zeros(unknowns.size)
    for name in PRIMAL:
        scale = np.maximum(np.abs(unknowns.of(step.iterate, name)), 0.1)
        unknowns.of(change, name)[:] = scale * rng.standard_normal(scale.shape)
    # Directions keep it that the step starts in the pose that it ends in.
    omega = unknowns.of(change, "omega")
    turned = np.einsum("n,j,nja->a", step.lengths, BUTCHER[-1], omega.reshape(-1, 3, 4))
    omega -= turned / step.lengths.sum()
    unknowns.of(change, "start")[:4] = 0.0
    unknowns.of(change, "springs")[~ends.free_springs] = 0.0
    return change


def test_a_direction_leads_back_to_the_solution_but_for_terms_of_second_order(start):
    step, ends = start.step()
    point, unknowns = InteriorPoint(step, ends, 1e-9), step.unknowns
    assert point.solve(lambda _: None)[0] is Status.SOLVED
    targets = unknowns.of(step.iterate, "slacks") * unknowns.of(step.iterate, "multipliers")

    def follow_direction():
        step.evaluate()
        ends.evaluate(step)
        step.iterate += point._direction(point._factored((1.0,)), targets, 1.0).change

    follow_direction()  # To the point of these products, which the last iterate is only near to.
    solution = step.iterate.copy()
    step.iterate += SIZE * disturbance(step, ends)
    follow_direction()
    for name in PRIMAL:
        found, wanted = (unknowns.of(one, name) for one in (step.iterate, solution))
        assert np.abs(found - wanted).max() < 1e-3 * SIZE * (1 + np.abs(wanted).max()), name
