//! One axis of the estimator: compensated rate in, filter and open-loop angle out.

use super::{
    AxisEstimate, Jerk, Options,
    cross_check::Shown,
    flags,
    motion::Motion,
    reference::{Known, Reference},
    reference_noise::{LONGEST, LONGEST_TURNING},
    spread::Spread,
    trend::{self, Trend},
};
use crate::{
    compensation::{Compensation, Identified},
    history::seconds,
    kalman::{Drive, Fate, Filter, Innovation, Measured, RATE_UNKNOWN},
    observer::Observer,
    process_noise::{HOLE, ProcessNoise},
};
use std::f64::consts::{PI, SQRT_2, TAU};

/// Standard deviation of the first angle of a reference that nothing is known of yet, rad.
const ANGLE_UNKNOWN: f64 = 0.1;

/// Times by which that variance has to exceed the model's to contradict it.
const EXCEEDS: f64 = 16.0;

/// Readings after a spike or a step whose interpolation still depends on it.
const UNREST: u8 = 4;

/// Variance of a gyro reading as long as fewer than [`SPREAD_KNOWN`] are there, (rad/s)² (0.6 °/s).
const READING_UNKNOWN: f64 = 1e-4;
const SPREAD_KNOWN: f64 = 12.0;

/// Smallest variance of a rate reading, (rad/s)²: no filter believes more than a nanoradian a second.
const RATE_VARIANCE_MIN: f64 = 1e-18;

/// Time between readings while there has been one only, s: rather more noise than there is than less.
const FIRST: f64 = 1e-3;

/// No angle or rate of a reference beyond this is believed, rad or rad/s.
const ANGLE_MAX: f64 = 1e9;

/// Standard deviation of an angle by which the turn that it is in is known, rad.
const KNOWN_TURN: f64 = 0.5 * PI;

/// An acceleration in the past is the change of the rate from so long before to so long after, s.
const AROUND: f64 = 0.02;

/// Readings beyond one turn that an encoder is believed not to wrap after.
const BELIEVED: u32 = 3;

/// The instant of one step.
pub(super) struct Moment {
    pub valid_t_ns: i64,
    /// Since the last one, s.
    pub dt: f64,
}

/// What an orientation shows of one axis beyond the estimate, rad: altogether, and since the last one.
#[derive(Clone, Copy)]
pub(super) struct Missing {
    pub angle: f64,
    pub increment: f64,
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
    /// What the state is compensated with.
    calibrated: Identified,
    angle_reference: Reference,
    rate_reference: Reference,
    /// The references have shown that the model's bias or scale is wrong: until one comes that is right, they count as not fitted.
    doubted: bool,
    /// Of the innovations beside either reference.
    angle_trend: Trend,
    rate_trend: Trend,
    /// Where a reading was left out, or began anew, since the last reference: readings until a cubic through them knows nothing of that.
    unrest: Option<u8>,
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
                filter: Filter::new(0.0, RATE_VARIANCE_MIN, identified.calibration),
                process_noise: ProcessNoise::default(),
                observer: options.gain.observer().map(Observer::new),
                spread: Spread::default(),
                calibrated: identified,
                angle_reference: Reference::new(identified.calibration.delay_std),
                rate_reference: Reference::new(identified.calibration.delay_std),
                doubted: false,
                angle_trend: Trend::default(),
                rate_trend: Trend::default(),
                unrest: None,
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
        let (now, before) = (self.identified, std::mem::replace(&mut state.calibrated, self.identified));
        let gain = now.affine[0] / before.affine[0];
        let offset = now.affine[1] - gain * before.affine[1];
        let is_rescaled = now.effects == before.effects && gain.is_finite();
        // A fit over readings from before a change describes the sensor that was.
        let is_own = !now.is_fitted || state.doubted || state.filter.knows(now.calibration);
        (state.angle_trend, state.rate_trend) = (Trend::default(), Trend::default());
        let rate = state.filter.rate();
        for reference in [&mut state.angle_reference, &mut state.rate_reference] {
            if is_rescaled {
                reference.rescale(gain, offset, rate);
            } else {
                *reference = Reference::new(now.calibration.delay_std);
            }
        }
        if is_rescaled {
            state.rate_reference.rescale_signal(gain, offset);
        }
        state.noise_gain_interval = 0.0;
        if state.started {
            if is_rescaled && is_own {
                state.filter.rescale_compensation(step, gain, offset);
                state.doubted &= !state.filter.agrees(now.calibration);
            } else {
                state.filter.step_compensation(step, now.calibration);
                state.doubted = false;
            }
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
        let spread = self.state.spread;
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
                state.filter = Filter::new(rate, r, self.identified.calibration);
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
            // Over a hole the prediction goes on with the last acceleration. The reading after it knows better, however far off it is.
            if state.filter.untaken() > HOLE * state.spread.interval {
                state.filter.believe();
            }
            let innovation = state.filter.update(Measured::Gyro, rate, r);
            out.innovation = innovation.value;
            out.innovation_std = innovation.std;
            out.nis = innovation.nis();
            out.flags |= match innovation.fate {
                Fate::Taken => 0,
                Fate::Rejected => flags::OUTLIER,
                Fate::Restarted => flags::RESTARTED,
            };
            if innovation.fate == Fate::Rejected {
                // A spike is no noise, and what it adds to the integral has not been turned.
                state.spread = spread;
            }
            if innovation.fate == Fate::Taken {
                state.unrest = state.unrest.map(|left| left.saturating_sub(1));
            } else {
                state.unrest = Some(UNREST);
            }
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
        if !self.state.started {
            return;
        }
        let known = self.known(compensation, when, &self.state.angle_reference);
        let state = &mut self.state;
        let expected = state.filter.angle() - when.since;
        if state.beyond_a_turn < BELIEVED {
            let beyond = reading.abs() > TAU + 0.1 && (reading - expected).abs() < PI && state.turns == 0.0;
            state.beyond_a_turn = if beyond { state.beyond_a_turn + 1 } else { 0 };
        }
        let mut reading = reading;
        if state.anchored && state.beyond_a_turn < BELIEVED {
            let open = Self::open_loop(state, compensation, self.axis, when);
            // From the last reading on, the angle is known to what rate and time make of it; or as the filter knows it.
            let next = state.angle_reference.expected(when.t_ns, open, &known, [state.filter.rate_std(), KNOWN_TURN]);
            let near = next.or_else(|| (state.filter.angle_std() < KNOWN_TURN).then_some(expected));
            // After so long a gap that the angle may be anywhere, nothing says that the shaft went round meanwhile.
            if let Some(ahead) = near.map(|near| near - reading - state.turns).filter(|ahead| ahead.abs() > PI) {
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
            self.take_absolute(compensation, when, angle, None, out);
        }
    }

    /// The difference between an orientation's angle and the filter's; returns what the filter took of it.
    pub(super) fn take_difference(
        &mut self,
        compensation: &Compensation,
        when: &ReferenceTime,
        missing: Missing,
        out: &mut AxisEstimate,
    ) -> f64 {
        if !self.state.started {
            return 0.0;
        }
        if !self.state.anchored {
            self.take_absolute(compensation, when, 0.0, None, out);
            return 0.0;
        }
        let before = self.state.filter.angle();
        self.take_absolute(compensation, when, before - when.since + missing.angle, Some(missing.increment), out);
        self.state.filter.angle() - before
    }

    /// The true angle at the reference's time. `increment` is what it has turned further since the last one than the estimate, where that
    /// is not the difference of two angles.
    fn take_absolute(
        &mut self,
        compensation: &Compensation,
        when: &ReferenceTime,
        angle: f64,
        increment: Option<f64>,
        out: &mut AxisEstimate,
    ) {
        let noise = self.identified.noise;
        let walk = noise.angle_random_walk.powi(2);
        if !self.state.anchored {
            // The model's reference may have been another one, and how late this one is, is not known yet.
            let state = &mut self.state;
            let late = self.identified.calibration.delay_std * state.filter.rate();
            state.anchored = true;
            state.filter.anchor(angle + when.since, ANGLE_UNKNOWN.powi(2) + late.powi(2));
            state.angle = angle;
            state.integrated_to = when.t_ns;
        }
        let open = Self::open_loop(&self.state, compensation, self.axis, when);
        let known = self.known(compensation, when, &self.state.angle_reference);
        let known = Known { over: if increment.is_some() { LONGEST_TURNING } else { LONGEST }, ..known };
        let state = &mut self.state;
        if state.unrest.is_some() {
            state.angle_reference.break_off();
            state.unrest = state.unrest.filter(|&left| left > 0);
        }
        let reference = &mut state.angle_reference;
        let heard = increment.and_then(|more| Some(reference.continued(when.t_ns, open, &known)? + more));
        let taken = reference.take_angle(when.t_ns, open, heard.unwrap_or(angle), &known);
        let (Some([late, variance]), true) = (taken, self.fuse) else { return };
        let r = variance + walk * seconds(when.valid_t_ns, when.t_ns).abs();
        let innovation = self.state.filter.update(Measured::Angle, angle + late + when.since, r);
        reported(&innovation, out);
        self.doubt(Measured::Angle, when.t_ns, &innovation, out);
    }

    /// ∫ rate dt from the first reference up to this one, rad.
    fn open_loop(state: &AxisState, compensation: &Compensation, axis: usize, when: &ReferenceTime) -> f64 {
        state.angle + compensation.history(axis).integral(state.integrated_to, when.valid_t_ns) - when.since
    }

    /// What is known of a reference's noise, and of the instant that it shows.
    fn known(&self, compensation: &Compensation, when: &ReferenceTime, reference: &Reference) -> Known {
        let (noise, state) = (&self.identified.noise, &self.state);
        let believed = noise.encoder > 0.0 && self.identified.is_fitted && !state.doubted;
        let walk = match noise.angle_random_walk {
            n if n > 0.0 => n * n,
            _ => state.spread.variance * state.spread.interval,
        };
        let (bias, scale) = (state.filter.bias(), state.filter.scale());
        let (late, _) = reference.check.delay();
        let (shown, gain) = (self.shown(compensation, when.t_ns, late), 1.0 / (1.0 + scale));
        let now = compensation.history(self.axis).value(when.t_ns).unwrap_or(shown.signal);
        Known {
            encoder: believed.then_some(noise.encoder),
            walk,
            over: LONGEST,
            bias,
            scale,
            rate: gain * (shown.signal - bias),
            acceleration: gain * shown.slope,
            turned: gain * (shown.since - bias * late),
            faster: gain * (now - shown.signal),
            shown,
        }
    }

    /// The instant that a reference shows at `t_ns` which is `late` seconds late.
    fn shown(&self, compensation: &Compensation, t_ns: i64, late: f64) -> Shown {
        let (history, spread) = (compensation.history(self.axis), &self.state.spread);
        let then = |later: f64| t_ns.saturating_add(((later - late) * 1e9).round() as i64);
        let value = |later: f64| history.value(then(later)).unwrap_or(0.0);
        let noise = if spread.count < SPREAD_KNOWN { READING_UNKNOWN } else { spread.variance };
        Shown {
            since: history.integral(then(0.0), t_ns),
            signal: value(0.0),
            slope: (value(AROUND) - value(-AROUND)) / (2.0 * AROUND),
            signal_variance: noise,
            slope_variance: 2.0 * noise / (2.0 * AROUND).powi(2),
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
            let state = &mut self.state;
            state.anchored = true;
            state.filter.anchor(when.since, ANGLE_UNKNOWN.powi(2));
            (state.angle, state.integrated_to) = (0.0, when.t_ns);
        }
        let history = compensation.history(self.axis);
        let (Some(now), Some(then)) = (history.value(when.valid_t_ns), history.value(when.t_ns)) else { return };
        let state = &self.state;
        let least = state.spread.variance.max(RATE_VARIANCE_MIN);
        let known = self.known(compensation, when, &self.state.rate_reference);
        let taken = self.state.rate_reference.take_rate(when.t_ns, then, reading, least, &known);
        let (Some([late, r]), true) = (taken, self.fuse) else { return };
        let innovation = self.state.filter.update(Measured::Rate, reading + late + now - then, r);
        reported(&innovation, out);
        self.doubt(Measured::Rate, when.t_ns, &innovation, out);
    }

    /// Takes bias and scale error from the references alone where they contradict the filter's; where its innovations say that they have
    /// changed, it knows them no longer.
    fn doubt(&mut self, measured: Measured, t_ns: i64, innovation: &Innovation, out: &mut AxisEstimate) {
        let state = &mut self.state;
        let rate = state.filter.rate();
        let (reference, trend, over) = match measured {
            Measured::Rate => (&mut state.rate_reference, &mut state.rate_trend, trend::OF_RATES),
            Measured::Angle | Measured::Gyro => (&mut state.angle_reference, &mut state.angle_trend, trend::OF_ANGLES),
        };
        if let Some(off) = trend.take(t_ns as f64 * 1e-9, innovation.value / innovation.std, rate, over) {
            let astray = if measured == Measured::Angle { innovation.value } else { 0.0 };
            state.filter.widen_calibration(off, astray);
            state.doubted = true;
            reference.check.forget(off);
            out.flags |= flags::CHANGED;
            return;
        }
        let (main, covariance) = state.filter.residual_calibration();
        if let Some((calibration, covariance)) = reference.check.contradicts(main, covariance) {
            state.filter.recalibrate(calibration, covariance);
            state.doubted = true;
            out.flags |= flags::CHANGED;
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
    /// differences where the model has no N, or one that they contradict.
    fn rate_variance(&mut self, compensation: &Compensation) -> f64 {
        let state = &mut self.state;
        let n = self.identified.noise.angle_random_walk;
        // How far apart readings are is not known at the first.
        let interval = if state.started { state.spread.interval } else { FIRST };
        if !(n > 0.0 && interval > 0.0) {
            let known = state.spread.count >= SPREAD_KNOWN;
            return state.spread.variance.max(if known { RATE_VARIANCE_MIN } else { READING_UNKNOWN });
        }
        if (interval - state.noise_gain_interval).abs() > 0.1 * interval {
            state.noise_gain = compensation.noise_gain(self.axis, interval);
            state.noise_gain_interval = interval;
        }
        let by_model = n * n / interval * state.noise_gain;
        let variance = if state.spread.least > EXCEEDS * by_model { state.spread.least } else { by_model };
        variance.max(RATE_VARIANCE_MIN)
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
