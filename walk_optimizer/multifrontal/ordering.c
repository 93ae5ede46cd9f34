/* Approximate minimum degree on a quotient graph.
 *
 * P. R. Amestoy, T. A. Davis, I. S. Duff: An approximate minimum degree ordering algorithm.
 * SIAM Journal on Matrix Analysis and Applications 17 (1996), 886-905.
 *
 * Eliminating a variable makes its neighbours a clique. The quotient graph keeps such a clique as an
 * "element", a list of its variables, so it never grows. Variables that have the same neighbours are
 * merged into one "supervariable" and eliminated together. Unknowns that touch a great part of the
 * matrix (parameters shared by all stages) are put last from the beginning. */
#include "ordering.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum State { VARIABLE, MERGED, ELEMENT, ABSORBED, DENSE };

/* The quotient graph. Lists of node i: first its elements, then its variables, in place of the
 * neighbours that it had at the beginning, which are never fewer. */
typedef struct {
    int n;
    int *state;
    int *list_begin;     /* [n] into lists */
    int *lists;          /* neighbours */
    int *element_count;  /* [n] elements in the list of a variable */
    int *variable_count; /* [n] variables in the list of a variable */
    int *weight;         /* [n] unknowns in a supervariable, 0 for one that is merged */
    int *degree;         /* [n] approximate external degree */
    int *parent;         /* [n] element that absorbed an element, -1 for none */
    int **members;       /* [n] variables of an element */
    int *member_count;   /* [n] */
    int *next_in_merged; /* [n] chain of the unknowns of a supervariable */
    int *last_in_merged; /* [n] */
    int *bucket;         /* [n + 1] first variable of a degree */
    int *next, *previous; /* [n] within a bucket */
    int *mark;           /* [n] */
    int *outside;        /* [n] weight of an element outside of the new one */
    int stamp;
    int smallest_degree;
} Graph;

static void unlink_degree(Graph *g, int i) {
    int before = g->previous[i], after = g->next[i];
    if (before >= 0) g->next[before] = after;
    else g->bucket[g->degree[i]] = after;
    if (after >= 0) g->previous[after] = before;
}

static void link_degree(Graph *g, int i) {
    int d = g->degree[i], first = g->bucket[d];
    g->previous[i] = -1;
    g->next[i] = first;
    if (first >= 0) g->previous[first] = i;
    g->bucket[d] = i;
    if (d < g->smallest_degree) g->smallest_degree = d;
}

static void free_graph(Graph *g) {
    if (g->members != NULL)
        for (int i = 0; i < g->n; i++) free(g->members[i]);
    int *arrays[] = {g->state, g->list_begin, g->lists, g->element_count, g->variable_count, g->weight,
                     g->degree, g->parent, g->member_count, g->next_in_merged, g->last_in_merged, g->bucket, g->next,
                     g->previous, g->mark, g->outside};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) free(arrays[k]);
    free(g->members);
}

static int *integers(size_t count) { return malloc((count + 1) * sizeof(int)); }

static int allocate_graph(Graph *g, int n, int entries) {
    memset(g, 0, sizeof *g);
    g->n = n;
    int **arrays[] = {&g->state, &g->list_begin, &g->element_count, &g->variable_count, &g->weight,
                      &g->degree, &g->parent, &g->member_count, &g->next_in_merged, &g->last_in_merged, &g->bucket,
                      &g->next, &g->previous, &g->mark, &g->outside};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        if ((*arrays[k] = integers(n)) == NULL) return 0;
    g->lists = integers(2 * (size_t)entries);
    g->members = calloc((size_t)n + 1, sizeof(int *));
    return g->lists != NULL && g->members != NULL;
}

/* Unknowns of a list of supervariables. */
static int count_unknowns(const Graph *g, const int *members, int count) {
    int total = 0;
    for (int m = 0; m < count; m++) total += g->weight[members[m]];
    return total;
}

/* Fill in the neighbours; unknowns with too many of them become DENSE and are left out. */
static void build_graph(Graph *g, const int *begin, const int *index) {
    int n = g->n, *count = g->outside;
    memset(count, 0, n * sizeof(int));
    for (int j = 0; j < n; j++)
        for (int k = begin[j]; k < begin[j + 1]; k++)
            if (index[k] != j) count[j]++, count[index[k]]++;
    int most = (int)fmax(64.0, 10.0 * sqrt((double)n)), total = 0;
    for (int i = 0; i < n; i++) {
        g->state[i] = count[i] > most ? DENSE : VARIABLE;
        g->list_begin[i] = total;
        total += count[i];
        g->element_count[i] = g->variable_count[i] = g->member_count[i] = g->mark[i] = 0;
        g->weight[i] = 1;
        g->parent[i] = -1;
        g->next_in_merged[i] = -1;
        g->last_in_merged[i] = i;
    }
    for (int j = 0; j < n; j++)
        for (int k = begin[j]; k < begin[j + 1]; k++) {
            int i = index[k];
            if (i == j || g->state[i] == DENSE || g->state[j] == DENSE) continue;
            g->lists[g->list_begin[i] + g->variable_count[i]++] = j;
            g->lists[g->list_begin[j] + g->variable_count[j]++] = i;
        }
    g->stamp = 0;
    g->smallest_degree = n;
    for (int d = 0; d <= n; d++) g->bucket[d] = -1;
    for (int i = n - 1; i >= 0; i--) {
        if (g->state[i] != VARIABLE) continue;
        g->degree[i] = g->variable_count[i];
        link_degree(g, i);
    }
}

static int next_pivot(Graph *g) {
    while (g->bucket[g->smallest_degree] < 0) g->smallest_degree++;
    return g->bucket[g->smallest_degree];
}

static void absorb(Graph *g, int e, int by) {
    g->state[e] = ABSORBED;
    g->parent[e] = by;
    free(g->members[e]);
    g->members[e] = NULL;
}

/* Make variable p an element: the union of its variables and of those of its elements, which it absorbs. */
static int create_element(Graph *g, int p) {
    int *list = g->lists + g->list_begin[p];
    int elements = g->element_count[p], room = g->variable_count[p], count = 0;
    for (int k = 0; k < elements; k++)
        if (g->state[list[k]] == ELEMENT) room += g->member_count[list[k]];
    int *members = integers(room);
    if (members == NULL) return 0;
    int stamp = ++g->stamp;
    g->mark[p] = stamp;
    for (int k = 0; k <= elements; k++) {
        if (k < elements && g->state[list[k]] != ELEMENT) continue;
        const int *source = k < elements ? g->members[list[k]] : list + elements;
        int length = k < elements ? g->member_count[list[k]] : g->variable_count[p];
        for (int m = 0; m < length; m++) {
            int i = source[m];
            if (g->state[i] != VARIABLE || g->mark[i] == stamp) continue;
            g->mark[i] = stamp;
            members[count++] = i;
        }
    }
    for (int k = 0; k < elements; k++)
        if (g->state[list[k]] == ELEMENT) absorb(g, list[k], p);
    g->state[p] = ELEMENT;
    g->members[p] = members;
    g->member_count[p] = count;
    return 1;
}

/* Compute, for each element next to the new one, the weight of its variables outside of the new one. */
static void weigh_outside(Graph *g, int p, int base) {
    for (int m = 0; m < g->member_count[p]; m++) {
        int i = g->members[p][m];
        const int *list = g->lists + g->list_begin[i];
        for (int k = 0; k < g->element_count[i]; k++) {
            int e = list[k];
            if (g->state[e] != ELEMENT || e == p) continue;
            if (g->mark[e] < base) {
                g->mark[e] = base;
                g->outside[e] = 0;
                for (int v = 0; v < g->member_count[e]; v++)
                    if (g->state[g->members[e][v]] == VARIABLE) g->outside[e] += g->weight[g->members[e][v]];
            }
            g->outside[e] -= g->weight[i];
        }
    }
}

/* Drop from variable i what the new element p stands for; return a hash of what is left.
 *
 * The list keeps its place: i was next to p itself or to an element that p absorbed, so at least one
 * entry goes for the one that comes. */
static unsigned prune(Graph *g, int i, int p, int member_stamp, int *external) {
    int *list = g->lists + g->list_begin[i], *variables = list + g->element_count[i];
    int elements_left = 0, variables_left = 0, sum = 0;
    unsigned hash = (unsigned)p;
    for (int k = 0; k < g->element_count[i]; k++) {
        int e = list[k];
        if (g->state[e] != ELEMENT || e == p) continue;
        if (g->outside[e] == 0) {
            absorb(g, e, p); /* wholly inside the new element */
            continue;
        }
        sum += g->outside[e];
        hash += (unsigned)e;
        list[elements_left++] = e;
    }
    for (int k = 0; k < g->variable_count[i]; k++) {
        int v = variables[k];
        if (g->state[v] != VARIABLE || g->mark[v] == member_stamp) continue;
        sum += g->weight[v];
        hash += (unsigned)v;
        variables[variables_left++] = v;
    }
    memmove(list + elements_left + 1, variables, variables_left * sizeof(int));
    list[elements_left] = p;
    g->element_count[i] = elements_left + 1;
    g->variable_count[i] = variables_left;
    *external = sum;
    return hash;
}

static int same_neighbours(Graph *g, int i, int j) {
    if (g->element_count[i] != g->element_count[j] || g->variable_count[i] != g->variable_count[j]) return 0;
    int count = g->element_count[i] + g->variable_count[i], stamp = ++g->stamp;
    const int *a = g->lists + g->list_begin[i], *b = g->lists + g->list_begin[j];
    for (int k = 0; k < count; k++) g->mark[a[k]] = stamp;
    for (int k = 0; k < count; k++)
        if (g->mark[b[k]] != stamp) return 0;
    return 1;
}

static void merge(Graph *g, int into, int i) {
    g->weight[into] += g->weight[i];
    g->weight[i] = 0;
    g->state[i] = MERGED;
    g->next_in_merged[g->last_in_merged[into]] = i;
    g->last_in_merged[into] = g->last_in_merged[i];
}

typedef struct { unsigned hash; int variable; } Hashed;

static int compare_hashes(const void *a, const void *b) {
    const Hashed *x = a, *y = b;
    if (x->hash != y->hash) return x->hash < y->hash ? -1 : 1;
    return (x->variable > y->variable) - (x->variable < y->variable);
}

/* Merge the variables of element p that can't be told apart. */
static void merge_equals(Graph *g, Hashed *hashed, int count) {
    qsort(hashed, count, sizeof *hashed, compare_hashes);
    for (int a = 0; a < count; a++) {
        int i = hashed[a].variable;
        if (g->state[i] != VARIABLE) continue;
        for (int b = a + 1; b < count && hashed[b].hash == hashed[a].hash; b++) {
            int j = hashed[b].variable;
            if (g->state[j] == VARIABLE && same_neighbours(g, i, j)) merge(g, i, j);
        }
    }
}

/* Eliminate supervariable p; false when memory runs out. */
static int eliminate(Graph *g, int p, int *remaining, Hashed *hashed) {
    unlink_degree(g, p);
    if (!create_element(g, p)) return 0;
    int member_stamp = g->stamp, *members = g->members[p], count = g->member_count[p];
    *remaining -= g->weight[p];
    for (int m = 0; m < count; m++) unlink_degree(g, members[m]);
    int base = ++g->stamp;
    weigh_outside(g, p, base);
    int weight = 0, kept = 0;
    for (int m = 0; m < count; m++) weight += g->weight[members[m]];
    for (int m = 0; m < count; m++) {
        int i = members[m], external;
        unsigned hash = prune(g, i, p, member_stamp, &external);
        if (g->element_count[i] == 1 && g->variable_count[i] == 0) { /* nothing beyond the new element */
            *remaining -= g->weight[i];
            weight -= g->weight[i];
            merge(g, p, i);
            continue;
        }
        g->outside[i] = external;
        hashed[kept++] = (Hashed){hash, i};
    }
    merge_equals(g, hashed, kept);
    int left = 0;
    for (int m = 0; m < count; m++) {
        int i = members[m];
        if (g->state[i] != VARIABLE) continue;
        members[left++] = i;
        int inside = weight - g->weight[i];
        int bound = g->degree[i] + inside, exact = g->outside[i] + inside, most = *remaining - g->weight[i];
        int d = exact < bound ? exact : bound;
        g->degree[i] = d < most ? d : most;
        link_degree(g, i);
    }
    g->member_count[p] = left;
    return 1;
}

static int *write_unknowns(const Graph *g, int i, int *to) {
    for (; i >= 0; i = g->next_in_merged[i]) *to++ = i;
    return to;
}

/* Fronts in the order of elimination. */
typedef struct {
    int count;
    int *front_of;                            /* [n] front that eliminates an unknown */
    int *element;                             /* [count] node of the quotient graph */
    int *pivot_count, *border_count, *parent; /* [count] */
    int **border;                             /* [count] unknowns */
} Fronts;

static void free_fronts(Fronts *fronts) {
    if (fronts->border != NULL)
        for (int f = 0; f < fronts->count; f++) free(fronts->border[f]);
    free(fronts->front_of), free(fronts->element), free(fronts->pivot_count);
    free(fronts->border_count), free(fronts->parent), free(fronts->border);
}

static int allocate_fronts(Fronts *fronts, int n) {
    memset(fronts, 0, sizeof *fronts);
    int **arrays[] = {&fronts->front_of, &fronts->element, &fronts->pivot_count, &fronts->border_count,
                      &fronts->parent};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++)
        if ((*arrays[k] = integers(n)) == NULL) return 0;
    return (fronts->border = calloc((size_t)n + 1, sizeof(int *))) != NULL;
}

/* Note the front of the element just made; false when memory runs out. */
static int record_front(Fronts *fronts, const Graph *g, int p) {
    int f = fronts->count++, count = g->member_count[p];
    fronts->element[f] = p;
    fronts->pivot_count[f] = g->weight[p];
    for (int i = p; i >= 0; i = g->next_in_merged[i]) fronts->front_of[i] = f;
    fronts->border_count[f] = count_unknowns(g, g->members[p], count);
    fronts->border[f] = integers(fronts->border_count[f]);
    if (fronts->border[f] == NULL) return 0;
    int *to = fronts->border[f];
    for (int m = 0; m < count; m++) to = write_unknowns(g, g->members[p][m], to);
    return 1;
}

/* Put all unknowns that were left out into one last front, and into the border of whatever couples to
 * them; false when memory runs out. */
static int add_dense_front(Fronts *fronts, const Graph *g, const int *begin, const int *index) {
    int n = g->n, dense = 0, last = fronts->count;
    for (int i = 0; i < n; i++)
        if (g->state[i] == DENSE) dense++;
    if (dense == 0) return 1;
    int *number = integers(n), *unknown = integers(dense);
    char *touched = calloc((size_t)last * dense + 1, 1);
    int fine = number != NULL && unknown != NULL && touched != NULL;
    if (fine) {
        for (int i = 0, d = 0; i < n; i++)
            if (g->state[i] == DENSE) {
                number[i] = d;
                unknown[d++] = i;
                fronts->front_of[i] = last;
            }
        for (int j = 0; j < n; j++)
            for (int k = begin[j]; k < begin[j + 1]; k++) {
                int i = index[k], i_dense = g->state[i] == DENSE, j_dense = g->state[j] == DENSE;
                if (i_dense != j_dense)
                    touched[(size_t)fronts->front_of[i_dense ? j : i] * dense + number[i_dense ? i : j]] = 1;
            }
    }
    for (int f = 0; fine && f < last; f++) {
        int count = fronts->border_count[f], parent = fronts->parent[f];
        int *border = realloc(fronts->border[f], (size_t)(count + dense + 1) * sizeof(int));
        if ((fine = border != NULL)) {
            fronts->border[f] = border;
            for (int d = 0; d < dense; d++) {
                if (!touched[(size_t)f * dense + d]) continue;
                border[count++] = unknown[d];
                if (parent >= 0) touched[(size_t)parent * dense + d] = 1;
            }
            if (parent < 0 && count > 0) fronts->parent[f] = last;
            fronts->border_count[f] = count;
        }
    }
    fronts->count++;
    fronts->pivot_count[last] = dense;
    fronts->border_count[last] = 0;
    fronts->parent[last] = -1;
    free(number), free(unknown), free(touched);
    return fine;
}

/* Fronts smaller than this are merged into their parents: dense work is faster than bookkeeping. */
#define SMALL_FRONT 8

/* Return for each front the one that it is merged into, itself where it stays; NULL without memory. */
static int *amalgamate(Fronts *fronts) {
    int *into = integers(fronts->count);
    if (into == NULL) return NULL;
    for (int f = 0; f < fronts->count; f++) {
        int p = fronts->parent[f];
        into[f] = f;
        if (p < 0) continue;
        int zeros = fronts->pivot_count[p] + fronts->border_count[p] - fronts->border_count[f];
        int both_small = fronts->pivot_count[f] < SMALL_FRONT && fronts->pivot_count[p] < SMALL_FRONT;
        if (zeros > 0 && !both_small) continue;
        into[f] = p;
        fronts->pivot_count[p] += fronts->pivot_count[f];
    }
    for (int f = fronts->count - 1; f >= 0; f--)
        if (into[f] != f) into[f] = into[into[f]];
    return into;
}

/* Number the fronts that stay so that each subtree is contiguous and children come first. */
static int *postorder(const Fronts *fronts, const int *into, int *kept) {
    int count = fronts->count;
    int *rank = integers(count), *first_child = integers(count), *sibling = integers(count);
    int *stack = integers(count);
    if (rank != NULL && first_child != NULL && sibling != NULL && stack != NULL) {
        int depth = 0, next = 0;
        for (int f = 0; f < count; f++) first_child[f] = -1;
        for (int f = count - 1; f >= 0; f--) {
            if (into[f] != f) continue;
            int p = fronts->parent[f];
            if (p < 0) {
                stack[depth++] = f;
                continue;
            }
            sibling[f] = first_child[into[p]];
            first_child[into[p]] = f;
        }
        while (depth > 0) {
            int f = stack[depth - 1], child = first_child[f];
            if (child >= 0) {
                first_child[f] = sibling[child];
                stack[depth++] = child;
            } else {
                rank[f] = next++;
                depth--;
            }
        }
        *kept = next;
    } else {
        free(rank);
        rank = NULL;
    }
    free(first_child), free(sibling), free(stack);
    return rank;
}

void free_assembly_tree(AssemblyTree *tree) {
    if (tree == NULL) return;
    free(tree->pivots), free(tree->pivot_begin), free(tree->border), free(tree->border_begin);
    free(tree->parent), free(tree);
}

/* Write the fronts that stay in their new order. */
static AssemblyTree *written_tree(const Fronts *fronts, const int *into, const int *rank, int kept, int n) {
    AssemblyTree *tree = calloc(1, sizeof *tree);
    if (tree == NULL) return NULL;
    size_t border_total = 0;
    for (int f = 0; f < fronts->count; f++)
        if (into[f] == f) border_total += fronts->border_count[f];
    *tree = (AssemblyTree){n, kept, integers(n), integers(kept), integers(border_total), integers(kept),
                           integers(kept)};
    if (tree->pivots == NULL || tree->pivot_begin == NULL || tree->border == NULL ||
        tree->border_begin == NULL || tree->parent == NULL) {
        free_assembly_tree(tree);
        return NULL;
    }
    memset(tree->pivot_begin, 0, (kept + 1) * sizeof(int));
    memset(tree->border_begin, 0, (kept + 1) * sizeof(int));
    for (int f = 0; f < fronts->count; f++) {
        if (into[f] != f) continue;
        int r = rank[f], p = fronts->parent[f];
        tree->pivot_begin[r + 1] = fronts->pivot_count[f];
        tree->border_begin[r + 1] = fronts->border_count[f];
        tree->parent[r] = p < 0 ? -1 : rank[into[p]];
    }
    for (int r = 0; r < kept; r++) {
        tree->pivot_begin[r + 1] += tree->pivot_begin[r];
        tree->border_begin[r + 1] += tree->border_begin[r];
    }
    for (int f = 0; f < fronts->count; f++)
        if (into[f] == f && fronts->border_count[f] > 0)
            memcpy(tree->border + tree->border_begin[rank[f]], fronts->border[f],
                   fronts->border_count[f] * sizeof(int));
    return tree;
}

/* Sort the unknowns into the pivots of their fronts, those of merged children first. */
static int write_pivots(AssemblyTree *tree, const Fronts *fronts, const int *into, const int *rank) {
    int count = fronts->count, n = tree->n;
    int *begin = integers(count), *sorted = integers(n), *at = integers(tree->front_count);
    int fine = begin != NULL && sorted != NULL && at != NULL;
    if (fine) {
        memset(begin, 0, (count + 1) * sizeof(int));
        for (int i = 0; i < n; i++) begin[fronts->front_of[i] + 1]++;
        for (int f = 0; f < count; f++) begin[f + 1] += begin[f];
        for (int i = n - 1; i >= 0; i--) sorted[--begin[fronts->front_of[i] + 1]] = i;
        memcpy(at, tree->pivot_begin, tree->front_count * sizeof(int));
        for (int k = 0; k < n; k++) {
            int i = sorted[k];
            tree->pivots[at[rank[into[fronts->front_of[i]]]]++] = i;
        }
    }
    free(begin), free(sorted), free(at);
    return fine;
}

static AssemblyTree *tree_of(Fronts *fronts, int n) {
    AssemblyTree *tree = NULL;
    int kept = 0, *into = amalgamate(fronts), *rank = into == NULL ? NULL : postorder(fronts, into, &kept);
    if (rank != NULL) tree = written_tree(fronts, into, rank, kept, n);
    if (tree != NULL && !write_pivots(tree, fronts, into, rank)) {
        free_assembly_tree(tree);
        tree = NULL;
    }
    free(into), free(rank);
    return tree;
}

/* Eliminate all variables of the graph; false when memory runs out. */
static int eliminate_all(Graph *g, Fronts *fronts) {
    Hashed *hashed = malloc(((size_t)g->n + 1) * sizeof *hashed);
    int remaining = 0, fine = hashed != NULL;
    for (int i = 0; i < g->n; i++) remaining += g->state[i] == VARIABLE;
    while (fine && remaining > 0) {
        int p = next_pivot(g);
        fine = eliminate(g, p, &remaining, hashed) && record_front(fronts, g, p);
    }
    free(hashed);
    for (int f = 0; fine && f < fronts->count; f++) {
        int absorber = g->parent[fronts->element[f]];
        fronts->parent[f] = absorber < 0 ? -1 : fronts->front_of[absorber];
    }
    return fine;
}

AssemblyTree *order_by_minimum_degree(int n, const int *begin, const int *index) {
    Graph graph;
    Fronts fronts;
    AssemblyTree *tree = NULL;
    memset(&fronts, 0, sizeof fronts);
    if (allocate_graph(&graph, n, begin[n]) && allocate_fronts(&fronts, n)) {
        build_graph(&graph, begin, index);
        if (eliminate_all(&graph, &fronts) && add_dense_front(&fronts, &graph, begin, index))
            tree = tree_of(&fronts, n);
    }
    free_fronts(&fronts);
    free_graph(&graph);
    return tree;
}
