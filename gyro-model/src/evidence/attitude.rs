//! A reference that is an orientation: its increments in the body frame, and the rotation of errors to the world.

use super::series::Series;
use crate::Record;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Reference attitudes at the reference rows.
#[derive(Clone, Debug)]
pub struct Attitude {
    /// World from body at each reference row.
    pub world_from_body: Vec<UnitQuaternion<f64>>,
    /// Rotation vector of each step in the body frame; zero at the first row.
    increments: Vec<Vector3<f64>>,
    /// World from the frame at the middle of each step.
    middle: Vec<UnitQuaternion<f64>>,
}

impl Attitude {
    /// Takes the quaternions of the series' reference rows; lengths need not be 1.
    #[must_use]
    pub fn new(record: &Record, series: &Series) -> Self {
        let world_from_body: Vec<UnitQuaternion<f64>> = series
            .reference_rows
            .iter()
            .map(|&k| {
                let [w, x, y, z] = record.rows[k].ref_quaternion;
                UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6).unwrap_or_default()
            })
            .collect();
        let mut increments = vec![Vector3::zeros()];
        let mut middle = vec![world_from_body.first().copied().unwrap_or_default()];
        for pair in world_from_body.windows(2) {
            let step = (pair[0].inverse() * pair[1]).scaled_axis();
            increments.push(step);
            middle.push(pair[0] * UnitQuaternion::from_scaled_axis(0.5 * step));
        }
        Self { world_from_body, increments, middle }
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

    /// Sum of world-frame error steps, each turned back to the body and taken about one of its axes.
    #[must_use]
    pub fn about_body_axis(&self, world: &[Vec<f64>], axis: usize) -> Vec<f64> {
        let n = self.middle.len();
        let mut sum = 0.0;
        (0..n)
            .map(|i| {
                if i > 0 {
                    let step = Vector3::from_fn(|c, _| world[c][i] - world[c][i - 1]);
                    sum += (self.middle[i].inverse() * step)[axis];
                }
                sum
            })
            .collect()
    }

    /// Sum of step errors in the world frame: the gyro's rotation vector of each step (its three angles' increments,
    /// with the coning correction of two successive steps) less the reference's.
    #[must_use]
    pub fn residual(&self, angle: [&[f64]; 3], lost: &[bool]) -> Vec<Vec<f64>> {
        let n = self.middle.len();
        let mut out = vec![vec![0.0; n]; 3];
        let mut sum = Vector3::zeros();
        let mut before = Vector3::zeros();
        for i in 1..n {
            let step = Vector3::new(
                angle[0][i] - angle[0][i - 1],
                angle[1][i] - angle[1][i - 1],
                angle[2][i] - angle[2][i - 1],
            );
            let turned = step + before.cross(&step) / 12.0;
            before = step;
            if !lost[i] {
                sum += self.middle[i] * (turned - self.increments[i]);
            }
            for (channel, value) in out.iter_mut().zip(sum.iter()) {
                channel[i] = *value;
            }
        }
        out
    }
}
