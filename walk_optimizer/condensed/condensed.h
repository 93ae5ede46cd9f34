/* A step in single support on collocation intervals, condensed to the angular velocities at the nodes.
 *
 * Everything is row-major. An interval has three nodes; a node has the unknowns
 *
 *     y = (theta 4, omega 4, momentum rate 6, K and q_eq 2),
 *
 * its five rows are u1, u2, u3, the row that no torque acts on, and the gap of the swing foot; its thirteen
 * inequalities are lower and upper bounds of theta, the gap, both sides of the friction cone, the load, and
 * the forward momentum.
 * An interval's condensed variables are
 *
 *     xi = (omega at its nodes 12, theta and omega at its start 8, K and q_eq 2),
 *
 * followed, where it matters, by the eight multipliers of the state at the end of the step. */
#ifndef CONDENSED_H
#define CONDENSED_H

/* What Python calls; all else is hidden. */
#define EXPORT __attribute__((visibility("default")))

enum {
    NODES = 3,
    ANGLES = 4,
    STATE = 8,
    MOMENTA = 6,
    POINT = 16,
    RATE = 8,    /* where the momentum rate begins in y */
    SPRING = 14, /* where K and q_eq begin in y */
    ROWS = 5,
    TORQUES = 3,
    PASSIVE = 3, /* the row without a torque */
    GAP = 4,
    LIMITS = 13,
    GAP_LIMIT = 8,
    CONE_LIMIT = 9,
    FORWARD_LIMIT = 12,
    CONES = 3,
    FREE = 12,       /* condensed variables of an interval: angular velocities */
    START = 12,      /* where its initial state begins in xi */
    SHARED = 20,     /* where K and q_eq begin in xi */
    WIDTH = 22,      /* of xi */
    PADDED = 24,
    PARAMETERS = 10, /* K, q_eq, and the multipliers of the state at the end */
    WHOLE = 30,      /* WIDTH and those multipliers */
    WHOLE_PADDED = 32,
    KEPT = 9,        /* angular velocities that the passive rows leave free */
    BEHIND = 18,     /* state and parameters */
    BEHIND_PADDED = 24
};

/* A function that CasADi made of scalar expressions: it needs no work space. */
typedef int (*Generated)(const double **arguments, double **results, long long *iw, double *w, int memory);

/* What is kept of an interval's elimination. */
typedef struct {
    int pivots[NODES], free[KEPT];
    double inverse[NODES][NODES];            /* of the passive rows in the pivots */
    double others[NODES][WHOLE_PADDED];      /* pivots = -others xi - inverse rows */
    double pivot_rows[NODES][WHOLE_PADDED];  /* of the Hessian, the future added */
    double factor[KEPT][KEPT];               /* Cholesky, lower */
    double coupling[KEPT][BEHIND_PADDED];    /* factor^-1 times the rows of the free ones */
    double constants[NODES], gradient[NODES]; /* of the last right-hand side: passive rows, pivots */
    double reduced[KEPT];                    /* factor^-1 times the gradient of the free ones */
} Elimination;

/* The problem, the iterate, what is evaluated there, and the last direction. Nodes are counted through. */
typedef struct {
    int intervals, threads;
    Generated momentum, point, curvature;
    const double *walker;        /* parameters of the generated functions */
    const double *lengths;       /* of the intervals in [s] */
    double differentiation[NODES][NODES + 1], butcher[NODES][NODES], quadrature[NODES];
    double lower[ANGLES], upper[ANGLES];
    double cone[CONES][2], cone_least[CONES], weight, mass;
    double penalty;              /* on the state at the end, see eliminate() */
    double curvature_share;      /* of the Lagrangian's Hessian, see condense() */
    /* The iterate. */
    const double *start;         /* theta, omega (8) */
    const double *omega;         /* (nodes, 4) */
    const double *momenta;       /* at the start and the nodes, (1 + nodes, 6) */
    const double *torques;       /* (nodes, 3) */
    const double *passive;       /* multipliers of the passive rows, (nodes) */
    const double *springs;       /* K, q_eq */
    const double *slacks;        /* (nodes, 13) */
    const double *multipliers;   /* (nodes, 13) */
    /* Evaluated there. */
    double *y;                   /* (nodes, 16) */
    double *true_momenta;        /* (1 + nodes, 6) */
    double *momentum_jacobian;   /* (1 + nodes, 6, 8) */
    double *rows;                /* (nodes, 5) */
    double *row_jacobian;        /* (nodes, 5, 16) */
    double *limits;              /* (nodes, 13) */
    double *rate_defect;         /* (nodes, 6) */
    double *momentum_multipliers; /* (1 + nodes, 6) */
    double *hessian;             /* (nodes, 16, 16) */
    double *start_hessian;       /* (8, 8) */
    /* Condensed. */
    double *condensed;           /* (intervals, 22, 24) */
    double *passive_rows;        /* (intervals, 3, 24) */
    double *defect_gradient;     /* (nodes, 16): Hessian times the defect */
    Elimination *eliminations;
    /* The last direction. */
    double *step_omega, *step_momenta, *step_torques, *new_passive, *step_slacks, *step_multipliers;
} Step;

/* Evaluates one range of intervals. */
typedef void (*Part)(Step *step, int begin, int end);

/* The derivative at node i of the polynomial through values (., 6) at the start and the nodes. */
void differentiate(const Step *step, int k, int i, const double *values, double *rate);

/* Adds factor times theta or omega (row) at node i of an interval of length h to a vector of condensed
 * variables: theta_i = theta_0 + h sum_j A_ij omega_j. */
static inline void add_state_row(const Step *step, double h, int i, int row, double factor, double *sum) {
    if (row < ANGLES) {
        sum[START + row] += factor;
        for (int j = 0; j < NODES; j++) sum[ANGLES * j + row] += h * step->butcher[i][j] * factor;
    } else {
        sum[ANGLES * i + row - ANGLES] += factor;
    }
}

/* Runs a part for all intervals, on as many threads as the step may use. */
void for_all_intervals(Step *step, Part part);

#endif
