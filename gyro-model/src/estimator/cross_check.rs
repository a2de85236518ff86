//! Bias and scale error of the compensated rate, and the reference's delay, by the reference alone, whatever model and filter believe.
//!
//! A filter that is certain of a wrong bias takes each new angle for a step of the reference and stays wrong. This second,
//! small filter has no such belief: it starts from what an unfitted sensor may have, and forgets over [`MEMORY`].
//!
//! ```text
//! x = [o  b  s  τ]ᵀ                     ∫u dt − θ, bias, scale error, the time by which the reference is later than the gyro
//! o⁺ = o + b Δt + s Δθ + w              w of variance N² Δt
//! angle   z = ∫u dt up to t − τ̂, − θ_ref(t) = o − b τ̂ − s (θ(t) − θ(t − τ̂)) + (τ − τ̂) ω(t − τ̂) + v
//! rate    z = u(t − τ̂) − ω_ref(t)           = b + s ω(t − τ̂) + (τ − τ̂) a(t − τ̂) + v
//! ```
//!
//! with v of the reference's variance and, since ω and a are known no better than b, s and the gyro's noise allow, of that of the product
//! (τ − τ̂) (ω − ω̂), Var τ Var ω (the second-order term of an extended filter: Jazwinski, "Stochastic Processes and Filtering Theory", 1970,
//! section 9.3). Without it a bias that is not known yet would pass for a motion that tells τ. The model is made linear about the delay τ̂
//! that is known so far, so that a delay that is a large part of a swing's period is no scale error.
//!
//! Where its b and s differ from the main filter's by more than [`CONTRADICTED`] (χ² of two degrees of freedom, both covariances
//! added), the main filter is wrong and takes them over.

use crate::kalman::Calibration;
use nalgebra::{Matrix2, Matrix4, RowVector4, Vector2, Vector4};

/// Over what time it forgets, s.
const MEMORY: f64 = 20.0;

/// χ²₂ beyond which the two filters contradict each other: 1 in 10⁷ by chance.
const CONTRADICTED: f64 = 32.0;

/// Times in a row that they have to.
const IN_A_ROW: u8 = 3;

/// Standard deviation of o before the first angle, rad.
const OFFSET_UNKNOWN: f64 = 1e3;

/// Innovations beyond this many standard deviations are rejected.
const GATE: f64 = 5.0;

/// Rejected in a row before it is the reference that has jumped.
const PATIENCE: u8 = 2;

/// The instant t − τ̂ that a reference shows at t, by the gyro.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shown {
    /// ∫u dt from then to t, rad.
    pub since: f64,
    /// u, rad/s, and du/dt, rad/s², then, and the variances that the gyro's noise makes of them.
    pub signal: f64,
    pub slope: f64,
    pub signal_variance: f64,
    pub slope_variance: f64,
}

/// See the module's head.
#[derive(Clone, Copy, Debug)]
pub(super) struct CrossCheck {
    x: Vector4<f64>,
    p: Matrix4<f64>,
    /// Variances at the start; none grows beyond them.
    prior: Vector4<f64>,
    rejected: u8,
    contradicted: u8,
}

impl CrossCheck {
    /// A filter that knows nothing of bias and scale error, and the delay to `delay_std`, s.
    pub(super) fn new(delay_std: f64) -> Self {
        let Calibration { bias_std, scale_std, .. } = Calibration::UNFITTED;
        let prior = Vector4::new(OFFSET_UNKNOWN, bias_std, scale_std, delay_std).map(|std| std * std);
        Self { x: Vector4::zeros(), p: Matrix4::from_diagonal(&prior), prior, rejected: 0, contradicted: 0 }
    }

    /// What is turned in `dt` while ∫u grows by `signalled`.
    pub(super) fn turned(&self, dt: f64, signalled: f64) -> f64 {
        (signalled - self.x[1] * dt) / (1.0 + self.x[2])
    }

    /// `dt` passes, in which `turned` is turned; `walk` is the gyro's N².
    pub(super) fn predict(&mut self, dt: f64, turned: f64, walk: f64) {
        #[rustfmt::skip]
        let f = Matrix4::new(
            1.0, dt,  turned, 0.0,
            0.0, 1.0, 0.0,    0.0,
            0.0, 0.0, 1.0,    0.0,
            0.0, 0.0, 0.0,    1.0,
        );
        self.x = f * self.x;
        self.p = f * self.p * f.transpose() * (dt / MEMORY).min(1.0).exp();
        self.p[(0, 0)] += walk * dt;
        let prior = self.prior;
        for i in 0..4 {
            if self.p[(i, i)] > prior[i] {
                let shrink = (prior[i] / self.p[(i, i)]).sqrt();
                self.p.row_mut(i).scale_mut(shrink);
                self.p.column_mut(i).scale_mut(shrink);
            }
        }
    }

    /// u becomes `gain` u + `offset`, while something turns at `rate`: so do 1 + s and b. ∫u dt up to now stays as it was added up, but its part
    /// over the last τ̂ is of the new u.
    pub(super) fn rescale(&mut self, gain: f64, offset: f64, rate: f64) {
        self.p[(0, 0)] += (((gain - 1.0) * rate + offset) * self.x[3]).powi(2);
        self.x[1] = gain * self.x[1] + offset;
        self.x[2] = gain * (1.0 + self.x[2]) - 1.0;
        for i in 1..3 {
            self.p.row_mut(i).scale_mut(gain);
            self.p.column_mut(i).scale_mut(gain);
        }
        self.contradicted = 0;
    }

    /// How late the reference is, s, and the standard deviation of that.
    pub(super) fn delay(&self) -> (f64, f64) {
        (self.x[3], self.p[(3, 3)].max(0.0).sqrt())
    }

    /// The rate that u makes, and its variance.
    fn rate(&self, signal: f64, variance: f64) -> (f64, f64) {
        let gain = 1.0 / (1.0 + self.x[2]);
        let rate = gain * (signal - self.x[1]);
        (rate, gain * gain * (variance + self.p[(1, 1)] + rate * rate * self.p[(2, 2)]))
    }

    /// ∫u dt up to the instant that the reference shows, less its angle, is `z`, of variance `r`.
    pub(super) fn take_angle(&mut self, z: f64, shown: &Shown, r: f64) {
        let delay = self.x[3];
        let (rate, uncertain) = self.rate(shown.signal, shown.signal_variance);
        let h = RowVector4::new(1.0, -delay, -self.turned(delay, shown.since), rate);
        if !self.take(h, z + rate * delay, r + uncertain * self.p[(3, 3)]) {
            self.rejected += 1;
            if self.rejected > PATIENCE {
                self.break_off();
            }
        }
    }

    /// u at the instant that the reference shows, less its rate, is `z`, of variance `r`.
    pub(super) fn take_rate(&mut self, z: f64, shown: &Shown, r: f64) {
        let gain = 1.0 / (1.0 + self.x[2]);
        let (rate, _) = self.rate(shown.signal, shown.signal_variance);
        let (acceleration, uncertain) = (gain * shown.slope, gain * gain * shown.slope_variance);
        let h = RowVector4::new(0.0, 1.0, rate, acceleration);
        self.take(h, z + acceleration * self.x[3], r + uncertain * self.p[(3, 3)]);
    }

    /// Bias and scale error may have changed: what is known of them is a guess. The delay is known worse by `factor`.
    pub(super) fn forget(&mut self, factor: f64) {
        let delay = (self.p[(3, 3)] * factor * factor).min(self.prior[3]);
        self.p = Matrix4::from_diagonal(&self.prior);
        self.p[(3, 3)] = delay;
        (self.rejected, self.contradicted) = (0, 0);
    }

    /// The next angle does not continue the last one.
    pub(super) fn break_off(&mut self) {
        self.rejected = 0;
        self.p.row_mut(0).fill(0.0);
        self.p.column_mut(0).fill(0.0);
        self.p[(0, 0)] = self.prior[0];
    }

    fn take(&mut self, h: RowVector4<f64>, z: f64, r: f64) -> bool {
        let ph = self.p * h.transpose();
        let s = (h * ph)[0] + r;
        let nu = z - (h * self.x)[0];
        if !nu.is_finite() || nu * nu > GATE * GATE * s {
            return false;
        }
        self.rejected = 0;
        let k = ph / s;
        let a = Matrix4::identity() - k * h;
        let before = *self;
        self.x += k * nu;
        self.p = a * self.p * a.transpose() + k * r * k.transpose();
        self.p = 0.5 * (self.p + self.p.transpose());
        if !self.x.iter().chain(self.p.iter()).all(|v| v.is_finite()) {
            *self = before;
        }
        true
    }

    /// Whether bias and scale error of the main filter, with their covariance, are wrong for certain; then what they are, with the
    /// covariance.
    pub(super) fn contradicts(
        &mut self,
        main: Vector2<f64>,
        covariance: Matrix2<f64>,
    ) -> Option<(Vector2<f64>, Matrix2<f64>)> {
        let (own, p): (Vector2<f64>, Matrix2<f64>) =
            (self.x.fixed_rows::<2>(1).into_owned(), self.p.fixed_view::<2, 2>(1, 1).into_owned());
        let off = own - main;
        let distance = (p + covariance).cholesky().map_or(0.0, |root| off.dot(&root.solve(&off)));
        self.contradicted = if distance > CONTRADICTED { self.contradicted + 1 } else { 0 };
        if self.contradicted < IN_A_ROW {
            return None;
        }
        self.contradicted = 0;
        Some((own, p))
    }
}
