/* Multifrontal L D L^T of a sparse symmetric indefinite matrix, with threshold pivoting. */
#ifndef WALK_OPTIMIZER_FACTORIZATION_H
#define WALK_OPTIMIZER_FACTORIZATION_H

#include <stddef.h>

/* Where the entries of a matrix go, and in which order its unknowns are eliminated. */
typedef struct Analysis Analysis;

/* The factors of one matrix. */
typedef struct Factors Factors;

typedef struct {
    int negative;   /* negative eigenvalues */
    int rank;       /* pivots found; less than n for a singular matrix */
    int delayed;    /* pivots put off to a parent front */
    int two_by_two; /* blocks of two pivots */
    int largest_front;
    long entries;    /* of L */
    long operations; /* multiplications with additions */
} Inertia;

/* Analyse the pattern of a lower triangle by columns, zero-based; NULL when memory runs out. */
Analysis *analyse(int n, const int *begin, const int *index);
void free_analysis(Analysis *analysis);

/* Factor a matrix with this pattern into the memory of *factors, which is made where it is NULL.
 *
 * values: as index was. threshold: a pivot is at least this part of the largest entry of its column.
 * smallest: entries up to this count as zero. threads: two make use of two processors; the result is the same.
 * Returns false when memory runs out. */
int factor(const Analysis *analysis, const double *values, double threshold, double smallest, int threads,
           Factors **factors, Inertia *inertia);
void free_factors(Factors *factors);

/* Forget the scales and the order of pivots that earlier matrices have left behind. */
void forget(const Analysis *analysis, Factors *factors);

/* Solve in place for one right-hand side x[n]. */
void solve(const Analysis *analysis, Factors *factors, double *x);

#endif
