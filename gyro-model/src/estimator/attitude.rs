//! An orientation as reference of three axes: the error-state way.
//!
//! The estimator carries its own orientation q̂, turned by the filters' angle increments. A reference q gives the small
//! rotation that is missing, in body axes,
//!
//! ```text
//! ν = log(q̂⁻¹ ⊗ q)
//! ```
//!
//! whose components are the innovations of the three axes' angles; what the filters take of it turns q̂ too. So nothing
//! is ever differenced twice, and an error of the reference does not grow with the motion.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// The orientation that the filters have reached.
#[derive(Clone, Copy, Debug)]
pub(super) struct Attitude {
    world_from_body: UnitQuaternion<f64>,
    /// The last reference, for axes that have no gyro.
    reference: UnitQuaternion<f64>,
    increment: Vector3<f64>,
    /// Orientation at the last reference, and the rotation that was left between the two then.
    then: UnitQuaternion<f64>,
    left: Vector3<f64>,
    turning: [bool; 3],
    started: bool,
}

impl Default for Attitude {
    fn default() -> Self {
        Self {
            world_from_body: UnitQuaternion::identity(),
            reference: UnitQuaternion::identity(),
            increment: Vector3::zeros(),
            then: UnitQuaternion::identity(),
            left: Vector3::zeros(),
            turning: [false; 3],
            started: false,
        }
    }
}

impl Attitude {
    /// Turns by the angle increments of one step. With the increment before it, the coning correction
    /// φ = Δθ + ¹⁄₁₂ Δθ₋₁ × Δθ makes the rotation exact to third order.
    pub(super) fn turn(&mut self, increment: [f64; 3], turning: [bool; 3]) {
        let now = Vector3::from(increment);
        self.turning = turning;
        if self.started && now.iter().all(|v| v.is_finite()) {
            let rotation = now + self.increment.cross(&now) / 12.0;
            self.world_from_body *= UnitQuaternion::from_scaled_axis(rotation);
            self.increment = now;
        }
    }

    /// The rotation from the estimate to this reference in body axes, rad, the estimate taken back by the angles that
    /// it turned `since` the reference; and how much of it has come since the last one, which was the same rotation in the body axes of that
    /// time. `None` where there is no orientation or nothing to compare it with yet.
    pub(super) fn compare(&mut self, wxyz: [f64; 4], since: [f64; 3]) -> Option<[[f64; 3]; 2]> {
        let raw = Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3]);
        let norm = raw.norm();
        if !norm.is_finite() || !(0.5..2.0).contains(&norm) {
            return None;
        }
        let reference = UnitQuaternion::from_quaternion(raw);
        let since = UnitQuaternion::from_scaled_axis(Vector3::from(since));
        if !self.started {
            *self = Self { world_from_body: reference * since, reference, then: reference, started: true, ..*self };
            return Some([[0.0; 3]; 2]);
        }
        // What turned about an axis without gyro is taken from the reference itself.
        let mut blind = (self.reference.inverse() * reference).scaled_axis();
        for (component, turning) in blind.iter_mut().zip(self.turning) {
            if turning {
                *component = 0.0;
            }
        }
        self.reference = reference;
        if blind != Vector3::zeros() {
            self.world_from_body *= UnitQuaternion::from_scaled_axis(blind);
        }
        let then = self.world_from_body * since.inverse();
        let difference = (then.inverse() * reference).scaled_axis();
        let increment = difference - then.inverse() * (self.then * self.left);
        (self.then, self.left) = (then, difference);
        difference.iter().all(|v| v.is_finite()).then(|| [difference.into(), increment.into()])
    }

    /// Turns by what the filters took of the difference.
    pub(super) fn correct(&mut self, correction: [f64; 3]) {
        if correction.iter().any(|&c| c != 0.0) {
            self.world_from_body *= UnitQuaternion::from_scaled_axis(Vector3::from(correction));
            self.left -= Vector3::from(correction);
            self.world_from_body.renormalize();
        }
    }
}
