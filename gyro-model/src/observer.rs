//! The paper's own filter: a two-state observer of bias and integrated gyro angle, its equations (6)–(9).
//!
//! ```text
//! d/dt [δ̂; θ̂_g] = [0 0; −1 0][δ̂; θ̂_g] + [M₁; M₂](θ_g − θ̂_g)                 (9)
//! stationary gain of (8), Q = diag(q₁, q₂), S:  M₁ = −√(q₁/S),  M₂ = √((q₂ + 2√(q₁ S))/S)
//! ```
//!
//! It leaves out the input θ̇, so θ̂_g follows the angle through a tracker of about 0.3 Hz: see [`Observer::response`].

use std::f64::consts::TAU;

/// Q and S with which the paper computes its gain.
pub(crate) const PAPER_Q: [f64; 2] = [5.0, 5.0];
/// See [`PAPER_Q`].
pub(crate) const PAPER_S: f64 = 1.1;
/// The gain M as the paper prints it.
pub(crate) const PRINTED_GAIN: [f64; 2] = [-2.132, 0.2373];

/// Longest step of the integration, s: a hundredth of the observer's shortest time constant.
const STEP: f64 = 5e-3;

/// A step beyond which the observer starts again, s.
const GAP: f64 = 10.0;

/// The stationary solution of (8): M = P Hᵀ S⁻¹.
#[must_use]
pub(crate) fn riccati_gain(q: [f64; 2], s: f64) -> [f64; 2] {
    [-(q[0] / s).sqrt(), ((q[1] + 2.0 * (q[0] * s).sqrt()) / s).sqrt()]
}

/// The observer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Observer {
    gain: [f64; 2],
    bias: f64,
    angle: f64,
    measured: f64,
    started: bool,
}

impl Observer {
    /// An observer with this gain M, at rest.
    #[must_use]
    pub(crate) fn new(gain: [f64; 2]) -> Self {
        Self { gain, bias: 0.0, angle: 0.0, measured: 0.0, started: false }
    }

    /// Takes the integrated gyro angle θ_g, `dt` after the last: (9) by Runge–Kutta of fourth order, θ_g linear between.
    pub(crate) fn step(&mut self, measured: f64, dt: f64) {
        if !measured.is_finite() {
            return;
        }
        if !self.started || dt > GAP {
            *self = Self { angle: measured, measured, started: true, bias: 0.0, ..*self };
            return;
        }
        let steps = (dt / STEP).ceil().max(1.0);
        let h = dt / steps;
        let slope = (measured - self.measured) / dt.max(f64::MIN_POSITIVE);
        for k in 0..steps as usize {
            let z = self.measured + slope * h * k as f64;
            let f = |bias: f64, angle: f64, t: f64| self.derivative(bias, angle, z + slope * t);
            let k1 = f(self.bias, self.angle, 0.0);
            let k2 = f(self.bias + 0.5 * h * k1[0], self.angle + 0.5 * h * k1[1], 0.5 * h);
            let k3 = f(self.bias + 0.5 * h * k2[0], self.angle + 0.5 * h * k2[1], 0.5 * h);
            let k4 = f(self.bias + h * k3[0], self.angle + h * k3[1], h);
            self.bias += h / 6.0 * (k1[0] + 2.0 * k2[0] + 2.0 * k3[0] + k4[0]);
            self.angle += h / 6.0 * (k1[1] + 2.0 * k2[1] + 2.0 * k3[1] + k4[1]);
        }
        self.measured = measured;
    }

    fn derivative(&self, bias: f64, angle: f64, measured: f64) -> [f64; 2] {
        let e = measured - angle;
        [self.gain[0] * e, -bias + self.gain[1] * e]
    }

    /// θ̂_g, rad.
    #[must_use]
    pub(crate) fn angle(&self) -> f64 {
        self.angle
    }

    /// dθ̂_g/dt, rad/s.
    #[must_use]
    pub(crate) fn rate(&self) -> f64 {
        self.derivative(self.bias, self.angle, self.measured)[1]
    }

    /// What the observer does to a sine of this frequency, Hz: (gain, phase in rad) of
    /// θ̂_g/θ_g = (M₂ s − M₁)/(s² + M₂ s − M₁).
    #[must_use]
    pub(crate) fn response(gain: [f64; 2], frequency: f64) -> (f64, f64) {
        let w = TAU * frequency;
        let (re, im) = (-gain[0], gain[1] * w);
        let (dre, dim) = (-gain[0] - w * w, gain[1] * w);
        (re.hypot(im) / dre.hypot(dim), im.atan2(re) - dim.atan2(dre))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stationary_gain_solves_the_papers_riccati_equation() {
        let (q, s) = ([3.0, 7.0], 0.8);
        let m = riccati_gain(q, s);
        // P H' = M S gives P12, P22; (8) stationary: E P + P E' + Q = M S M'.
        let (p12, p22) = (m[0] * s, m[1] * s);
        let p11 = -m[0] * m[1] * s;
        let residual = [q[0] - m[0] * m[0] * s, -p11 - m[0] * m[1] * s, -2.0 * p12 + q[1] - m[1] * m[1] * s];
        assert!(p22 > 0.0 && p11 * p22 > p12 * p12);
        for r in residual {
            assert!(r.abs() < 1e-12, "{residual:?}");
        }
    }

    #[test]
    fn a_sine_comes_out_with_the_gain_and_phase_of_the_transfer_function() {
        for gain in [riccati_gain(PAPER_Q, PAPER_S), PRINTED_GAIN] {
            let (f, dt) = (0.25, 1e-3);
            let mut observer = Observer::new(gain);
            let (mut s, mut c, mut n) = (0.0, 0.0, 0.0);
            for k in 0..100_000 {
                let t = f64::from(k) * dt;
                observer.step((TAU * f * t).sin(), dt);
                if t >= 60.0 {
                    s += observer.angle() * (TAU * f * t).sin();
                    c += observer.angle() * (TAU * f * t).cos();
                    n += 0.5;
                }
            }
            let (amplitude, phase) = ((s / n).hypot(c / n), (c / n).atan2(s / n));
            let (expected, angle) = Observer::response(gain, f);
            assert!((amplitude / expected - 1.0).abs() < 1e-3, "{amplitude} {expected}");
            assert!((phase - angle).abs() < 1e-3, "{phase} {angle}");
        }
    }
}
