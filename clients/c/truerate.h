/* The rate of a running truerate, read from its shared memory (`truerate run --out shm`): C99, Linux, no library.
 *
 *     struct truerate rate;
 *     struct truerate_row row;
 *     if (truerate_open(&rate, "/dev/shm/truerate-1000-default") == 0)
 *         while (truerate_wait(&rate, &row, 100) >= 0) ...
 *
 * The layout is that of docs/feed.md, version 1. Little-endian machines only. */
#ifndef TRUERATE_H
#define TRUERATE_H

#include <errno.h>
#include <fcntl.h>
#include <linux/futex.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#if __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "truerate.h is for little-endian machines"
#endif

enum { TRUERATE_VERSION = 1, TRUERATE_HEAD = 128 };
enum { TRUERATE_STALE = 1, TRUERATE_END = 2 };                                     /* row.flags */
enum { TRUERATE_PRESENT = 1, TRUERATE_HELD = 2, TRUERATE_LOST = 4, TRUERATE_OUTLIER = 8, TRUERATE_RESTARTED = 16, TRUERATE_CHANGED = 32 };

struct truerate_row {
    char magic[4];           /* "TRTR" */
    uint16_t version, flags;
    uint64_t sequence;       /* the sample's number */
    int64_t valid_ns;        /* when the rate held, from the source's first row */
    uint64_t valid_clock_ns; /* the same on CLOCK_MONOTONIC: now less this is how old the rate is */
    uint64_t given_ns;       /* when this row was given, CLOCK_MONOTONIC */
    uint64_t epoch;          /* of the parameters */
    double rate[3];          /* rad/s, compensated and filtered; 0 where the axis is not present */
    double rate_std[3];      /* rad/s */
    double rate_compensated[3];
    uint32_t axis_flags[3];
    uint32_t reserved;
};
typedef char truerate_row_is_136_bytes[sizeof(struct truerate_row) == 136 ? 1 : -1];

struct truerate {
    const unsigned char *base;
    size_t length;
    uint32_t slots;
    uint64_t seen;           /* number of the last row that was read */
};

static inline uint32_t truerate_word(const struct truerate *rate, size_t at) {
    return __atomic_load_n((const uint32_t *)(const void *)(rate->base + at), __ATOMIC_ACQUIRE);
}

static inline uint64_t truerate_long(const struct truerate *rate, size_t at) {
    return __atomic_load_n((const uint64_t *)(const void *)(rate->base + at), __ATOMIC_ACQUIRE);
}

static inline void truerate_close(struct truerate *rate) {
    if (rate->base) munmap((void *)(uintptr_t)rate->base, rate->length);
    rate->base = NULL;
}

/* 0, or -1 with errno: ENOENT while nothing runs, EPROTO where it is another version, EACCES where another user made it:
   in /dev/shm anyone may make a file, and truerate-UID-… is to be that user's. */
static inline int truerate_open(struct truerate *rate, const char *path) {
    struct stat there;
    unsigned owner;
    memset(rate, 0, sizeof *rate);
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) return -1;
    void *base = MAP_FAILED;
    int known = fstat(file, &there) == 0;
    if (known && sscanf(path, "/dev/shm/truerate-%u-", &owner) == 1 && there.st_uid != owner) {
        close(file);
        errno = EACCES;
        return -1;
    }
    if (known && there.st_size >= TRUERATE_HEAD)
        base = mmap(NULL, (size_t)there.st_size, PROT_READ, MAP_SHARED, file, 0);
    close(file);
    if (base == MAP_FAILED) { errno = EPROTO; return -1; }
    rate->base = base;
    rate->length = (size_t)there.st_size;
    rate->slots = truerate_word(rate, 16);
    if (memcmp(base, "truerate", 8) != 0 || truerate_word(rate, 8) != TRUERATE_VERSION ||
        truerate_word(rate, 12) != sizeof(struct truerate_row) || rate->slots == 0 ||
        TRUERATE_HEAD + (uint64_t)rate->slots * (8 + sizeof(struct truerate_row)) > rate->length) {
        truerate_close(rate);
        errno = EPROTO;
        return -1;
    }
    return 0;
}

/* Reads row `number` (from 1); 1 where it is there and whole, 0 where it was written over or is not there yet. */
static inline int truerate_read(const struct truerate *rate, uint64_t number, struct truerate_row *row) {
    size_t at = TRUERATE_HEAD + (size_t)((number - 1) % rate->slots) * (8 + sizeof *row);
    if (number == 0 || truerate_long(rate, at) != number) return 0;
    memcpy(row, rate->base + at + 8, sizeof *row);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    return __atomic_load_n((const uint64_t *)(const void *)(rate->base + at), __ATOMIC_RELAXED) == number;
}

/* The newest row, without waiting: 1 where it is new, 0 where nothing is new. */
static inline int truerate_newest(struct truerate *rate, struct truerate_row *row) {
    for (;;) {
        uint64_t written = truerate_long(rate, 40);
        if (written == rate->seen) return 0;
        if (truerate_read(rate, written, row)) { rate->seen = written; return 1; }
    }
}

/* The next newest row, waited for at most so many milliseconds: 1; 0 where none came; -1 where the pipeline has ended. */
static inline int truerate_wait(struct truerate *rate, struct truerate_row *row, int milliseconds) {
    struct timespec start, now;
    clock_gettime(CLOCK_MONOTONIC, &start);
    for (;;) {
        uint32_t word = truerate_word(rate, 36);
        if (truerate_newest(rate, row)) return 1;
        if (truerate_word(rate, 32) == 2) return -1;
        clock_gettime(CLOCK_MONOTONIC, &now);
        int64_t left = milliseconds * 1000000LL - ((now.tv_sec - start.tv_sec) * 1000000000LL + now.tv_nsec - start.tv_nsec);
        if (left <= 0) return 0;
        struct timespec rest = {left / 1000000000LL, left % 1000000000LL};
        syscall(SYS_futex, rate->base + 36, FUTEX_WAIT, word, &rest, NULL, 0);
    }
}

#endif
