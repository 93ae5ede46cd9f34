"""The condensed linear algebra against dense linear algebra, and what a Newton direction promises."""

import numpy as np
from condensed.conftest import needs_compiler

from walk_optimizer.condensed.step import BUTCHER, PENALTY

# Of the barrier: multipliers over slacks.
WEIGHT = 1e-2

pytestmark = needs_compiler


def disturbed(start, size, threads=1):
    """Return the step of a shipped gait whose velocities are off by random numbers, and its ends."""
    step, ends = start.step(threads)
    rng = np.random.default_rng(3)
    omega, after = (step.unknowns.of(step.iterate, name) for name in ("omega", "start"))
    omega += size * rng.standard_normal(omega.shape)
    after[4:] += size * rng.standard_normal(4)
    step.unknowns.of(step.iterate, "slacks")[:] = 1.0
    step.unknowns.of(step.iterate, "multipliers")[:] = WEIGHT
    step.evaluate(settle=True)
    ends.evaluate(step)
    return step, ends


def newton_direction(step, ends):
    """Return the changes of the unknowns by the Newton step of the equations."""
    unknowns = step.unknowns
    targets = np.zeros(unknowns.inequalities)
    step.evaluate_curvature()
    ends.evaluate_curvature(np.zeros(len(ends.equations)), np.zeros(ends.size))
    joined = ends.joined(step.eliminated(0.0), step, np.full(ends.size, WEIGHT), 0.0)
    change, _, _ = joined.solved(step.gathered(targets), np.zeros(ends.size))
    step.spread(change, targets)
    direction = np.zeros(unknowns.size)
    for name in ("omega", "momenta", "torques"):
        unknowns.of(direction, name)[:] = unknowns.of(step.direction, name)
    unknowns.of(direction, "start")[:] = change[:8]
    unknowns.of(direction, "springs")[:] = change[8:10]
    return direction


def equations(step, ends):
    """Return what the iterate leaves of all equations."""
    step.evaluate()
    ends.evaluate(step)
    momenta = step.true_momenta - step.unknowns.of(step.iterate, "momenta")
    torques = step.rows[:, :3] - step.unknowns.of(step.iterate, "torques")
    return np.concatenate([momenta.ravel(), torques.ravel(), step.rows[:, 3], ends.rows])


def test_along_a_newton_direction_all_equations_shrink_alike_but_for_terms_of_second_order(start):
    step, ends = disturbed(start, 1e-3)
    before, first = equations(step, ends), step.iterate.copy()
    direction = newton_direction(step, ends)
    wrong = []
    for part in (1e-4, 1e-5):
        step.iterate[:] = first + part * direction
        wrong.append(np.abs(equations(step, ends) - (1 - part) * before).max())
    assert wrong[1] < wrong[0] / 50
    assert wrong[1] < 1e-6 * np.abs(before).max()


def whole_system(step):
    """Return Hessian and equations of all intervals, written out, and the places of the last state.

    Unknowns are omega (12) and the first state (8) of each interval, the last state (8), K and q_eq.
    """
    count = step.lengths.size
    size = 20 * count + 10
    hessian, rows = np.zeros((size, size)), []
    for k in range(count):
        own = [*range(20 * k, 20 * k + 20), size - 2, size - 1]
        hessian[np.ix_(own, own)] += step.condensed[k, :, :22]
        for passive in step.passive_rows[3 * k : 3 * k + 3, :22]:
            rows.append(np.zeros(size))
            rows[-1][own] = passive
        after = 20 * (k + 1) + 12 if k < count - 1 else 20 * count
        for a in range(4):
            angle, velocity = np.zeros(size), np.zeros(size)
            angle[[20 * k + 12 + a, after + a]] = 1.0, -1.0
            angle[20 * k + a + 4 * np.arange(3)] = step.lengths[k] * BUTCHER[-1]
            velocity[[20 * k + 8 + a, after + 4 + a]] = 1.0, -1.0
            rows += [angle, velocity]
    return hessian, np.array(rows), np.arange(20 * count, 20 * count + 8)


def test_the_recursion_is_the_schur_complement_of_the_whole_system(start):
    step, _ = disturbed(start, 1e-3)
    step.evaluate_curvature()
    recursive = step.eliminated(0.0)
    hessian, rows, last = whole_system(step)
    hessian[last, last] += PENALTY
    size = hessian.shape[0]
    given = [*range(12, 20), size - 2, size - 1]
    inner = np.setdiff1d(np.arange(size), given)
    corner = np.zeros((len(rows), len(rows)))
    system = np.block([[hessian[np.ix_(inner, inner)], rows[:, inner].T], [rows[:, inner], corner]])
    # What the given ones, and the multipliers of the last state, do to the others.
    right = np.zeros((system.shape[0], 18))
    right[: inner.size, :10] = hessian[np.ix_(inner, given)]
    right[inner.size :, :10] = rows[:, given]
    right[np.searchsorted(inner, last), range(10, 18)] = 1.0
    dense = -right.T @ np.linalg.solve(system, right)
    dense[:10, :10] += hessian[np.ix_(given, given)]
    scale = np.sqrt(np.maximum(np.abs(np.diag(dense)), 1e-3))
    both = np.outer(scale, scale)
    np.testing.assert_allclose(recursive / both, dense / both, atol=1e-6)


def test_one_and_two_threads_give_the_same_bits(start):
    directions = [newton_direction(*disturbed(start, 1e-3, threads)) for threads in (1, 2)]
    np.testing.assert_array_equal(*directions)


def test_a_value_that_is_no_number_is_not_taken_for_convex(start):
    step, ends = disturbed(start, 0.0)
    step.unknowns.of(step.iterate, "omega")[5, 2] = np.nan
    step.evaluate()
    ends.evaluate(step)
    step.evaluate_curvature()
    assert step.eliminated(1.0) is None
    assert not np.isfinite(step.infeasibility())
