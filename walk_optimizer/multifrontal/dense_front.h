/* Partial elimination of one dense symmetric matrix, with threshold pivoting. */
#ifndef WALK_OPTIMIZER_DENSE_FRONT_H
#define WALK_OPTIMIZER_DENSE_FRONT_H

#include <stddef.h>

/* A front: its first `candidates` unknowns may be eliminated, the others are its border. */
typedef struct {
    double *a; /* [size x size] by columns; the lower triangle counts */
    size_t size;
    int candidates;
    int *unknowns;    /* [size] names, kept in order with the rows */
    double *diagonal; /* [size] of D, out */
    double *below;    /* [size] of D, out: 0 but in the first row of a block of two */
} DenseFront;

typedef struct {
    int eliminated, negative, two_by_two;
} Elimination;

/* Eliminate the candidates that pass the threshold test: A = L D L^T + rest.
 *
 * The pivots come first, with their columns of L, unit lower triangular, in their places; below and right
 * of them is the rest. */
Elimination eliminate_candidates(const DenseFront *front, double threshold, double smallest);

#endif
