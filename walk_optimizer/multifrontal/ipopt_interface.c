/* The calls by which IPOPT reaches a direct solver that it loads at run time (option hsllib).
 *
 * IPOPT knows several of them by name. We answer those that it makes to ma97, whose declarations it
 * publishes (src/Algorithm/LinearSolvers/IpMa97SolverInterface.hpp and hsl_ma97d.h). Matrices come as
 * columns of the lower triangle with indices from 1. */
#include <limits.h>
#include <stdlib.h>
#include <string.h>

#include "factorization.h"

#define EXPORTED __attribute__((visibility("default")))

struct ma97_control {
    int f_arrays, action, nemin;
    double multiplier;
    int ordering, print_level, scaling;
    double small, u;
    int unit_diagnostics, unit_error, unit_warning;
    long factor_min;
    int solve_blas3;
    long solve_min;
    int solve_mf;
    double consist_tol;
    int ispare[5];
    double rspare[10];
};

struct ma97_info {
    int flag, flag68, flag77, matrix_dup, matrix_rank, matrix_outrange, matrix_missing_diag, maxdepth;
    int maxfront, num_delay;
    long num_factor, num_flops;
    int num_neg, num_sup, num_two, ordering, stat, maxsupernode;
    int ispare[4];
    double rspare[10];
};

enum { OUT_OF_MEMORY = -1, SINGULAR = -7 };

/* What IPOPT keeps between its calls: one analysis, and the room of its factors. */
typedef struct {
    int n;
    Analysis *analysis;
    Factors *factors;
} Handle;

EXPORTED void ma97_default_control_d(struct ma97_control *control) {
    memset(control, 0, sizeof *control);
    control->f_arrays = 1;
    control->small = 1e-20;
    control->u = 0.01;
}

EXPORTED void ma97_analyse_d(int check, int n, const int ptr[], const int row[], double val[], void **akeep,
                             const struct ma97_control *control, struct ma97_info *info, int order[]) {
    (void)check, (void)val, (void)control, (void)order;
    memset(info, 0, sizeof *info);
    *akeep = NULL;
    Handle *handle = calloc(1, sizeof *handle);
    int *begin = malloc(((size_t)n + 1) * sizeof(int)), *index = malloc((size_t)ptr[n] * sizeof(int));
    if (handle != NULL && begin != NULL && index != NULL) {
        for (int j = 0; j <= n; j++) begin[j] = ptr[j] - 1;
        for (int k = 0; k < begin[n]; k++) index[k] = row[k] - 1;
        handle->n = n;
        handle->analysis = analyse(n, begin, index);
    }
    free(begin), free(index);
    if (handle == NULL || handle->analysis == NULL) {
        free(handle);
        info->flag = OUT_OF_MEMORY;
        return;
    }
    *akeep = handle;
}

EXPORTED void ma97_factor_d(int matrix_type, const int ptr[], const int row[], const double val[],
                            void **akeep, void **fkeep, const struct ma97_control *control,
                            struct ma97_info *info, double scale[]) {
    (void)matrix_type, (void)ptr, (void)row, (void)scale;
    Handle *handle = *akeep;
    Inertia inertia;
    memset(info, 0, sizeof *info);
    *fkeep = NULL;
    if (!factor(handle->analysis, val, control->u, control->small, &handle->factors, &inertia)) {
        info->flag = OUT_OF_MEMORY;
        return;
    }
    info->flag = inertia.rank < handle->n ? SINGULAR : 0;
    info->matrix_rank = inertia.rank;
    info->num_neg = inertia.negative;
    info->num_delay = inertia.delayed;
    info->num_two = inertia.two_by_two;
    info->maxfront = inertia.largest_front;
    info->num_factor = inertia.entries;
    info->num_flops = inertia.operations;
}

EXPORTED void ma97_solve_d(int job, int nrhs, double *x, int ldx, void **akeep, void **fkeep,
                           const struct ma97_control *control, struct ma97_info *info) {
    (void)job, (void)fkeep, (void)control;
    Handle *handle = *akeep;
    info->flag = 0;
    for (int k = 0; k < nrhs; k++) solve(handle->analysis, handle->factors, x + (size_t)k * ldx);
}

EXPORTED void ma97_factor_solve_d(int matrix_type, const int ptr[], const int row[], const double val[],
                                  int nrhs, double x[], int ldx, void **akeep, void **fkeep,
                                  const struct ma97_control *control, struct ma97_info *info,
                                  double scale[]) {
    ma97_factor_d(matrix_type, ptr, row, val, akeep, fkeep, control, info, scale);
    if (info->flag < 0) return;
    struct ma97_info solved;
    ma97_solve_d(0, nrhs, x, ldx, akeep, fkeep, control, &solved);
}

EXPORTED void ma97_free_akeep_d(void **akeep) {
    Handle *handle = *akeep;
    if (handle == NULL) return;
    free_factors(handle->factors);
    free_analysis(handle->analysis);
    free(handle);
    *akeep = NULL;
}

EXPORTED void ma97_finalise_d(void **akeep, void **fkeep) {
    ma97_free_akeep_d(akeep);
    *fkeep = NULL;
}
