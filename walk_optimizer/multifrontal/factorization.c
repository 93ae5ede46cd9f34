/* Multifrontal factorisation.
 *
 * I. S. Duff, J. K. Reid: The multifrontal solution of indefinite sparse symmetric linear equations.
 * ACM Transactions on Mathematical Software 9 (1983), 302-325.
 *
 * A front is a small dense matrix: its candidates for pivots, then its border. Blocks of one or two pivots
 * are chosen among the candidates; candidates that fail the threshold test are delayed to the parent. What
 * is left of a front, its contribution, waits on a stack for its parent. */
#include "factorization.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "ordering.h"

/* A pivot as good as this is taken without looking further. */
#define GOOD_PIVOT 0.01

/* Sweeps of the scaling, each of which begins with the scales of the matrix before. */
#define SCALING_SWEEPS 1

struct Analysis {
    AssemblyTree *tree;
    int *entry_begin; /* [front_count + 1] entries of the matrix that a front assembles */
    int *entry;       /* [entries] their places among the values */
    int *row, *column; /* [entries] their unknowns */
    int entry_count;
    int *front_of;     /* [n] front that eliminates an unknown if nothing is delayed */
};

/* One front after its elimination. L is unit lower triangular at its top. */
typedef struct {
    int size, eliminated;
    size_t unknowns;     /* [size] among the indices, pivots first */
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

struct Factors {
    Front *fronts;
    Doubles values, stack;
    double *scale;             /* [n] */
    Integers indices, waiting; /* waiting: fronts whose contributions are on the stack */
    int *pivots;               /* [n] those of the tree, within each front in the order of the last time */
    int *place;                /* [n] of an unknown in the front being assembled */
    int *places;               /* [n] of the unknowns of a contribution in that front */
    double *part;              /* [n] of a right-hand side */
    double *largest;           /* [n] scaled entry of a column */
};

/* Reserve room at the end of an array that grows; false when memory runs out. */
static int reserve_doubles(Doubles *array, size_t count) {
    if (array->used + count <= array->room) return 1;
    size_t room = 2 * array->room + count;
    double *data = realloc(array->data, room * sizeof *data);
    if (data == NULL) return 0;
    array->data = data;
    array->room = room;
    return 1;
}

static int reserve_integers(Integers *array, size_t count) {
    if (array->used + count <= array->room) return 1;
    size_t room = 2 * array->room + count;
    int *data = realloc(array->data, room * sizeof *data);
    if (data == NULL) return 0;
    array->data = data;
    array->room = room;
    return 1;
}

void free_analysis(Analysis *analysis) {
    if (analysis == NULL) return;
    free_assembly_tree(analysis->tree);
    free(analysis->entry_begin), free(analysis->entry), free(analysis->row), free(analysis->column);
    free(analysis->front_of);
    free(analysis);
}

void free_factors(Factors *factors) {
    if (factors == NULL) return;
    free(factors->fronts), free(factors->values.data), free(factors->stack.data);
    free(factors->indices.data), free(factors->waiting.data), free(factors->place);
    free(factors->pivots), free(factors->places), free(factors->part), free(factors->scale), free(factors->largest);
    free(factors);
}

/* Give every entry of the matrix to the front that eliminates the first of its two unknowns. */
static void assign_entries(Analysis *analysis, int n, const int *begin, const int *index) {
    const AssemblyTree *tree = analysis->tree;
    int *front_of = analysis->front_of, *at = analysis->entry_begin;
    for (int f = 0; f < tree->front_count; f++)
        for (int k = tree->pivot_begin[f]; k < tree->pivot_begin[f + 1]; k++) front_of[tree->pivots[k]] = f;
    memset(at, 0, ((size_t)tree->front_count + 1) * sizeof(int));
    for (int pass = 0; pass < 2; pass++) {
        for (int j = 0; j < n; j++)
            for (int k = begin[j]; k < begin[j + 1]; k++) {
                int i = index[k], f = front_of[i] < front_of[j] ? front_of[i] : front_of[j];
                if (pass == 0) {
                    at[f + 1]++;
                    continue;
                }
                int e = at[f]++;
                analysis->entry[e] = k;
                analysis->row[e] = i;
                analysis->column[e] = j;
            }
        if (pass == 0)
            for (int f = 0; f < tree->front_count; f++) at[f + 1] += at[f];
    }
    memmove(at + 1, at, (size_t)tree->front_count * sizeof(int));
    at[0] = 0;
}

Analysis *analyse(int n, const int *begin, const int *index) {
    Analysis *analysis = calloc(1, sizeof *analysis);
    if (analysis == NULL) return NULL;
    size_t entries = (size_t)begin[n] + 1;
    analysis->entry_count = begin[n];
    analysis->tree = order_by_minimum_degree(n, begin, index);
    if (analysis->tree != NULL) {
        analysis->entry_begin = malloc(((size_t)analysis->tree->front_count + 1) * sizeof(int));
        analysis->entry = malloc(entries * sizeof(int));
        analysis->row = malloc(entries * sizeof(int));
        analysis->column = malloc(entries * sizeof(int));
        analysis->front_of = malloc(((size_t)n + 1) * sizeof(int));
        if (analysis->entry_begin != NULL && analysis->entry != NULL && analysis->row != NULL &&
            analysis->column != NULL && analysis->front_of != NULL) {
            assign_entries(analysis, n, begin, index);
            return analysis;
        }
    }
    free_analysis(analysis);
    return NULL;
}

void forget(const Analysis *analysis, Factors *factors) {
    memcpy(factors->pivots, analysis->tree->pivots, (size_t)analysis->tree->n * sizeof(int));
    for (int i = 0; i < analysis->tree->n; i++) factors->scale[i] = 1.0;
}

static Factors *new_factors(const Analysis *analysis) {
    const AssemblyTree *tree = analysis->tree;
    Factors *factors = calloc(1, sizeof *factors);
    if (factors == NULL) return NULL;
    factors->fronts = malloc(((size_t)tree->front_count + 1) * sizeof(Front));
    factors->place = malloc(((size_t)tree->n + 1) * sizeof(int));
    factors->pivots = malloc(((size_t)tree->n + 1) * sizeof(int));
    factors->places = malloc(((size_t)tree->n + 1) * sizeof(int));
    factors->part = malloc(((size_t)tree->n + 1) * sizeof(double));
    factors->scale = malloc(((size_t)tree->n + 1) * sizeof(double));
    factors->largest = malloc(((size_t)tree->n + 1) * sizeof(double));
    if (factors->fronts != NULL && factors->pivots != NULL && factors->place != NULL &&
        factors->places != NULL && factors->part != NULL && factors->scale != NULL &&
        factors->largest != NULL) {
        forget(analysis, factors);
        return factors;
    }
    free_factors(factors);
    return NULL;
}

/* Bring the largest entries of all columns near to 1.
 *
 * D. Ruiz: A scaling algorithm to equilibrate both rows and columns norms in matrices. RAL-TR-2001-034.
 * Barrier terms range over thirty decades: without this, small entries that matter look like rounding. */
static void equilibrate(const Analysis *analysis, const double *values, Factors *factors) {
    int n = analysis->tree->n;
    double *restrict scale = factors->scale, *restrict largest = factors->largest;
    for (int sweep = 0; sweep < SCALING_SWEEPS; sweep++) {
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
        int pivots = factors->fronts[child].size - factors->fronts[child].eliminated;
        delayed += pivots - (tree->border_begin[child + 1] - tree->border_begin[child]);
    }
    if (!reserve_integers(indices, own + delayed + border)) return -1;
    front->unknowns = indices->used;
    int *list = indices->data + indices->used, size = own;
    memcpy(list, factors->pivots + tree->pivot_begin[f], own * sizeof(int));
    for (size_t w = factors->waiting.used; w > 0; w--) {
        int child = factors->waiting.data[w - 1];
        if (tree->parent[child] != f) break;
        const Front *from = &factors->fronts[child];
        int count = from->size - from->eliminated - (tree->border_begin[child + 1] - tree->border_begin[child]);
        memcpy(list + size, indices->data + from->unknowns + from->eliminated, count * sizeof(int));
        size += count;
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

/* Exchange unknowns p < t of a front, in L as well. */
static void exchange(double *a, size_t size, int *unknowns, int p, int t) {
    if (p == t) return;
    int unknown = unknowns[p];
    unknowns[p] = unknowns[t];
    unknowns[t] = unknown;
#define SWAP(x, y) do { double s_ = (x); (x) = (y); (y) = s_; } while (0)
    for (int c = 0; c < p; c++) SWAP(a[p + c * size], a[t + c * size]);
    SWAP(a[p + p * size], a[t + t * size]);
    for (int i = p + 1; i < t; i++) SWAP(a[i + p * size], a[t + i * size]);
    for (size_t i = t + 1; i < size; i++) SWAP(a[i + p * size], a[i + t * size]);
#undef SWAP
}

/* A block of one or two pivots: second is -1 for one. Quality: how little the rest grows, at most 1. */
typedef struct {
    int first, second;
    double quality;
} Pivot;

/* Largest magnitude of n numbers. */
static double largest_of(const double *values, size_t n) {
    double largest = 0.0;
#pragma omp simd reduction(max : largest)
    for (size_t i = 0; i < n; i++) largest = fabs(values[i]) > largest ? fabs(values[i]) : largest;
    return largest;
}

/* Largest magnitude off the diagonal in column t of what is left, from row `from` on. */
static double column_maximum(const double *a, size_t size, int from, int t) {
    double largest = largest_of(a + (t + 1) + t * size, size - t - 1);
    for (int i = from; i < t; i++) {
        double value = fabs(a[t + i * size]);
        largest = value > largest ? value : largest;
    }
    return largest;
}

/* The candidate that candidate t is most coupled to; -1 for none. */
static int strongest_coupling(const double *a, size_t size, int from, int candidates, int t) {
    double largest = 0.0;
    int where = -1;
    for (int i = from; i < candidates; i++) {
        double value = i == t ? 0.0 : fabs(i < t ? a[t + i * size] : a[i + t * size]);
        if (value > largest) largest = value, where = i;
    }
    return where;
}

/* Largest magnitude in column t of what is left, without rows t and other. */
static double remaining_maximum(double *a, size_t size, int from, int t, int other) {
    double *coupling = t < other ? a + other + t * size : a + t + other * size, kept = *coupling;
    *coupling = 0.0;
    double largest = column_maximum(a, size, from, t);
    *coupling = kept;
    return largest;
}

/* Judge column t as a pivot, alone or with the candidate that it is most coupled to. */
static Pivot judge(double *a, size_t size, int from, int candidates, int t, double smallest) {
    double diagonal = a[t + t * size], largest = column_maximum(a, size, from, t);
    Pivot single = {t, -1, 0.0};
    if (fabs(diagonal) > smallest) single.quality = fabs(diagonal) >= largest ? 1.0 : fabs(diagonal) / largest;
    if (single.quality >= GOOD_PIVOT || largest <= smallest) return single;
    int other = strongest_coupling(a, size, from, candidates, t);
    if (other < 0) return single;
    int low = t < other ? t : other, high = t < other ? other : t;
    double a11 = a[low + low * size], a21 = a[high + low * size], a22 = a[high + high * size];
    double scale = fabs(a21), determinant = (a11 / scale) * (a22 / scale) - 1.0; /* over a21^2 */
    double first = remaining_maximum(a, size, from, low, high);
    double second = remaining_maximum(a, size, from, high, low);
    double growth = fmax(fabs(a22) * first + scale * second, scale * first + fabs(a11) * second);
    double quality = growth > 0.0 ? fabs(determinant) * scale * scale / growth : 1.0;
    if (quality > 1.0) quality = 1.0;
    return fabs(determinant) > 1e-12 && quality > single.quality ? (Pivot){low, high, quality} : single;
}

static Pivot choose_pivot(double *a, size_t size, int from, int candidates, double threshold,
                          double smallest) {
    double enough = threshold > GOOD_PIVOT ? threshold : GOOD_PIVOT;
    Pivot best = {from, -1, -1.0};
    for (int t = from; t < candidates; t++) {
        Pivot pivot = judge(a, size, from, candidates, t, smallest);
        if (pivot.quality > best.quality) best = pivot;
        if (best.quality >= enough) break;
    }
    return best;
}

/* Eliminate one pivot at p from the other candidates; leave L in its column. */
static void eliminate_one(double *restrict a, size_t size, int p, int candidates) {
    double *restrict column = a + p * size, inverse = 1.0 / column[p];
    for (int j = p + 1; j < candidates; j++) {
        double factor = column[j] * inverse, *restrict target = a + j * size;
        if (factor == 0.0) continue;
        for (size_t i = j; i < size; i++) target[i] -= column[i] * factor;
    }
    for (size_t i = p + 1; i < size; i++) column[i] *= inverse;
}

/* Eliminate the pivots p and p + 1 together. */
static void eliminate_two(double *restrict a, size_t size, int p, int candidates) {
    double *restrict first = a + p * size, *restrict second = first + size;
    double d11 = first[p], d21 = first[p + 1], d22 = second[p + 1];
    double determinant = (d11 / d21) * d22 - d21; /* over d21 */
    double i11 = d22 / d21 / determinant, i21 = -1.0 / determinant, i22 = d11 / d21 / determinant;
    for (int j = p + 2; j < candidates; j++) {
        double *restrict target = a + j * size;
        double f1 = i11 * first[j] + i21 * second[j], f2 = i21 * first[j] + i22 * second[j];
        if (f1 == 0.0 && f2 == 0.0) continue;
        for (size_t i = j; i < size; i++) target[i] -= first[i] * f1 + second[i] * f2;
    }
    for (size_t i = p + 2; i < size; i++) {
        double l1 = i11 * first[i] + i21 * second[i], l2 = i21 * first[i] + i22 * second[i];
        first[i] = l1;
        second[i] = l2;
    }
}

/* Count the signs of a block of two pivots. */
static int negative_of_two(double d11, double d21, double d22) {
    if ((d11 / d21) * (d22 / d21) < 1.0) return 1;
    return d11 < 0.0 ? 2 : 0;
}

/* Subtract L D L^T of the pivots from the border, four columns of L at a time. */
static void update_border(double *restrict a, size_t size, int eliminated, int candidates,
                          const double *restrict diagonal, const double *restrict below) {
    double weights[4];
    for (int p = 0; p < eliminated; p += 4) {
        int width = eliminated - p < 4 ? eliminated - p : 4;
        const double *restrict l0 = a + p * size, *restrict l1 = l0 + (width > 1 ? size : 0);
        const double *restrict l2 = l0 + (width > 2 ? 2 * size : 0), *restrict l3 = l0 + (width > 3 ? 3 * size : 0);
        for (size_t j = candidates; j < size; j++) {
            double *restrict target = a + j * size;
            for (int w = 0; w < 4; w++) {
                int c = p + w;
                weights[w] = 0.0;
                if (w >= width) continue;
                weights[w] = diagonal[c] * a[j + c * size];
                if (below[c] != 0.0) weights[w] += below[c] * a[j + (c + 1) * size];
                if (c > 0 && below[c - 1] != 0.0) weights[w] += below[c - 1] * a[j + (c - 1) * size];
            }
            double w0 = weights[0], w1 = weights[1], w2 = weights[2], w3 = weights[3];
            for (size_t i = j; i < size; i++)
                target[i] -= l0[i] * w0 + l1[i] * w1 + l2[i] * w2 + l3[i] * w3;
        }
    }
}

/* Eliminate what can be of a front; its columns of L stay where it was assembled, followed by D. */
static void eliminate_front(Factors *factors, Front *front, int candidates, double threshold,
                            double smallest, Inertia *inertia) {
    size_t size = front->size;
    double *a = factors->values.data + factors->values.used;
    double *diagonal = a + size * size, *below = diagonal + size;
    int *unknowns = factors->indices.data + front->unknowns, p = 0;
    while (p < candidates) {
        Pivot pivot = choose_pivot(a, size, p, candidates, threshold, smallest);
        if (pivot.quality < threshold) break;
        exchange(a, size, unknowns, p, pivot.first);
        double *column = a + p * size;
        diagonal[p] = column[p];
        below[p] = 0.0;
        if (pivot.second < 0) {
            inertia->negative += column[p] < 0.0;
            eliminate_one(a, size, p, candidates);
            column[p++] = 1.0;
            continue;
        }
        exchange(a, size, unknowns, p + 1, pivot.second);
        below[p] = column[p + 1];
        diagonal[p + 1] = column[p + 1 + size], below[p + 1] = 0.0;
        inertia->negative += negative_of_two(diagonal[p], below[p], diagonal[p + 1]);
        inertia->two_by_two++;
        eliminate_two(a, size, p, candidates);
        column[p] = 1.0, column[p + 1] = 0.0, column[p + 1 + size] = 1.0;
        p += 2;
    }
    front->eliminated = p;
    inertia->rank += p;
    update_border(a, size, p, candidates, diagonal, below);
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
        inertia->delayed += candidates - eliminated;
        inertia->largest_front = size > inertia->largest_front ? size : inertia->largest_front;
        inertia->entries += (long)eliminated * (2 * size - eliminated + 1) / 2;
        for (int p = 0; p < eliminated; p++) inertia->operations += (long)(size - p) * (size - p + 1) / 2;
    }
    return 1;
}

/* x <- inv(D) inv(L) x for the pivots of one front, and its border's part of the same. */
static void solve_forward(const Factors *factors, const Front *front, double *restrict x,
                          double *restrict part) {
    const int *unknowns = factors->indices.data + front->unknowns;
    const double *restrict l = factors->values.data + front->columns;
    const double *diagonal = factors->values.data + front->diagonal;
    const double *below = factors->values.data + front->below;
    int size = front->size, eliminated = front->eliminated;
    for (int i = 0; i < size; i++) part[i] = x[unknowns[i]];
    for (int c = 0; c < eliminated; c++, l += size) {
        double value = part[c];
        for (int i = c + 1; i < size; i++) part[i] -= l[i] * value;
    }
    for (int p = 0; p < eliminated; p++) {
        if (below[p] == 0.0) {
            part[p] /= diagonal[p];
            continue;
        }
        double d11 = diagonal[p] / below[p], d22 = diagonal[p + 1] / below[p];
        double b1 = part[p] / below[p], b2 = part[p + 1] / below[p], determinant = d11 * d22 - 1.0;
        part[p] = (d22 * b1 - b2) / determinant;
        part[p + 1] = (d11 * b2 - b1) / determinant;
        p++;
    }
    for (int i = 0; i < size; i++) x[unknowns[i]] = part[i];
}

/* x <- inv(L^T) x for the pivots of one front. */
static void solve_backward(const Factors *factors, const Front *front, double *restrict x,
                           double *restrict part) {
    const int *unknowns = factors->indices.data + front->unknowns;
    int size = front->size, eliminated = front->eliminated;
    for (int i = 0; i < size; i++) part[i] = x[unknowns[i]];
    for (int c = eliminated - 1; c >= 0; c--) {
        const double *restrict l = factors->values.data + front->columns + (size_t)c * size;
        double sum = 0.0;
        for (int i = c + 1; i < size; i++) sum += l[i] * part[i];
        part[c] -= sum;
    }
    for (int i = 0; i < eliminated; i++) x[unknowns[i]] = part[i];
}

void solve(const Analysis *analysis, Factors *factors, double *x) {
    int count = analysis->tree->front_count;
    double *part = factors->part;
    const double *scale = factors->scale;
    for (int i = 0; i < analysis->tree->n; i++) x[i] *= scale[i];
    for (int f = 0; f < count; f++) solve_forward(factors, &factors->fronts[f], x, part);
    for (int f = count - 1; f >= 0; f--) solve_backward(factors, &factors->fronts[f], x, part);
    for (int i = 0; i < analysis->tree->n; i++) x[i] *= scale[i];
}
