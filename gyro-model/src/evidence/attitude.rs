//! A reference that is an orientation: its increments in the body frame, and the rotation of errors to the world.

use super::series::Series;
use crate::Record;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Reference attitudes at the reference rows.
#[derive(Clone, Debug)]
pub struct Attitude {
    /// World from body at each reference row.
    pub world_from_body: Vec<UnitQuaternion<f64>>,
    /// Rotation vector of each step in the body frame; zero at the first row.
    increments: Vec<Vector3<f64>>,
    /// World from the frame at the middle of each step.
    middle: Vec<Matrix3<f64>>,
    /// The body axes that have a gyro and are asked about.
    axes: Vec<usize>,
}

impl Attitude {
    /// Takes the quaternions of the series' reference rows, which serve these body axes; lengths need not be 1.
    #[must_use]
    pub fn new(record: &Record, series: &Series, axes: Vec<usize>) -> Self {
        let world_from_body: Vec<UnitQuaternion<f64>> = series
            .reference_rows
            .iter()
            .map(|&k| {
                let [w, x, y, z] = record.rows[k].ref_quaternion;
                UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6).unwrap_or_default()
            })
            .collect();
        let mut increments = vec![Vector3::zeros()];
        let mut middle = vec![world_from_body.first().copied().unwrap_or_default().to_rotation_matrix().into_inner()];
        for pair in world_from_body.windows(2) {
            let step = (pair[0].inverse() * pair[1]).scaled_axis();
            increments.push(step);
            middle.push((pair[0] * UnitQuaternion::from_scaled_axis(0.5 * step)).to_rotation_matrix().into_inner());
        }
        Self { world_from_body, increments, middle, axes }
    }

    /// Channels of a residual: three of the world where each body axis has its gyro; else those body axes that have one.
    #[must_use]
    pub fn channels(&self) -> usize {
        self.axes.len()
    }

    /// Whether errors are seen from the world, where a reference's noise does not add up.
    fn is_whole(&self) -> bool {
        self.axes.len() == 3
    }

    /// The shares of a residual's channels in its component along body axis `axis` at reference row `row`.
    #[must_use]
    pub fn direction(&self, axis: usize, row: usize) -> [f64; 3] {
        if !self.is_whole() {
            let own = self.axes.iter().position(|own| *own == axis);
            return std::array::from_fn(|channel| if own == Some(channel) { 1.0 } else { 0.0 });
        }
        let rotation = self.world_from_body[row].to_rotation_matrix();
        std::array::from_fn(|channel| rotation.matrix()[(channel, axis)])
    }

    /// Sum of the increments about body axis `axis`, rad.
    #[must_use]
    pub fn turned_about(&self, axis: usize) -> Vec<f64> {
        self.increments
            .iter()
            .scan(0.0, |sum, step| {
                *sum += step[axis];
                Some(*sum)
            })
            .collect()
    }

    /// Sum of a residual's error steps, each turned back to the body and taken about one of its axes.
    #[must_use]
    pub fn about_body_axis(&self, world: &[Vec<f64>], axis: usize) -> Vec<f64> {
        if let Some(channel) = self.axes.iter().position(|own| *own == axis).filter(|_| !self.is_whole()) {
            return world[channel].clone();
        }
        let n = self.middle.len();
        let mut sum = 0.0;
        (0..n)
            .map(|i| {
                if i > 0 {
                    let step = Vector3::from_fn(|c, _| world[c][i] - world[c][i - 1]);
                    sum += self.middle[i].column(axis).dot(&step);
                }
                sum
            })
            .collect()
    }

    /// Sum of step errors: the gyro's rotation vector of each step (its three angles' increments, with the coning
    /// correction of two successive steps) less the reference's. What turned about an axis without gyro is the reference's.
    ///
    /// A reference that shows another orientation, R exp(o), has turned in a step by log(exp(−oᵢ₋₁) exp(θ) exp(oᵢ)).
    #[must_use]
    pub fn residual(&self, angle: [Option<&[f64]>; 3], off: [Option<&[f64]>; 3], lost: &[bool]) -> Vec<Vec<f64>> {
        let n = self.middle.len();
        let is_off = off.iter().any(Option::is_some);
        let mut out = vec![vec![0.0; n]; self.channels()];
        let mut sum = Vector3::zeros();
        let mut before = Vector3::zeros();
        let off = |i: usize| rotation(&Vector3::from_fn(|a, _| off[a].map_or(0.0, |off| off[i])));
        let mut off_before = if is_off { off(0) } else { UnitQuaternion::identity() };
        for i in 1..n {
            let step = Vector3::from_fn(|a, _| angle[a].map_or(self.increments[i][a], |angle| angle[i] - angle[i - 1]));
            let mut turned = step + before.cross(&step) / 12.0;
            if is_off {
                let off_after = off(i);
                turned = turn(&(off_before.inverse() * rotation(&turned) * off_after));
                off_before = off_after;
            }
            before = step;
            if !lost[i] {
                let error = turned - self.increments[i];
                sum += if self.is_whole() { self.middle[i] * error } else { error };
            }
            for (k, channel) in out.iter_mut().enumerate() {
                channel[i] = sum[if self.is_whole() { k } else { self.axes[k] }];
            }
        }
        out
    }

    /// What [`Attitude::residual`] changes by where the angle of one axis becomes `new`, step by step:
    ///
    /// ```text
    /// Δ(θᵢ + θᵢ₋₁ × θᵢ / 12) = Δᵢ + (Δᵢ₋₁ × θᵢ' + θᵢ₋₁ × Δᵢ) / 12,   Δ along the axis, θ' = θ + Δ
    /// ```
    #[must_use]
    pub fn difference(&self, angle: [Option<&[f64]>; 3], axis: usize, new: &[f64], lost: &[bool]) -> Vec<Vec<f64>> {
        let n = self.middle.len();
        let mut out = vec![vec![0.0; n]; self.channels()];
        let own = angle[axis].unwrap_or(new);
        let mut sum = Vector3::zeros();
        let (mut before, mut moved_before) = (Vector3::zeros(), 0.0);
        let (next, other) = ((axis + 1) % 3, (axis + 2) % 3);
        for i in 1..n {
            let step = Vector3::from_fn(|a, _| angle[a].map_or(self.increments[i][a], |angle| angle[i] - angle[i - 1]));
            let moved = (new[i] - own[i]) - (new[i - 1] - own[i - 1]);
            if !lost[i] {
                // e_a × v has −v_(a+2) along a + 1 and v_(a+1) along a + 2; v × e_a the opposite.
                let mut error = Vector3::zeros();
                error[axis] = moved;
                error[next] = (before[other] * moved - moved_before * step[other]) / 12.0;
                error[other] = (moved_before * step[next] - before[next] * moved) / 12.0;
                sum += if self.is_whole() { self.middle[i] * error } else { error };
            }
            (before, moved_before) = (step, moved);
            for (k, channel) in out.iter_mut().enumerate() {
                channel[i] = sum[if self.is_whole() { k } else { self.axes[k] }];
            }
        }
        out
    }
}

/// Square of half an angle up to which the series of its sine and cosine hold to the last digit.
const SMALL: f64 = 2.5e-3;

/// The rotation by a rotation vector, whose angle is mostly small here: by the series of sine and cosine.
fn rotation(v: &Vector3<f64>) -> UnitQuaternion<f64> {
    let x = 0.25 * v.norm_squared();
    if x > SMALL {
        return UnitQuaternion::from_scaled_axis(*v);
    }
    let cos = 1.0 - x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0)));
    let sin_over = 1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0)));
    UnitQuaternion::new_unchecked(Quaternion::from_parts(cos, 0.5 * sin_over * v))
}

/// The rotation vector of a rotation: where its angle is small, by the series of the arcsine.
fn turn(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    let v = q.imag();
    let x = v.norm_squared();
    if x > SMALL || q.w < 0.0 {
        return q.scaled_axis();
    }
    let asin_over =
        1.0 + x * (1.0 / 6.0 + x * (3.0 / 40.0 + x * (5.0 / 112.0 + x * (35.0 / 1152.0 + x * (63.0 / 2816.0)))));
    2.0 * asin_over * v
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Axis, Model, Row};

    /// A body that turns about all three axes.
    fn record() -> Record {
        let rows = (0..300).map(|k| {
            let t = f64::from(k) * 0.01;
            let turn = Vector3::new((3.0 * t).sin(), 0.7 * (5.0 * t).cos(), 0.4 * t);
            let q = UnitQuaternion::from_scaled_axis(turn).into_inner();
            let gyro = [3.0 * (3.0 * t).cos(), -3.5 * (5.0 * t).sin(), 0.4];
            Row { t_ns: i64::from(k) * 10_000_000, gyro, ref_quaternion: [q.w, q.i, q.j, q.k], ..Row::EMPTY }
        });
        Record { rows: rows.collect(), ..Record::default() }
    }

    #[test]
    fn small_rotations_by_series_are_those_by_sine_and_arcsine() {
        for angle in [0.0, 1e-9, 1e-3, 0.03, 0.0999, 0.1001, 0.5, 3.0] {
            let v = angle * Vector3::new(1.0, -2.0, 2.0) / 3.0;
            let q = UnitQuaternion::from_scaled_axis(v);
            assert!((rotation(&v).into_inner() - q.into_inner()).norm() < 1e-15, "{angle} rad");
            assert!((turn(&q) - v).norm() < 1e-15 * (1.0 + angle), "{angle} rad: {}", turn(&q) - v);
        }
    }

    #[test]
    fn a_difference_is_that_of_two_residuals() {
        let record = record();
        let series = Series::new(&record, Axis::X, &Model::base_for(&record)).unwrap();
        let attitude = Attitude::new(&record, &series, vec![0, 1, 2]);
        let n = series.reference_rows.len();
        let angle = |f: f64| -> Vec<f64> { (0..n).map(|i| (f * 0.01 * i as f64).sin()).collect() };
        let angles = [angle(3.0), angle(5.0), angle(1.0)];
        let lost: Vec<bool> = (0..n).map(|i| (100..110).contains(&i)).collect();
        let of = |angles: &[Vec<f64>; 3]| attitude.residual(angles.each_ref().map(|a| Some(&a[..])), [None; 3], &lost);
        let before = of(&angles);
        for axis in 0..3 {
            let mut moved = angles.clone();
            moved[axis].iter_mut().enumerate().for_each(|(i, a)| *a += 1e-2 * (0.07 * i as f64).sin());
            let exact = of(&moved);
            let angles = angles.each_ref().map(|a| Some(&a[..]));
            let difference = attitude.difference(angles, axis, &moved[axis], &lost);
            for (channel, own) in difference.iter().enumerate() {
                let off = (0..n).map(|i| (exact[channel][i] - before[channel][i] - own[i]).abs()).fold(0.0, f64::max);
                assert!(off < 1e-12, "axis {axis}, channel {channel}: {off}");
            }
        }
    }
}
