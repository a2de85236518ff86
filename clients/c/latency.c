/* How long a rate is on its way from kalman to a program that waits for it: 20 000 rows, in µs.
 *
 *     cc -O2 -o latency latency.c && ./latency /dev/shm/truerate-1000-default */
#define _GNU_SOURCE
#include "truerate.h"
#include <stdio.h>
#include <stdlib.h>

enum { ROWS = 20000 };

static int compare(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

int main(int argc, char **argv) {
    static double late[ROWS];
    struct truerate rate;
    struct truerate_row row;
    struct timespec now;
    int rows = 0;
    if (argc != 2 || truerate_open(&rate, argv[1]) != 0) { fprintf(stderr, "latency PATH\n"); return 2; }
    while (rows < ROWS && truerate_wait(&rate, &row, 1000) == 1) {
        clock_gettime(CLOCK_MONOTONIC, &now);
        late[rows++] = (double)(now.tv_sec * 1000000000LL + now.tv_nsec - (int64_t)row.given_ns) * 1e-3;
    }
    if (rows == 0) return 1;
    qsort(late, (size_t)rows, sizeof *late, compare);
    printf("rows %d  p50 %.1f  p99 %.1f  p99.9 %.1f  max %.1f\n", rows, late[rows / 2], late[rows * 99L / 100],
           late[rows * 999L / 1000], late[rows - 1]);
    return 0;
}
