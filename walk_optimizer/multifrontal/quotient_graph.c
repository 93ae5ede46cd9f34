/* Approximate minimum degree on a quotient graph.
 *
 * P. R. Amestoy, T. A. Davis, I. S. Duff: An approximate minimum degree ordering algorithm.
 * SIAM Journal on Matrix Analysis and Applications 17 (1996), 886-905.
 *
 * Eliminating a variable makes its neighbours a clique. The quotient graph keeps such a clique as an
 * "element", a list of its variables, so it never grows. Variables that have the same neighbours are
 * merged into one "supervariable" and eliminated together. Unknowns that touch a great part of the
 * matrix (parameters shared by all stages) are put last from the beginning. */
#include "quotient_graph.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

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

void free_graph(Graph *g) {
    if (g->members != NULL)
        for (int i = 0; i < g->n; i++) free(g->members[i]);
    int *arrays[] = {g->state, g->list_begin, g->lists, g->element_count, g->variable_count, g->weight,
                     g->degree, g->parent, g->member_count, g->next_in_merged, g->last_in_merged, g->bucket, g->next,
                     g->previous, g->mark, g->outside};
    for (size_t k = 0; k < sizeof arrays / sizeof *arrays; k++) free(arrays[k]);
    free(g->members);
}

int allocate_graph(Graph *g, int n, int entries) {
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

int count_unknowns(const Graph *g, const int *members, int count) {
    int total = 0;
    for (int m = 0; m < count; m++) total += g->weight[members[m]];
    return total;
}

void build_graph(Graph *g, const int *begin, const int *index) {
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

int next_pivot(Graph *g) {
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

int eliminate(Graph *g, int p, int *remaining, Hashed *hashed) {
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

int *write_unknowns(const Graph *g, int i, int *to) {
    for (; i >= 0; i = g->next_in_merged[i]) *to++ = i;
    return to;
}
