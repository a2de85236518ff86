//! Compensation: from readings to rates, sample by sample, causal, without allocation.
//!
//! ```text
//! reading ω_g → lost?                        Reading: the sample is marked where the information is gone
//!             → u = α ω_g + δ                Calibration
//!             → undo the sensor's response   Response (lag): ω_f
//!             → ω̂ = ω_f − Σ β φ(ω̂, …)        Felt: fixed point in ω̂ over all axes together
//!             → undo the mount's response    Response (mount resonance)
//!             → valid at t − d               Timing
//! ```
//!
//! The fixed point converges where the errors are errors (|∂(βφ)/∂ω| < 1); each effect's memory is committed once a
//! sample, at the last iterate. An accelerometer, thermometer or supply that has no value at a row holds its last one.

use crate::{
    AxisModel, Model, Noise, Row,
    effects::{Effect, Memory, Signals, Stage, Trait},
    history::{History, seconds},
    kalman::Calibration,
    record::FREE_CHANNELS,
};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Effects of one axis whose memory a [`State`] holds; later ones start afresh after a restore.
pub const MEMORIES: usize = 32;

/// Most iterations of the fixed point; it stops earlier at [`CONVERGED`].
const ITERATIONS: usize = 12;

/// Relative change at which the fixed point is taken as reached.
const CONVERGED: f64 = 1e-13;

/// Readings before a response has the three that its derivatives need.
const START_UP: u8 = 2;

/// A reading beyond this is no reading, rad/s (a thousand turns a second).
const ABSURD: f64 = 1e4;

/// One axis' compensated reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Compensated {
    /// ω̂, rad/s.
    pub rate: f64,
    /// The time at which it is valid, ns.
    pub valid_t_ns: i64,
    /// Whether the reading said nothing about the rate (dead zone, saturation).
    pub lost: bool,
}

/// What is known of an axis' uncertainty.
#[derive(Clone, Copy, Debug)]
pub struct Identified {
    /// The model's noise.
    pub noise: Noise,
    /// Standard deviations of the bias and scale error that the model leaves: the standard errors of δ and of α/α with what may have
    /// changed since, or what a sensor that was never fitted may have.
    pub calibration: Calibration,
    /// Whether both are fitted, by a model that leaves no error that may be theirs.
    pub is_fitted: bool,
    /// α and δ.
    pub affine: [f64; 2],
    /// A number that tells which effects the model has beside those two.
    pub effects: u64,
}

impl Identified {
    fn of(model: &AxisModel) -> Self {
        let fitted = |effect: &str| {
            let error = model.term(effect).map_or(f64::NAN, |term| term.std_errors[0]);
            error.is_finite().then_some(error)
        };
        // Without a delay in it a model does not say that there is none.
        let delay = model.terms.iter().find(|term| term.effect.stage() == Stage::Timing).map(|term| term.std_errors[0]);
        let (bias, scale) = (fitted("bias"), fitted("scale-factor").map(|error| error / model.alpha().abs()));
        let scale = scale.filter(|std| std.is_finite());
        // What is missing from a model may have been taken for a scale error: a late reference for a smaller motion.
        let explained = model.noise.unexplained < Calibration::SINCE.scale_std;
        let is_other = |term: &&crate::Term| !matches!(term.effect.card().id, "bias" | "scale-factor");
        Self {
            noise: model.noise,
            calibration: Calibration {
                bias_std: bias.map_or(Calibration::UNFITTED.bias_std, |std| std.hypot(Calibration::SINCE.bias_std)),
                scale_std: scale.filter(|_| explained).map_or(Calibration::UNFITTED.scale_std, |std| {
                    std.hypot(Calibration::SINCE.scale_std).hypot(model.noise.unexplained)
                }),
                delay_std: delay.filter(|std| std.is_finite()).unwrap_or(Calibration::UNFITTED.delay_std),
            },
            is_fitted: bias.is_some() && scale.is_some() && explained,
            affine: [model.alpha(), model.delta()],
            effects: model
                .terms
                .iter()
                .filter(is_other)
                .fold(0, |sum, term| sum.wrapping_mul(31).wrapping_add(key(term.effect))),
        }
    }
}

/// What compensation remembers, as plain data for crash recovery.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// Of each effect, by [`key`].
    memory: [[(u64, Memory); MEMORIES]; 3],
    axes: [AxisPast; 3],
    /// α and δ of the model that `axes` is compensated with.
    calibration: [(f64, f64); 3],
    environment: Environment,
}

/// An effect's id as a number, the same in every process of this program; never 0.
fn key(effect: &dyn Effect) -> u64 {
    let mut hasher = DefaultHasher::new();
    effect.card().id.hash(&mut hasher);
    hasher.finish().max(1)
}

/// One effect of a model with its memory.
struct Placed {
    effect: &'static dyn Effect,
    values: Vec<f64>,
    memory: Memory,
}

/// One axis' model, its effects sorted by the stage at which they act.
#[derive(Default)]
struct Plan {
    alpha: f64,
    delta: f64,
    timing: Vec<Placed>,
    reading: Vec<Placed>,
    sensor: Vec<Placed>,
    felt: Vec<Placed>,
    mount: Vec<Placed>,
    reference: Vec<Placed>,
    /// Of an axis without a model: how late the reference is by the models of the others, ns.
    shift: i64,
}

/// The last samples of one axis.
#[derive(Clone, Copy, Debug, Default)]
struct AxisPast {
    started: bool,
    t_ns: i64,
    /// ω_f of the last sample.
    felt: f64,
    /// ω̂ at the gyro of the last two samples.
    rates: [f64; 2],
    /// The last step, s.
    step: f64,
    /// Samples so far, up to two.
    count: u8,
    /// The last compensated rate.
    output: f64,
    /// Readings that the responses still need before they are known again, and until when they settle, ns.
    wanted: u8,
    settles_t_ns: i64,
}

impl AxisPast {
    fn recalibrate(&mut self, affine: impl Fn(f64) -> f64) {
        self.felt = affine(self.felt);
        self.rates = self.rates.map(&affine);
        self.output = affine(self.output);
    }

    /// Whether what undoing a response makes of this reading is a guess, after one that was lost: it takes two more for a
    /// curvature, and what they were taken for has to die away.
    fn is_unsure(&mut self, lost: bool, t_ns: i64, reach: f64) -> bool {
        if lost {
            self.wanted = START_UP;
            return false;
        }
        if self.wanted == 0 {
            return t_ns < self.settles_t_ns;
        }
        self.wanted -= 1;
        self.settles_t_ns = t_ns.saturating_add((reach * 1e9) as i64);
        true
    }

    /// dω̂/dt between the last two samples.
    fn last_slope(&self) -> f64 {
        if self.count > 1 && self.step > 0.0 { (self.rates[0] - self.rates[1]) / self.step } else { 0.0 }
    }

    /// dω̂/dt at a new rate, `dt` after the last: the slope there of the parabola through the last three.
    fn slope(&self, rate: f64, dt: f64) -> f64 {
        if self.count == 0 || dt <= 0.0 {
            return 0.0;
        }
        let near = (rate - self.rates[0]) / dt;
        if self.count == 1 || self.step <= 0.0 {
            return near;
        }
        near + (near - (self.rates[0] - self.rates[1]) / self.step) * dt / (dt + self.step)
    }
}

/// Values held from the last row that had them.
#[derive(Clone, Copy, Debug)]
struct Environment {
    accel: [f64; 3],
    temperature: f64,
    supply: f64,
    supply_origin: f64,
    free: [f64; FREE_CHANNELS],
}

impl Environment {
    const EMPTY: Self = Self {
        accel: [0.0; 3],
        temperature: 25.0,
        supply: f64::NAN,
        supply_origin: f64::NAN,
        free: [0.0; FREE_CHANNELS],
    };

    fn take(&mut self, row: &Row) {
        let hold = |held: &mut f64, value: f64| {
            if value.is_finite() {
                *held = value;
            }
        };
        for (held, &value) in self.accel.iter_mut().zip(&row.accel) {
            hold(held, value);
        }
        hold(&mut self.temperature, row.temperature);
        hold(&mut self.supply, row.supply);
        if !self.supply_origin.is_finite() {
            self.supply_origin = self.supply;
        }
        for (held, &value) in self.free.iter_mut().zip(&row.free) {
            hold(held, value);
        }
    }

    fn signals(&self, t_ns: i64) -> Signals {
        let delta_supply = self.supply - self.supply_origin;
        Signals {
            t: t_ns as f64 * 1e-9,
            accel: self.accel,
            delta_temperature: self.temperature - 25.0,
            delta_supply: if delta_supply.is_finite() { delta_supply } else { 0.0 },
            supply: if self.supply.is_finite() { self.supply } else { 0.0 },
            free: self.free,
            ..Signals::default()
        }
    }
}

impl Placed {
    fn of(model: &AxisModel, stage: impl Fn(&dyn Effect) -> bool) -> Vec<Self> {
        model
            .terms
            .iter()
            .filter(|term| stage(term.effect))
            .map(|term| Self { effect: term.effect, values: term.values.clone(), memory: Memory::default() })
            .collect()
    }

    /// What it errs by; it remembers the sample only where it is committed.
    fn error(&mut self, signals: &Signals, commit: bool) -> f64 {
        let mut memory = self.memory;
        let error = self.effect.error_seen(&self.values, signals, &mut memory);
        if commit {
            self.memory = memory;
        }
        if error.is_finite() { error } else { 0.0 }
    }
}

/// Whether this response is the mount's (between shaft and gyro) rather than the sensor's own.
#[must_use]
pub fn of_the_mount(effect: &dyn Effect) -> bool {
    effect.stage() == Stage::Response && effect.is(Trait::Resonance)
}

impl Plan {
    fn new(model: &AxisModel) -> Self {
        let at = |stage| Placed::of(model, move |e| e.stage() == stage);
        Self {
            alpha: model.alpha(),
            delta: model.delta(),
            timing: at(Stage::Timing),
            reading: at(Stage::Reading),
            sensor: Placed::of(model, |e| e.stage() == Stage::Response && !of_the_mount(e)),
            felt: at(Stage::Felt),
            mount: Placed::of(model, of_the_mount),
            reference: Placed::of(model, |e| e.stage().is_of_reference()),
            shift: 0,
        }
    }

    /// The effects that remember something, always in the same order.
    fn placed(&self) -> impl Iterator<Item = &Placed> {
        self.sensor.iter().chain(&self.felt).chain(&self.mount).chain(&self.reference)
    }

    /// The same, to be changed.
    fn placed_mut(&mut self) -> impl Iterator<Item = &mut Placed> {
        self.sensor.iter_mut().chain(&mut self.felt).chain(&mut self.mount).chain(&mut self.reference)
    }

    /// Takes over the memory of the effects that `old` had too.
    fn inherit(&mut self, old: &Self) {
        for new in self.placed_mut() {
            if let Some(before) = old.placed().find(|p| p.effect.card().id == new.effect.card().id) {
                new.memory = before.memory;
            }
        }
    }

    fn valid_time(&self, t_ns: i64) -> i64 {
        let t = t_ns as f64 * 1e-9;
        let valid = self.timing.iter().fold(t, |t, p| p.effect.valid_time(&p.values, t));
        let shift = ((valid - t) * 1e9).round();
        let own = if shift.is_finite() { t_ns.saturating_add(shift as i64) } else { t_ns };
        own.saturating_add(self.shift)
    }

    /// How late the reference is, ns.
    fn reference_late(&self) -> i64 {
        (self.timing.iter().map(|p| p.effect.reference_late(&p.values)).sum::<f64>() * 1e9).round() as i64
    }

    fn responses(&mut self) -> impl Iterator<Item = &mut Placed> {
        self.sensor.iter_mut().chain(&mut self.mount)
    }

    /// How far a reading reaches into the rates after it where responses are undone, s.
    fn reach(&self) -> Option<f64> {
        let responses = self.sensor.iter().chain(&self.mount);
        responses.map(|p| p.effect.reach(&p.values)).reduce(|a, b| a + b)
    }

    fn felt_error(&mut self, signals: &Signals, commit: bool) -> f64 {
        self.felt.iter_mut().map(|p| p.error(signals, commit)).sum()
    }
}

/// What a reference errs by.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ReferenceError {
    /// Σ κψ, rad.
    pub sum: f64,
    /// Whether its reading says nothing of the angle.
    pub silent: bool,
}

/// Undoes a chain of responses, one step.
fn undo(chain: &mut [Placed], felt: f64, dt: f64) -> f64 {
    chain.iter_mut().fold(felt, |rate, p| {
        let undone = p.effect.undo_response(&p.values, rate, dt, &mut p.memory);
        if undone.is_finite() { undone } else { rate }
    })
}

/// Compensates up to three axes.
pub struct Compensation {
    plans: [Plan; 3],
    past: [AxisPast; 3],
    environment: Environment,
    history: [History; 3],
    identified: [Identified; 3],
    /// 1 where a reading was lost, over time of validity.
    lost: [History; 3],
    /// How late the reference is by the model of every axis that has one, ns.
    reference_late: i64,
}

impl Compensation {
    /// A compensation that starts with this model; an axis without one passes its reading through.
    #[must_use]
    pub fn new(model: &Model) -> Self {
        let mut compensation = Self {
            plans: [Plan::default(), Plan::default(), Plan::default()],
            past: [AxisPast::default(); 3],
            environment: Environment::EMPTY,
            history: [History::default(), History::default(), History::default()],
            identified: [Identified::of(&AxisModel::default()); 3],
            lost: [History::default(), History::default(), History::default()],
            reference_late: 0,
        };
        compensation.take(model);
        compensation
    }

    /// What is known of an axis' uncertainty.
    #[must_use]
    pub fn identified(&self, axis: usize) -> Identified {
        self.identified[axis]
    }

    /// Whether a reading that bears on this instant says nothing about the rate.
    #[must_use]
    pub fn lost(&self, axis: usize, valid_t_ns: i64) -> bool {
        self.lost[axis].value(valid_t_ns).is_some_and(|share| share.abs() > 1e-6)
    }

    /// The compensated rates of an axis over time of validity.
    #[must_use]
    pub fn history(&self, axis: usize) -> &History {
        &self.history[axis]
    }

    /// When a reading taken at `t_ns` is valid on this axis, ns on the reference's clock.
    #[must_use]
    pub fn valid_time(&self, axis: usize, t_ns: i64) -> i64 {
        self.plans[axis].valid_time(t_ns)
    }

    /// How late the reference is, ns: by the model of every axis that has one.
    #[must_use]
    pub fn reference_late(&self) -> i64 {
        self.reference_late
    }

    /// Whether this axis has had a reading.
    #[must_use]
    pub fn started(&self, axis: usize) -> bool {
        self.past[axis].started
    }

    /// Takes another model between two samples. The last samples are rewritten to it (exactly for α, δ and timing; what
    /// other effects change is carried over from the last sample), so that no later output mixes two models. Returns
    /// the step of each axis' last compensated rate.
    pub fn set_model(&mut self, model: &Model, angle: [f64; 3]) -> [f64; 3] {
        let before = self.calibration();
        let mut again = Instant {
            t_ns: self.past.iter().filter(|past| past.started).map(|past| past.t_ns).max().unwrap_or(0),
            stamps: [0; 3],
            present: self.past.map(|past| past.started),
            felt: self.past.map(|past| past.felt),
            dt: self.past.map(|past| past.step),
            angle,
            new: false,
        };
        // Both models see the last sample from the memory after it: the same one twice makes no step.
        let old = self.fixed_point(&again);
        self.take(model);
        let plans = &self.plans;
        let affine = |i: usize, rate: f64| plans[i].alpha * (rate - before[i].1) / before[i].0 + plans[i].delta;
        again.felt = std::array::from_fn(|i| affine(i, self.past[i].felt));
        let rates = self.fixed_point(&again);
        std::array::from_fn(|i| {
            let ((a0, d0), plan, past) = (before[i], &self.plans[i], &mut self.past[i]);
            if !past.started {
                return 0.0;
            }
            let affine = |rate: f64| plan.alpha * (rate - d0) / a0 + plan.delta;
            let rest = rates[i] - affine(old[i]);
            let step = affine(past.output) + rest - past.output;
            let shift = self.history[i].newest().map_or(0, |(t, _)| plan.valid_time(past.t_ns).saturating_sub(t));
            past.felt = again.felt[i];
            past.output += step;
            past.rates = past.rates.map(|rate| affine(rate) + rest);
            self.history[i].rewrite(|t, rate| (t.saturating_add(shift), affine(rate) + rest));
            self.lost[i].rewrite(|t, lost| (t.saturating_add(shift), lost));
            step
        })
    }

    fn take(&mut self, model: &Model) {
        for (i, axis) in model.axes.iter().enumerate() {
            let neutral = AxisModel::default();
            let axis = axis.as_ref().unwrap_or(&neutral);
            let mut plan = Plan::new(axis);
            plan.inherit(&self.plans[i]);
            self.plans[i] = plan;
            self.identified[i] = Identified::of(axis);
        }
        let modelled = || model.axes.iter().zip(&self.plans).filter_map(|(axis, plan)| axis.as_ref().map(|_| plan));
        self.reference_late = modelled().map(Plan::reference_late).min().unwrap_or(0);
        for (axis, plan) in model.axes.iter().zip(&mut self.plans) {
            plan.shift = if axis.is_none() { self.reference_late } else { 0 };
        }
        if let Some(supply) = model.origin.supply {
            self.environment.supply_origin = supply;
        }
    }

    /// One row in, one compensated rate an axis out; `None` where the axis has no reading at this row. `angle` is the
    /// best known shaft angle of each axis, for effects that depend on it.
    pub fn step(&mut self, row: &Row, angle: [f64; 3]) -> [Option<Compensated>; 3] {
        self.environment.take(row);
        let present = row.gyro.map(|reading| reading.is_finite() && reading.abs() < ABSURD);
        let mut now = Instant {
            t_ns: row.t_ns,
            stamps: std::array::from_fn(|i| self.plans[i].valid_time(row.t_ns)),
            present,
            felt: self.past.map(|past| past.rates[0]),
            dt: [0.0; 3],
            angle,
            new: true,
        };
        for i in now.axes() {
            let (past, plan) = (&self.past[i], &mut self.plans[i]);
            now.dt[i] = if past.started { seconds(row.t_ns, past.t_ns) } else { 0.0 };
            now.felt[i] = undo(&mut plan.sensor, plan.alpha * row.gyro[i] + plan.delta, now.dt[i]);
            self.history[i].push(now.stamps[i], now.felt[i]);
        }
        let rates = self.fixed_point(&now);
        for i in now.axes() {
            let signals = self.signals(&now, &rates, i);
            self.plans[i].felt_error(&signals, true);
        }
        std::array::from_fn(|i| {
            if !present[i] {
                return None;
            }
            let (past, plan) = (&mut self.past[i], &mut self.plans[i]);
            let undone = undo(&mut plan.mount, rates[i], now.dt[i]);
            let rate = if undone.is_finite() && undone.abs() < ABSURD { undone } else { past.output };
            let mut lost = plan.reading.iter().any(|p| p.effect.lost(&p.values, row.gyro[i]));
            if lost {
                // The corner at the edge of what was cut off is no motion: the responses start again beyond it.
                plan.responses().for_each(|p| p.memory = Memory::default());
            }
            if let Some(reach) = plan.reach() {
                lost |= past.is_unsure(lost, row.t_ns, reach);
            }
            *past = AxisPast {
                started: true,
                t_ns: row.t_ns,
                felt: now.felt[i],
                rates: [rates[i], past.rates[0]],
                step: now.dt[i],
                count: (past.count + 1).min(2),
                output: rate,
                ..*past
            };
            self.history[i].replace_newest(rate);
            self.lost[i].push(now.stamps[i], if lost { 1.0 } else { 0.0 });
            Some(Compensated { rate, valid_t_ns: now.stamps[i], lost })
        })
    }

    /// ω̂ = ω_f − Σ βφ(ω̂) of all axes of one instant together.
    fn fixed_point(&mut self, instant: &Instant) -> [f64; 3] {
        let (mut rates, mut last) = (instant.felt, f64::INFINITY);
        for _ in 0..ITERATIONS {
            let mut next = rates;
            for i in instant.axes() {
                let signals = self.signals(instant, &rates, i);
                next[i] = instant.felt[i] - self.plans[i].felt_error(&signals, false);
                if !next[i].is_finite() || next[i].abs() > ABSURD {
                    next[i] = instant.felt[i];
                }
            }
            let reached = (0..3).all(|i| (next[i] - rates[i]).abs() <= CONVERGED * (1.0 + rates[i].abs()));
            let change = (0..3).map(|i| (next[i] - rates[i]).abs()).fold(0.0, f64::max);
            // What runs away comes no nearer: an error that follows the newest rate's slope more than that slope is known.
            if change > last {
                break;
            }
            (rates, last) = (next, change);
            if instant.new {
                for i in instant.axes() {
                    self.history[i].replace_newest(rates[i]);
                }
            }
            if reached {
                break;
            }
        }
        rates
    }

    /// What the regressors of axis `i` see at this instant.
    fn signals(&self, instant: &Instant, rates: &[f64; 3], i: usize) -> Signals {
        Signals {
            axis: i,
            dt: instant.dt[i],
            angle: instant.angle[i],
            rates: std::array::from_fn(|j| {
                let together = j == i || instant.stamps[j] == instant.stamps[i];
                let earlier = if together { None } else { self.history[j].value(instant.stamps[i]) };
                earlier.unwrap_or(rates[j])
            }),
            rate_dot: self.past[i].slope(rates[i], instant.dt[i]),
            ..self.environment.signals(instant.t_ns)
        }
    }

    /// What the reference of this axis errs by at this true angle, rad. Call once a reference reading, in time order, with
    /// `commit`; without it nothing is remembered.
    pub fn reference_error(&mut self, axis: usize, t_ns: i64, angle: f64, commit: bool) -> ReferenceError {
        let plan = &mut self.plans[axis];
        if plan.reference.is_empty() {
            return ReferenceError::default();
        }
        let rates = self.past.map(|past| past.output);
        let rate_dot = self.past[axis].last_slope();
        let signals = Signals { axis, rates, rate_dot, angle, ..self.environment.signals(t_ns) };
        plan.reference.iter_mut().fold(ReferenceError::default(), |whole, p| {
            let error = p.error(&signals, commit);
            ReferenceError { sum: whole.sum + error, silent: whole.silent || p.effect.silent(&p.values, error) }
        })
    }

    /// By how much undoing the responses of this axis multiplies the variance of white noise, at this sample interval.
    #[must_use]
    pub fn noise_gain(&self, axis: usize, dt: f64) -> f64 {
        let plan = &self.plans[axis];
        if plan.sensor.is_empty() && plan.mount.is_empty() {
            return 1.0;
        }
        // The impulse response after the start-up, squared and summed.
        let mut memory: [Memory; MEMORIES] = [Memory::default(); MEMORIES];
        let mut sum = 0.0;
        for k in 0..200 {
            let impulse = if k == 8 { 1.0 } else { 0.0 };
            let response = plan
                .sensor
                .iter()
                .chain(&plan.mount)
                .zip(&mut memory)
                .fold(impulse, |rate, (p, memory)| p.effect.undo_response(&p.values, rate, dt, memory));
            sum += response * response;
        }
        if sum.is_finite() { sum.max(1.0) } else { 1.0 }
    }

    /// What is remembered, for crash recovery.
    #[must_use]
    pub fn save(&self) -> State {
        let mut memory = [[(0, Memory::default()); MEMORIES]; 3];
        for (memory, plan) in memory.iter_mut().zip(&self.plans) {
            for (memory, placed) in memory.iter_mut().zip(plan.placed()) {
                *memory = (key(placed.effect), placed.memory);
            }
        }
        State { memory, axes: self.past, calibration: self.calibration(), environment: self.environment }
    }

    fn calibration(&self) -> [(f64, f64); 3] {
        self.plans.each_ref().map(|plan| (plan.alpha, plan.delta))
    }

    /// Takes up where a saved compensation left off, the effects that its model had too with what they remembered; the
    /// history starts again at its last sample. Returns the step of each axis' last compensated rate where this model's α and δ
    /// are others.
    pub fn restore(&mut self, state: &State) -> [f64; 3] {
        for (memory, plan) in state.memory.iter().zip(&mut self.plans) {
            for placed in plan.placed_mut() {
                if let Some((_, memory)) = memory.iter().find(|(known, _)| *known == key(placed.effect)) {
                    placed.memory = *memory;
                }
            }
        }
        self.past = state.axes;
        for ((past, plan), (alpha, delta)) in self.past.iter_mut().zip(&self.plans).zip(state.calibration) {
            if (plan.alpha, plan.delta) != (alpha, delta) {
                past.recalibrate(|rate| plan.alpha * (rate - delta) / alpha + plan.delta);
            }
        }
        let origin = self.environment.supply_origin;
        self.environment = state.environment;
        if origin.is_finite() {
            self.environment.supply_origin = origin;
        }
        for i in 0..3 {
            self.history[i].clear();
            self.lost[i].clear();
            if self.past[i].started {
                self.history[i].push(self.plans[i].valid_time(self.past[i].t_ns), self.past[i].output);
            }
        }
        std::array::from_fn(|i| self.past[i].output - state.axes[i].output)
    }
}

/// One instant of all axes, on its way through the fixed point.
struct Instant {
    t_ns: i64,
    /// Time of validity of each axis, ns.
    stamps: [i64; 3],
    present: [bool; 3],
    /// ω_f of each axis; the last rate of an axis without a reading.
    felt: [f64; 3],
    dt: [f64; 3],
    angle: [f64; 3],
    /// Whether this instant is the newest of the history (not one gone through again).
    new: bool,
}

impl Instant {
    fn axes(&self) -> impl Iterator<Item = usize> + use<> {
        let present = self.present;
        (0..3).filter(move |&i| present[i])
    }
}
