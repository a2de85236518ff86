//! The Kalman filter of one axis.
//!
//! ```text
//! x = [θ  u  a  b  s]ᵀ         angle; compensated rate u without its white noise, and its derivative a; residual bias and scale error of u
//! u = (1 + s) ω + b            ω the true rate
//! ẋ = [(u − b)/(1 + s)  a  w_j  w_b  0]ᵀ   w_j white jerk of density q (identified by [`crate::process_noise`]), w_b bias random walk
//! gyro        z = u + v                v of variance N²/dt
//! encoder     z = θ + v
//! rate        z = (u − b)/(1 + s) + v
//! ```
//!
//! The state is u and not ω, so that the gyro's measurement is linear and says nothing of b and s: with ω in its place, an extended
//! filter gains certainty about s from its own linearisation alone (the inconsistency that Huang, Mourikis and Roumeliotis, "Observability-based
//! rules for designing consistent EKF SLAM estimators", 2010, describe). Only a reference tells b and s.
//!
//! The acceleration is a state because a rate alone, driven by white noise, cannot follow a motion and average at the
//! same time: at 100 Hz on a 0.25 Hz sine of ±150° it leaves 99.9 % of the noise. Covariances are updated in Joseph
//! form, P⁺ = (I − K H) P (I − K H)ᵀ + K R Kᵀ, which keeps P symmetric and positive for any gain.
//!
//! A manoeuvre begins faster than q is identified. It shows in whitened gyro innovations of one sign: where their
//! fading sum g ← g/2 + ν/√S passes [`MANOEUVRE`] of its own standard deviation, P of u and a grows by the factor ν²/S before
//! the update.
//!
//! Each innovation ν is gated at [`GATE`] of its own standard deviation. Beyond it, a signal that has made such steps
//! lately (at first: any that `ACCELERATION_UNKNOWN` makes) makes another, and the filter starts again from it; else up to [`PATIENCE`] in a row are taken for outliers,
//! and the next one for a step; the first gyro reading after a hole is never taken for an outlier ([`Filter::believe`]). So neither a spike gets in
//! nor a sudden motion locks the filter out.

use nalgebra::{Matrix2, Matrix5, RowVector5, Vector2, Vector5};

const ANGLE: usize = 0;
const SIGNAL: usize = 1;
const ACCELERATION: usize = 2;
const BIAS: usize = 3;
const SCALE: usize = 4;

/// Innovations beyond this many standard deviations are rejected.
pub const GATE: f64 = 5.0;

/// Rejected in a row before the filter believes them.
pub const PATIENCE: u8 = 2;

/// Standard deviations of g beyond which a manoeuvre has begun (3 in 1000 samples without one).
pub const MANOEUVRE: f64 = 3.0;

/// By what g fades from sample to sample.
const FADE: f64 = 0.5;

/// Over what time the largest step of the signal is forgotten, s.
const REACH_MEMORY: f64 = 60.0;

/// Standard deviation of an acceleration that nothing is known of, rad/s².
const ACCELERATION_UNKNOWN: f64 = 300.0;

/// Standard deviation of a rate after a gap in the readings, rad/s.
pub(crate) const RATE_UNKNOWN: f64 = 10.0;

/// A step without readings from which nothing of the motion is carried over, s.
const GAP: f64 = 0.5;

/// Largest variance that is kept, so that no product overflows.
const VARIANCE_MAX: f64 = 1e12;

/// No scale error beyond this is believed.
const SCALE_MAX: f64 = 0.25;

/// What is known of the compensation that the filter reads: standard deviations of what it leaves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calibration {
    /// Of the bias, rad/s.
    pub bias_std: f64,
    /// Of the scale error.
    pub scale_std: f64,
    /// Of the delay between gyro and reference, s.
    pub delay_std: f64,
}

impl Calibration {
    /// Of a sensor that was never fitted: 11 °/s, 5 % and 80 ms.
    pub const UNFITTED: Self = Self { bias_std: 0.2, scale_std: 0.05, delay_std: 0.08 };

    /// What a sensor may have changed since its model was fitted: 1 °/s and 1 %. A zero of such a sensor moves by some 0.05 °/s
    /// for each kelvin, and a little from one start to the next.
    pub const SINCE: Self = Self { bias_std: 0.0175, scale_std: 0.01, delay_std: 0.0 };

    fn variances(self) -> [f64; 2] {
        [self.bias_std.powi(2), self.scale_std.powi(2)]
    }
}

/// What a measurement is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// The compensated rate, u.
    Gyro,
    /// An angle.
    Angle,
    /// A reference's rate: ω.
    Rate,
}

/// What became of a measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Innovation {
    /// ν = z − H x.
    pub value: f64,
    /// √S.
    pub std: f64,
    /// Taken, rejected, or taken as a new start.
    pub fate: Fate,
}

impl Innovation {
    /// ν²/S, chi-square distributed with one degree of freedom where model and noise are right.
    #[must_use]
    pub fn nis(&self) -> f64 {
        (self.value / self.std).powi(2)
    }
}

/// See [`Innovation`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fate {
    /// Updated the state.
    Taken,
    /// Beyond the gate, left out.
    Rejected,
    /// Beyond the gate once too often: the state starts again from it.
    Restarted,
}

/// Intensities of the noise that drives the state.
#[derive(Clone, Copy, Debug)]
pub struct Drive {
    /// q, spectral density of the jerk, rad²/s⁵.
    pub jerk: f64,
    /// Random walk of the bias, rad/s/√s.
    pub bias_random_walk: f64,
}

/// The filter of one axis.
#[derive(Clone, Copy, Debug)]
pub struct Filter {
    x: Vector5<f64>,
    p: Matrix5<f64>,
    rejected: [u8; 3],
    /// Largest innovation lately that was a step of the signal, one a measurement.
    reach: [f64; 3],
    /// g.
    trend: f64,
    /// Time since the last gyro reading that was taken, s.
    untaken: f64,
}

impl Filter {
    /// A filter that starts from one gyro reading of variance `r`.
    #[must_use]
    pub fn new(rate: f64, r: f64, calibration: Calibration) -> Self {
        let [b, s] = calibration.variances();
        Self {
            x: Vector5::new(0.0, rate, 0.0, 0.0, 0.0),
            p: Matrix5::from_diagonal(&Vector5::new(0.0, r, ACCELERATION_UNKNOWN.powi(2), b, s)),
            rejected: [0; 3],
            reach: [f64::NAN, 0.0, 0.0],
            trend: 0.0,
            untaken: 0.0,
        }
    }

    /// Moves the state `dt` ahead.
    pub fn predict(&mut self, dt: f64, drive: &Drive) {
        if dt <= 0.0 {
            return;
        }
        let forget = (-dt / REACH_MEMORY).exp();
        self.reach = self.reach.map(|reach| reach * forget);
        if dt > GAP {
            self.predict_over_gap(dt, drive);
            return;
        }
        if self.reach[Measured::Gyro as usize].is_nan() {
            self.reach[Measured::Gyro as usize] = ACCELERATION_UNKNOWN * dt;
        }
        self.untaken += dt;
        let (dt2, dt3) = (dt * dt, dt * dt * dt);
        let gain = self.gain();
        let turned = gain * (dt * (self.x[SIGNAL] - self.x[BIAS]) + 0.5 * dt2 * self.x[ACCELERATION]);
        #[rustfmt::skip]
        let f = Matrix5::new(
            1.0, gain * dt, 0.5 * gain * dt2, -gain * dt, -gain * turned,
            0.0, 1.0,       dt,               0.0,        0.0,
            0.0, 0.0,       1.0,              0.0,        0.0,
            0.0, 0.0,       0.0,              1.0,        0.0,
            0.0, 0.0,       0.0,              0.0,        1.0,
        );
        let q = drive.jerk;
        #[rustfmt::skip]
        let q = Matrix5::new(
            gain * gain * q * dt3 * dt2 / 20.0, gain * q * dt2 * dt2 / 8.0, gain * q * dt3 / 6.0, 0.0, 0.0,
            gain * q * dt2 * dt2 / 8.0,         q * dt3 / 3.0,              q * dt2 / 2.0,        0.0, 0.0,
            gain * q * dt3 / 6.0,               q * dt2 / 2.0,              q * dt,               0.0, 0.0,
            0.0, 0.0, 0.0, drive.bias_random_walk.powi(2) * dt, 0.0,
            0.0, 0.0, 0.0, 0.0, 0.0,
        );
        self.x[ANGLE] += turned;
        self.x[SIGNAL] += dt * self.x[ACCELERATION];
        self.p = f * self.p * f.transpose() + q;
        self.bound();
    }

    /// Over a gap the rate is held, and nothing is known of where it went meanwhile.
    fn predict_over_gap(&mut self, dt: f64, drive: &Drive) {
        self.x[ANGLE] += self.rate() * dt;
        self.x[ACCELERATION] = 0.0;
        self.p[(ANGLE, ANGLE)] += (RATE_UNKNOWN * dt).powi(2);
        self.p[(BIAS, BIAS)] += drive.bias_random_walk.powi(2) * dt;
        self.forget(SIGNAL, RATE_UNKNOWN.powi(2));
        self.forget(ACCELERATION, ACCELERATION_UNKNOWN.powi(2));
        // What the gap leaves of the angle is independent of bias and scale.
        self.forget(ANGLE, self.p[(ANGLE, ANGLE)]);
        self.untaken = 0.0;
        self.bound();
    }

    /// One part of the state, known to a variance of `variance` and independent of the others.
    fn forget(&mut self, state: usize, variance: f64) {
        self.p.row_mut(state).fill(0.0);
        self.p.column_mut(state).fill(0.0);
        self.p[(state, state)] = variance;
    }

    /// 1/(1 + s), ∂ω/∂u.
    fn gain(&self) -> f64 {
        1.0 / (1.0 + self.x[SCALE])
    }

    /// ∂ω/∂x.
    fn rate_gradient(&self) -> RowVector5<f64> {
        let gain = self.gain();
        RowVector5::new(0.0, gain, 0.0, -gain, -gain * self.rate())
    }

    /// Time since the last gyro reading that was taken, s.
    #[must_use]
    pub fn untaken(&self) -> f64 {
        self.untaken
    }

    /// Believes the next gyro reading, however far it is from what was expected.
    pub fn believe(&mut self) {
        self.rejected[Measured::Gyro as usize] = PATIENCE;
    }

    /// Takes a measurement `z` of variance `r`.
    pub fn update(&mut self, measured: Measured, z: f64, r: f64) -> Innovation {
        let h = match measured {
            Measured::Gyro => RowVector5::new(0.0, 1.0, 0.0, 0.0, 0.0),
            Measured::Angle => RowVector5::new(1.0, 0.0, 0.0, 0.0, 0.0),
            Measured::Rate => self.rate_gradient(),
        };
        let expected = match measured {
            Measured::Gyro => self.x[SIGNAL],
            Measured::Angle => self.x[ANGLE],
            Measured::Rate => self.rate(),
        };
        let ph = self.p * h.transpose();
        let s = (h * ph)[0] + r;
        let nu = z - expected;
        let mut innovation = Innovation { value: nu, std: s.sqrt(), fate: Fate::Taken };
        let rejected = &mut self.rejected[measured as usize];
        if nu * nu <= GATE * GATE * s {
            *rejected = 0;
            if measured == Measured::Gyro {
                self.untaken = 0.0;
            }
            let (ph, s) = if measured == Measured::Gyro && self.manoeuvre(nu, s) {
                let ph = self.p * h.transpose();
                (ph, (h * ph)[0] + r)
            } else {
                (ph, s)
            };
            let k = ph / s;
            self.x += k * nu;
            let a = Matrix5::identity() - k * h;
            self.p = a * self.p * a.transpose() + k * r * k.transpose();
            self.x[SCALE] = self.x[SCALE].clamp(-SCALE_MAX, SCALE_MAX);
            self.bound();
        } else if !nu.is_finite() || (*rejected < PATIENCE && nu.abs() > self.reach[measured as usize]) {
            *rejected = rejected.saturating_add(1);
            innovation.fate = Fate::Rejected;
        } else {
            *rejected = 0;
            let reach = &mut self.reach[measured as usize];
            *reach = reach.max(nu.abs());
            self.restart(measured, z, r);
            innovation.fate = Fate::Restarted;
        }
        innovation
    }

    /// Whether a manoeuvre has begun; if so, P has grown.
    fn manoeuvre(&mut self, nu: f64, s: f64) -> bool {
        self.trend = FADE * self.trend + nu / s.sqrt();
        if self.trend * self.trend * (1.0 - FADE * FADE) < MANOEUVRE * MANOEUVRE {
            return false;
        }
        self.trend = 0.0;
        let root = (nu * nu / s).max(1.0).sqrt();
        for state in [SIGNAL, ACCELERATION] {
            for other in 0..5 {
                self.p[(state, other)] *= root;
                self.p[(other, state)] *= root;
            }
        }
        true
    }

    /// Starts the measured part of the state again from `z`; the other states keep what they know.
    fn restart(&mut self, measured: Measured, z: f64, r: f64) {
        match measured {
            Measured::Angle => {
                self.x[ANGLE] = z;
                self.forget(ANGLE, r);
            }
            Measured::Gyro => {
                // The step was at any instant since the last reading that was taken: a uniform distribution of what has turned meanwhile.
                let most = self.gain() * (z - self.x[SIGNAL]) * std::mem::take(&mut self.untaken);
                self.x[ANGLE] += 0.5 * most;
                self.p[(ANGLE, ANGLE)] += most * most / 12.0;
                self.x[SIGNAL] = z;
                self.x[ACCELERATION] = 0.0;
                self.forget(SIGNAL, r);
                self.forget(ACCELERATION, ACCELERATION_UNKNOWN.powi(2));
            }
            // The gyro's signal stays as it is: what differs from it is bias.
            Measured::Rate => {
                self.x[BIAS] = self.x[SIGNAL] - z * (1.0 + self.x[SCALE]);
                self.forget(BIAS, r + self.p[(SIGNAL, SIGNAL)] + self.p[(SCALE, SCALE)] * z * z);
            }
        }
    }

    /// Sets the angle, known to a variance of `r`.
    pub fn anchor(&mut self, angle: f64, r: f64) {
        self.rejected[Measured::Angle as usize] = 0;
        self.restart(Measured::Angle, angle, r);
    }

    /// Turns on by what is known for certain.
    pub fn turn(&mut self, angle: f64) {
        self.x[ANGLE] += angle;
    }

    /// As long as no reference gives it a zero, the angle counts from its start and has no uncertainty of its own.
    pub fn forget_angle_variance(&mut self) {
        self.p.row_mut(ANGLE).fill(0.0);
        self.p.column_mut(ANGLE).fill(0.0);
    }

    /// Another compensation: u makes the step that the compensation makes, and the residual bias and scale error, which belonged to
    /// the old one, start again as the new model knows them.
    pub fn step_compensation(&mut self, step: f64, calibration: Calibration) {
        let [b, s] = calibration.variances();
        self.x[SIGNAL] += step;
        (self.x[BIAS], self.x[SCALE]) = (0.0, 0.0);
        self.forget(BIAS, b);
        self.forget(SCALE, s);
    }

    /// Another compensation that is not known better: u makes the step that the compensation makes and becomes `gain` u + `offset`, and
    /// so do 1 + s and b, which stay as well known as they were.
    pub fn rescale_compensation(&mut self, step: f64, gain: f64, offset: f64) {
        self.x[SIGNAL] += step;
        self.x[BIAS] = gain * self.x[BIAS] + offset;
        self.x[SCALE] = (gain * (1.0 + self.x[SCALE]) - 1.0).clamp(-SCALE_MAX, SCALE_MAX);
        for state in [BIAS, SCALE] {
            self.p.row_mut(state).scale_mut(gain);
            self.p.column_mut(state).scale_mut(gain);
        }
    }

    /// Whether b and s are both known clearly better than `calibration` has them: to half the variance.
    #[must_use]
    pub fn knows(&self, calibration: Calibration) -> bool {
        let [b, s] = calibration.variances();
        self.p[(BIAS, BIAS)] <= 0.5 * b && self.p[(SCALE, SCALE)] <= 0.5 * s
    }

    /// Whether it knows that b and s are as small as `calibration` has them.
    #[must_use]
    pub fn agrees(&self, calibration: Calibration) -> bool {
        let [b, s] = calibration.variances();
        self.knows(calibration) && self.x[BIAS].powi(2) <= b && self.x[SCALE].powi(2) <= s
    }

    /// b and s may have changed: their standard deviations grow by `factor`, to those of [`Calibration::SINCE`] at least and of
    /// [`Calibration::UNFITTED`] at most. So the angle may have gone astray by `astray`.
    pub fn widen_calibration(&mut self, factor: f64, astray: f64) {
        self.forget(ANGLE, self.p[(ANGLE, ANGLE)] + astray * astray);
        let [least, most] = [Calibration::SINCE, Calibration::UNFITTED].map(Calibration::variances);
        for (k, state) in [BIAS, SCALE].into_iter().enumerate() {
            let known = self.p[(state, state)];
            self.forget(state, (known * factor * factor).clamp(least[k], most[k]).max(known));
        }
    }

    /// b and s with their covariance.
    #[must_use]
    pub fn residual_calibration(&self) -> (Vector2<f64>, Matrix2<f64>) {
        (Vector2::new(self.x[BIAS], self.x[SCALE]), self.p.fixed_view::<2, 2>(BIAS, BIAS).into_owned())
    }

    /// b and s are these, with this covariance, whatever was believed of them.
    pub fn recalibrate(&mut self, calibration: Vector2<f64>, covariance: Matrix2<f64>) {
        (self.x[BIAS], self.x[SCALE]) = (calibration[0], calibration[1].clamp(-SCALE_MAX, SCALE_MAX));
        self.forget(BIAS, 0.0);
        self.forget(SCALE, 0.0);
        self.p.fixed_view_mut::<2, 2>(BIAS, BIAS).copy_from(&covariance);
    }

    /// θ, rad.
    #[must_use]
    pub fn angle(&self) -> f64 {
        self.x[ANGLE]
    }

    /// ω, rad/s.
    #[must_use]
    pub fn rate(&self) -> f64 {
        (self.x[SIGNAL] - self.x[BIAS]) * self.gain()
    }

    /// dω/dt, rad/s².
    #[must_use]
    pub fn acceleration(&self) -> f64 {
        self.x[ACCELERATION] * self.gain()
    }

    /// b, rad/s.
    #[must_use]
    pub fn bias(&self) -> f64 {
        self.x[BIAS]
    }

    /// Standard deviation of θ, rad.
    #[must_use]
    pub fn angle_std(&self) -> f64 {
        self.p[(ANGLE, ANGLE)].max(0.0).sqrt()
    }

    /// Standard deviation of ω, rad/s.
    #[must_use]
    pub fn rate_std(&self) -> f64 {
        let h = self.rate_gradient();
        (h * self.p * h.transpose())[0].max(0.0).sqrt()
    }

    /// The share of the last gyro innovation of variance `r` that the rate took, 0–1.
    #[must_use]
    pub fn rate_gain(&self, r: f64) -> f64 {
        // K = P⁻/S = P⁺/R.
        (self.p[(SIGNAL, SIGNAL)] / r.max(f64::MIN_POSITIVE)).clamp(1e-6, 1.0)
    }

    /// s.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.x[SCALE]
    }

    /// Standard deviation of b, rad/s.
    #[must_use]
    pub fn bias_std(&self) -> f64 {
        self.p[(BIAS, BIAS)].max(0.0).sqrt()
    }

    /// Whether every number is one.
    #[must_use]
    pub fn is_finite(&self) -> bool {
        self.x.iter().chain(self.p.iter()).all(|v| v.is_finite())
    }

    /// Symmetric, and no variance beyond [`VARIANCE_MAX`].
    fn bound(&mut self) {
        self.p = 0.5 * (self.p + self.p.transpose());
        for state in 0..5 {
            let variance = self.p[(state, state)];
            if variance > VARIANCE_MAX {
                self.p.row_mut(state).fill(0.0);
                self.p.column_mut(state).fill(0.0);
                self.p[(state, state)] = VARIANCE_MAX;
            } else if variance < 0.0 {
                self.p.row_mut(state).fill(0.0);
                self.p.column_mut(state).fill(0.0);
            }
        }
    }
}
