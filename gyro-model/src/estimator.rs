//! The estimator: one row in, one estimate out, for up to three axes. The kalman process and `truerate apply` both
//! call [`Estimator::step`] and nothing else, so what runs live and what runs on a log agree bit for bit.
//!
//! A row taken at `t` gives an estimate that is valid at `t − d` (the latest instant that every axis has reached);
//! references wait in a queue until the estimate has reached their time. Where `d` is negative the reference is late: an
//! estimate says its time on both clocks. The estimator never reads a clock, allocates nothing in `step`, and no number in it
//! ever becomes non-finite.

use crate::{
    Model, Row,
    compensation::{self, Compensation},
    history::seconds,
    observer,
};
use std::collections::VecDeque;

mod attitude;
mod axis;
mod cross_check;
mod motion;
mod reference;
mod reference_noise;
mod spread;
mod trend;

use attitude::Attitude;
use axis::{AxisEstimator, AxisState, Missing, Moment, ReferenceTime};

/// References that may wait: half a second at 8 kHz.
const WAITING: usize = 4096;

/// Bits of [`AxisEstimate::flags`].
pub mod flags {
    /// The reading says nothing about the rate (dead zone, saturation); the filter did without it.
    pub const LOST: u32 = 1;
    /// The reading lay beyond the gate and was left out.
    pub const OUTLIER: u32 = 1 << 1;
    /// There was no reading; the rate is held, the filter predicted.
    pub const HELD: u32 = 1 << 2;
    /// A reference was taken in.
    pub const REFERENCE: u32 = 1 << 3;
    /// A reference lay beyond the gate and was left out.
    pub const REFERENCE_OUTLIER: u32 = 1 << 4;
    /// The gate was overrun and the filter started again from the measurement.
    pub const RESTARTED: u32 = 1 << 5;
    /// The row was not newer than the one before and changed nothing.
    pub const ROW_REJECTED: u32 = 1 << 6;
    /// A reference contradicts what was known of bias and scale error: both are found again.
    pub const CHANGED: u32 = 1 << 7;
}

/// Which gain the filter uses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Gain {
    /// The Kalman filter of [`crate::kalman`].
    #[default]
    Kalman,
    /// The paper's observer with the stationary gain of its equation (8).
    PaperRiccati,
    /// The paper's observer with the gain that it prints.
    PaperPrinted,
}

impl Gain {
    /// M of the paper's equation (9); `None` for the Kalman filter.
    #[must_use]
    pub fn observer(self) -> Option<[f64; 2]> {
        match self {
            Self::Kalman => None,
            Self::PaperRiccati => Some(observer::riccati_gain(observer::PAPER_Q, observer::PAPER_S)),
            Self::PaperPrinted => Some(observer::PRINTED_GAIN),
        }
    }
}

/// What to do with the jerk's density.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Jerk {
    /// Identified while it runs.
    #[default]
    Identified,
    /// This spectral density, rad²/s⁵.
    Fixed(f64),
}

/// How to estimate.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Which gain.
    pub gain: Gain,
    /// Which process noise.
    pub jerk: Jerk,
    /// Whether references correct the filter (the open-loop angle never sees them either way).
    pub fuse_reference: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { gain: Gain::Kalman, jerk: Jerk::Identified, fuse_reference: true }
    }
}

/// What is known at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The instant, ns since the log's first row, on the clock of the gyro's stamps.
    pub valid_t_ns: i64,
    /// The stamp of a reference that shows this instant, ns: later where the reference is late.
    pub reference_t_ns: i64,
    /// Epoch of the model it was made with.
    pub epoch: u64,
    /// The axes.
    pub axes: [AxisEstimate; 3],
}

/// What is known of one axis. `NaN` where there is no value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AxisEstimate {
    /// Whether this axis has had a reading.
    pub present: bool,
    /// Compensated rate, nothing else done to it, rad/s.
    pub rate: f64,
    /// Filtered rate, rad/s.
    pub rate_filtered: f64,
    /// Standard deviation of the filtered rate, rad/s.
    pub rate_std: f64,
    /// By how much the filtered rate is later than the true one at the motion's own frequency, s.
    pub lag: f64,
    /// ∫ rate dt from the first reference on, rad.
    pub angle: f64,
    /// Filtered angle, with the reference, rad.
    pub angle_fused: f64,
    /// Residual bias of the compensated rate as the filter sees it, rad/s.
    pub bias: f64,
    /// Gyro innovation, rad/s.
    pub innovation: f64,
    /// Its standard deviation, rad/s.
    pub innovation_std: f64,
    /// ν²/S of the gyro innovation.
    pub nis: f64,
    /// Innovation of the last reference taken or rejected at this row (rad; rad/s for a reference rate).
    pub reference_innovation: f64,
    /// Its standard deviation.
    pub reference_innovation_std: f64,
    /// Bits of [`flags`].
    pub flags: u32,
}

impl AxisEstimate {
    /// No axis.
    pub const ABSENT: Self = Self {
        present: false,
        rate: f64::NAN,
        rate_filtered: f64::NAN,
        rate_std: f64::NAN,
        lag: f64::NAN,
        angle: f64::NAN,
        angle_fused: f64::NAN,
        bias: f64::NAN,
        innovation: f64::NAN,
        innovation_std: f64::NAN,
        nis: f64::NAN,
        reference_innovation: f64::NAN,
        reference_innovation_std: f64::NAN,
        flags: 0,
    };

    /// The compensated rate where the row has a reading; `NaN` where it has none and the rate before is held.
    #[must_use]
    pub fn measured(&self) -> f64 {
        if self.flags & flags::HELD == 0 { self.rate } else { f64::NAN }
    }
}

/// Everything that an estimator needs to go on after a crash, as plain data.
#[derive(Clone, Copy, Debug)]
pub struct Snapshot {
    /// Time of the last row, ns.
    pub t_ns: i64,
    /// The last estimate.
    pub estimate: Estimate,
    started: bool,
    compensation: compensation::State,
    axes: [AxisState; 3],
    attitude: Attitude,
}

/// A reference that waits for the estimate to reach its time.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    t_ns: i64,
    angle: [f64; 3],
    rate: [f64; 3],
    quaternion: [f64; 4],
}

/// See the module's head.
pub struct Estimator {
    options: Options,
    compensation: Compensation,
    axes: [AxisEstimator; 3],
    attitude: Attitude,
    waiting: VecDeque<Waiting>,
    started: bool,
    t_ns: i64,
    last: Estimate,
}

impl Estimator {
    /// An estimator without a model: readings pass uncompensated until [`Self::set_model`].
    #[must_use]
    pub fn new(options: Options) -> Self {
        let model = Model::default();
        let compensation = Compensation::new(&model);
        let axes = std::array::from_fn(|i| AxisEstimator::new(i, &options, compensation.identified(i)));
        Self {
            options,
            compensation,
            axes,
            attitude: Attitude::default(),
            waiting: VecDeque::with_capacity(WAITING),
            started: false,
            t_ns: 0,
            last: Estimate { valid_t_ns: 0, reference_t_ns: 0, epoch: 0, axes: [AxisEstimate::ABSENT; 3] },
        }
    }

    /// Takes a model, between two samples and without a bump: the output steps only where the compensation itself
    /// does, and no later estimate mixes two models. Another delay re-stamps the state (the time of validity may go
    /// back once). This may allocate; `step` never does.
    pub fn set_model(&mut self, model: &Model) {
        let angles = self.angles();
        let valid_before = self.valid_time(self.t_ns);
        let own = |compensation: &Compensation| [0, 1, 2].map(|i| compensation.valid_time(i, self.t_ns));
        let own_before = own(&self.compensation);
        let steps = self.compensation.set_model(model, angles);
        let own_after = own(&self.compensation);
        let shift = self.valid_time(self.t_ns).saturating_sub(valid_before);
        for (i, (axis, step)) in self.axes.iter_mut().zip(steps).enumerate() {
            let own = own_after[i].saturating_sub(own_before[i]);
            axis.set_model(&self.compensation, step, valid_before, [own, shift]);
        }
        if self.started {
            self.last = self.at(self.last.reference_t_ns.saturating_add(shift));
        }
        self.last.epoch = model.epoch;
    }

    /// One row in, one estimate out.
    pub fn step(&mut self, row: &Row) -> Estimate {
        if self.started && row.t_ns <= self.t_ns {
            for axis in &mut self.last.axes {
                axis.flags |= flags::ROW_REJECTED;
            }
            return self.last;
        }
        self.wait(row);
        let angles = self.angles();
        self.compensation.step(row, angles);
        let valid_t_ns = self.valid_time(row.t_ns);
        let moment = Moment {
            valid_t_ns,
            dt: if self.started { seconds(valid_t_ns, self.last.reference_t_ns).max(0.0) } else { 0.0 },
        };
        self.started = true;
        self.t_ns = row.t_ns;
        self.last = self.at(valid_t_ns);

        let before = self.axes.each_ref().map(AxisEstimator::angle);
        for (axis, out) in self.axes.iter_mut().zip(&mut self.last.axes) {
            *out = axis.step(&self.compensation, &moment);
        }
        let increment: [f64; 3] = std::array::from_fn(|i| self.axes[i].angle() - before[i]);
        let turning = self.axes.each_ref().map(AxisEstimator::started);
        self.attitude.turn(increment, turning);
        while let Some(reference) = self.waiting.front().copied().filter(|r| r.t_ns <= valid_t_ns) {
            self.waiting.pop_front();
            self.take_reference(&reference, valid_t_ns);
        }
        for (axis, estimate) in self.axes.iter_mut().zip(&mut self.last.axes) {
            axis.report(&self.compensation, valid_t_ns, estimate);
        }
        self.last
    }

    /// What is known at a later instant without any new reading: rates held, uncertainty grown. Nothing is changed.
    #[must_use]
    pub fn coast(&self, t_ns: i64) -> Estimate {
        let mut estimate = self.last;
        let ahead = seconds(t_ns, self.t_ns);
        if self.started && ahead > 0.0 {
            estimate = self.at(self.valid_time(t_ns));
            for (axis, out) in self.axes.iter().zip(&mut estimate.axes) {
                axis.coast(ahead, out);
            }
        }
        estimate
    }

    /// Everything needed to go on after a crash.
    #[must_use]
    pub fn save(&self) -> Snapshot {
        Snapshot {
            t_ns: self.t_ns,
            estimate: self.last,
            started: self.started,
            compensation: self.compensation.save(),
            axes: self.axes.each_ref().map(AxisEstimator::save),
            attitude: self.attitude,
        }
    }

    /// Goes on from a snapshot, with the model that is set now: the one that it was taken with, usually; else as if that model were
    /// set after it. References that waited are lost, and the angle's integral takes up at the snapshot's last sample.
    pub fn restore(&mut self, snapshot: &Snapshot) {
        let epoch = self.last.epoch;
        let steps = self.compensation.restore(&snapshot.compensation);
        self.waiting.clear();
        self.t_ns = snapshot.t_ns;
        self.started = snapshot.started;
        self.last = Estimate { epoch, ..snapshot.estimate };
        self.attitude = snapshot.attitude;
        for (axis, state) in self.axes.iter_mut().zip(&snapshot.axes) {
            axis.restore(state);
        }
        if epoch != snapshot.estimate.epoch && self.started {
            let valid_before = self.last.reference_t_ns;
            self.last = self.at(self.valid_time(self.t_ns));
            let shift = self.last.reference_t_ns.saturating_sub(valid_before);
            for (axis, step) in self.axes.iter_mut().zip(steps) {
                axis.set_model(&self.compensation, step, valid_before, [shift; 2]);
            }
        }
    }

    /// The last estimate at another time, ns on the reference's clock.
    fn at(&self, reference_t_ns: i64) -> Estimate {
        let valid_t_ns = reference_t_ns.saturating_sub(self.compensation.reference_late());
        Estimate { valid_t_ns, reference_t_ns, ..self.last }
    }

    /// The filter's angles: θ of the regressors.
    fn angles(&self) -> [f64; 3] {
        self.axes.each_ref().map(AxisEstimator::angle)
    }

    /// The instant that every axis has reached with a row taken at `t_ns`, on the reference's clock.
    fn valid_time(&self, t_ns: i64) -> i64 {
        (0..3).map(|i| self.compensation.valid_time(i, t_ns)).min().unwrap_or(t_ns)
    }

    /// Puts a row's references into the queue; the oldest goes where it is full.
    fn wait(&mut self, row: &Row) {
        if !self.options.fuse_reference && self.axes.iter().all(AxisEstimator::anchored) {
            return;
        }
        let some = row.ref_angle.iter().chain(&row.ref_rate).chain(&row.ref_quaternion).any(|v| v.is_finite());
        if some {
            if self.waiting.len() == WAITING {
                self.waiting.pop_front();
            }
            self.waiting.push_back(Waiting {
                t_ns: row.t_ns,
                angle: row.ref_angle,
                rate: row.ref_rate,
                quaternion: row.ref_quaternion,
            });
        }
    }

    /// Hands a reference to the axes, the most direct form first: shaft angle, orientation, rate.
    fn take_reference(&mut self, reference: &Waiting, valid_t_ns: i64) {
        let when: [ReferenceTime; 3] = std::array::from_fn(|i| ReferenceTime {
            t_ns: reference.t_ns,
            valid_t_ns,
            since: self.compensation.history(i).integral(reference.t_ns, valid_t_ns),
        });
        let missing = self.attitude.compare(reference.quaternion, when.each_ref().map(|w| w.since));
        let mut correction = [0.0; 3];
        for (i, axis) in self.axes.iter_mut().enumerate() {
            let out = &mut self.last.axes[i];
            if reference.angle[i].is_finite() {
                axis.take_angle(&mut self.compensation, &when[i], reference.angle[i], out);
            } else if let Some([angle, increment]) = missing {
                let missing = Missing { angle: angle[i], increment: increment[i] };
                correction[i] = axis.take_difference(&self.compensation, &when[i], missing, out);
            } else if reference.rate[i].is_finite() {
                axis.take_rate(&self.compensation, &when[i], reference.rate[i], out);
            }
        }
        self.attitude.correct(correction);
    }
}

#[cfg(test)]
mod tests;
