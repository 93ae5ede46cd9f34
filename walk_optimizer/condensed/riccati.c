/* Riccati recursion over the intervals, from the end of the step to its start.
 *
 * The value of the steps behind a state x is 1/2 (x, p)' V (x, p) in x and the parameters
 * p = (K, q_eq, w), w being the multipliers of the state at the end: there the recursion begins with
 * w' x + penalty / 2 x' x, so that intervals are convex where the whole step is; what the penalty adds
 * is taken off again where the ends are joined. */
#include <math.h>
#include <string.h>

#include "condensed.h"

/* For whoever provides the memory. */
EXPORT const int elimination_bytes = sizeof(Elimination), step_bytes = sizeof(Step);

typedef struct {
    double state[STATE][STATE], mixed[STATE][PARAMETERS], parameters[PARAMETERS][PARAMETERS];
} Value;

/* Adds to columns of `sum` what the state at the end of an interval hands to its variables. */
static inline void hand_back(const Step *step, double h, int row, double factor, double *sum) {
    add_state_row(step, h, NODES - 1, row, factor, sum);
}

/* The Hessian of an interval and of the value behind it, (30, 32). */
static void whole_hessian(
    const Step *step, int k, const Value *value, double whole[WHOLE][WHOLE_PADDED]) {
    double h = step->lengths[k], product[STATE][WHOLE_PADDED];
    memset(whole, 0, sizeof(double) * WHOLE * WHOLE_PADDED);
    for (int a = 0; a < WIDTH; a++)
        memcpy(whole[a], step->condensed + PADDED * (WIDTH * k + a), sizeof(double) * WIDTH);
    memset(product, 0, sizeof product);
    for (int a = 0; a < STATE; a++) {
        for (int b = 0; b < STATE; b++) hand_back(step, h, b, value->state[a][b], product[a]);
        for (int b = 0; b < PARAMETERS; b++) product[a][SHARED + b] += value->mixed[a][b];
    }
    for (int a = 0; a < STATE; a++) {
        double columns[SHARED] = {0.0};
        hand_back(step, h, a, 1.0, columns);
        for (int c = 0; c < SHARED; c++) {
            if (columns[c] == 0.0) continue;
            for (int d = 0; d < WHOLE_PADDED; d++) whole[c][d] += columns[c] * product[a][d];
            for (int b = 0; b < PARAMETERS; b++) whole[SHARED + b][c] += columns[c] * value->mixed[a][b];
        }
    }
    for (int a = 0; a < PARAMETERS; a++)
        for (int b = 0; b < PARAMETERS; b++) whole[SHARED + a][SHARED + b] += value->parameters[a][b];
}

/* Solves the passive rows for three angular velocities, by Gauss-Jordan elimination with complete pivoting.
 * Returns 0 where they depend on each other. */
static int solve_passive_rows(const double *rows, Elimination *kept) {
    double left[NODES][WHOLE_PADDED] = {{0.0}}, right[NODES][NODES] = {{0.0}};
    int used[NODES] = {0}, is_pivot[FREE] = {0};
    for (int r = 0; r < NODES; r++) {
        memcpy(left[r], rows + PADDED * r, sizeof(double) * WIDTH);
        right[r][r] = 1.0;
    }
    for (int turn = 0; turn < NODES; turn++) {
        int row = -1, column = -1;
        double largest = 0.0;
        for (int r = 0; r < NODES; r++)
            for (int c = 0; c < FREE && !used[r]; c++)
                if (!is_pivot[c] && fabs(left[r][c]) > largest)
                    largest = fabs(left[r][c]), row = r, column = c;
        if (row < 0) return 0;
        used[row] = is_pivot[column] = 1;
        kept->pivots[row] = column;
        double inverse = 1.0 / left[row][column];
        for (int c = 0; c < WHOLE_PADDED; c++) left[row][c] *= inverse;
        for (int c = 0; c < NODES; c++) right[row][c] *= inverse;
        for (int r = 0; r < NODES; r++) {
            double factor = left[r][column];
            if (r == row || factor == 0.0) continue;
            for (int c = 0; c < WHOLE_PADDED; c++) left[r][c] -= factor * left[row][c];
            for (int c = 0; c < NODES; c++) right[r][c] -= factor * right[row][c];
        }
    }
    for (int t = 0; t < NODES; t++)
        for (int r = 0; r < NODES; r++) left[t][kept->pivots[r]] = 0.0;
    memcpy(kept->others, left, sizeof left);
    memcpy(kept->inverse, right, sizeof right);
    for (int c = 0, f = 0; c < FREE; c++)
        if (!is_pivot[c]) kept->free[f++] = c;
    return 1;
}

/* Puts -others xi in place of the pivots: whole - N' R - R' N with R = rows of the pivots - 1/2 their own
 * Hessian times N. */
static void substitute_pivots(Elimination *kept, double whole[WHOLE][WHOLE_PADDED]) {
    double rest[NODES][WHOLE_PADDED];
    for (int t = 0; t < NODES; t++) {
        memcpy(kept->pivot_rows[t], whole[kept->pivots[t]], sizeof(double) * WHOLE_PADDED);
        memcpy(rest[t], kept->pivot_rows[t], sizeof rest[t]);
        for (int s = 0; s < NODES; s++) {
            double half = kept->pivot_rows[t][kept->pivots[s]] / 2;
            for (int c = 0; c < WHOLE_PADDED; c++) rest[t][c] -= half * kept->others[s][c];
        }
    }
    for (int t = 0; t < NODES; t++) {
        for (int a = 0; a < WHOLE; a++) {
            double other = kept->others[t][a], own = rest[t][a];
            for (int c = 0; c < WHOLE_PADDED; c++)
                whole[a][c] -= other * rest[t][c] + own * kept->others[t][c];
        }
    }
}

/* Cholesky's factor of the free ones, and what it makes of their rows. Returns 0 where they are not convex. */
static int factor_free(Elimination *kept, double whole[WHOLE][WHOLE_PADDED]) {
    for (int a = 0; a < KEPT; a++) {
        const double *row = whole[kept->free[a]];
        for (int b = 0; b <= a; b++) {
            double sum = row[kept->free[b]];
            for (int c = 0; c < b; c++) sum -= kept->factor[a][c] * kept->factor[b][c];
            if (a > b) {
                kept->factor[a][b] = sum / kept->factor[b][b];
            } else {
                if (!(sum > 0.0)) return 0;
                kept->factor[a][a] = sqrt(sum);
            }
        }
        double *coupling = kept->coupling[a], inverse = 1.0 / kept->factor[a][a];
        memset(coupling, 0, sizeof(double) * BEHIND_PADDED);
        memcpy(coupling, row + START, sizeof(double) * BEHIND);
        for (int c = 0; c < a; c++)
            for (int d = 0; d < BEHIND_PADDED; d++) coupling[d] -= kept->factor[a][c] * kept->coupling[c][d];
        for (int d = 0; d < BEHIND_PADDED; d++) coupling[d] *= inverse;
    }
    return 1;
}

/* The value in front of an interval: what is left of its Hessian once its variables are eliminated. */
static void value_before(const Elimination *kept, double whole[WHOLE][WHOLE_PADDED], Value *value) {
    double left[BEHIND][BEHIND_PADDED];
    memset(left, 0, sizeof left);
    for (int a = 0; a < BEHIND; a++) {
        memcpy(left[a], whole[START + a] + START, sizeof(double) * BEHIND);
        for (int c = 0; c < KEPT; c++)
            for (int d = 0; d < BEHIND_PADDED; d++) left[a][d] -= kept->coupling[c][a] * kept->coupling[c][d];
    }
    for (int a = 0; a < STATE; a++) {
        for (int b = 0; b < STATE; b++) value->state[a][b] = (left[a][b] + left[b][a]) / 2;
        for (int b = 0; b < PARAMETERS; b++) value->mixed[a][b] = left[a][STATE + b];
    }
    for (int a = 0; a < PARAMETERS; a++)
        for (int b = 0; b < PARAMETERS; b++)
            value->parameters[a][b] = (left[STATE + a][STATE + b] + left[STATE + b][STATE + a]) / 2;
}

/* Eliminates all intervals and returns the value of the whole step, (18, 18). The result is 0 where the step
 * is not convex, else 1. */
EXPORT int eliminate(Step *step, double *result) {
    Value value;
    double whole[WHOLE][WHOLE_PADDED];
    memset(&value, 0, sizeof value);
    for (int a = 0; a < STATE; a++) {
        value.state[a][a] = step->penalty;
        value.mixed[a][2 + a] = 1.0;
    }
    for (int k = step->intervals - 1; k >= 0; k--) {
        Elimination *kept = step->eliminations + k;
        whole_hessian(step, k, &value, whole);
        if (!solve_passive_rows(step->passive_rows + PADDED * NODES * k, kept)) return 0;
        substitute_pivots(kept, whole);
        if (!factor_free(kept, whole)) return 0;
        value_before(kept, whole, &value);
    }
    for (int a = 0; a < STATE; a++) {
        memcpy(result + BEHIND * a, value.state[a], sizeof value.state[a]);
        memcpy(result + BEHIND * a + STATE, value.mixed[a], sizeof value.mixed[a]);
        for (int b = 0; b < PARAMETERS; b++) result[BEHIND * (STATE + b) + a] = value.mixed[a][b];
    }
    for (int a = 0; a < PARAMETERS; a++)
        memcpy(result + BEHIND * (STATE + a) + STATE, value.parameters[a], sizeof value.parameters[a]);
    return 1;
}

/* Takes an interval's gradient (22) and what its passive rows lack (3) into account, in front of which
 * the gradient of the value is (18), state and parameters. */
void sweep_back(const Step *step, int k, const double *own, const double *lacking, double *gradient) {
    Elimination *kept = step->eliminations + k;
    double whole[WHOLE_PADDED] = {0.0}, offset[NODES];
    memcpy(whole, own, sizeof(double) * WIDTH);
    for (int a = 0; a < STATE; a++) hand_back(step, step->lengths[k], a, gradient[a], whole);
    for (int a = 0; a < PARAMETERS; a++) whole[SHARED + a] += gradient[STATE + a];
    for (int t = 0; t < NODES; t++) {
        kept->constants[t] = lacking[t];
        kept->gradient[t] = whole[kept->pivots[t]];
    }
    for (int t = 0; t < NODES; t++) {
        offset[t] = 0.0;
        for (int r = 0; r < NODES; r++) offset[t] -= kept->inverse[t][r] * lacking[r];
    }
    for (int t = 0; t < NODES; t++)
        for (int c = 0; c < WHOLE_PADDED; c++) whole[c] += kept->pivot_rows[t][c] * offset[t];
    for (int t = 0; t < NODES; t++) {
        double of_pivot = whole[kept->pivots[t]];
        for (int c = 0; c < WHOLE_PADDED; c++) whole[c] -= kept->others[t][c] * of_pivot;
    }
    for (int a = 0; a < KEPT; a++) {
        double sum = whole[kept->free[a]];
        for (int b = 0; b < a; b++) sum -= kept->factor[a][b] * kept->reduced[b];
        kept->reduced[a] = sum / kept->factor[a][a];
    }
    memcpy(gradient, whole + START, sizeof(double) * BEHIND);
    for (int a = 0; a < KEPT; a++)
        for (int c = 0; c < BEHIND; c++) gradient[c] -= kept->coupling[a][c] * kept->reduced[a];
}

/* Finds an interval's variables, (30), of which state and parameters are given, and the new multipliers of
 * its passive rows. */
void sweep_forward(const Step *step, int k, double *whole, double *multipliers) {
    const Elimination *kept = step->eliminations + k;
    double values[KEPT], of_pivot[NODES];
    for (int a = 0; a < KEPT; a++) {
        values[a] = -kept->reduced[a];
        for (int c = 0; c < BEHIND; c++) values[a] -= kept->coupling[a][c] * whole[START + c];
    }
    for (int a = KEPT - 1; a >= 0; a--) {
        for (int b = a + 1; b < KEPT; b++) values[a] -= kept->factor[b][a] * values[b];
        values[a] /= kept->factor[a][a];
    }
    for (int t = 0; t < NODES; t++) whole[kept->pivots[t]] = 0.0;
    for (int a = 0; a < KEPT; a++) whole[kept->free[a]] = values[a];
    for (int t = 0; t < NODES; t++) {
        of_pivot[t] = 0.0;
        for (int r = 0; r < NODES; r++) of_pivot[t] -= kept->inverse[t][r] * kept->constants[r];
        for (int c = 0; c < WHOLE; c++) of_pivot[t] -= kept->others[t][c] * whole[c];
    }
    for (int t = 0; t < NODES; t++) whole[kept->pivots[t]] = of_pivot[t];
    for (int r = 0; r < NODES; r++) multipliers[r] = 0.0;
    for (int t = 0; t < NODES; t++) {
        double slope = kept->gradient[t];
        for (int c = 0; c < WHOLE; c++) slope += kept->pivot_rows[t][c] * whole[c];
        for (int r = 0; r < NODES; r++) multipliers[r] -= kept->inverse[t][r] * slope;
    }
}
