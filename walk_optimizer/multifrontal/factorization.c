/* Multifrontal factorisation.
 *
 * I. S. Duff, J. K. Reid: The multifrontal solution of indefinite sparse symmetric linear equations.
 * ACM Transactions on Mathematical Software 9 (1983), 302-325.
 *
 * A front is a small dense matrix: its candidates for pivots, then its border. Candidates that fail the
 * threshold test are delayed to the parent. What is left of a front, its contribution, waits on a stack
 * for its parent. */
#include "factorization.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "dense_front.h"
#include "factors.h"

/* Bring the largest entries of all columns nearer to 1, beginning with the scales of the matrix before.
 *
 * D. Ruiz: A scaling algorithm to equilibrate both rows and columns norms in matrices. RAL-TR-2001-034.
 * Barrier terms range over thirty decades: without this, small entries that matter look like rounding. */
static void equilibrate(const Analysis *analysis, const double *values, Factors *factors) {
    int n = analysis->tree->n;
    double *restrict scale = factors->scale, *restrict largest = factors->largest;
    for (int i = 0; i < n; i++) largest[i] = 0.0;
    for (int e = 0; e < analysis->entry_count; e++) {
        int i = analysis->row[e], j = analysis->column[e];
        double value = fabs(values[analysis->entry[e]]) * scale[i] * scale[j];
        if (value > largest[i]) largest[i] = value;
        if (value > largest[j]) largest[j] = value;
    }
    for (int i = 0; i < n; i++)
        if (largest[i] > 0.0) scale[i] /= sqrt(largest[i]);
}

/* List the unknowns of front f: its pivots, those delayed by its children, its border.
 * Returns the number of candidates, -1 when memory runs out. */
static int list_unknowns(const AssemblyTree *tree, int f, Factors *factors) {
    Integers *indices = &factors->indices;
    Front *front = &factors->fronts[f];
    int own = tree->pivot_begin[f + 1] - tree->pivot_begin[f];
    int border = tree->border_begin[f + 1] - tree->border_begin[f];
    size_t delayed = 0;
    for (size_t w = factors->waiting.used; w > 0; w--) {
        int child = factors->waiting.data[w - 1];
        if (tree->parent[child] != f) break;
        delayed += factors->fronts[child].delayed;
    }
    if (!reserve_integers(indices, own + delayed + border)) return -1;
    front->unknowns = indices->used;
    int *list = indices->data + indices->used, size = own;
    memcpy(list, factors->pivots + tree->pivot_begin[f], own * sizeof(int));
    for (size_t w = factors->waiting.used; size < own + (int)delayed; w--) {
        const Front *from = &factors->fronts[factors->waiting.data[w - 1]];
        memcpy(list + size, indices->data + from->unknowns + from->eliminated, from->delayed * sizeof(int));
        size += from->delayed;
    }
    int candidates = size;
    memcpy(list + size, tree->border + tree->border_begin[f], border * sizeof(int));
    front->size = size + border;
    indices->used += front->size;
    for (int i = 0; i < front->size; i++) factors->place[list[i]] = i;
    return candidates;
}

/* Sum up the front: its entries of the matrix and the contributions of its children, which it takes off
 * the stack; false when memory runs out. */
static int assemble(const Analysis *analysis, const double *values, int f, Factors *factors) {
    const Front *front = &factors->fronts[f];
    size_t size = front->size;
    if (!reserve_doubles(&factors->values, size * (size + 2))) return 0;
    double *restrict a = factors->values.data + factors->values.used;
    const int *place = factors->place;
    const double *scale = factors->scale;
    memset(a, 0, size * size * sizeof(double));
    for (int e = analysis->entry_begin[f]; e < analysis->entry_begin[f + 1]; e++) {
        int row = analysis->row[e], column = analysis->column[e];
        size_t i = place[row], j = place[column];
        a[i > j ? i + j * size : j + i * size] += values[analysis->entry[e]] * scale[row] * scale[column];
    }
    Integers *waiting = &factors->waiting;
    while (waiting->used > 0 && analysis->tree->parent[waiting->data[waiting->used - 1]] == f) {
        const Front *child = &factors->fronts[waiting->data[--waiting->used]];
        int rest = child->size - child->eliminated;
        const int *unknowns = factors->indices.data + child->unknowns + child->eliminated;
        const double *from = factors->stack.data + child->contribution;
        int *restrict to = factors->places;
        for (int r = 0; r < rest; r++) to[r] = place[unknowns[r]];
        for (int c = 0; c < rest; c++, from += rest) {
            size_t j = to[c];
            for (int r = c; r < rest; r++) {
                size_t i = to[r], low = i < j ? i : j, high = i < j ? j : i;
                a[high + low * size] += from[r];
            }
        }
        factors->stack.used = child->contribution;
    }
    return 1;
}

/* Eliminate what can be of a front; its columns of L stay where it was assembled, followed by D. */
static void eliminate_front(Factors *factors, Front *front, int candidates, double threshold,
                            double smallest, Inertia *inertia) {
    size_t size = front->size;
    double *a = factors->values.data + factors->values.used, *diagonal = a + size * size;
    int *unknowns = factors->indices.data + front->unknowns;
    DenseFront dense = {a, size, candidates, unknowns, diagonal, diagonal + size};
    Elimination done = eliminate_candidates(&dense, threshold, smallest);
    front->eliminated = done.eliminated;
    front->delayed = candidates - done.eliminated;
    inertia->rank += done.eliminated;
    inertia->negative += done.negative;
    inertia->two_by_two += done.two_by_two;
}

/* Put the front's contribution on the stack, and close up its columns of L and D; false when memory runs
 * out. */
static int store(Factors *factors, int f) {
    Front *front = &factors->fronts[f];
    size_t size = front->size, eliminated = front->eliminated, rest = size - eliminated;
    if (!reserve_doubles(&factors->stack, rest * rest) || !reserve_integers(&factors->waiting, 1)) return 0;
    double *a = factors->values.data + factors->values.used, *to = factors->stack.data + factors->stack.used;
    for (size_t c = 0; c < rest; c++)
        memcpy(to + c + c * rest, a + eliminated + c + (eliminated + c) * size, (rest - c) * sizeof(double));
    front->contribution = factors->stack.used;
    factors->stack.used += rest * rest;
    factors->waiting.data[factors->waiting.used++] = f;
    front->columns = factors->values.used;
    front->diagonal = front->columns + size * eliminated;
    front->below = front->diagonal + eliminated;
    memmove(a + size * eliminated, a + size * size, eliminated * sizeof(double));
    memmove(a + (size + 1) * eliminated, a + size * (size + 1), eliminated * sizeof(double));
    factors->values.used += (size + 2) * eliminated;
    return 1;
}

/* Keep the order of the front's own pivots for the next matrix, whose good pivots will be much the same. */
static void remember_order(const Analysis *analysis, Factors *factors, int f, int candidates) {
    const int *unknowns = factors->indices.data + factors->fronts[f].unknowns;
    const AssemblyTree *tree = analysis->tree;
    int *own = factors->pivots + tree->pivot_begin[f], count = tree->pivot_begin[f + 1] - tree->pivot_begin[f];
    int kept = 0;
    for (int i = 0; i < candidates && kept < count; i++)
        if (analysis->front_of[unknowns[i]] == f) own[kept++] = unknowns[i];
}

int factor(const Analysis *analysis, const double *values, double threshold, double smallest,
           Factors **made, Inertia *inertia) {
    const AssemblyTree *tree = analysis->tree;
    Factors *factors = *made != NULL ? *made : (*made = new_factors(analysis));
    if (factors == NULL) return 0;
    factors->values.used = factors->stack.used = factors->indices.used = factors->waiting.used = 0;
    *inertia = (Inertia){0};
    /* Of scaled entries, which are at most about 1, what is smaller than this is rounding. */
    smallest = fmax(smallest, DBL_EPSILON);
    equilibrate(analysis, values, factors);
    for (int f = 0; f < tree->front_count; f++) {
        int candidates = list_unknowns(tree, f, factors);
        if (candidates < 0 || !assemble(analysis, values, f, factors)) return 0;
        Front *front = &factors->fronts[f];
        eliminate_front(factors, front, candidates, threshold, smallest, inertia);
        remember_order(analysis, factors, f, candidates);
        if (!store(factors, f)) return 0;
        int eliminated = front->eliminated, size = front->size;
        inertia->delayed += front->delayed;
        inertia->largest_front = size > inertia->largest_front ? size : inertia->largest_front;
        inertia->entries += (long)eliminated * (2 * size - eliminated + 1) / 2;
        for (int p = 0; p < eliminated; p++) inertia->operations += (long)(size - p) * (size - p + 1) / 2;
    }
    return 1;
}
