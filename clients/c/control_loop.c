/* A control loop on truerate's rate: holds a vehicle's z axis still with a proportional controller, and knows what to do
 * without a rate.
 *
 *     cc -O2 -o control_loop control_loop.c && ./control_loop /dev/shm/truerate-1000-default
 *
 * It writes its command, a line a row, to standard output: time, rate, command. */
#define _GNU_SOURCE
#include "truerate.h"
#include <stdio.h>

#define GAIN 0.8          /* command per rad/s */
#define LIMIT 1.0         /* of the command */
#define TRUSTED 0.2       /* rad/s: a larger standard deviation is not acted on */
#define PATIENCE_MS 50    /* without a row for so long the command is 0 */

static double command(const struct truerate_row *row) {
    double wanted = -GAIN * row->rate[2];
    if (!(row->axis_flags[2] & TRUERATE_PRESENT) || (row->axis_flags[2] & TRUERATE_HELD) || row->rate_std[2] > TRUSTED)
        return 0.0;
    return wanted > LIMIT ? LIMIT : wanted < -LIMIT ? -LIMIT : wanted;
}

int main(int argc, char **argv) {
    struct truerate rate;
    struct truerate_row row;
    if (argc != 2) { fprintf(stderr, "control_loop PATH\n"); return 2; }
    while (truerate_open(&rate, argv[1]) != 0) {
        if (errno != ENOENT) { perror(argv[1]); return 1; }
        usleep(20000);
    }
    for (;;) {
        switch (truerate_wait(&rate, &row, PATIENCE_MS)) {
        case 1:
            if (!(row.flags & TRUERATE_END))
                printf("%.9f %.9g %.9g\n", (double)row.valid_ns * 1e-9, row.rate[2], command(&row));
            break;
        case 0:
            printf("none 0 0\n");
            break;
        default:
            truerate_close(&rate);
            return 0;
        }
        fflush(stdout);
    }
}
