//! What the reference measured beside what the model makes of the gyro, in even steps of time, while it runs.
//!
//! Both sides are running angles: the reference's, unwrapped, at the time it was read, and the integral of the
//! compensated rate at the time at which the reference shows it (so that a modelled delay lines the two up). A step's rate is
//! the angle's increment over it: encoder noise telescopes, nothing is differentiated twice.

use gyro_model::{Row, estimator::Estimate, record::turn};
use serde::Serialize;
use std::{
    collections::VecDeque,
    f64::consts::{PI, TAU},
};

/// One step, ns: 20 updates a second.
const STEP_NS: i64 = 50_000_000;
/// Steps that the residual is averaged over: half a second.
const RESIDUAL_STEPS: usize = 10;
/// A reference that is that far behind has nothing to say about a step, ns.
const LATE_NS: i64 = 600_000_000;
/// A jump in time that begins everything anew, ns.
const JUMP_NS: i64 = 2_000_000_000;

/// One step of time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Step {
    /// Its end, s of the source.
    pub t: f64,
    /// The three axes.
    pub axes: [StepAxis; 3],
}

/// One axis of a step; `None` where there is no value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct StepAxis {
    /// Rate that the reference measured, °/s.
    pub measured: Option<f64>,
    /// Rate that the model makes of the gyro, °/s.
    pub model: Option<f64>,
    /// Model less measured over the last half second, °/s.
    pub residual: Option<f64>,
}

/// A running angle.
#[derive(Debug, Default)]
struct Track {
    points: VecDeque<(i64, f64)>,
}

impl Track {
    fn push(&mut self, time_ns: i64, angle: f64) {
        if angle.is_finite() && self.points.back().is_none_or(|last| time_ns > last.0) {
            self.points.push_back((time_ns, angle));
        }
    }

    fn last(&self) -> Option<(i64, f64)> {
        self.points.back().copied()
    }

    /// Linear between the two points around `time_ns`.
    fn at(&self, time_ns: i64) -> Option<f64> {
        let after = self.points.partition_point(|p| p.0 < time_ns);
        let &(t1, y1) = self.points.get(after)?;
        if t1 == time_ns {
            return Some(y1);
        }
        let &(t0, y0) = self.points.get(after.checked_sub(1)?)?;
        (t1 - t0 <= LATE_NS).then(|| y0 + (y1 - y0) * (time_ns - t0) as f64 / (t1 - t0) as f64)
    }

    /// The angle with which another model's track goes on at `time_ns`, what lies later being forgotten; `rate`, rad/s, leads
    /// to where there is no angle.
    fn continued(&mut self, time_ns: i64, rate: f64) -> Option<f64> {
        let first = *self.points.front()?;
        let angle = self.at(time_ns);
        while self.points.back().is_some_and(|last| last.0 >= time_ns) {
            self.points.pop_back();
        }
        let (t, y) = self.last().unwrap_or(first);
        angle.or_else(|| {
            let led = y + rate * (time_ns - t) as f64 * 1e-9;
            ((time_ns - t).abs() <= LATE_NS && led.is_finite()).then_some(led)
        })
    }

    /// Forgets what lies before `time_ns`, but for one point.
    fn forget(&mut self, time_ns: i64) {
        while self.points.len() > 1 && self.points[1].0 <= time_ns {
            self.points.pop_front();
        }
    }
}

#[derive(Debug, Default)]
struct Line {
    reference: Track,
    model: Track,
    /// What is added to the estimates' angle: a model that says of what time they hold moves them in time, not in angle.
    offset: f64,
    /// Angle error at the last steps' ends.
    errors: VecDeque<Option<f64>>,
}

/// Lines up rows and estimates.
#[derive(Debug, Default)]
pub struct Motion {
    axes: [Line; 3],
    quaternion: Option<[f64; 4]>,
    epoch: Option<u64>,
    row_ns: Option<i64>,
    /// End of the last step.
    edge_ns: Option<i64>,
}

impl Motion {
    /// Takes the references of a row.
    pub fn row(&mut self, row: &Row) {
        let last = self.row_ns.replace(row.t_ns);
        if last.is_some_and(|last| row.t_ns < last || row.t_ns > last + JUMP_NS) {
            *self = Self { row_ns: Some(row.t_ns), ..Self::default() };
        }
        let turned = self.turned(row.ref_quaternion);
        for (i, line) in self.axes.iter_mut().enumerate() {
            let before = line.reference.last();
            let angle = if row.ref_angle[i].is_finite() {
                before.map_or(row.ref_angle[i], |(_, y)| y + wrapped(row.ref_angle[i] - y))
            } else if let Some(turned) = turned {
                before.map_or(0.0, |(_, y)| y) + turned[i]
            } else {
                let rate = row.ref_rate[i];
                before.map_or(0.0, |(t, y)| y + rate * (row.t_ns - t) as f64 * 1e-9) + 0.0 * rate
            };
            line.reference.push(row.t_ns, angle);
        }
    }

    /// The rotation since the last orientation, in body axes, rad.
    fn turned(&mut self, q: [f64; 4]) -> Option<[f64; 3]> {
        if q.iter().any(|v| !v.is_finite()) {
            return None;
        }
        let Some(p) = self.quaternion.replace(q) else { return Some([0.0; 3]) };
        Some(turn(p, q))
    }

    /// Takes an estimate.
    pub fn estimate(&mut self, estimate: &Estimate) {
        let is_same = self.epoch.replace(estimate.epoch) == Some(estimate.epoch);
        for (line, axis) in self.axes.iter_mut().zip(&estimate.axes) {
            if !axis.present {
                continue;
            }
            if !is_same && let Some(angle) = line.model.continued(estimate.reference_t_ns, axis.rate) {
                line.offset = angle - axis.angle;
            }
            line.model.push(estimate.reference_t_ns, line.offset + axis.angle);
        }
    }

    /// The steps that are complete by now.
    pub fn steps(&mut self) -> Vec<Step> {
        let Some(newest) = self.axes.iter().filter_map(|l| l.model.last()).map(|p| p.0).max() else {
            return Vec::new();
        };
        let mut edge = self.edge_ns.unwrap_or_else(|| newest.div_euclid(STEP_NS) * STEP_NS);
        if newest < edge - JUMP_NS || newest > edge + JUMP_NS {
            edge = newest.div_euclid(STEP_NS) * STEP_NS;
        }
        let mut steps = Vec::new();
        while edge + STEP_NS <= newest && self.is_complete(edge + STEP_NS, newest) {
            let (from, to) = (edge, edge + STEP_NS);
            steps.push(Step { t: to as f64 * 1e-9, axes: std::array::from_fn(|i| self.axes[i].step(from, to)) });
            edge = to;
        }
        self.edge_ns = Some(edge);
        for line in &mut self.axes {
            line.reference.forget(edge);
            line.model.forget(edge);
        }
        steps
    }

    /// Whether every axis that has a reference knows it up to `edge`, or can't be waited for.
    fn is_complete(&self, edge: i64, newest: i64) -> bool {
        self.axes.iter().all(|l| l.reference.last().is_none_or(|(t, _)| t >= edge || newest - t > LATE_NS))
    }
}

impl Line {
    fn step(&mut self, from: i64, to: i64) -> StepAxis {
        let seconds = (to - from) as f64 * 1e-9;
        let rate = |track: &Track| Some(((track.at(to)? - track.at(from)?) / seconds).to_degrees());
        let error = self.model.at(to).zip(self.reference.at(to)).map(|(m, r)| m - r);
        self.errors.push_back(error);
        if self.errors.len() > RESIDUAL_STEPS + 1 {
            self.errors.pop_front();
        }
        let whole = self.errors.len() > RESIDUAL_STEPS;
        let first = self.errors.front().copied().flatten().filter(|_| whole);
        let residual = error.zip(first).map(|(b, a)| ((b - a) / (seconds * RESIDUAL_STEPS as f64)).to_degrees());
        StepAxis { measured: rate(&self.reference), model: rate(&self.model), residual }
    }
}

/// Into −π … π.
fn wrapped(angle: f64) -> f64 {
    (angle + PI).rem_euclid(TAU) - PI
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyro_model::estimator::AxisEstimate;

    const SOME: AxisEstimate = AxisEstimate { present: true, ..AxisEstimate::ABSENT };
    const NONE: Estimate = Estimate { valid_t_ns: 0, reference_t_ns: 0, epoch: 0, axes: [AxisEstimate::ABSENT; 3] };

    fn angle(t: f64) -> f64 {
        2.0 * t + 0.3 * (3.0 * t).sin()
    }

    /// Three seconds of it, with the estimate that `estimated` makes of each row's number and time, s.
    fn play(motion: &mut Motion, estimated: impl Fn(i64, f64) -> (Estimate, AxisEstimate)) -> Vec<Step> {
        let mut steps = Vec::new();
        for k in 0..3000_i64 {
            let t = k as f64 * 1e-3;
            let mut row = Row { t_ns: k * 1_000_000, ..Row::EMPTY };
            row.ref_angle[2] = wrapped(angle(t));
            motion.row(&row);
            let (mut estimate, axis) = estimated(k, t);
            estimate.axes[2] = axis;
            motion.estimate(&estimate);
            steps.extend(motion.steps());
        }
        steps
    }

    /// A model that knows the delay, s, and whose scale is off by `error`.
    fn play_model(motion: &mut Motion, delay: f64, error: f64) -> Vec<Step> {
        play(motion, |k, t| {
            let estimate = Estimate { reference_t_ns: k * 1_000_000 - (delay * 1e9) as i64, ..NONE };
            (estimate, AxisEstimate { angle: angle(t - delay) * (1.0 + error), ..SOME })
        })
    }

    #[test]
    fn a_right_model_lies_on_the_reference_whatever_its_delay() {
        let steps = play_model(&mut Motion::default(), 0.012, 0.0);
        assert!(steps.len() > 50);
        for axis in steps.iter().skip(12).map(|s| s.axes[2]) {
            assert!((axis.model.unwrap() - axis.measured.unwrap()).abs() < 0.05, "{axis:?}");
            assert!(axis.residual.unwrap().abs() < 0.01, "{axis:?}");
        }
        assert!(steps.iter().all(|s| s.axes[0] == StepAxis::default()));
    }

    #[test]
    fn a_delay_that_is_added_or_taken_back_is_no_jerk() {
        let steps = play(&mut Motion::default(), |k, t| {
            let epoch = u64::from(k >= 1210) + u64::from(k >= 2230);
            let late = if epoch == 1 { 20_000_000 } else { 0 };
            let rate = 2.0 + 0.9 * (3.0 * (t - 0.02)).cos();
            let axis = AxisEstimate { angle: angle(t - 0.02), rate, ..SOME };
            (Estimate { reference_t_ns: k * 1_000_000 - late, epoch, ..NONE }, axis)
        });
        assert!(steps.len() > 50);
        for axis in steps.iter().skip(12).map(|s| s.axes[2]) {
            assert!((axis.model.unwrap() - axis.measured.unwrap()).abs() < 4.0, "{axis:?}");
            assert!(axis.residual.unwrap().abs() < 4.0, "{axis:?}");
        }
    }

    #[test]
    fn a_wrong_scale_shows_in_the_residual() {
        let steps = play_model(&mut Motion::default(), 0.0, 0.01);
        let mean = steps.iter().filter_map(|s| s.axes[2].residual).sum::<f64>() / steps.len() as f64;
        assert!((0.5..2.0).contains(&mean), "{mean}");
    }

    #[test]
    fn memory_stays_bounded_where_a_reference_falls_silent() {
        let mut motion = Motion::default();
        play_model(&mut motion, 0.0, 0.0);
        for k in 3000..20_000_i64 {
            motion.row(&Row { t_ns: k * 1_000_000, ..Row::EMPTY });
            let mut estimate = Estimate { reference_t_ns: k * 1_000_000, ..NONE };
            estimate.axes[2] = AxisEstimate { angle: 0.0, ..SOME };
            motion.estimate(&estimate);
            motion.steps();
        }
        assert!(motion.axes[2].model.points.len() < 1500, "{}", motion.axes[2].model.points.len());
    }

    #[test]
    fn a_rotation_about_one_axis_turns_that_axis_of_the_quaternion() {
        let mut motion = Motion::default();
        let mut sum = [0.0; 3];
        for k in 0..100 {
            let half = 0.5 * 0.05 * f64::from(k);
            let turned = motion.turned([half.cos(), 0.0, half.sin(), 0.0]).unwrap();
            sum = std::array::from_fn(|i| sum[i] + turned[i]);
        }
        assert!((sum[1] - 0.05 * 99.0).abs() < 1e-9 && sum[0].abs() < 1e-12 && sum[2].abs() < 1e-12, "{sum:?}");
    }
}
