/* Sends a log as frames: reads lines "time_s,gyro_z,ref_angle_z" from standard input, writes frames to standard output.
 *
 *     cc -O2 -o send_frames send_frames.c && ./send_frames < log.csv > /dev/ttyUSB0 */
#include "truerate_frame.h"
#include <stdio.h>

int main(void) {
    struct truerate_frame frame = {.flags = TRUERATE_BEGINS, .fields = TRUERATE_GYRO_Z | TRUERATE_REF_ANGLE_Z};
    uint8_t out[TRUERATE_FRAME_MAX];
    char line[256];
    double t, gyro, angle;
    while (fgets(line, sizeof line, stdin)) {
        if (sscanf(line, "%lf,%lf,%lf", &t, &gyro, &angle) != 3) continue;
        frame.time_us = (uint64_t)(t * 1e6 + 0.5);
        frame.values[0] = (float)gyro;
        frame.values[1] = (float)angle;
        if (fwrite(out, 1, truerate_frame_write(&frame, out), stdout) == 0 || fflush(stdout) != 0) return 1;
        frame.flags = 0;
        frame.number++;
    }
    return 0;
}
