/* The graph of a matrix in the course of its elimination. */
#ifndef WALK_OPTIMIZER_QUOTIENT_GRAPH_H
#define WALK_OPTIMIZER_QUOTIENT_GRAPH_H

#include <stddef.h>
#include <stdlib.h>

enum State { VARIABLE, MERGED, ELEMENT, ABSORBED, DENSE };

/* The quotient graph. Lists of node i: first its elements, then its variables, in place of the
 * neighbours that it had at the beginning, which are never fewer. */
typedef struct {
    int n;
    int *state;
    int *list_begin;     /* [n] into lists */
    int *lists;          /* neighbours */
    int *element_count;  /* [n] elements in the list of a variable */
    int *variable_count; /* [n] variables in the list of a variable */
    int *weight;         /* [n] unknowns in a supervariable, 0 for one that is merged */
    int *degree;         /* [n] approximate external degree */
    int *parent;         /* [n] element that absorbed an element, -1 for none */
    int **members;       /* [n] variables of an element */
    int *member_count;   /* [n] */
    int *next_in_merged; /* [n] chain of the unknowns of a supervariable */
    int *last_in_merged; /* [n] */
    int *bucket;         /* [n + 1] first variable of a degree */
    int *next, *previous; /* [n] within a bucket */
    int *mark;           /* [n] */
    int *outside;        /* [n] weight of an element outside of the new one */
    int stamp;
    int smallest_degree;
} Graph;

/* A variable and a hash of its neighbours. */
typedef struct { unsigned hash; int variable; } Hashed;

/* Room for so many numbers and one more; NULL when memory runs out. */
static inline int *integers(size_t count) { return malloc((count + 1) * sizeof(int)); }

/* False when memory runs out. entries: of the lower triangle. */
int allocate_graph(Graph *g, int n, int entries);
void free_graph(Graph *g);

/* Fill in the neighbours; unknowns with too many of them become DENSE and are left out. */
void build_graph(Graph *g, const int *begin, const int *index);

/* A supervariable of least degree. */
int next_pivot(Graph *g);

/* Eliminate supervariable p; false when memory runs out.
 *
 * remaining: unknowns that are not eliminated yet, counted down. hashed: scratch space, [n]. */
int eliminate(Graph *g, int p, int *remaining, Hashed *hashed);

/* Unknowns of a list of supervariables. */
int count_unknowns(const Graph *g, const int *members, int count);

/* Write the unknowns of supervariable i; return the place behind them. */
int *write_unknowns(const Graph *g, int i, int *to);

#endif
