/* Multifrontal factorisation.
 *
 * I. S. Duff, J. K. Reid: The multifrontal solution of indefinite sparse symmetric linear equations.
 * ACM Transactions on Mathematical Software 9 (1983), 302-325.
 *
 * A front is a small dense matrix: its candidates for pivots, then its border. Candidates that fail the
 * threshold test are delayed to the parent. What is left of a front, its contribution, waits on a stack
 * for its parent. Two threads do the two parts of the branches, then one of them the trunk. */
#include "factorization.h"

#include <float.h>
#include <math.h>
#include <pthread.h>
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

/* The elimination of one part. */
typedef struct {
    const Analysis *analysis;
    const double *values;
    double threshold, smallest;
    Factors *factors;
    int part;
    Workspace *own; /* of the part */
    Inertia inertia;
    int fine; /* false when memory ran out */
} Task;

/* What the part of a front has written. */
static const Workspace *written(const Task *task, int f) {
    return &task->factors->parts[task->analysis->part_of[f]];
}

/* List the unknowns of front f: its pivots, those delayed by its children, its border.
 * Returns the number of candidates for pivots, -1 when memory runs out. */
static int list_unknowns(Task *task, int f) {
    const Analysis *analysis = task->analysis;
    const AssemblyTree *tree = analysis->tree;
    Factors *factors = task->factors;
    Integers *indices = &task->own->indices;
    Front *front = &factors->fronts[f];
    int own = tree->pivot_begin[f + 1] - tree->pivot_begin[f], candidates = own;
    int border = tree->border_begin[f + 1] - tree->border_begin[f];
    for (int child = analysis->first_child[f]; child >= 0; child = analysis->sibling[child])
        candidates += factors->fronts[child].delayed;
    front->size = candidates + border;
    if (!reserve_integers(indices, front->size)) return -1;
    front->unknowns = indices->used;
    indices->used += front->size;
    int *list = indices->data + front->unknowns, *to = list + own;
    memcpy(list, factors->pivots + tree->pivot_begin[f], own * sizeof(int));
    for (int child = analysis->first_child[f]; child >= 0; child = analysis->sibling[child]) {
        const Front *from = &factors->fronts[child];
        const int *unknowns = written(task, child)->indices.data + from->unknowns + from->eliminated;
        memcpy(to, unknowns, from->delayed * sizeof(int));
        to += from->delayed;
    }
    memcpy(to, tree->border + tree->border_begin[f], border * sizeof(int));
    for (int i = 0; i < front->size; i++) task->own->place[list[i]] = i;
    return candidates;
}

/* Add the contribution of a child to a front. */
static void add_contribution(const Task *task, int child, double *restrict a, size_t size) {
    const Front *of = &task->factors->fronts[child];
    const Workspace *from = written(task, child);
    int rest = of->size - of->eliminated;
    const int *unknowns = from->indices.data + of->unknowns + of->eliminated;
    const double *restrict entries = from->stack.data + of->contribution;
    int *restrict to = task->own->places;
    for (int r = 0; r < rest; r++) to[r] = task->own->place[unknowns[r]];
    for (int c = 0; c < rest; c++, entries += rest) {
        size_t j = to[c];
        for (int r = c; r < rest; r++) {
            size_t i = to[r], low = i < j ? i : j, high = i < j ? j : i;
            a[high + low * size] += entries[r];
        }
    }
}

/* Sum up the front: its entries of the matrix and the contributions of its children, of which those of this
 * part are taken off the stack; false when memory runs out. */
static int assemble(Task *task, int f) {
    const Analysis *analysis = task->analysis;
    Workspace *own = task->own;
    size_t size = task->factors->fronts[f].size;
    if (!reserve_doubles(&own->values, size * (size + 2))) return 0;
    double *restrict a = own->values.data + own->values.used;
    const double *scale = task->factors->scale;
    memset(a, 0, size * size * sizeof(double));
    for (int e = analysis->entry_begin[f]; e < analysis->entry_begin[f + 1]; e++) {
        int row = analysis->row[e], column = analysis->column[e];
        size_t i = own->place[row], j = own->place[column];
        a[i > j ? i + j * size : j + i * size] += task->values[analysis->entry[e]] * scale[row] * scale[column];
    }
    for (int child = analysis->first_child[f]; child >= 0; child = analysis->sibling[child]) {
        add_contribution(task, child, a, size);
        if (analysis->part_of[child] == task->part)
            own->stack.used = task->factors->fronts[child].contribution;
    }
    return 1;
}

/* Eliminate what can be of front f; its columns of L stay where it was assembled, followed by D. */
static void eliminate_front(Task *task, int f, int candidates) {
    Front *front = &task->factors->fronts[f];
    Inertia *inertia = &task->inertia;
    size_t size = front->size;
    double *a = task->own->values.data + task->own->values.used, *diagonal = a + size * size;
    int *unknowns = task->own->indices.data + front->unknowns;
    DenseFront dense = {a, size, candidates, unknowns, diagonal, diagonal + size};
    Elimination done = eliminate_candidates(&dense, task->threshold, task->smallest);
    front->eliminated = done.eliminated;
    front->delayed = candidates - done.eliminated;
    inertia->rank += done.eliminated;
    inertia->negative += done.negative;
    inertia->two_by_two += done.two_by_two;
    inertia->delayed += front->delayed;
    if (front->size > inertia->largest_front) inertia->largest_front = front->size;
    inertia->entries += (long)done.eliminated * (2 * front->size - done.eliminated + 1) / 2;
    for (long p = size; p > (long)size - done.eliminated; p--) inertia->operations += p * (p + 1) / 2;
}

/* Put the front's contribution on the stack, and close up its columns of L and D; false when memory runs
 * out. */
static int store(Task *task, int f) {
    Front *front = &task->factors->fronts[f];
    Doubles *values = &task->own->values, *stack = &task->own->stack;
    size_t size = front->size, eliminated = front->eliminated, rest = size - eliminated;
    if (!reserve_doubles(stack, rest * rest)) return 0;
    double *a = values->data + values->used, *to = stack->data + stack->used;
    for (size_t c = 0; c < rest; c++)
        memcpy(to + c + c * rest, a + eliminated + c + (eliminated + c) * size, (rest - c) * sizeof(double));
    front->contribution = stack->used;
    stack->used += rest * rest;
    front->columns = values->used;
    front->diagonal = front->columns + size * eliminated;
    front->below = front->diagonal + eliminated;
    memmove(a + size * eliminated, a + size * size, eliminated * sizeof(double));
    memmove(a + (size + 1) * eliminated, a + size * (size + 1), eliminated * sizeof(double));
    values->used += (size + 2) * eliminated;
    return 1;
}

/* Keep the order of the front's own pivots for the next matrix, whose good pivots will be much the same. */
static void remember_order(Task *task, int f) {
    const int *unknowns = task->own->indices.data + task->factors->fronts[f].unknowns;
    const AssemblyTree *tree = task->analysis->tree;
    int *own = task->factors->pivots + tree->pivot_begin[f];
    int count = tree->pivot_begin[f + 1] - tree->pivot_begin[f], kept = 0;
    for (int i = 0; kept < count; i++)
        if (task->analysis->front_of[unknowns[i]] == f) own[kept++] = unknowns[i];
}

/* Eliminate the fronts of a part, children first. */
static void *eliminate_part(void *argument) {
    Task *task = argument;
    Workspace *own = task->own;
    own->values.used = own->stack.used = own->indices.used = 0;
    for (int f = 0; task->fine && f < task->analysis->tree->front_count; f++) {
        if (task->analysis->part_of[f] != task->part) continue;
        int candidates = list_unknowns(task, f);
        task->fine = candidates >= 0 && assemble(task, f);
        if (!task->fine) break;
        eliminate_front(task, f, candidates);
        remember_order(task, f);
        task->fine = store(task, f);
    }
    return NULL;
}

static void add_inertia(Inertia *sum, const Inertia *part) {
    sum->negative += part->negative;
    sum->rank += part->rank;
    sum->delayed += part->delayed;
    sum->two_by_two += part->two_by_two;
    sum->entries += part->entries;
    sum->operations += part->operations;
    if (part->largest_front > sum->largest_front) sum->largest_front = part->largest_front;
}

int factor(const Analysis *analysis, const double *values, double threshold, double smallest, int threads,
           Factors **made, Inertia *inertia) {
    Factors *factors = *made != NULL ? *made : (*made = new_factors(analysis));
    if (factors == NULL) return 0;
    *inertia = (Inertia){0};
    equilibrate(analysis, values, factors);
    Task tasks[PARTS];
    for (int k = 0; k < PARTS; k++)
        /* Of scaled entries, which are at most about 1, what is smaller than epsilon is rounding. */
        tasks[k] = (Task){analysis, values, threshold, fmax(smallest, DBL_EPSILON), factors, k,
                          &factors->parts[k], {0}, 1};
    pthread_t other;
    int apart = threads > 1 && pthread_create(&other, NULL, eliminate_part, &tasks[OTHER_BRANCHES]) == 0;
    eliminate_part(&tasks[FIRST_BRANCHES]);
    if (apart)
        pthread_join(other, NULL);
    else
        eliminate_part(&tasks[OTHER_BRANCHES]);
    if (tasks[FIRST_BRANCHES].fine && tasks[OTHER_BRANCHES].fine) eliminate_part(&tasks[TRUNK]);
    int fine = 1;
    for (int k = 0; k < PARTS; k++) {
        add_inertia(inertia, &tasks[k].inertia);
        fine = fine && tasks[k].fine;
    }
    return fine;
}
