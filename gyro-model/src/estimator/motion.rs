//! How fast the motion is, and how far the filter is behind it.

use std::f64::consts::SQRT_2;

/// Over what time the motion's own frequency is averaged, s.
const MOTION_MEMORY: f64 = 4.0;

/// The motion of the last seconds: mean squares of rate and acceleration (its own frequency is √(E a²/E ω²)/2π), and
/// the filter's delay, weighed by a².
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    rate: f64,
    acceleration: f64,
    lag: f64,
}

impl Motion {
    /// Takes the filter's rate and acceleration; `tau` = (N²/q)^¼ is the time over which it averages. The stationary
    /// filter's response from true to filtered rate is (1 + √2 jωτ)/(1 − ω²τ² + √2 jωτ).
    pub(super) fn take(&mut self, rate: f64, acceleration: f64, tau: f64, dt: f64) {
        let forget = -(-dt / MOTION_MEMORY).exp_m1();
        self.rate += forget * (rate * rate - self.rate);
        self.acceleration += forget * (acceleration * acceleration - self.acceleration);
        let omega = (self.acceleration / self.rate.max(f64::MIN_POSITIVE)).sqrt().clamp(1e-6, 1e6);
        let x = (omega * tau).min(1e6);
        let now = ((SQRT_2 * x).atan2(1.0 - x * x) - (SQRT_2 * x).atan()) / omega;
        let weighed = now * acceleration * acceleration;
        if weighed.is_finite() {
            self.lag += forget * (weighed - self.lag);
        }
    }

    /// The filter's delay, s.
    pub(super) fn lag(&self) -> f64 {
        if self.acceleration > 0.0 { self.lag / self.acceleration } else { 0.0 }
    }
}
