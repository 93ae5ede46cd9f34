/* From the order of elimination to fronts: who eliminates what, and where its contribution goes. */
#include "assembly_tree.h"

#include <stdlib.h>
#include <string.h>

#include "quotient_graph.h"

/* Fronts in the order of elimination. */
typedef struct {
    int count;
    int *front_of;                            /* [n] front that eliminates an unknown */
    int *element;                             /* [count] node of the quotient graph */
    int *pivot_count, *border_count, *parent; /* [count] */
    int **border;                             /* [count] unknowns */
} Fronts;

static void free_fronts(Fronts *fronts) {
    if (fronts->border != NULL)
        for (int f = 0; f < fronts->count; f++) free(fronts->border[f]);
    free(fronts->front_of), free(fronts->element), free(fronts->pivot_count);
    free(fronts->border_count), free(fronts->parent), free(fronts->border);
}

static int allocate_fronts(Fronts *fronts, int n) {
    memset(fronts, 0, sizeof *fronts);
    int **arrays[] = {&fronts->front_of, &fronts->element, &fronts->pivot_count, &fronts->border_count,
                      &fronts->parent};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        if ((*arrays[k] = integers(n)) == NULL) return 0;
    return (fronts->border = calloc((size_t)n + 1, sizeof(int *))) != NULL;
}

/* Note the front of the element just made; false when memory runs out. */
static int record_front(Fronts *fronts, const Graph *g, int p) {
    int f = fronts->count++, count = g->member_count[p];
    fronts->element[f] = p;
    fronts->pivot_count[f] = g->weight[p];
    for (int i = p; i >= 0; i = g->next_in_merged[i]) fronts->front_of[i] = f;
    fronts->border_count[f] = count_unknowns(g, g->members[p], count);
    fronts->border[f] = integers(fronts->border_count[f]);
    if (fronts->border[f] == NULL) return 0;
    int *to = fronts->border[f];
    for (int m = 0; m < count; m++) to = write_unknowns(g, g->members[p][m], to);
    return 1;
}

/* Put all unknowns that were left out into one last front, and into the border of whatever couples to
 * them; false when memory runs out. */
static int add_dense_front(Fronts *fronts, const Graph *g, const int *begin, const int *index) {
    int n = g->n, dense = 0, last = fronts->count;
    for (int i = 0; i < n; i++)
        if (g->state[i] == DENSE) dense++;
    if (dense == 0) return 1;
    int *number = integers(n), *unknown = integers(dense);
    char *touched = calloc((size_t)last * dense + 1, 1);
    int fine = number != NULL && unknown != NULL && touched != NULL;
    if (fine) {
        for (int i = 0, d = 0; i < n; i++)
            if (g->state[i] == DENSE) {
                number[i] = d;
                unknown[d++] = i;
                fronts->front_of[i] = last;
            }
        for (int j = 0; j < n; j++)
            for (int k = begin[j]; k < begin[j + 1]; k++) {
                int i = index[k], i_dense = g->state[i] == DENSE, j_dense = g->state[j] == DENSE;
                if (i_dense != j_dense)
                    touched[(size_t)fronts->front_of[i_dense ? j : i] * dense + number[i_dense ? i : j]] = 1;
            }
    }
    for (int f = 0; fine && f < last; f++) {
        int count = fronts->border_count[f], parent = fronts->parent[f];
        int *border = realloc(fronts->border[f], (size_t)(count + dense + 1) * sizeof(int));
        if ((fine = border != NULL)) {
            fronts->border[f] = border;
            for (int d = 0; d < dense; d++) {
                if (!touched[(size_t)f * dense + d]) continue;
                border[count++] = unknown[d];
                if (parent >= 0) touched[(size_t)parent * dense + d] = 1;
            }
            if (parent < 0 && count > 0) fronts->parent[f] = last;
            fronts->border_count[f] = count;
        }
    }
    fronts->count++;
    fronts->pivot_count[last] = dense;
    fronts->border_count[last] = 0;
    fronts->parent[last] = -1;
    free(number), free(unknown), free(touched);
    return fine;
}

/* Fronts smaller than this are merged into their parents: dense work is faster than bookkeeping. */
#define SMALL_FRONT 8

/* Return for each front the one that it is merged into, itself where it stays; NULL without memory. */
static int *amalgamate(Fronts *fronts) {
    int *into = integers(fronts->count);
    if (into == NULL) return NULL;
    for (int f = 0; f < fronts->count; f++) {
        int p = fronts->parent[f];
        into[f] = f;
        if (p < 0) continue;
        int zeros = fronts->pivot_count[p] + fronts->border_count[p] - fronts->border_count[f];
        int both_small = fronts->pivot_count[f] < SMALL_FRONT && fronts->pivot_count[p] < SMALL_FRONT;
        if (zeros > 0 && !both_small) continue;
        into[f] = p;
        fronts->pivot_count[p] += fronts->pivot_count[f];
    }
    for (int f = fronts->count - 1; f >= 0; f--)
        if (into[f] != f) into[f] = into[into[f]];
    return into;
}

/* Number the fronts that stay so that each subtree is contiguous and children come first. */
static int *postorder(const Fronts *fronts, const int *into, int *kept) {
    int count = fronts->count;
    int *rank = integers(count), *first_child = integers(count), *sibling = integers(count);
    int *stack = integers(count);
    if (rank != NULL && first_child != NULL && sibling != NULL && stack != NULL) {
        int depth = 0, next = 0;
        for (int f = 0; f < count; f++) first_child[f] = -1;
        for (int f = count - 1; f >= 0; f--) {
            if (into[f] != f) continue;
            int p = fronts->parent[f];
            if (p < 0) {
                stack[depth++] = f;
                continue;
            }
            sibling[f] = first_child[into[p]];
            first_child[into[p]] = f;
        }
        while (depth > 0) {
            int f = stack[depth - 1], child = first_child[f];
            if (child >= 0) {
                first_child[f] = sibling[child];
                stack[depth++] = child;
            } else {
                rank[f] = next++;
                depth--;
            }
        }
        *kept = next;
    } else {
        free(rank);
        rank = NULL;
    }
    free(first_child), free(sibling), free(stack);
    return rank;
}

void free_assembly_tree(AssemblyTree *tree) {
    if (tree == NULL) return;
    free(tree->pivots), free(tree->pivot_begin), free(tree->border), free(tree->border_begin);
    free(tree->parent), free(tree);
}

/* Write the fronts that stay in their new order. */
static AssemblyTree *written_tree(const Fronts *fronts, const int *into, const int *rank, int kept, int n) {
    AssemblyTree *tree = calloc(1, sizeof *tree);
    if (tree == NULL) return NULL;
    size_t border_total = 0;
    for (int f = 0; f < fronts->count; f++)
        if (into[f] == f) border_total += fronts->border_count[f];
    *tree = (AssemblyTree){n, kept, integers(n), integers(kept), integers(border_total), integers(kept),
                           integers(kept)};
    if (tree->pivots == NULL || tree->pivot_begin == NULL || tree->border == NULL ||
        tree->border_begin == NULL || tree->parent == NULL) {
        free_assembly_tree(tree);
        return NULL;
    }
    memset(tree->pivot_begin, 0, (kept + 1) * sizeof(int));
    memset(tree->border_begin, 0, (kept + 1) * sizeof(int));
    for (int f = 0; f < fronts->count; f++) {
        if (into[f] != f) continue;
        int r = rank[f], p = fronts->parent[f];
        tree->pivot_begin[r + 1] = fronts->pivot_count[f];
        tree->border_begin[r + 1] = fronts->border_count[f];
        tree->parent[r] = p < 0 ? -1 : rank[into[p]];
    }
    for (int r = 0; r < kept; r++) {
        tree->pivot_begin[r + 1] += tree->pivot_begin[r];
        tree->border_begin[r + 1] += tree->border_begin[r];
    }
    for (int f = 0; f < fronts->count; f++)
        if (into[f] == f && fronts->border_count[f] > 0)
            memcpy(tree->border + tree->border_begin[rank[f]], fronts->border[f],
                   fronts->border_count[f] * sizeof(int));
    return tree;
}

/* Sort the unknowns into the pivots of their fronts, those of merged children first. */
static int write_pivots(AssemblyTree *tree, const Fronts *fronts, const int *into, const int *rank) {
    int count = fronts->count, n = tree->n;
    int *begin = integers(count), *sorted = integers(n), *at = integers(tree->front_count);
    int fine = begin != NULL && sorted != NULL && at != NULL;
    if (fine) {
        memset(begin, 0, (count + 1) * sizeof(int));
        for (int i = 0; i < n; i++) begin[fronts->front_of[i] + 1]++;
        for (int f = 0; f < count; f++) begin[f + 1] += begin[f];
        for (int i = n - 1; i >= 0; i--) sorted[--begin[fronts->front_of[i] + 1]] = i;
        memcpy(at, tree->pivot_begin, tree->front_count * sizeof(int));
        for (int k = 0; k < n; k++) {
            int i = sorted[k];
            tree->pivots[at[rank[into[fronts->front_of[i]]]]++] = i;
        }
    }
    free(begin), free(sorted), free(at);
    return fine;
}

static AssemblyTree *tree_of(Fronts *fronts, int n) {
    AssemblyTree *tree = NULL;
    int kept = 0, *into = amalgamate(fronts), *rank = into == NULL ? NULL : postorder(fronts, into, &kept);
    if (rank != NULL) tree = written_tree(fronts, into, rank, kept, n);
    if (tree != NULL && !write_pivots(tree, fronts, into, rank)) {
        free_assembly_tree(tree);
        tree = NULL;
    }
    free(into), free(rank);
    return tree;
}

/* Eliminate all variables of the graph; false when memory runs out. */
static int eliminate_all(Graph *g, Fronts *fronts) {
    Hashed *hashed = malloc(((size_t)g->n + 1) * sizeof *hashed);
    int remaining = 0, fine = hashed != NULL;
    for (int i = 0; i < g->n; i++) remaining += g->state[i] == VARIABLE;
    while (fine && remaining > 0) {
        int p = next_pivot(g);
        fine = eliminate(g, p, &remaining, hashed) && record_front(fronts, g, p);
    }
    free(hashed);
    for (int f = 0; fine && f < fronts->count; f++) {
        int absorber = g->parent[fronts->element[f]];
        fronts->parent[f] = absorber < 0 ? -1 : fronts->front_of[absorber];
    }
    return fine;
}

AssemblyTree *order_by_minimum_degree(int n, const int *begin, const int *index) {
    Graph graph;
    Fronts fronts;
    AssemblyTree *tree = NULL;
    memset(&fronts, 0, sizeof fronts);
    if (allocate_graph(&graph, n, begin[n]) && allocate_fronts(&fronts, n)) {
        build_graph(&graph, begin, index);
        if (eliminate_all(&graph, &fronts) && add_dense_front(&fronts, &graph, begin, index))
            tree = tree_of(&fronts, n);
    }
    free_fronts(&fronts);
    free_graph(&graph);
    return tree;
}
