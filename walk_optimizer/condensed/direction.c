/* Newton directions of the interior-point method, once the intervals are eliminated. */
#include <string.h>

#include "condensed.h"

void sweep_back(const Step *step, int k, const double *own, const double *lacking, double *gradient);
void sweep_forward(const Step *step, int k, double *whole, double *multipliers);

/* The multiplier that an inequality has after a full step in which its value does not change. */
static double held_multiplier(const Step *step, int entry, double target) {
    double slack = step->slacks[entry], excess = step->limits[entry] - slack;
    return (target - step->multipliers[entry] * excess) / slack;
}

/* The gradient of a node in y, (16). */
static void point_gradient(const Step *step, int k, int i, const double *targets, double *gradient) {
    int node = NODES * k + i, first = LIMITS * node;
    const double *jacobian = step->row_jacobian + ROWS * POINT * node;
    const double *forward = step->momentum_jacobian + MOMENTA * STATE * (node + 1);
    double share = step->lengths[k] * step->quadrature[i], held[LIMITS];
    for (int r = 0; r < LIMITS; r++) held[r] = held_multiplier(step, first + r, targets[first + r]);
    memcpy(gradient, step->defect_gradient + POINT * node, sizeof(double) * POINT);
    for (int r = 0; r < ROWS; r++) {
        if (r == PASSIVE) continue;
        double factor = r == GAP ? -held[GAP_LIMIT] : share * step->rows[ROWS * node + r];
        for (int a = 0; a < POINT; a++) gradient[a] += factor * jacobian[POINT * r + a];
    }
    for (int a = 0; a < ANGLES; a++) gradient[a] += held[ANGLES + a] - held[a];
    for (int a = 0; a < STATE; a++) gradient[a] -= held[FORWARD_LIMIT] / step->mass * forward[a];
    for (int r = 0; r < CONES; r++)
        for (int a = 0; a < 2; a++) gradient[RATE + a] -= held[CONE_LIMIT + r] * step->cone[r][a];
}

/* The gradient of an interval in its condensed variables, (22): T' times those of its nodes. */
static void interval_gradient(const Step *step, int k, const double *targets, double *sum) {
    double of_momenta[NODES + 1][MOMENTA] = {{0.0}}, of_points[NODES][POINT], h = step->lengths[k];
    memset(sum, 0, sizeof(double) * WIDTH);
    for (int i = 0; i < NODES; i++) {
        point_gradient(step, k, i, targets, of_points[i]);
        for (int j = 0; j <= NODES; j++)
            for (int m = 0; m < MOMENTA; m++)
                of_momenta[j][m] += step->differentiation[i][j] / h * of_points[i][RATE + m];
        for (int s = 0; s < 2; s++) sum[SHARED + s] += of_points[i][SPRING + s];
    }
    for (int j = 0; j <= NODES; j++) {
        const double *jacobian = step->momentum_jacobian + MOMENTA * STATE * (NODES * k + j);
        double of_state[STATE] = {0.0};
        for (int m = 0; m < MOMENTA; m++)
            for (int a = 0; a < STATE; a++) of_state[a] += jacobian[STATE * m + a] * of_momenta[j][m];
        if (j == 0) {
            for (int a = 0; a < STATE; a++) sum[START + a] += of_state[a];
            continue;
        }
        for (int a = 0; a < ANGLES; a++) {
            double of_angle = of_state[a] + of_points[j - 1][a];
            sum[START + a] += of_angle;
            for (int l = 0; l < NODES; l++) sum[ANGLES * l + a] += h * step->butcher[j - 1][l] * of_angle;
            sum[ANGLES * (j - 1) + a] += of_state[ANGLES + a] + of_points[j - 1][ANGLES + a];
        }
    }
}

/* Returns the gradient of the value of the whole step, (18), for products of slacks and multipliers that
 * are wanted, (nodes, 13). */
EXPORT void gather(Step *step, const double *targets, double *gradient) {
    memset(gradient, 0, sizeof(double) * BEHIND);
    for (int k = step->intervals - 1; k >= 0; k--) {
        double own[WIDTH], lacking[NODES];
        interval_gradient(step, k, targets, own);
        for (int i = 0; i < NODES; i++) {
            int node = NODES * k + i;
            const double *row = step->row_jacobian + POINT * (ROWS * node + PASSIVE) + RATE;
            lacking[i] = step->rows[ROWS * node + PASSIVE];
            for (int m = 0; m < MOMENTA; m++) lacking[i] += row[m] * step->rate_defect[MOMENTA * node + m];
        }
        sweep_back(step, k, own, lacking, gradient);
    }
}

static void step_momentum(Step *step, int node, const double *change) {
    const double *jacobian = step->momentum_jacobian + MOMENTA * STATE * node;
    for (int m = 0; m < MOMENTA; m++) {
        int entry = MOMENTA * node + m;
        double sum = step->true_momenta[entry] - step->momenta[entry];
        for (int a = 0; a < STATE; a++) sum += jacobian[STATE * m + a] * change[a];
        step->step_momenta[entry] = sum;
    }
}

/* What a change of y does to a node's torques, slacks and multipliers. */
static void step_point(Step *step, int node, const double *change, const double *targets) {
    const double *jacobian = step->row_jacobian + ROWS * POINT * node;
    double of_rows[ROWS], of_limits[LIMITS];
    for (int r = 0; r < ROWS; r++) {
        of_rows[r] = 0.0;
        for (int a = 0; a < POINT; a++) of_rows[r] += jacobian[POINT * r + a] * change[a];
    }
    for (int r = 0; r < TORQUES; r++)
        step->step_torques[TORQUES * node + r] =
            of_rows[r] + step->rows[ROWS * node + r] - step->torques[TORQUES * node + r];
    for (int a = 0; a < ANGLES; a++) {
        of_limits[a] = change[a];
        of_limits[ANGLES + a] = -change[a];
    }
    of_limits[GAP_LIMIT] = of_rows[GAP];
    for (int r = 0; r < CONES; r++)
        of_limits[CONE_LIMIT + r] = step->cone[r][0] * change[RATE] + step->cone[r][1] * change[RATE + 1];
    of_limits[FORWARD_LIMIT] = 0.0;
    for (int a = 0; a < STATE; a++)
        of_limits[FORWARD_LIMIT] += step->momentum_jacobian[MOMENTA * STATE * (node + 1) + a] * change[a];
    of_limits[FORWARD_LIMIT] /= step->mass;
    for (int r = 0; r < LIMITS; r++) {
        int entry = LIMITS * node + r;
        double slack = step->slacks[entry], multiplier = step->multipliers[entry];
        double of_slack = step->limits[entry] - slack + of_limits[r];
        step->step_slacks[entry] = of_slack;
        step->step_multipliers[entry] = (targets[entry] - multiplier * of_slack) / slack - multiplier;
    }
}

/* Finds the whole direction, after gather() with the same targets.
 *
 * `ends` are the changes of the state at the start (8) and the parameters (10): K, q_eq, w. */
EXPORT void spread(Step *step, const double *ends, const double *targets) {
    double state[STATE], whole[WHOLE_PADDED];
    memcpy(state, ends, sizeof state);
    step_momentum(step, 0, state);
    for (int k = 0; k < step->intervals; k++) {
        double h = step->lengths[k], changes[NODES][POINT];
        memset(whole, 0, sizeof whole);
        memcpy(whole + START, state, sizeof state);
        memcpy(whole + SHARED, ends + STATE, sizeof(double) * PARAMETERS);
        sweep_forward(step, k, whole, step->new_passive + NODES * k);
        memcpy(step->step_omega + FREE * k, whole, sizeof(double) * FREE);
        for (int i = 0; i < NODES; i++) {
            for (int a = 0; a < ANGLES; a++) {
                double sum = 0.0;
                for (int j = 0; j < NODES; j++) sum += step->butcher[i][j] * whole[ANGLES * j + a];
                changes[i][a] = state[a] + h * sum;
                changes[i][ANGLES + a] = whole[ANGLES * i + a];
            }
            step_momentum(step, NODES * k + i + 1, changes[i]);
            memcpy(changes[i] + SPRING, ends + STATE, sizeof(double) * 2);
        }
        for (int i = 0; i < NODES; i++) {
            differentiate(step, k, i, step->step_momenta, changes[i] + RATE);
            step_point(step, NODES * k + i, changes[i], targets);
        }
        memcpy(state, changes[NODES - 1], sizeof state);
    }
}
