/* A fill-reducing order of elimination of a symmetric matrix, as an assembly tree. */
#ifndef WALK_OPTIMIZER_ASSEMBLY_TREE_H
#define WALK_OPTIMIZER_ASSEMBLY_TREE_H

/* Fronts of a multifrontal factorisation, children before parents.
 *
 * Front f eliminates the unknowns pivots[pivot_begin[f] .. pivot_begin[f + 1]) and couples them to
 * the unknowns border[border_begin[f] .. border_begin[f + 1]), all of which are eliminated by its
 * ancestors. parent[f] > f, or -1 for a root. */
typedef struct {
    int n;
    int front_count;
    int *pivots;       /* [n] */
    int *pivot_begin;  /* [front_count + 1] */
    int *border;       /* [border_begin[front_count]] */
    int *border_begin; /* [front_count + 1] */
    int *parent;       /* [front_count] */
} AssemblyTree;

/* Order by approximate minimum degree; NULL when memory runs out.
 *
 * begin, index: columns of the lower triangle, zero-based; the diagonal may be missing. */
AssemblyTree *order_by_minimum_degree(int n, const int *begin, const int *index);

void free_assembly_tree(AssemblyTree *tree);

#endif
