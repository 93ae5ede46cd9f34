/* Subtrees of about a sixteenth of the work each are dealt out, to the part that has less so far. What is
 * above them is the trunk. */
#include "division.h"

#include <stdlib.h>

#define SHARE 16

/* About the work of a front: its elimination, its assembly, and what every front costs. */
static double work_of(const AssemblyTree *tree, int f) {
    double pivots = tree->pivot_begin[f + 1] - tree->pivot_begin[f];
    double size = pivots + tree->border_begin[f + 1] - tree->border_begin[f];
    return size * size * (pivots + 20.0) + 500.0;
}

int divide_fronts(const AssemblyTree *tree, int *part_of) {
    int count = tree->front_count;
    double *below = calloc((size_t)count + 1, sizeof(double)), total = 0.0, given[2] = {0.0, 0.0};
    if (below == NULL) return 0;
    for (int f = 0; f < count; f++) {
        double work = work_of(tree, f);
        total += work;
        below[f] += work;
        if (tree->parent[f] >= 0) below[tree->parent[f]] += below[f];
    }
    /* From the roots down: a subtree that is small enough goes to one part as a whole. */
    for (int f = count - 1; f >= 0; f--) {
        int parent = tree->parent[f], lighter = given[OTHER_BRANCHES] < given[FIRST_BRANCHES];
        if (parent >= 0 && part_of[parent] != TRUNK) {
            part_of[f] = part_of[parent];
        } else if (below[f] * SHARE > total) {
            part_of[f] = TRUNK;
        } else {
            part_of[f] = lighter ? OTHER_BRANCHES : FIRST_BRANCHES;
            given[part_of[f]] += below[f];
        }
    }
    free(below);
    return 1;
}
