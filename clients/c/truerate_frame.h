/* Writes the frames that `truerate run --source 'serial:…?format=frames'` reads (docs/feed.md): C99, no library, no heap.
 * Little-endian machines (all Arm, AVR, RISC-V, x86).
 *
 *     uint8_t out[TRUERATE_FRAME_MAX];
 *     struct truerate_frame frame = {.time_us = micros, .fields = TRUERATE_GYRO | TRUERATE_TEMPERATURE};
 *     frame.values[0] = gx; frame.values[1] = gy; frame.values[2] = gz; frame.values[3] = celsius;
 *     write(port, out, truerate_frame_write(&frame, out));
 *
 * Set TRUERATE_BEGINS in `flags` of the first frame after a reset; `number` grows by one with every frame. */
#ifndef TRUERATE_FRAME_H
#define TRUERATE_FRAME_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Bits of `fields`, in the order in which the values follow each other. */
enum {
    TRUERATE_GYRO_X = 1, TRUERATE_GYRO_Y = 2, TRUERATE_GYRO_Z = 4, TRUERATE_GYRO = 7, /* rad/s */
    TRUERATE_ACCEL = 7 << 3,                                                          /* x, y, z; m/s² */
    TRUERATE_TEMPERATURE = 1 << 6, TRUERATE_SUPPLY = 1 << 7,                          /* °C, V */
    TRUERATE_REF_ANGLE_X = 1 << 8, TRUERATE_REF_ANGLE_Y = 1 << 9, TRUERATE_REF_ANGLE_Z = 1 << 10, /* rad */
    TRUERATE_REF_RATE_X = 1 << 11, TRUERATE_REF_RATE_Y = 1 << 12, TRUERATE_REF_RATE_Z = 1 << 13   /* rad/s */
};
enum { TRUERATE_BEGINS = 1, TRUERATE_VALUES_MAX = 26, TRUERATE_FRAME_MAX = 16 + 4 * TRUERATE_VALUES_MAX + 2 + 3 };

struct truerate_frame {
    uint8_t flags;
    uint16_t number;
    uint64_t time_us; /* of the reading, by any clock that only grows */
    uint32_t fields;
    float values[TRUERATE_VALUES_MAX]; /* those that `fields` names, without gaps */
};

/* CRC-16 with polynomial 0x1021, begun at 0xffff. */
static inline uint16_t truerate_crc(const uint8_t *bytes, size_t length) {
    uint16_t crc = 0xffff;
    while (length--) {
        crc ^= (uint16_t)((uint16_t)*bytes++ << 8);
        for (int bit = 0; bit < 8; bit++) crc = (uint16_t)(crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1);
    }
    return crc;
}

/* Writes one frame with the zeros about it; the number of bytes. */
static inline size_t truerate_frame_write(const struct truerate_frame *frame, uint8_t *out) {
    uint8_t raw[TRUERATE_FRAME_MAX];
    size_t length = 16, code = 1, at = 2;
    raw[0] = 1;
    raw[1] = frame->flags;
    memcpy(raw + 2, &frame->number, 2);
    memcpy(raw + 4, &frame->time_us, 8);
    memcpy(raw + 12, &frame->fields, 4);
    for (uint32_t left = frame->fields; left; left &= left - 1, length += 4)
        memcpy(raw + length, &frame->values[(length - 16) / 4], 4);
    uint16_t crc = truerate_crc(raw, length);
    memcpy(raw + length, &crc, 2);
    length += 2;
    /* COBS: no zero inside a frame. A frame is shorter than 254 bytes, so no run is too long. */
    out[0] = 0;
    for (size_t i = 0; i < length; i++) {
        if (raw[i]) out[at++] = raw[i];
        else { out[code] = (uint8_t)(at - code); code = at++; }
    }
    out[code] = (uint8_t)(at - code);
    out[at++] = 0;
    return at;
}

#endif
