/* Every row of a running truerate's rate about z as a line: arrival, number, sequence, clock of validity, given, epoch, rate, standard
   deviation, flags. Times in ns of CLOCK_MONOTONIC.
 *
 *     rows /dev/shm/truerate-1000-default */
#define _GNU_SOURCE
#include "truerate.h"
#include <inttypes.h>

int main(int argc, char **argv) {
    struct truerate rate;
    struct truerate_row row;
    struct timespec now;
    if (argc != 2) return 2;
    while (truerate_open(&rate, argv[1]) != 0) usleep(1000);
    for (uint64_t next = 0;;) {
        int came = truerate_wait(&rate, &row, 100);
        if (came < 0) return 0;
        if (came == 0) continue;
        clock_gettime(CLOCK_MONOTONIC, &now);
        /* Those that came since the last look, as far as they still stand there. */
        if (next == 0 || next + rate.slots / 2 < rate.seen) next = rate.seen;
        for (; next <= rate.seen; next++) {
            if (!truerate_read(&rate, next, &row)) continue;
            printf("%" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %" PRIu64 " %.9g %.9g %u\n",
                   (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec, next, row.sequence, row.valid_clock_ns,
                   row.given_ns, row.epoch, row.rate[2], row.rate_std[2], row.axis_flags[2]);
        }
        fflush(stdout);
    }
}
