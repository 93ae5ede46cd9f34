/* Blocks of one or two pivots are chosen among the candidates as in
 *
 * I. S. Duff, J. K. Reid: The multifrontal solution of indefinite sparse symmetric linear equations.
 * ACM Transactions on Mathematical Software 9 (1983), 302-325. */
#include "dense_front.h"

#include <math.h>

/* A pivot as good as this is taken without looking further. */
#define GOOD_PIVOT 0.01

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

/* Eliminate a chosen block at p; return how many pivots it has. */
static int eliminate_block(const DenseFront *front, int p, Pivot pivot, Elimination *sum) {
    size_t size = front->size;
    double *a = front->a, *column = a + p * size, *diagonal = front->diagonal + p, *below = front->below + p;
    exchange(a, size, front->unknowns, p, pivot.first);
    diagonal[0] = column[p];
    below[0] = 0.0;
    if (pivot.second < 0) {
        sum->negative += column[p] < 0.0;
        eliminate_one(a, size, p, front->candidates);
        column[p] = 1.0;
        return 1;
    }
    exchange(a, size, front->unknowns, p + 1, pivot.second);
    below[0] = column[p + 1];
    diagonal[1] = column[p + 1 + size], below[1] = 0.0;
    sum->negative += negative_of_two(diagonal[0], below[0], diagonal[1]);
    sum->two_by_two++;
    eliminate_two(a, size, p, front->candidates);
    column[p] = 1.0, column[p + 1] = 0.0, column[p + 1 + size] = 1.0;
    return 2;
}

Elimination eliminate_candidates(const DenseFront *front, double threshold, double smallest) {
    Elimination sum = {0, 0, 0};
    while (sum.eliminated < front->candidates) {
        int p = sum.eliminated;
        Pivot pivot = choose_pivot(front->a, front->size, p, front->candidates, threshold, smallest);
        if (pivot.quality < threshold) break;
        sum.eliminated += eliminate_block(front, p, pivot, &sum);
    }
    update_border(front->a, front->size, sum.eliminated, front->candidates, front->diagonal, front->below);
    return sum;
}
