/* A division of the elimination into parts that two processors can do at the same time. */
#ifndef WALK_OPTIMIZER_DIVISION_H
#define WALK_OPTIMIZER_DIVISION_H

#include "assembly_tree.h"

/* Some subtrees, other subtrees, which need nothing of the first ones, and the rest, which needs both. */
enum { FIRST_BRANCHES, OTHER_BRANCHES, TRUNK, PARTS };

/* Write the part of each front, [front_count]; false when memory runs out. */
int divide_fronts(const AssemblyTree *tree, int *part_of);

#endif
