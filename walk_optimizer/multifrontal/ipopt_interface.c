/* The calls by which IPOPT reaches a direct solver that it loads at run time (option hsllib).
 *
 * IPOPT knows several of them by name. We answer those that it makes to ma97, whose declarations it
 * publishes (src/Algorithm/LinearSolvers/IpMa97SolverInterface.hpp and hsl_ma97d.h). Matrices come as
 * columns of the lower triangle with indices from 1. */
#include <pthread.h>
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

/* What IPOPT keeps between its calls: one pattern and its analysis, and the room of its factors. */
typedef struct {
    int n;
    int *begin, *index; /* columns of the lower triangle, zero-based */
    Analysis *analysis;
    Factors *factors;
} Handle;

/* IPOPT analyses its matrix anew in every solve, but a search solves a few patterns many times. Those used
 * last are kept, the newest first. */
#define KEPT 4
static Handle *kept[KEPT];
static pthread_mutex_t kept_lock = PTHREAD_MUTEX_INITIALIZER;

static void free_handle(Handle *handle) {
    if (handle == NULL) return;
    free_factors(handle->factors);
    free_analysis(handle->analysis);
    free(handle->begin), free(handle->index), free(handle);
}

static int same_pattern(const Handle *handle, int n, const int *ptr, const int *row) {
    if (handle == NULL || handle->n != n) return 0;
    for (int j = 0; j <= n; j++)
        if (handle->begin[j] != ptr[j] - 1) return 0;
    for (int k = 0; k < handle->begin[n]; k++)
        if (handle->index[k] != row[k] - 1) return 0;
    return 1;
}

/* Take the handle of a pattern out of those that are kept; NULL for none. */
static Handle *take(int n, const int *ptr, const int *row) {
    Handle *found = NULL;
    pthread_mutex_lock(&kept_lock);
    for (int k = 0; k < KEPT && found == NULL; k++) {
        if (!same_pattern(kept[k], n, ptr, row)) continue;
        found = kept[k];
        memmove(kept + k, kept + k + 1, (KEPT - 1 - k) * sizeof *kept);
        kept[KEPT - 1] = NULL;
    }
    pthread_mutex_unlock(&kept_lock);
    /* The same solve must not depend on those before it. */
    if (found != NULL && found->factors != NULL) forget(found->analysis, found->factors);
    return found;
}

static void keep(Handle *handle) {
    pthread_mutex_lock(&kept_lock);
    Handle *oldest = kept[KEPT - 1];
    memmove(kept + 1, kept, (KEPT - 1) * sizeof *kept);
    kept[0] = handle;
    pthread_mutex_unlock(&kept_lock);
    free_handle(oldest);
}

static Handle *new_handle(int n, const int *ptr, const int *row) {
    Handle *handle = calloc(1, sizeof *handle);
    if (handle == NULL) return NULL;
    handle->n = n;
    handle->begin = malloc(((size_t)n + 1) * sizeof(int));
    handle->index = malloc((size_t)ptr[n] * sizeof(int));
    if (handle->begin != NULL && handle->index != NULL) {
        for (int j = 0; j <= n; j++) handle->begin[j] = ptr[j] - 1;
        for (int k = 0; k < ptr[n] - 1; k++) handle->index[k] = row[k] - 1;
        handle->analysis = analyse(n, handle->begin, handle->index);
    }
    if (handle->analysis != NULL) return handle;
    free_handle(handle);
    return NULL;
}

/* Set by the program before a solve; IPOPT knows nothing of it. */
static int threads = 1;

EXPORTED void use_threads(int count) { threads = count; }

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
    Handle *handle = take(n, ptr, row);
    *akeep = handle != NULL ? handle : new_handle(n, ptr, row);
    if (*akeep == NULL) info->flag = OUT_OF_MEMORY;
}

EXPORTED void ma97_factor_d(int matrix_type, const int ptr[], const int row[], const double val[],
                            void **akeep, void **fkeep, const struct ma97_control *control,
                            struct ma97_info *info, double scale[]) {
    (void)matrix_type, (void)ptr, (void)row, (void)scale;
    Handle *handle = *akeep;
    Inertia inertia;
    memset(info, 0, sizeof *info);
    *fkeep = NULL;
    if (!factor(handle->analysis, val, control->u, control->small, threads, &handle->factors, &inertia)) {
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
    if (*akeep != NULL) keep(*akeep);
    *akeep = NULL;
}

EXPORTED void ma97_finalise_d(void **akeep, void **fkeep) {
    ma97_free_akeep_d(akeep);
    *fkeep = NULL;
}
