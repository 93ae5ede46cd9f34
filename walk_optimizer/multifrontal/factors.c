/* Memory of an analysis and of its factors. */
#include "factors.h"

#include <stdlib.h>
#include <string.h>

/* Return the data of an array with room for so many items, moved if need be; the array's own if memory
 * runs out, with the room as it was. */
static void *grown(void *data, size_t needed, size_t *room, size_t item) {
    if (needed <= *room) return data;
    void *moved = realloc(data, (*room + needed) * item);
    if (moved == NULL) return data;
    *room += needed;
    return moved;
}

int reserve_doubles(Doubles *array, size_t count) {
    array->data = grown(array->data, array->used + count, &array->room, sizeof *array->data);
    return array->used + count <= array->room;
}

int reserve_integers(Integers *array, size_t count) {
    array->data = grown(array->data, array->used + count, &array->room, sizeof *array->data);
    return array->used + count <= array->room;
}

static void link_children(const AssemblyTree *tree, int *first_child, int *sibling) {
    for (int f = 0; f < tree->front_count; f++) first_child[f] = -1;
    for (int f = 0; f < tree->front_count; f++) {
        int parent = tree->parent[f];
        if (parent < 0) continue;
        sibling[f] = first_child[parent];
        first_child[parent] = f;
    }
}

/* Give every entry of the matrix to the front that eliminates the first of its two unknowns. */
static void assign_entries(Analysis *analysis, int n, const int *begin, const int *index) {
    const AssemblyTree *tree = analysis->tree;
    int *front_of = analysis->front_of, *at = analysis->entry_begin;
    for (int f = 0; f < tree->front_count; f++)
        for (int k = tree->pivot_begin[f]; k < tree->pivot_begin[f + 1]; k++) front_of[tree->pivots[k]] = f;
    memset(at, 0, ((size_t)tree->front_count + 1) * sizeof(int));
    for (int pass = 0; pass < 2; pass++) {
        for (int j = 0; j < n; j++)
            for (int k = begin[j]; k < begin[j + 1]; k++) {
                int i = index[k], f = front_of[i] < front_of[j] ? front_of[i] : front_of[j];
                if (pass == 0) {
                    at[f + 1]++;
                    continue;
                }
                int e = at[f]++;
                analysis->entry[e] = k;
                analysis->row[e] = i;
                analysis->column[e] = j;
            }
        if (pass == 0)
            for (int f = 0; f < tree->front_count; f++) at[f + 1] += at[f];
    }
    memmove(at + 1, at, (size_t)tree->front_count * sizeof(int));
    at[0] = 0;
}

void free_analysis(Analysis *analysis) {
    if (analysis == NULL) return;
    free_assembly_tree(analysis->tree);
    free(analysis->entry_begin), free(analysis->entry), free(analysis->row), free(analysis->column);
    free(analysis->front_of), free(analysis->part_of), free(analysis->first_child), free(analysis->sibling);
    free(analysis);
}

Analysis *analyse(int n, const int *begin, const int *index) {
    Analysis *analysis = calloc(1, sizeof *analysis);
    if (analysis == NULL) return NULL;
    size_t entries = (size_t)begin[n] + 1;
    analysis->entry_count = begin[n];
    analysis->tree = order_by_minimum_degree(n, begin, index);
    if (analysis->tree != NULL) {
        size_t fronts = (size_t)analysis->tree->front_count + 1;
        analysis->part_of = malloc(fronts * sizeof(int));
        analysis->first_child = malloc(fronts * sizeof(int));
        analysis->sibling = malloc(fronts * sizeof(int));
        analysis->entry_begin = malloc(fronts * sizeof(int));
        analysis->entry = malloc(entries * sizeof(int));
        analysis->row = malloc(entries * sizeof(int));
        analysis->column = malloc(entries * sizeof(int));
        analysis->front_of = malloc(((size_t)n + 1) * sizeof(int));
        if (analysis->part_of != NULL && analysis->first_child != NULL && analysis->sibling != NULL &&
            analysis->entry_begin != NULL && analysis->entry != NULL && analysis->row != NULL &&
            analysis->column != NULL && analysis->front_of != NULL &&
            divide_fronts(analysis->tree, analysis->part_of)) {
            link_children(analysis->tree, analysis->first_child, analysis->sibling);
            assign_entries(analysis, n, begin, index);
            return analysis;
        }
    }
    free_analysis(analysis);
    return NULL;
}

void free_factors(Factors *factors) {
    if (factors == NULL) return;
    for (int k = 0; k < PARTS; k++) {
        Workspace *part = &factors->parts[k];
        free(part->values.data), free(part->stack.data), free(part->indices.data);
        free(part->place), free(part->places);
    }
    free(factors->fronts), free(factors->pivots), free(factors->piece);
    free(factors->scale), free(factors->largest);
    free(factors);
}

void forget(const Analysis *analysis, Factors *factors) {
    memcpy(factors->pivots, analysis->tree->pivots, (size_t)analysis->tree->n * sizeof(int));
    for (int i = 0; i < analysis->tree->n; i++) factors->scale[i] = 1.0;
}

Factors *new_factors(const Analysis *analysis) {
    size_t n = (size_t)analysis->tree->n + 1;
    Factors *factors = calloc(1, sizeof *factors);
    if (factors == NULL) return NULL;
    factors->fronts = malloc(((size_t)analysis->tree->front_count + 1) * sizeof(Front));
    factors->pivots = malloc(n * sizeof(int));
    factors->piece = malloc(n * sizeof(double));
    factors->scale = malloc(n * sizeof(double));
    factors->largest = malloc(n * sizeof(double));
    int fine = factors->fronts != NULL && factors->pivots != NULL && factors->piece != NULL &&
               factors->scale != NULL && factors->largest != NULL;
    for (int k = 0; k < PARTS; k++) {
        factors->parts[k].place = malloc(n * sizeof(int));
        factors->parts[k].places = malloc(n * sizeof(int));
        fine = fine && factors->parts[k].place != NULL && factors->parts[k].places != NULL;
    }
    if (fine) {
        forget(analysis, factors);
        return factors;
    }
    free_factors(factors);
    return NULL;
}
