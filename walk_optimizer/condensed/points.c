/* Values and derivatives at the nodes: the generated functions, called node by node. */
#include <string.h>

#include "condensed.h"

static void evaluate_momentum(Step *step, const double *state, int node) {
    const double *arguments[] = {state, step->walker};
    double *results[] = {
        step->true_momenta + MOMENTA * node, step->momentum_jacobian + MOMENTA * STATE * node};
    step->momentum(arguments, results, NULL, NULL, 0);
}

/* theta_i = theta_0 + h sum_j A_ij omega_j; theta at the end of the interval is its last. */
static void place_angles(Step *step) {
    const double *before = step->start;
    for (int k = 0; k < step->intervals; k++) {
        for (int i = 0; i < NODES; i++) {
            double *y = step->y + POINT * (NODES * k + i);
            for (int a = 0; a < ANGLES; a++) {
                double sum = 0.0;
                for (int j = 0; j < NODES; j++)
                    sum += step->butcher[i][j] * step->omega[ANGLES * (NODES * k + j) + a];
                y[a] = before[a] + step->lengths[k] * sum;
                y[ANGLES + a] = step->omega[ANGLES * (NODES * k + i) + a];
            }
            y[SPRING] = step->springs[0];
            y[SPRING + 1] = step->springs[1];
        }
        before = step->y + POINT * (NODES * k + NODES - 1);
    }
}

void differentiate(const Step *step, int k, int i, const double *values, double *rate) {
    for (int m = 0; m < MOMENTA; m++) {
        double sum = 0.0;
        for (int j = 0; j <= NODES; j++)
            sum += step->differentiation[i][j] * values[MOMENTA * (NODES * k + j) + m];
        rate[m] = sum / step->lengths[k];
    }
}

static void limit_values(const Step *step, int node) {
    const double *y = step->y + POINT * node;
    double *limits = step->limits + LIMITS * node;
    double force[2] = {y[RATE], y[RATE + 1] + step->weight};
    for (int a = 0; a < ANGLES; a++) {
        limits[a] = y[a] - step->lower[a];
        limits[ANGLES + a] = step->upper[a] - y[a];
    }
    limits[GAP_LIMIT] = step->rows[ROWS * node + GAP];
    for (int r = 0; r < CONES; r++)
        limits[CONE_LIMIT + r] =
            step->cone[r][0] * force[0] + step->cone[r][1] * force[1] - step->cone_least[r];
    limits[FORWARD_LIMIT] = step->true_momenta[MOMENTA * (node + 1)] / step->mass;
}

static void evaluate_momenta(Step *step, int begin, int end) {
    for (int node = NODES * begin; node < NODES * end; node++)
        evaluate_momentum(step, step->y + POINT * node, node + 1);
}

static void evaluate_rows(Step *step, int begin, int end) {
    for (int k = begin; k < end; k++) {
        for (int i = 0; i < NODES; i++) {
            int node = NODES * k + i;
            double *y = step->y + POINT * node, at_true[MOMENTA];
            differentiate(step, k, i, step->momenta, y + RATE);
            differentiate(step, k, i, step->true_momenta, at_true);
            for (int m = 0; m < MOMENTA; m++)
                step->rate_defect[MOMENTA * node + m] = at_true[m] - y[RATE + m];
            const double *arguments[] = {y, step->walker};
            double *results[] = {step->rows + ROWS * node, step->row_jacobian + ROWS * POINT * node};
            step->point(arguments, results, NULL, NULL, 0);
            limit_values(step, node);
        }
    }
}

/* Evaluates momenta; those of the iterate may then be set to them. */
EXPORT void evaluate_states(Step *step) {
    place_angles(step);
    evaluate_momentum(step, step->start, 0);
    for_all_intervals(step, evaluate_momenta);
}

/* Evaluates rows, limits and their derivatives, after evaluate_states(). */
EXPORT void evaluate_points(Step *step) { for_all_intervals(step, evaluate_rows); }

/* The multipliers of a node's rows: the torques' are those that make them stationary. */
static void row_multipliers(const Step *step, int k, int i, double *multipliers) {
    int node = NODES * k + i;
    double share = step->lengths[k] * step->quadrature[i];
    for (int r = 0; r < TORQUES; r++) multipliers[r] = share * step->torques[TORQUES * node + r];
    multipliers[PASSIVE] = step->passive[node];
    multipliers[GAP] = -step->multipliers[LIMITS * node + GAP_LIMIT];
}

/* Momenta enter through their rates alone, and linearly: that gives the multipliers of what they are. */
static void find_momentum_multipliers(Step *step) {
    int nodes = NODES * step->intervals;
    memset(step->momentum_multipliers, 0, sizeof(double) * MOMENTA * (nodes + 1));
    for (int k = 0; k < step->intervals; k++) {
        for (int i = 0; i < NODES; i++) {
            int node = NODES * k + i;
            const double *jacobian = step->row_jacobian + ROWS * POINT * node;
            double of_rows[ROWS], of_rate[MOMENTA];
            row_multipliers(step, k, i, of_rows);
            for (int m = 0; m < MOMENTA; m++) {
                of_rate[m] = 0.0;
                for (int r = 0; r < GAP; r++) of_rate[m] += of_rows[r] * jacobian[POINT * r + RATE + m];
            }
            for (int r = 0; r < CONES; r++)
                for (int m = 0; m < 2; m++)
                    of_rate[m] -= step->multipliers[LIMITS * node + CONE_LIMIT + r] * step->cone[r][m];
            for (int j = 0; j <= NODES; j++) {
                double factor = step->differentiation[i][j] / step->lengths[k];
                double *sum = step->momentum_multipliers + MOMENTA * (NODES * k + j);
                for (int m = 0; m < MOMENTA; m++) sum[m] += factor * of_rate[m];
            }
        }
    }
}

static void evaluate_hessians(Step *step, int begin, int end) {
    double multipliers[ROWS], of_momenta[MOMENTA];
    for (int k = begin; k < end; k++) {
        for (int i = 0; i < NODES; i++) {
            int node = NODES * k + i;
            row_multipliers(step, k, i, multipliers);
            memcpy(of_momenta, step->momentum_multipliers + MOMENTA * (node + 1), sizeof of_momenta);
            of_momenta[0] -= step->multipliers[LIMITS * node + FORWARD_LIMIT] / step->mass;
            const double *arguments[] = {step->y + POINT * node, multipliers, of_momenta, step->walker};
            double *results[] = {step->hessian + POINT * POINT * node};
            step->curvature(arguments, results, NULL, NULL, 0);
        }
    }
}

/* Evaluates the Hessians of the Lagrangian, after evaluate_points(). */
EXPORT void evaluate_curvature(Step *step) {
    double y[POINT] = {0.0}, none[ROWS] = {0.0}, whole[POINT * POINT];
    find_momentum_multipliers(step);
    for_all_intervals(step, evaluate_hessians);
    memcpy(y, step->start, sizeof(double) * STATE);
    const double *arguments[] = {y, none, step->momentum_multipliers, step->walker};
    double *results[] = {whole};
    step->curvature(arguments, results, NULL, NULL, 0);
    for (int a = 0; a < STATE; a++)
        memcpy(step->start_hessian + STATE * a, whole + POINT * a, sizeof(double) * STATE);
}
