"""The factorisation against NumPy and SciPy: solutions, inertia, singular and badly scaled matrices."""

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from multifrontal.ipopt_calls import Factorization
from scipy.sparse.linalg import splu

from walk_optimizer.multifrontal.library import factorization_library

LIBRARY = factorization_library()
pytestmark = pytest.mark.skipif(LIBRARY is None, reason="no C compiler")
SINGULAR = -7


def kkt(variables, constraints, density, generator, barrier=0.0):
    """[[H + S, A^T], [A, 0]] with a sparse indefinite H and barrier terms S over many decades."""
    normal = {"random_state": generator, "data_rvs": generator.standard_normal}
    hessian = sp.random(variables, variables, density, **normal)
    diagonal = generator.standard_normal(variables) + 10.0 ** generator.uniform(-barrier, barrier, variables)
    jacobian = sp.random(constraints, variables, density, **normal)
    # Full rank by an entry of its own in each row.
    own = sp.coo_matrix(
        (
            generator.uniform(1, 2, constraints),
            (range(constraints), generator.permutation(variables)[:constraints]),
        ),
        (constraints, variables),
    )
    jacobian = jacobian + own
    return with_diagonal(sp.bmat([[hessian + hessian.T + sp.diags(diagonal), jacobian.T], [jacobian, None]]))


def with_diagonal(matrix):
    """Return the matrix with an entry for every diagonal place, zero or not, as IPOPT has it."""
    matrix = sp.coo_matrix(matrix)
    n = matrix.shape[0]
    filled = sp.csc_matrix(matrix) + sp.eye(n, format="csc")
    filled.setdiag(matrix.diagonal())
    return sp.csc_matrix(filled)


def chain(stages, generator, width=12, shared=3):
    """The KKT matrix of a chain of stages with shared unknowns that touch them all."""
    blocks = [kkt(width, width // 2, 0.3, generator) for _ in range(stages)]
    size = blocks[0].shape[0]
    couplings = sp.block_diag(blocks, format="lil")
    for k in range(stages - 1):
        link = sp.random(size, size, 0.05, random_state=generator)
        couplings[k * size : (k + 1) * size, (k + 1) * size : (k + 2) * size] = link
        couplings[(k + 1) * size : (k + 2) * size, k * size : (k + 1) * size] = link.T
    border = sp.random(stages * size, shared, 0.3, random_state=generator)
    return with_diagonal(sp.bmat([[couplings, border], [border.T, sp.eye(shared) * 5]]))


def rescaled(matrix, scales):
    """Return D A D with zeros kept as entries."""
    result = sp.csc_matrix(matrix).copy()
    columns = np.repeat(np.arange(result.shape[0]), np.diff(result.indptr))
    result.data *= scales[result.indices] * scales[columns]
    return result


def check(matrix, right, solution, tolerance=1e-9):
    scale = abs(matrix) @ np.abs(solution) + np.abs(right)
    np.testing.assert_array_less(np.abs(matrix @ solution - right), tolerance * scale + 1e-300)


@given(st.integers(1, 40), st.floats(0, 1), st.floats(0.02, 0.6), st.integers(0, 2**32 - 1), st.floats(0, 3))
@settings(deadline=None, max_examples=150)
def test_solutions_and_inertia_of_random_kkt_matrices(variables, part, density, seed, barrier):
    generator = np.random.default_rng(seed)
    matrix = kkt(variables, int(part * variables), density, generator, barrier)
    eigenvalues = np.linalg.eigvalsh(matrix.toarray())
    if np.abs(eigenvalues).min() < 1e-6 * np.abs(eigenvalues).max():
        return
    factorization = Factorization(LIBRARY, matrix)
    verdict = factorization.factor(matrix)
    right = generator.standard_normal((matrix.shape[0], 2))
    solution = factorization.solve(right)
    factorization.close()
    assert (verdict.flag, verdict.rank) == (0, matrix.shape[0])
    assert verdict.negative == np.sum(eigenvalues < 0)
    np.testing.assert_allclose(solution, np.linalg.solve(matrix.toarray(), right), rtol=1e-4, atol=1e-6)


def test_a_long_chain_with_shared_unknowns_costs_in_proportion_to_its_length():
    entries = {}
    for stages in (100, 200, 400):
        generator = np.random.default_rng(3)
        matrix = chain(stages, generator)
        factorization = Factorization(LIBRARY, matrix)
        verdict = factorization.factor(matrix)
        right = generator.standard_normal(matrix.shape[0])
        solution = factorization.solve(right)
        factorization.close()
        assert verdict.flag == 0
        np.testing.assert_allclose(solution, splu(matrix).solve(right), rtol=1e-5, atol=1e-8)
        entries[stages] = verdict.entries
    assert entries[200] < 2.2 * entries[100]
    assert entries[400] < 2.2 * entries[200]


def test_the_same_pattern_is_factored_again_for_other_values():
    generator = np.random.default_rng(8)
    matrix = chain(30, generator)
    factorization = Factorization(LIBRARY, matrix)
    for _ in range(5):
        factorization.factor(matrix)
        right = generator.standard_normal(matrix.shape[0])
        check(matrix, right, factorization.solve(right))
        scales = 10.0 ** generator.uniform(-3, 3, matrix.shape[0])
        matrix = rescaled(matrix, scales)
    factorization.close()


@pytest.mark.parametrize("decades", [10, 15])
def test_scales_apart_by_many_decades_cost_no_accuracy(decades):
    generator = np.random.default_rng(5)
    matrix = chain(20, generator)
    scales = 10.0 ** generator.uniform(-decades, decades, matrix.shape[0])
    scaled = rescaled(matrix, scales)
    expected = generator.standard_normal(matrix.shape[0])
    factorization = Factorization(LIBRARY, matrix)
    for _ in range(4):  # the scaling settles over some matrices, as it does in the course of a solve
        verdict = factorization.factor(scaled)
    solution = factorization.solve(scales * (matrix @ expected)) * scales
    factorization.close()
    assert verdict.negative == np.sum(np.linalg.eigvalsh(matrix.toarray()) < 0)
    np.testing.assert_allclose(solution, expected, rtol=1e-6, atol=1e-8)


@pytest.mark.parametrize("threshold", [1e-10, 1e-8, 1e-4, 0.1])
def test_every_threshold_of_pivots_solves(threshold):
    generator = np.random.default_rng(6)
    matrix = chain(20, generator)
    right = generator.standard_normal(matrix.shape[0])
    factorization = Factorization(LIBRARY, matrix, threshold)
    verdict = factorization.factor(matrix)
    assert (verdict.flag, verdict.rank) == (0, matrix.shape[0])
    check(matrix, right, factorization.solve(right))
    factorization.close()


def test_multipliers_alone_are_paired_or_delayed():
    # Constraints that couple to one variable each: an empty diagonal is no pivot of its own.
    matrix = with_diagonal(sp.bmat([[sp.coo_matrix((6, 6)), sp.eye(6)], [sp.eye(6), None]]))
    factorization = Factorization(LIBRARY, matrix)
    verdict = factorization.factor(matrix)
    right = np.arange(12.0)
    np.testing.assert_allclose(factorization.solve(right), np.r_[right[6:], right[:6]])
    factorization.close()
    assert (verdict.flag, verdict.negative, verdict.two_by_two) == (0, 6, 6)


def test_singular_matrices_are_reported():
    dependent = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0]])
    jacobian = sp.coo_matrix(dependent)
    for matrix in (
        with_diagonal(sp.bmat([[sp.eye(3), jacobian.T], [jacobian, None]])),
        with_diagonal(sp.coo_matrix((4, 4))),
    ):
        factorization = Factorization(LIBRARY, matrix)
        verdict = factorization.factor(matrix)
        factorization.close()
        assert verdict.flag == SINGULAR
        assert verdict.rank < matrix.shape[0]


def test_values_that_are_no_numbers_end_as_singular():
    matrix = chain(5, np.random.default_rng(1))
    factorization = Factorization(LIBRARY, matrix)
    spoilt = matrix.copy()
    spoilt.data[:] = np.nan
    assert factorization.factor(spoilt).flag == SINGULAR
    right = np.ones(matrix.shape[0])
    assert factorization.factor(matrix).flag == 0, "the next matrix is none the worse"
    check(matrix, right, factorization.solve(right))
    factorization.close()


def test_parts_without_coupling_and_a_single_unknown():
    for matrix in (sp.csc_matrix([[-4.0]]), sp.csc_matrix(np.diag([1.0, -2.0, 3.0]))):
        factorization = Factorization(LIBRARY, matrix)
        verdict = factorization.factor(matrix)
        right = np.ones(matrix.shape[0])
        np.testing.assert_allclose(factorization.solve(right), right / matrix.diagonal())
        factorization.close()
        assert (verdict.flag, verdict.negative) == (0, 1)


def test_a_solve_does_not_depend_on_those_before_it():
    # Analyses are kept for the next solve of the same pattern, what was learnt from its matrices is not.
    generator = np.random.default_rng(7)
    matrix = chain(20, generator)
    right = generator.standard_normal(matrix.shape[0])
    solutions = []
    for _ in range(2):
        factorization = Factorization(LIBRARY, matrix)
        factorization.factor(matrix)
        solutions.append(factorization.solve(right))
        factorization.factor(rescaled(matrix, 10.0 ** generator.uniform(-4, 4, matrix.shape[0])))
        factorization.close()
    np.testing.assert_array_equal(*solutions)


def test_patterns_that_are_used_in_turn_are_told_apart():
    matrices = [chain(stages, np.random.default_rng(stages)) for stages in range(2, 9)] * 2
    for matrix in matrices:
        factorization = Factorization(LIBRARY, matrix)
        factorization.factor(matrix)
        right = np.ones(matrix.shape[0])
        check(matrix, right, factorization.solve(right))
        factorization.close()


@pytest.mark.parametrize("stages", [1, 2, 60])
def test_two_threads_find_the_very_same_factors(stages):
    generator = np.random.default_rng(11)
    matrix = chain(stages, generator)
    scales = 10.0 ** generator.uniform(-4, 4, (2, matrix.shape[0]))
    # Each begins with what is learnt from those before it.
    matrices = [matrix, *(rescaled(matrix, one) for one in scales), matrix]
    right = generator.standard_normal(matrix.shape[0])
    found = []
    for threads in (1, 2):
        factorization = Factorization(LIBRARY, matrix, threads=threads)
        verdicts = [factorization.factor(one) for one in matrices]
        found.append((verdicts, factorization.solve(right)))
        factorization.close()
    (verdicts, solution), (same_verdicts, same_solution) = found
    assert verdicts == same_verdicts
    np.testing.assert_array_equal(solution, same_solution)
    check(matrix, right, solution)
