/* What an analysis and its factors are made of. */
#ifndef WALK_OPTIMIZER_FACTORS_H
#define WALK_OPTIMIZER_FACTORS_H

#include <stddef.h>

#include "assembly_tree.h"
#include "division.h"
#include "factorization.h"

struct Analysis {
    AssemblyTree *tree;
    int *part_of;               /* [front_count] division of the work */
    int *first_child, *sibling; /* [front_count] children of a front, the last one first; -1 for none */
    int *entry_begin;           /* [front_count + 1] entries of the matrix that a front assembles */
    int *entry;                 /* [entries] their places among the values */
    int *row, *column;          /* [entries] their unknowns */
    int entry_count;
    int *front_of; /* [n] front that eliminates an unknown if nothing is delayed */
};

/* One front after its elimination. L is unit lower triangular at its top. */
typedef struct {
    int size, eliminated, delayed;
    size_t unknowns;     /* [size] among the indices of its part, pivots first */
    size_t columns;      /* [size x eliminated] of L among the values */
    size_t diagonal;     /* [eliminated] of D among the values */
    size_t below;        /* [eliminated] of D, below the diagonal: 0 but in a block of two */
    size_t contribution; /* [(size - eliminated)^2] on the stack */
} Front;

typedef struct {
    double *data;
    size_t used, room;
} Doubles;

typedef struct {
    int *data;
    size_t used, room;
} Integers;

/* What the elimination of a part writes. */
typedef struct {
    Doubles values, stack;
    Integers indices;
    int *place;  /* [n] of an unknown in the front being assembled */
    int *places; /* [n] of the unknowns of a contribution in that front */
} Workspace;

struct Factors {
    Front *fronts;
    Workspace parts[PARTS];
    double *scale;   /* [n] */
    int *pivots;     /* [n] those of the tree, within each front in the order of the last time */
    double *piece;   /* [n] of a right-hand side */
    double *largest; /* [n] scaled entry of a column */
};

/* Reserve room at the end of an array that grows; false when memory runs out. */
int reserve_doubles(Doubles *array, size_t count);
int reserve_integers(Integers *array, size_t count);

/* NULL when memory runs out. */
Factors *new_factors(const Analysis *analysis);

#endif
