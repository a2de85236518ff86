/* @HEADING@.
 *
 * Compensates the readings of a gyro, one at a time, as `truerate apply` does:
 *
 *     truerate_state state;
 *     truerate_begin(&state);
 *     ... at each reading:
 *     truerate_in in = { t_ns, { gyro_x, gyro_y, gyro_z } };  (rad/s; NAN for an axis that has none)
 *     truerate_out out = truerate_step(&state, &in);
 *     ... out.rate[i] is the rate that was true at out.valid_t_ns[i] (`truerate apply` gives all axes at the earliest of these).
 *
 * Clock: t_ns is the gyro's own stamp, on the clock of the log that the model was fitted on (where a reference had another one, it was
 * set to the gyro's). out.valid_t_ns counts on the same clock, earlier than t_ns by the gyro's delay.
 *
@NOTES@ *
 * Doubles throughout. The same to the last bit as truerate where the model needs only + - * /; compile with
 * -ffp-contract=off for that (the default of -std=c99), and never with -ffast-math: NAN means that there is no value.
 */
#ifndef TRUERATE_MODEL_H
#define TRUERATE_MODEL_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* One reading. */
typedef struct {
    int64_t t_ns;       /* the gyro's own time stamp, ns; from any origin, but from power-on where an effect depends on time */
    double gyro[3];     /* readings of x, y, z, rad/s; NAN where an axis has none */
@INPUTS@} truerate_in;

/* What it comes to. */
typedef struct {
    double rate[3];         /* compensated rates, rad/s; NAN where there was no reading */
    int64_t valid_t_ns[3];  /* when they were true, ns on the clock of the readings */
    int lost[3];            /* 1 where the reading says nothing about the rate: within a dead zone, at the end of the range */
} truerate_out;

/* What is remembered from reading to reading. */
typedef struct {
    double memory[@MEMORIES@][8];
    double accel[3], temperature, supply, supply_origin, angle[3], channel[8];
    double rates[3][2], step[3], output[3];
    int64_t t_ns[3], settles_t_ns[3];
    int started[3], count[3], wanted[3];
} truerate_state;

/* One instant as an effect sees it. */
typedef struct {
    double t, dt, rate, rates[3], rate_dot, angle, accel[3], delta_temperature, delta_supply, supply, channel[8];
} truerate_signals;

static inline double truerate_finite(double value, double otherwise)
{
    return isfinite(value) ? value : otherwise;
}

static inline void truerate_hold(double *held, double value)
{
    if (isfinite(value)) {
        *held = value;
    }
}

static inline double truerate_sign(double x)
{
    return x > 0.0 ? 1.0 : x < 0.0 ? -1.0 : x;
}

/* Small whole exponents by multiplication. */
static inline double truerate_power(double base, double exponent)
{
    if (exponent != floor(exponent) || !(fabs(exponent) <= 16.0)) {
        return pow(base, exponent);
    }
    double result = 1.0;
    for (int n = (int)fabs(exponent); n > 0; n /= 2) {
        if (n % 2 == 1) {
            result *= base;
        }
        base *= base;
    }
    return exponent < 0.0 ? 1.0 / result : result;
}

@EFFECTS@static inline double truerate_felt(double (*error)(const truerate_signals *, double *), const truerate_signals *in,
                                   double *memory, int commit)
{
    double copy[8];
    memcpy(copy, memory, sizeof copy);
    const double value = error(in, copy);
    if (commit) {
        memcpy(memory, copy, sizeof copy);
    }
    return truerate_finite(value, 0.0);
}

/* What the sensor feels beside the rate of this axis, rad/s. */
static inline double truerate_felt_error(truerate_state *state, int axis, const truerate_signals *in, int commit)
{
    double sum = 0.0;
    (void)state, (void)in, (void)commit;
    switch (axis) {
@FELT@    default:
        break;
    }
    return sum;
}

/* The sensor's own response undone, one step. */
static inline double truerate_undo_sensor(truerate_state *state, int axis, double rate, double dt)
{
    (void)state, (void)dt;
    switch (axis) {
@SENSOR@    default:
        break;
    }
    return rate;
}

/* The mount's response undone, one step. */
static inline double truerate_undo_mount(truerate_state *state, int axis, double rate, double dt)
{
    (void)state, (void)dt;
    switch (axis) {
@MOUNT@    default:
        break;
    }
    return rate;
}

/* When a reading taken at t_ns was true. */
static inline int64_t truerate_valid_t_ns(int axis, int64_t t_ns)
{
    const double taken = (double)t_ns * 1e-9;
    double t = taken;
    switch (axis) {
@VALID@    default:
        break;
    }
    return t_ns + (int64_t)round((t - taken) * 1e9);
}

/* Whether a reading says nothing about the rate; then the responses begin again beyond it, and what they make of the next
 * few readings is unsure. */
static inline int truerate_is_lost(truerate_state *state, int axis, double reading, int64_t t_ns)
{
    int lost = 0;
    double reach = -1.0;
    (void)reading;
    switch (axis) {
@LOST@    default:
        break;
    }
    switch (axis) {
@REACH@    default:
        break;
    }
    if (lost) {
        switch (axis) {
@FORGET@        default:
            break;
        }
    }
    if (reach < 0.0) {
        return lost;
    }
    if (lost) {
        state->wanted[axis] = 2;
        return 1;
    }
    if (state->wanted[axis] == 0) {
        return t_ns < state->settles_t_ns[axis];
    }
    state->wanted[axis] -= 1;
    state->settles_t_ns[axis] = t_ns + (int64_t)(reach * 1e9);
    return 1;
}

/* d(rate)/dt at a new rate: the slope there of the parabola through the last three. */
static inline double truerate_slope(const truerate_state *state, int axis, double rate, double dt)
{
    if (state->count[axis] == 0 || dt <= 0.0) {
        return 0.0;
    }
    const double now = (rate - state->rates[axis][0]) / dt;
    if (state->count[axis] == 1 || state->step[axis] <= 0.0) {
        return now;
    }
    const double before = (state->rates[axis][0] - state->rates[axis][1]) / state->step[axis];
    return now + (now - before) * dt / (dt + state->step[axis]);
}

static inline truerate_signals truerate_seen(const truerate_state *state, int axis, int64_t t_ns, const double rates[3],
                                             double dt)
{
    truerate_signals in;
    in.t = (double)t_ns * 1e-9;
    in.dt = dt;
    in.rate = rates[axis];
    in.rate_dot = truerate_slope(state, axis, rates[axis], dt);
    in.angle = state->angle[axis];
    in.delta_temperature = state->temperature - 25.0;
    in.delta_supply = truerate_finite(state->supply - state->supply_origin, 0.0);
    in.supply = truerate_finite(state->supply, 0.0);
    memcpy(in.rates, rates, sizeof in.rates);
    memcpy(in.accel, state->accel, sizeof in.accel);
    memcpy(in.channel, state->channel, sizeof in.channel);
    return in;
}

/* Before the first reading. */
static inline void truerate_begin(truerate_state *state)
{
    memset(state, 0, sizeof *state);
    state->temperature = 25.0;
    state->supply = NAN;
    state->supply_origin = @SUPPLY_ORIGIN@;
}

/* One reading in, compensated rates out. */
static inline truerate_out truerate_step(truerate_state *state, const truerate_in *in)
{
    static const double alpha[3] = { @ALPHA@ }, delta[3] = { @DELTA@ };
    truerate_out out;
    double felt[3], rates[3], dt[3], last = INFINITY;
    int present[3];
@HOLD@    for (int i = 0; i < 3; ++i) {
        present[i] = isfinite(in->gyro[i]) && fabs(in->gyro[i]) < 1e4;
        out.valid_t_ns[i] = truerate_valid_t_ns(i, in->t_ns);
        dt[i] = present[i] && state->started[i] ? (double)(in->t_ns - state->t_ns[i]) * 1e-9 : 0.0;
        felt[i] = state->rates[i][0];
        if (present[i]) {
            felt[i] = truerate_undo_sensor(state, i, alpha[i] * in->gyro[i] + delta[i], dt[i]);
        }
        rates[i] = felt[i];
    }
    /* What is felt goes by the rate that is sought: iterated until it stands. */
    for (int k = 0; k < 12; ++k) {
        double next[3], change = 0.0;
        int reached = 1;
        for (int i = 0; i < 3; ++i) {
            next[i] = rates[i];
            if (present[i]) {
                const truerate_signals seen = truerate_seen(state, i, in->t_ns, rates, dt[i]);
                next[i] = felt[i] - truerate_felt_error(state, i, &seen, 0);
                if (!isfinite(next[i]) || fabs(next[i]) > 1e4) {
                    next[i] = felt[i];
                }
            }
        }
        for (int i = 0; i < 3; ++i) {
            reached = reached && fabs(next[i] - rates[i]) <= 1e-13 * (1.0 + fabs(rates[i]));
            change = fmax(change, fabs(next[i] - rates[i]));
        }
        if (change > last) {
            break;
        }
        memcpy(rates, next, sizeof rates);
        last = change;
        if (reached) {
            break;
        }
    }
    for (int i = 0; i < 3; ++i) {
        if (present[i]) {
            const truerate_signals seen = truerate_seen(state, i, in->t_ns, rates, dt[i]);
            truerate_felt_error(state, i, &seen, 1);
        }
    }
    for (int i = 0; i < 3; ++i) {
        out.rate[i] = NAN;
        out.lost[i] = 0;
        if (!present[i]) {
            continue;
        }
        const double undone = truerate_undo_mount(state, i, rates[i], dt[i]);
        out.rate[i] = isfinite(undone) && fabs(undone) < 1e4 ? undone : state->output[i];
        out.lost[i] = truerate_is_lost(state, i, in->gyro[i], in->t_ns);
        state->started[i] = 1;
        state->t_ns[i] = in->t_ns;
        state->rates[i][1] = state->rates[i][0];
        state->rates[i][0] = rates[i];
        state->step[i] = dt[i];
        state->count[i] = state->count[i] < 2 ? state->count[i] + 1 : 2;
        state->output[i] = out.rate[i];
    }
    return out;
}

#ifdef __cplusplus
}
#endif

#endif /* TRUERATE_MODEL_H */
