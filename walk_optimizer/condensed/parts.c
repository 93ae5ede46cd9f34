/* Halves of the intervals on two threads. */
#include <pthread.h>

#include "condensed.h"

typedef struct {
    Step *step;
    Part part;
    int begin, end;
} Task;

static void *run(void *argument) {
    Task *task = argument;
    task->part(task->step, task->begin, task->end);
    return NULL;
}

void for_all_intervals(Step *step, Part part) {
    int middle = step->threads > 1 ? step->intervals / 2 : step->intervals;
    Task second = {step, part, middle, step->intervals};
    pthread_t other;
    int apart = middle < step->intervals && pthread_create(&other, NULL, run, &second) == 0;
    part(step, 0, apart ? middle : step->intervals);
    if (apart) pthread_join(other, NULL);
}
