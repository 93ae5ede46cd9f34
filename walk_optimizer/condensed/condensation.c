/* From the variables of the nodes to the condensed ones of their interval.
 *
 * To first order theta_i = theta_0 + h sum_j A_ij omega_j, and the momentum rate at node i is
 * sum_j D_ij P_j / h with P_j = P(theta_j, omega_j) + what the iterate lacks of it (lifted Newton:
 * [Albersmeyer2010]). All of that is linear, so a node's y is T xi + defect, and its Hessian T' Q T. */
#include <string.h>

#include "condensed.h"

/* The columns of T that are not trivial: rows of the momentum rate, (6, 24) for each node. */
static void rate_columns(const Step *step, int k, double rates[NODES][MOMENTA][PADDED]) {
    double momenta[NODES + 1][MOMENTA][PADDED], h = step->lengths[k];
    memset(momenta, 0, sizeof momenta);
    for (int j = 0; j <= NODES; j++) {
        const double *jacobian = step->momentum_jacobian + MOMENTA * STATE * (NODES * k + j);
        for (int m = 0; m < MOMENTA; m++) {
            const double *by_angle = jacobian + STATE * m, *by_velocity = by_angle + ANGLES;
            double *row = momenta[j][m];
            for (int a = 0; a < ANGLES; a++) row[START + a] = by_angle[a];
            if (j == 0) {
                for (int a = 0; a < ANGLES; a++) row[START + ANGLES + a] = by_velocity[a];
                continue;
            }
            for (int l = 0; l < NODES; l++)
                for (int a = 0; a < ANGLES; a++)
                    row[ANGLES * l + a] = h * step->butcher[j - 1][l] * by_angle[a];
            for (int a = 0; a < ANGLES; a++) row[ANGLES * (j - 1) + a] += by_velocity[a];
        }
    }
    for (int i = 0; i < NODES; i++) {
        for (int m = 0; m < MOMENTA; m++) {
            double *rate = rates[i][m];
            memset(rate, 0, sizeof(double) * PADDED);
            for (int j = 0; j <= NODES; j++) {
                double factor = step->differentiation[i][j] / h;
                for (int c = 0; c < PADDED; c++) rate[c] += factor * momenta[j][m][c];
            }
        }
    }
}

/* Adds factor times a row of y, given at node i, to a vector of condensed variables. */
static inline void add_row(
    const Step *step, double h, int i, int row, double factor, const double rates[MOMENTA][PADDED],
    double *sum) {
    if (row < RATE) {
        add_state_row(step, h, i, row, factor, sum);
    } else if (row < SPRING) {
        const double *rate = rates[row - RATE];
        for (int c = 0; c < PADDED; c++) sum[c] += factor * rate[c];
    } else {
        sum[SHARED + row - SPRING] += factor;
    }
}

/* The Hessian of a node with its torques and the barrier of its inequalities, (16, 16). */
static void point_hessian(const Step *step, int k, int i, double *q) {
    int node = NODES * k + i;
    const double *hessian = step->hessian + POINT * POINT * node;
    const double *jacobian = step->row_jacobian + ROWS * POINT * node;
    const double *forward = step->momentum_jacobian + MOMENTA * STATE * (node + 1);
    double weights[LIMITS], share = step->lengths[k] * step->quadrature[i];
    for (int r = 0; r < LIMITS; r++)
        weights[r] = step->multipliers[LIMITS * node + r] / step->slacks[LIMITS * node + r];
    for (int e = 0; e < POINT * POINT; e++) q[e] = step->curvature_share * hessian[e];
    for (int r = 0; r < ROWS; r++) {
        if (r == PASSIVE) continue;
        double factor = r == GAP ? weights[GAP_LIMIT] : share;
        const double *row = jacobian + POINT * r;
        for (int a = 0; a < POINT; a++)
            for (int b = 0; b < POINT; b++) q[POINT * a + b] += factor * row[a] * row[b];
    }
    for (int a = 0; a < ANGLES; a++) q[POINT * a + a] += weights[a] + weights[ANGLES + a];
    double of_forward = weights[FORWARD_LIMIT] / (step->mass * step->mass);
    for (int a = 0; a < STATE; a++)
        for (int b = 0; b < STATE; b++) q[POINT * a + b] += of_forward * forward[a] * forward[b];
    for (int r = 0; r < CONES; r++)
        for (int a = 0; a < 2; a++)
            for (int b = 0; b < 2; b++)
                q[POINT * (RATE + a) + RATE + b] +=
                    weights[CONE_LIMIT + r] * step->cone[r][a] * step->cone[r][b];
}

static void condense_interval(Step *step, int k) {
    double rates[NODES][MOMENTA][PADDED], h = step->lengths[k];
    double *sum = step->condensed + WIDTH * PADDED * k;
    memset(sum, 0, sizeof(double) * WIDTH * PADDED);
    rate_columns(step, k, rates);
    for (int i = 0; i < NODES; i++) {
        int node = NODES * k + i;
        double q[POINT * POINT], product[POINT][PADDED];
        const double *defect = step->rate_defect + MOMENTA * node;
        point_hessian(step, k, i, q);
        memset(product, 0, sizeof product);
        for (int a = 0; a < POINT; a++) {
            double lost = 0.0;
            for (int b = 0; b < POINT; b++) add_row(step, h, i, b, q[POINT * a + b], rates[i], product[a]);
            for (int m = 0; m < MOMENTA; m++) lost += q[POINT * a + RATE + m] * defect[m];
            step->defect_gradient[POINT * node + a] = lost;
        }
        for (int a = 0; a < POINT; a++) {
            double row[PADDED] = {0.0};
            add_row(step, h, i, a, 1.0, rates[i], row);
            for (int c = 0; c < WIDTH; c++)
                if (row[c] != 0.0)
                    for (int d = 0; d < PADDED; d++) sum[PADDED * c + d] += row[c] * product[a][d];
        }
        double *passive = step->passive_rows + PADDED * node;
        memset(passive, 0, sizeof(double) * PADDED);
        for (int b = 0; b < POINT; b++)
            add_row(
                step, h, i, b, step->row_jacobian[POINT * (ROWS * node + PASSIVE) + b], rates[i], passive);
    }
}

static void condense_part(Step *step, int begin, int end) {
    for (int k = begin; k < end; k++) condense_interval(step, k);
}

/* Condenses Hessians and passive rows; of the Lagrangian's curvature, which may be negative, a share. */
EXPORT void condense(Step *step, double curvature) {
    step->curvature_share = curvature;
    for_all_intervals(step, condense_part);
}
