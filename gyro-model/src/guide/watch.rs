//! What the hand does: how fast and how far the sensor has turned lately, by its gyro and by its reference.

use crate::{Axis, Model, Row, limits::Limits};
use nalgebra::{Quaternion, UnitQuaternion};
use std::collections::VecDeque;

/// Between two looks, s: shorter ones are averaged.
const STEP: f64 = 0.01;
/// Looks that are kept, s.
const KEPT: f64 = 12.0;
/// Readings that are looked at for the end of the range.
const READINGS: usize = 4000;
/// Share of the looks that are faster than what counts as the fastest.
const FASTEST: f64 = 0.05;

/// The last seconds.
#[derive(Clone, Debug, Default)]
pub(super) struct Watch {
    looks: VecDeque<Look>,
    sum: Sum,
    /// How far the reference has turned in all, rad, and its last reading.
    turned: [f64; 3],
    before: Option<Row>,
    attitude: Option<UnitQuaternion<f64>>,
    readings: VecDeque<[f64; 3]>,
    /// Compensated rate = α reading + δ; δ none where it is not known.
    alpha: [f64; 3],
    delta: [Option<f64>; 3],
}

#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    begun: f64,
    gyro: [f64; 3],
    count: [f64; 3],
    rows: u32,
}

#[derive(Clone, Copy, Debug)]
struct Look {
    t: f64,
    gyro: [f64; 3],
    turned: [f64; 3],
    rows: u32,
}

/// What was seen of one axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Seen {
    /// How long it was looked at, s.
    pub seconds: f64,
    /// The fastest rate but for a twentieth of the time, rad/s.
    pub rate: f64,
    /// From one end to the other, rad, by the gyro.
    pub travel: f64,
    /// The same by the reference.
    pub reference: f64,
}

impl Watch {
    pub(super) fn new() -> Self {
        Self { alpha: [1.0; 3], ..Self::default() }
    }

    /// Takes what is known of scale factor and bias.
    pub(super) fn calibrate(&mut self, model: &Model) {
        for (i, own) in model.axes.iter().enumerate() {
            let Some(own) = own else { continue };
            if own.delta().is_finite() && own.alpha().is_finite() && own.alpha() > 0.2 && own.alpha() < 5.0 {
                (self.alpha[i], self.delta[i]) = (own.alpha(), Some(own.delta()));
            }
        }
    }

    pub(super) fn take(&mut self, row: &Row) {
        let t = row.t_ns as f64 * 1e-9;
        self.follow(row);
        if self.readings.len() == READINGS {
            self.readings.pop_front();
        }
        self.readings.push_back(row.gyro);
        let sum = &mut self.sum;
        if sum.rows == 0 {
            sum.begun = t;
        }
        sum.rows += 1;
        for (i, reading) in row.gyro.iter().enumerate().filter(|(_, reading)| reading.is_finite()) {
            sum.gyro[i] += reading;
            sum.count[i] += 1.0;
        }
        if t - sum.begun < STEP && !self.looks.is_empty() {
            return;
        }
        let last = self.looks.back().map_or([0.0; 3], |last| last.gyro);
        let gyro = std::array::from_fn(|i| if sum.count[i] > 0.0 { sum.gyro[i] / sum.count[i] } else { last[i] });
        self.looks.push_back(Look { t, gyro, turned: self.turned, rows: sum.rows });
        self.sum = Sum::default();
        while self.looks.front().is_some_and(|first| first.t < t - KEPT) {
            self.looks.pop_front();
        }
    }

    /// Adds up what the reference turns.
    fn follow(&mut self, row: &Row) {
        let [w, x, y, z] = row.ref_quaternion;
        if w.is_finite() {
            let now = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
            if let Some(before) = self.attitude {
                let step = (before.inverse() * now).scaled_axis();
                self.turned.iter_mut().zip(step.iter()).for_each(|(turned, step)| *turned += step);
            }
            self.attitude = Some(now);
        }
        let Some(before) = &mut self.before else {
            self.before = Some(*row);
            return;
        };
        let dt = (row.t_ns - before.t_ns) as f64 * 1e-9;
        before.t_ns = row.t_ns;
        for i in 0..3 {
            if row.ref_angle[i].is_finite() {
                let step = row.ref_angle[i] - before.ref_angle[i];
                if step.is_finite() {
                    let turns = (step / std::f64::consts::TAU).round() * std::f64::consts::TAU;
                    self.turned[i] += step - turns;
                }
                before.ref_angle[i] = row.ref_angle[i];
            } else if row.ref_rate[i].is_finite() {
                before.ref_rate[i] = row.ref_rate[i];
            }
            if !before.ref_angle[i].is_finite() && before.ref_rate[i].is_finite() {
                self.turned[i] += dt * before.ref_rate[i];
            }
        }
    }

    /// What an axis did in the last `seconds`, not before `since`.
    pub(super) fn seen(&self, axis: Axis, seconds: f64, since: f64) -> Seen {
        let i = axis.index();
        let Some(now) = self.looks.back().map(|look| look.t) else { return Seen::default() };
        let from = self.looks.partition_point(|look| look.t < (now - seconds).max(since));
        let looks: Vec<Look> = self.looks.range(from..).copied().collect();
        if looks.len() < 4 {
            return Seen::default();
        }
        let mut readings: Vec<f64> = looks.iter().map(|look| self.alpha[i] * look.gyro[i]).collect();
        // While the bias is not known, a reading that stays the same is no motion.
        let delta = self.delta[i].unwrap_or_else(|| {
            let mut sorted = readings.clone();
            sorted.sort_by(f64::total_cmp);
            -sorted[sorted.len() / 2]
        });
        for reading in &mut readings {
            *reading += delta;
        }
        let (mut angle, mut low, mut high) = (0.0_f64, 0.0_f64, 0.0_f64);
        for (pair, rate) in looks.windows(2).zip(&readings[1..]) {
            angle += rate * (pair[1].t - pair[0].t);
            (low, high) = (low.min(angle), high.max(angle));
        }
        let mut sizes: Vec<f64> = readings.iter().map(|rate| rate.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let rate = sizes[((1.0 - FASTEST) * (sizes.len() - 1) as f64) as usize];
        let ends = |ends: (f64, f64), look: &Look| (ends.0.min(look.turned[i]), ends.1.max(look.turned[i]));
        let (least, most) = looks.iter().fold((f64::INFINITY, f64::NEG_INFINITY), ends);
        Seen { seconds: now - looks[0].t, rate, travel: high - low, reference: most - least }
    }

    /// Rows a second lately.
    pub(super) fn rows_a_second(&self) -> Option<f64> {
        let (last, from) = (self.looks.back()?, self.looks.len().saturating_sub(300));
        let seconds = last.t - self.looks[from].t;
        let rows: u32 = self.looks.range(from + 1..).map(|look| look.rows).sum();
        (seconds > 1.0).then(|| f64::from(rows) / seconds)
    }

    /// The largest reading of an axis, where it stands at it as at the end of its range, rad/s.
    pub(super) fn rail(&self, axis: Axis) -> Option<f64> {
        let readings =
            || self.readings.iter().map(|reading| reading[axis.index()]).filter(|reading| reading.is_finite());
        let largest = readings().map(f64::abs).fold(0.0, f64::max);
        // A gyro that is at rest has no range to speak of.
        if largest < 1.0 {
            return None;
        }
        Limits::of(readings()).stands_at(largest).map(f64::abs)
    }
}
