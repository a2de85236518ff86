//! The rigid body: its attitude, and the specific force at the sensor.

use super::{
    motion::{Instant, normal},
    noise::Smooth,
    sensor::SensorSpec,
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;

/// Standard gravity, m/s².
pub const GRAVITY: f64 = 9.80665;

/// Time constant of shaking, s: it reaches to some 4 Hz.
const SHAKING: f64 = 0.042;

/// Attitude and specific force.
#[derive(Clone, Debug)]
pub(super) struct Body {
    /// Body to world.
    attitude: UnitQuaternion<f64>,
    /// Specific force in the body frame without the accelerometer's noise, m/s².
    pub force: [f64; 3],
    time: f64,
    shaking: [Smooth; 3],
    random: ChaCha8Rng,
}

impl Body {
    pub(super) fn new(sensor: &SensorSpec, random: ChaCha8Rng) -> Self {
        Self {
            attitude: UnitQuaternion::identity(),
            force: [0.0; 3],
            time: 0.0,
            shaking: [Smooth::new(sensor.shaking, SHAKING); 3],
            random,
        }
    }

    /// Moves on to the instant `now`, `dt` later; `free` where all three axes turn.
    pub(super) fn step(
        &mut self,
        sensor: &SensorSpec,
        free: bool,
        now: [Instant; 3],
        dt: f64,
        mut at: impl FnMut(f64) -> [Instant; 3],
    ) {
        let i = sensor.axis.index();
        let (mut rate, mut rate_dot) = (Vector3::from(now.map(|n| n.rate)), Vector3::from(now.map(|n| n.rate_dot)));
        let up = if free {
            self.attitude *= turn(self.time, dt, |t| Vector3::from(at(t).map(|n| n.rate)));
            self.attitude.inverse() * Vector3::z()
        } else {
            for other in [(i + 1) % 3, (i + 2) % 3] {
                (rate[other], rate_dot[other]) = (0.0, 0.0);
            }
            let mut up = Vector3::zeros();
            if sensor.horizontal {
                (up[(i + 1) % 3], up[(i + 2) % 3]) = now[i].angle.sin_cos();
            } else {
                let tilt = sensor.tilt * (std::f64::consts::TAU * sensor.tilt_frequency * (self.time + dt)).sin();
                (up[(i + 1) % 3], up[i]) = tilt.sin_cos();
            }
            up
        };
        self.time += dt;
        let arm = Vector3::from(sensor.lever_arm);
        let force = GRAVITY * up + rate_dot.cross(&arm) + rate.cross(&rate.cross(&arm));
        for axis in 0..3 {
            self.force[axis] = force[axis] + self.shaking[axis].step(dt, &mut self.random);
        }
    }

    /// The attitude as motion capture sees it: w, x, y, z, turned by `off` rad about the body's axes, and by `noise` rad about each.
    pub(super) fn seen(&self, off: [f64; 3], noise: f64, random: &mut ChaCha8Rng) -> [f64; 4] {
        let error = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|_, _| normal(random, noise)));
        let shown = self.attitude * UnitQuaternion::from_scaled_axis(Vector3::from(off));
        let seen: Quaternion<f64> = (shown * error).into_inner();
        [seen.w, seen.i, seen.j, seen.k]
    }
}

/// The turn from `t` to `t + dt` at the body rates `rate`: Magnus' series of fourth order at Gauss' two points, for
/// R' = R [ω]×: Ω = h/2 (ω₁ + ω₂) + √3 h²/12 ω₁ × ω₂.
fn turn(t: f64, dt: f64, mut rate: impl FnMut(f64) -> Vector3<f64>) -> UnitQuaternion<f64> {
    let offset = 3_f64.sqrt() / 6.0;
    let (first, second) = (rate(t + (0.5 - offset) * dt), rate(t + (0.5 + offset) * dt));
    let commutator = 3_f64.sqrt() / 12.0 * dt * dt * first.cross(&second);
    UnitQuaternion::from_scaled_axis(0.5 * dt * (first + second) + commutator)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rates(t: f64) -> Vector3<f64> {
        Vector3::new(3.0 * (5.0 * t).sin(), 2.0 * (3.0 * t).cos(), 4.0 * (2.0 * t).sin())
    }

    fn attitude(dt: f64) -> UnitQuaternion<f64> {
        let steps = (1.0 / dt).round() as u32;
        (0..steps).fold(UnitQuaternion::identity(), |q, k| q * turn(f64::from(k) * dt, dt, rates))
    }

    #[test]
    fn halving_the_step_makes_the_attitude_sixteen_times_better() {
        let exact = attitude(1e-4);
        let [coarse, fine] = [0.02, 0.01].map(|dt| attitude(dt).angle_to(&exact));
        assert!((10.0..25.0).contains(&(coarse / fine)), "{coarse} {fine}");
    }

    #[test]
    fn the_attitude_turns_with_the_body_rates_and_not_with_the_worlds() {
        // A quarter turn about x, then one about the body's y: the body's z ends along the world's y… in world axes.
        let quarter = std::f64::consts::FRAC_PI_2;
        let first = turn(0.0, 1.0, |_| Vector3::x() * quarter);
        let second = turn(0.0, 1.0, |_| Vector3::y() * quarter);
        let z = (first * second) * Vector3::z();
        assert!((z - Vector3::x()).norm() < 1e-12, "{z}");
    }
}
