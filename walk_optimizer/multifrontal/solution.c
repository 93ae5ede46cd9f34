/* Forward and backward substitution, front by front. */
#include <stddef.h>

#include "factors.h"

/* x <- inv(D) inv(L) x for the pivots of one front, and its border's part of the same. */
static void solve_forward(const Workspace *of, const Front *front, double *restrict x,
                          double *restrict piece) {
    const int *unknowns = of->indices.data + front->unknowns;
    const double *restrict l = of->values.data + front->columns;
    const double *diagonal = of->values.data + front->diagonal;
    const double *below = of->values.data + front->below;
    int size = front->size, eliminated = front->eliminated;
    for (int i = 0; i < size; i++) piece[i] = x[unknowns[i]];
    for (int c = 0; c < eliminated; c++, l += size) {
        double value = piece[c];
        for (int i = c + 1; i < size; i++) piece[i] -= l[i] * value;
    }
    for (int p = 0; p < eliminated; p++) {
        if (below[p] == 0.0) {
            piece[p] /= diagonal[p];
            continue;
        }
        double d11 = diagonal[p] / below[p], d22 = diagonal[p + 1] / below[p];
        double b1 = piece[p] / below[p], b2 = piece[p + 1] / below[p], determinant = d11 * d22 - 1.0;
        piece[p] = (d22 * b1 - b2) / determinant;
        piece[p + 1] = (d11 * b2 - b1) / determinant;
        p++;
    }
    for (int i = 0; i < size; i++) x[unknowns[i]] = piece[i];
}

/* x <- inv(L^T) x for the pivots of one front. */
static void solve_backward(const Workspace *of, const Front *front, double *restrict x,
                           double *restrict piece) {
    const int *unknowns = of->indices.data + front->unknowns;
    int size = front->size, eliminated = front->eliminated;
    for (int i = 0; i < size; i++) piece[i] = x[unknowns[i]];
    for (int c = eliminated - 1; c >= 0; c--) {
        const double *restrict l = of->values.data + front->columns + (size_t)c * size;
        double sum = 0.0;
        for (int i = c + 1; i < size; i++) sum += l[i] * piece[i];
        piece[c] -= sum;
    }
    for (int i = 0; i < eliminated; i++) x[unknowns[i]] = piece[i];
}

void solve(const Analysis *analysis, Factors *factors, double *x) {
    int count = analysis->tree->front_count;
    const int *part_of = analysis->part_of;
    const double *scale = factors->scale;
    for (int i = 0; i < analysis->tree->n; i++) x[i] *= scale[i];
    for (int f = 0; f < count; f++)
        solve_forward(&factors->parts[part_of[f]], &factors->fronts[f], x, factors->piece);
    for (int f = count - 1; f >= 0; f--)
        solve_backward(&factors->parts[part_of[f]], &factors->fronts[f], x, factors->piece);
    for (int i = 0; i < analysis->tree->n; i++) x[i] *= scale[i];
}
