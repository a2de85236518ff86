//! One axis of the estimator: compensated rate in, filter and open-loop angle out.

use super::{AxisEstimate, Jerk, Options, flags};
use crate::{
    compensation::{Compensation, Identified},
    history::seconds,
    kalman::{Drive, Fate, Filter, Innovation, Measured, RATE_UNKNOWN},
    observer::Observer,
    process_noise::ProcessNoise,
};
use std::f64::consts::{PI, SQRT_2, TAU};

/// Standard deviation of a reference angle where the model has none, rad.
const ENCODER_UNKNOWN: f64 = 1e-3;

/// Smallest variance of a rate reading, (rad/s)²: no filter believes more than a nanoradian a second.
const RATE_VARIANCE_MIN: f64 = 1e-18;

/// Time between readings while there has been one only, s: rather more noise than there is than less.
const FIRST: f64 = 1e-3;

/// No angle or rate of a reference beyond this is believed, rad or rad/s.
const ANGLE_MAX: f64 = 1e9;

/// Over how many samples noise and interval are averaged.
const AVERAGE: f64 = 256.0;

/// Over what time the motion's own frequency is averaged, s.
const MOTION_MEMORY: f64 = 4.0;
/// Standard deviation of an angle by which the turn that it is in is known, rad.
const KNOWN_TURN: f64 = 0.5 * PI;
/// Readings beyond one turn that an encoder is believed not to wrap after.
const BELIEVED: u32 = 3;

/// The instant of one step.
pub(super) struct Moment {
    pub valid_t_ns: i64,
    /// Since the last one, s.
    pub dt: f64,
}

/// When a reference was read, and what has turned since.
pub(super) struct ReferenceTime {
    pub t_ns: i64,
    /// The filter's instant.
    pub valid_t_ns: i64,
    /// ∫ rate dt from one to the other, rad.
    pub since: f64,
}

/// What an axis remembers, as plain data.
#[derive(Clone, Copy, Debug)]
pub(super) struct AxisState {
    started: bool,
    anchored: bool,
    filter: Filter,
    process_noise: ProcessNoise,
    observer: Option<Observer>,
    spread: Spread,
    reference_spread: Spread,
    motion: Motion,
    /// ∫ rate dt up to `integrated_to`.
    angle: f64,
    integrated_to: i64,
    /// ∫ rate dt since the first sample, for the observer.
    gyro_angle: f64,
    /// Whole turns added to a wrapped encoder, rad.
    turns: f64,
    /// Readings in a row that lie beyond one turn just where the angle was expected: such an encoder does not wrap.
    beyond_a_turn: u32,
    /// The interval and gain for which the responses' noise gain was computed.
    noise_gain: f64,
    noise_gain_interval: f64,
}

/// See the module's head.
pub(super) struct AxisEstimator {
    axis: usize,
    jerk: Jerk,
    fuse: bool,
    identified: Identified,
    state: AxisState,
}

/// White noise of a sampled signal from its third differences (which a smooth motion leaves alone), and its interval.
#[derive(Clone, Copy, Debug, Default)]
struct Spread {
    last: [f64; 3],
    variance: f64,
    interval: f64,
    t_ns: i64,
    count: f64,
}

impl Spread {
    fn take(&mut self, t_ns: i64, value: f64) {
        let dt = seconds(t_ns, self.t_ns);
        if self.count > 0.0 && dt <= 0.0 {
            return;
        }
        let weight = 1.0 / self.count.clamp(1.0, AVERAGE);
        if self.count == 1.0 {
            self.interval = dt;
        } else if self.count > 1.0 {
            self.interval += weight * (dt.clamp(0.3 * self.interval, 3.0 * self.interval) - self.interval);
        }
        let [a, b, c] = self.last;
        if self.count >= 3.0 {
            // Σ of squared weights 1, 3, 3, 1 is 20.
            let square = (value - 3.0 * a + 3.0 * b - c).powi(2) / 20.0;
            self.variance += (square - self.variance) / (self.count - 2.0).min(AVERAGE);
        }
        self.last = [value, a, b];
        self.t_ns = t_ns;
        self.count += 1.0;
    }
}

/// The motion of the last seconds: mean squares of rate and acceleration (its own frequency is √(E a²/E ω²)/2π), and
/// the filter's delay, weighed by a².
#[derive(Clone, Copy, Debug, Default)]
struct Motion {
    rate: f64,
    acceleration: f64,
    lag: f64,
}

impl Motion {
    /// Takes the filter's rate and acceleration; `tau` = (N²/q)^¼ is the time over which it averages. The stationary
    /// filter's response from true to filtered rate is (1 + √2 jωτ)/(1 − ω²τ² + √2 jωτ).
    fn take(&mut self, rate: f64, acceleration: f64, tau: f64, dt: f64) {
        let forget = -(-dt / MOTION_MEMORY).exp_m1();
        self.rate += forget * (rate * rate - self.rate);
        self.acceleration += forget * (acceleration * acceleration - self.acceleration);
        let omega = (self.acceleration / self.rate.max(f64::MIN_POSITIVE)).sqrt().clamp(1e-6, 1e6);
        let x = (omega * tau).min(1e6);
        let now = ((SQRT_2 * x).atan2(1.0 - x * x) - (SQRT_2 * x).atan()) / omega;
        let weighed = now * acceleration * acceleration;
        if weighed.is_finite() {
            self.lag += forget * (weighed - self.lag);
        }
    }

    /// The filter's delay, s.
    fn lag(&self) -> f64 {
        if self.acceleration > 0.0 { self.lag / self.acceleration } else { 0.0 }
    }
}

impl AxisEstimator {
    pub(super) fn new(axis: usize, options: &Options, identified: Identified) -> Self {
        Self {
            axis,

            jerk: options.jerk,
            fuse: options.fuse_reference,
            identified,
            state: AxisState {
                started: false,
                anchored: false,
                filter: Filter::new(0.0, RATE_VARIANCE_MIN, identified.bias_std),
                process_noise: ProcessNoise::default(),
                observer: options.gain.observer().map(Observer::new),
                spread: Spread::default(),
                reference_spread: Spread::default(),
                motion: Motion::default(),
                angle: 0.0,
                integrated_to: 0,
                gyro_angle: 0.0,
                turns: 0.0,
                beyond_a_turn: 0,
                noise_gain: 1.0,
                noise_gain_interval: 0.0,
            },
        }
    }

    pub(super) fn save(&self) -> AxisState {
        self.state
    }

    pub(super) fn restore(&mut self, state: &AxisState) {
        self.state = *state;
    }

    pub(super) fn started(&self) -> bool {
        self.state.started
    }

    pub(super) fn anchored(&self) -> bool {
        self.state.anchored
    }

    /// The filter's angle; counted from the first sample as long as there is no reference.
    pub(super) fn angle(&self) -> f64 {
        self.state.filter.angle()
    }

    /// Another model: the compensated rate steps by `step`; this axis' times of validity by `own` ns, and the time that all
    /// axes are estimated at, `valid_t_ns` so far, by `shift`.
    pub(super) fn set_model(
        &mut self,
        compensation: &Compensation,
        step: f64,
        valid_t_ns: i64,
        [own, shift]: [i64; 2],
    ) {
        self.identified = compensation.identified(self.axis);
        let state = &mut self.state;
        state.noise_gain_interval = 0.0;
        if state.started {
            state.filter.step_compensation(step, self.identified.bias_std);
            state.integrated_to = state.integrated_to.saturating_add(own);
            let moved = [own, shift].map(|by| valid_t_ns.saturating_add(by));
            state.filter.turn(compensation.history(self.axis).integral(moved[0], moved[1]));
            state.spread.t_ns = state.spread.t_ns.saturating_add(shift);
            state.spread.last = state.spread.last.map(|rate| rate + step);
            state.process_noise.shift(step);
        }
    }

    /// Moves to an instant with its reading, if there is one.
    pub(super) fn step(&mut self, compensation: &Compensation, moment: &Moment) -> AxisEstimate {
        let mut out = AxisEstimate::ABSENT;
        let history = compensation.history(self.axis);
        let (Some((newest, _)), Some(rate)) = (history.newest(), history.value(moment.valid_t_ns)) else {
            return out;
        };
        out.present = true;
        out.rate = rate;
        let read = newest >= moment.valid_t_ns;
        let lost = compensation.lost(self.axis, moment.valid_t_ns);
        if read && !lost {
            self.state.spread.take(moment.valid_t_ns, rate);
        }
        out.flags = if read { 0 } else { flags::HELD } | (if lost { flags::LOST } else { 0 });
        self.integrate(compensation, moment, newest);
        let r = self.rate_variance(compensation);
        let state = &mut self.state;
        if !state.started {
            if read {
                state.started = true;
                // Inside a dead zone or beyond the range a first reading says nothing of the rate.
                let r = if lost { RATE_UNKNOWN.powi(2) } else { r };
                state.filter = Filter::new(rate, r, self.identified.bias_std);
                state.process_noise.step(rate, r, 0.0, 1.0);
            }
            return out;
        }
        let before = state.filter;
        let jerk = match self.jerk {
            Jerk::Fixed(density) => density,
            Jerk::Identified => state.process_noise.density(r, state.spread.interval),
        };
        let drive = Drive { jerk, bias_random_walk: self.identified.noise.bias_random_walk };
        state.filter.predict(moment.dt, &drive);
        if !state.anchored {
            state.filter.forget_angle_variance();
        }
        if read && !lost {
            let innovation = state.filter.update(Measured::Gyro, rate, r);
            out.innovation = innovation.value;
            out.innovation_std = innovation.std;
            out.nis = innovation.nis();
            out.flags |= match innovation.fate {
                Fate::Taken => 0,
                Fate::Rejected => flags::OUTLIER,
                Fate::Restarted => flags::RESTARTED,
            };
            state.process_noise.step(rate, r, moment.dt, state.spread.interval);
        }
        if !state.filter.is_finite() {
            state.filter = before;
        }
        // A stationary gain K of the rate is √2 dt/τ where it is small; at K = 1 nothing is averaged.
        let gain = state.filter.rate_gain(r);
        let tau = SQRT_2 * state.spread.interval * (1.0 - gain) / gain;
        state.motion.take(state.filter.rate(), state.filter.acceleration(), tau, moment.dt);
        out.lag = state.motion.lag();
        out
    }

    /// Fills in what the references of this instant may have changed.
    pub(super) fn report(&self, compensation: &Compensation, valid_t_ns: i64, out: &mut AxisEstimate) {
        let state = &self.state;
        if !state.started {
            return;
        }
        if state.anchored {
            // Beyond the newest reading the rate is held, and integrated again once it is known.
            out.angle = state.angle + compensation.history(self.axis).integral(state.integrated_to, valid_t_ns);
            out.angle_fused = state.filter.angle();
        }
        out.rate_filtered = state.filter.rate();
        out.rate_std = state.filter.rate_std();
        out.bias = state.filter.bias();
        if let Some(observer) = &state.observer {
            out.rate_filtered = observer.rate();
            out.rate_std = f64::NAN;
            out.angle_fused = observer.angle();
        }
    }

    /// The rate held for `dt`, its uncertainty grown.
    pub(super) fn coast(&self, dt: f64, out: &mut AxisEstimate) {
        if !self.state.started {
            return;
        }
        let r = self.state.spread.variance.max(RATE_VARIANCE_MIN);
        let jerk = match self.jerk {
            Jerk::Fixed(density) => density,
            Jerk::Identified => self.state.process_noise.density(r, self.state.spread.interval),
        };
        let mut filter = self.state.filter;
        let drive = Drive { jerk, bias_random_walk: self.identified.noise.bias_random_walk };
        filter.predict(dt, &drive);
        out.flags = flags::HELD;
        out.rate_std = filter.rate_std();
        out.angle += out.rate * dt;
        out.angle_fused += out.rate_filtered * dt;
        (out.innovation, out.innovation_std, out.nis) = (f64::NAN, f64::NAN, f64::NAN);
    }

    /// A shaft angle.
    pub(super) fn take_angle(
        &mut self,
        compensation: &mut Compensation,
        when: &ReferenceTime,
        reading: f64,
        out: &mut AxisEstimate,
    ) {
        let state = &mut self.state;
        if !state.started {
            return;
        }
        let expected = state.filter.angle() - when.since;
        if state.beyond_a_turn < BELIEVED {
            let beyond = reading.abs() > TAU + 0.1 && (reading - expected).abs() < PI && state.turns == 0.0;
            state.beyond_a_turn = if beyond { state.beyond_a_turn + 1 } else { 0 };
        }
        let mut reading = reading;
        if state.anchored && state.beyond_a_turn < BELIEVED {
            let ahead = expected - reading - state.turns;
            // After so long a gap that the angle may be anywhere, nothing says that the shaft went round meanwhile.
            if ahead.abs() > PI && state.filter.angle_std() < KNOWN_TURN {
                state.turns += (ahead / TAU).round() * TAU;
            }
            reading += state.turns;
        }
        // The encoder's own errors depend on the angle that they spoil: once about what is known, once about the result.
        let about = if state.anchored { expected } else { reading };
        let rough = reading - compensation.reference_error(self.axis, when.t_ns, about, false).sum;
        let error = compensation.reference_error(self.axis, when.t_ns, rough, true);
        if error.silent && state.anchored {
            return;
        }
        let angle = reading - error.sum;
        if angle.is_finite() && angle.abs() < ANGLE_MAX {
            self.take_absolute(when, angle, out);
        }
    }

    /// The difference between an orientation's angle and the filter's; returns what the filter took of it.
    pub(super) fn take_difference(&mut self, when: &ReferenceTime, difference: f64, out: &mut AxisEstimate) -> f64 {
        if !self.state.started {
            return 0.0;
        }
        if !self.state.anchored {
            self.take_absolute(when, 0.0, out);
            return 0.0;
        }
        let before = self.state.filter.angle();
        self.take_absolute(when, before - when.since + difference, out);
        self.state.filter.angle() - before
    }

    /// The true angle at the reference's time.
    fn take_absolute(&mut self, when: &ReferenceTime, angle: f64, out: &mut AxisEstimate) {
        let state = &mut self.state;
        let noise = &self.identified.noise;
        let encoder = if noise.encoder > 0.0 { noise.encoder } else { ENCODER_UNKNOWN };
        let r = encoder.powi(2) + noise.angle_random_walk.powi(2) * seconds(when.valid_t_ns, when.t_ns).abs();
        if !state.anchored {
            state.anchored = true;
            state.filter.anchor(angle + when.since, r);
            state.angle = angle;
            state.integrated_to = when.t_ns;
        } else if self.fuse {
            let innovation = state.filter.update(Measured::Angle, angle + when.since, r);
            reported(&innovation, out);
        }
    }

    /// A rate read at the reference's time; what the compensated rate has changed since is added to it.
    pub(super) fn take_rate(
        &mut self,
        compensation: &Compensation,
        when: &ReferenceTime,
        reading: f64,
        out: &mut AxisEstimate,
    ) {
        if !self.state.started || reading.abs() > ANGLE_MAX {
            return;
        }
        if !self.state.anchored {
            self.take_absolute(when, 0.0, out);
        }
        let history = compensation.history(self.axis);
        let change = match (history.value(when.valid_t_ns), history.value(when.t_ns)) {
            (Some(now), Some(then)) => now - then,
            _ => 0.0,
        };
        let state = &mut self.state;
        state.reference_spread.take(when.t_ns, reading);
        let r = state.reference_spread.variance.max(state.spread.variance).max(RATE_VARIANCE_MIN);
        if self.fuse && state.reference_spread.count > 8.0 {
            let innovation = state.filter.update(Measured::Rate, reading + change, r);
            reported(&innovation, out);
        }
    }

    /// Integrates the compensated rate up to this instant, or to the newest reading where that is earlier.
    fn integrate(&mut self, compensation: &Compensation, moment: &Moment, newest: i64) {
        let history = compensation.history(self.axis);
        let state = &mut self.state;
        let to = moment.valid_t_ns.min(newest);
        if state.anchored && to > state.integrated_to {
            state.angle += history.integral(state.integrated_to, to);
            state.integrated_to = to;
        }
        if let Some(observer) = &mut state.observer {
            let from = moment.valid_t_ns.saturating_sub((moment.dt * 1e9).round() as i64);
            state.gyro_angle += history.integral(from, moment.valid_t_ns);
            observer.step(state.gyro_angle, moment.dt);
        }
    }

    /// Variance of one compensated reading: N²/dt, times what undoing a lag or resonance makes of it; from third
    /// differences where the model has no N.
    fn rate_variance(&mut self, compensation: &Compensation) -> f64 {
        let state = &mut self.state;
        let n = self.identified.noise.angle_random_walk;
        // How far apart readings are is not known at the first.
        let interval = if state.started { state.spread.interval } else { FIRST };
        if !(n > 0.0 && interval > 0.0) {
            return state.spread.variance.max(RATE_VARIANCE_MIN);
        }
        if (interval - state.noise_gain_interval).abs() > 0.1 * interval {
            state.noise_gain = compensation.noise_gain(self.axis, interval);
            state.noise_gain_interval = interval;
        }
        (n * n / interval * state.noise_gain).max(RATE_VARIANCE_MIN)
    }
}

/// Writes a reference's innovation into the estimate.
fn reported(innovation: &Innovation, out: &mut AxisEstimate) {
    out.reference_innovation = innovation.value;
    out.reference_innovation_std = innovation.std;
    out.flags |= match innovation.fate {
        Fate::Taken => flags::REFERENCE,
        Fate::Rejected => flags::REFERENCE_OUTLIER,
        Fate::Restarted => flags::REFERENCE | flags::RESTARTED,
    };
}
