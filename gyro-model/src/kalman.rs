//! The Kalman filter of one axis.
//!
//! ```text
//! x = [θ  ω  a  b]ᵀ    angle, rate, acceleration, residual bias of the compensated rate
//! ẋ = [ω  a  w_j  w_b]ᵀ  w_j white jerk of density q (identified by [`crate::process_noise`]), w_b bias random walk
//! gyro        z = ω + b + v        v of variance N²/dt
//! encoder     z = θ + v
//! rate        z = ω + v
//! ```
//!
//! The acceleration is a state because a rate alone, driven by white noise, cannot follow a motion and average at the
//! same time: at 100 Hz on a 0.25 Hz sine of ±150° it leaves 99.9 % of the noise. Covariances are updated in Joseph
//! form, P⁺ = (I − K H) P (I − K H)ᵀ + K R Kᵀ, which keeps P symmetric and positive for any gain.
//!
//! A manoeuvre begins faster than q is identified. It shows in whitened gyro innovations of one sign: where their
//! fading sum g ← g/2 + ν/√S passes [`MANOEUVRE`] of its own standard deviation, P of rate and acceleration grows by
//! the factor ν²/S before the update.
//!
//! Each innovation ν is gated at [`GATE`] of its own standard deviation. Beyond it, a signal that has made such steps
//! lately (at first: any that `ACCELERATION_UNKNOWN` makes) makes another, and the filter starts again from it; else up to [`PATIENCE`] in a row are taken for outliers,
//! and the next one for a step. So neither a spike gets in nor a sudden motion locks the filter out.
//!
//! Where four new starts from a reference follow one another with ν of one sign, the reference does not step: the filter's rate or
//! bias is wrong, and its covariance too small. With T the time since the last angle (1 for a reference that is a rate) and
//! v = (ν/T)², P of the bias grows by v, P of the rate by 2v and their covariance by −v, since the gyro measures their sum; and the
//! acceleration starts again as unknown.

use nalgebra::{Matrix4, RowVector4, Vector4};

const ANGLE: usize = 0;
const RATE: usize = 1;
const ACCELERATION: usize = 2;
const BIAS: usize = 3;

/// Innovations beyond this many standard deviations are rejected.
pub const GATE: f64 = 5.0;

/// Rejected in a row before the filter believes them.
pub const PATIENCE: u8 = 2;

/// New starts from a reference in a row with ν of one sign from which on the state is doubted. Of first differences of white noise,
/// four in a row have one sign once in sixty.
const SLIPS: i8 = 4;

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

/// What a measurement is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measured {
    /// The compensated rate: ω + b.
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
    x: Vector4<f64>,
    p: Matrix4<f64>,
    rejected: [u8; 3],
    /// Largest innovation lately that was a step of the signal, one a measurement.
    reach: [f64; 3],
    /// g.
    trend: f64,
    /// New starts from a reference in a row, by their sign; one a measurement.
    slips: [i8; 3],
    /// Since an angle was taken or started from, s.
    since_angle: f64,
}

impl Filter {
    /// A filter that starts from one gyro reading of variance `r`, with a residual bias of 0 ± `bias_std`.
    #[must_use]
    pub fn new(rate: f64, r: f64, bias_std: f64) -> Self {
        let b = bias_std * bias_std;
        let mut p = Matrix4::from_diagonal(&Vector4::new(0.0, r + b, ACCELERATION_UNKNOWN.powi(2), b));
        p[(RATE, BIAS)] = -b;
        p[(BIAS, RATE)] = -b;
        Self {
            x: Vector4::new(0.0, rate, 0.0, 0.0),
            p,
            rejected: [0; 3],
            reach: [f64::NAN, 0.0, 0.0],
            trend: 0.0,
            slips: [0; 3],
            since_angle: 0.0,
        }
    }

    /// Moves the state `dt` ahead.
    pub fn predict(&mut self, dt: f64, drive: &Drive) {
        if dt <= 0.0 {
            return;
        }
        let forget = (-dt / REACH_MEMORY).exp();
        self.reach = self.reach.map(|reach| reach * forget);
        self.since_angle += dt;
        if dt > GAP {
            self.predict_over_gap(dt, drive);
            return;
        }
        if self.reach[Measured::Gyro as usize].is_nan() {
            self.reach[Measured::Gyro as usize] = ACCELERATION_UNKNOWN * dt;
        }
        let (dt2, dt3) = (dt * dt, dt * dt * dt);
        #[rustfmt::skip]
        let f = Matrix4::new(
            1.0, dt,  0.5 * dt2, 0.0,
            0.0, 1.0, dt,        0.0,
            0.0, 0.0, 1.0,       0.0,
            0.0, 0.0, 0.0,       1.0,
        );
        let q = drive.jerk;
        #[rustfmt::skip]
        let q = Matrix4::new(
            q * dt3 * dt2 / 20.0, q * dt2 * dt2 / 8.0, q * dt3 / 6.0, 0.0,
            q * dt2 * dt2 / 8.0,  q * dt3 / 3.0,       q * dt2 / 2.0, 0.0,
            q * dt3 / 6.0,        q * dt2 / 2.0,       q * dt,        0.0,
            0.0, 0.0, 0.0, drive.bias_random_walk.powi(2) * dt,
        );
        self.x = f * self.x;
        self.p = f * self.p * f.transpose() + q;
        self.bound();
    }

    /// Over a gap the rate is held, and nothing is known of where it went meanwhile.
    fn predict_over_gap(&mut self, dt: f64, drive: &Drive) {
        let bias = self.p[(BIAS, BIAS)] + drive.bias_random_walk.powi(2) * dt;
        let angle = self.p[(ANGLE, ANGLE)] + (RATE_UNKNOWN * dt).powi(2);
        self.x[ANGLE] += self.x[RATE] * dt;
        self.x[ACCELERATION] = 0.0;
        let rate = RATE_UNKNOWN.powi(2) + bias;
        self.p = Matrix4::from_diagonal(&Vector4::new(angle, rate, ACCELERATION_UNKNOWN.powi(2), bias));
        self.bound();
    }

    /// Takes a measurement `z` of variance `r`.
    pub fn update(&mut self, measured: Measured, z: f64, r: f64) -> Innovation {
        let h = match measured {
            Measured::Gyro => RowVector4::new(0.0, 1.0, 0.0, 1.0),
            Measured::Angle => RowVector4::new(1.0, 0.0, 0.0, 0.0),
            Measured::Rate => RowVector4::new(0.0, 1.0, 0.0, 0.0),
        };
        let ph = self.p * h.transpose();
        let s = (h * ph)[0] + r;
        let nu = z - (h * self.x)[0];
        let mut innovation = Innovation { value: nu, std: s.sqrt(), fate: Fate::Taken };
        let rejected = &mut self.rejected[measured as usize];
        if nu * nu <= GATE * GATE * s {
            *rejected = 0;
            self.slips[measured as usize] = 0;
            if measured == Measured::Angle {
                self.since_angle = 0.0;
            }
            let (ph, s) = if measured == Measured::Gyro && self.manoeuvre(nu, s) {
                let ph = self.p * h.transpose();
                (ph, (h * ph)[0] + r)
            } else {
                (ph, s)
            };
            let k = ph / s;
            self.x += k * nu;
            let a = Matrix4::identity() - k * h;
            self.p = a * self.p * a.transpose() + k * r * k.transpose();
            self.bound();
        } else if !nu.is_finite() || (*rejected < PATIENCE && nu.abs() > self.reach[measured as usize]) {
            *rejected = rejected.saturating_add(1);
            innovation.fate = Fate::Rejected;
        } else {
            *rejected = 0;
            let reach = &mut self.reach[measured as usize];
            *reach = reach.max(nu.abs());
            self.restart(measured, z, r);
            if measured != Measured::Gyro {
                self.slip(measured, nu);
            }
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
        for state in [RATE, ACCELERATION] {
            for other in 0..4 {
                self.p[(state, other)] *= root;
                self.p[(other, state)] *= root;
            }
        }
        true
    }

    /// Starts the measured part of the state again from `z`; the other states keep what they know.
    fn restart(&mut self, measured: Measured, z: f64, r: f64) {
        let clear = |p: &mut Matrix4<f64>, state: usize| {
            p.row_mut(state).fill(0.0);
            p.column_mut(state).fill(0.0);
        };
        if measured == Measured::Angle {
            self.x[ANGLE] = z;
            clear(&mut self.p, ANGLE);
            self.p[(ANGLE, ANGLE)] = r;
            return;
        }
        let bias = if measured == Measured::Gyro { self.x[BIAS] } else { 0.0 };
        let bias_variance = if measured == Measured::Gyro { self.p[(BIAS, BIAS)] } else { 0.0 };
        self.x[RATE] = z - bias;
        self.x[ACCELERATION] = 0.0;
        clear(&mut self.p, RATE);
        clear(&mut self.p, ACCELERATION);
        self.p[(RATE, RATE)] = r + bias_variance;
        self.p[(RATE, BIAS)] = -bias_variance;
        self.p[(BIAS, RATE)] = -bias_variance;
        self.p[(ACCELERATION, ACCELERATION)] = ACCELERATION_UNKNOWN.powi(2);
    }

    /// Counts a new start from a reference that the state was off by `nu`; after too many it is the state that is wrong.
    fn slip(&mut self, measured: Measured, nu: f64) {
        let after = if measured == Measured::Angle { std::mem::take(&mut self.since_angle) } else { 1.0 };
        let count = &mut self.slips[measured as usize];
        let sign = if nu > 0.0 { 1 } else { -1 };
        *count = if *count * sign > 0 { (*count + sign).clamp(-SLIPS, SLIPS) } else { sign };
        if count.abs() < SLIPS || after <= 0.0 {
            return;
        }
        let variance = (nu / after).powi(2).min(RATE_UNKNOWN.powi(2));
        self.p[(RATE, RATE)] += 2.0 * variance;
        self.p[(BIAS, BIAS)] += variance;
        self.p[(RATE, BIAS)] -= variance;
        self.p[(BIAS, RATE)] -= variance;
        self.p.row_mut(ACCELERATION).fill(0.0);
        self.p.column_mut(ACCELERATION).fill(0.0);
        self.p[(ACCELERATION, ACCELERATION)] = ACCELERATION_UNKNOWN.powi(2);
    }

    /// Sets the angle, known to a variance of `r`.
    pub fn anchor(&mut self, angle: f64, r: f64) {
        self.rejected[Measured::Angle as usize] = 0;
        self.slips[Measured::Angle as usize] = 0;
        self.since_angle = 0.0;
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

    /// Another compensation: the rate makes the step that the compensation makes, and the residual bias, which
    /// belonged to the old one, starts again at 0 ± `bias_std`.
    pub fn step_compensation(&mut self, step: f64, bias_std: f64) {
        let b = bias_std * bias_std;
        self.x[RATE] += step + self.x[BIAS];
        self.x[BIAS] = 0.0;
        let reading = self.p[(RATE, RATE)] + 2.0 * self.p[(RATE, BIAS)] + self.p[(BIAS, BIAS)];
        for state in [ANGLE, RATE, ACCELERATION] {
            self.p[(state, BIAS)] = 0.0;
            self.p[(BIAS, state)] = 0.0;
        }
        self.p[(RATE, RATE)] = reading.max(0.0) + b;
        self.p[(BIAS, BIAS)] = b;
        self.p[(RATE, BIAS)] = -b;
        self.p[(BIAS, RATE)] = -b;
        for state in [ANGLE, ACCELERATION] {
            // Keep |P_ij| ≤ √(P_ii P_jj), whatever the old bias had done to it.
            let bound = (self.p[(state, state)] * self.p[(RATE, RATE)]).sqrt() * 0.99;
            let value = self.p[(state, RATE)].clamp(-bound, bound);
            self.p[(state, RATE)] = value;
            self.p[(RATE, state)] = value;
        }
    }

    /// θ, rad.
    #[must_use]
    pub fn angle(&self) -> f64 {
        self.x[ANGLE]
    }

    /// ω, rad/s.
    #[must_use]
    pub fn rate(&self) -> f64 {
        self.x[RATE]
    }

    /// dω/dt, rad/s².
    #[must_use]
    pub fn acceleration(&self) -> f64 {
        self.x[ACCELERATION]
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
        self.p[(RATE, RATE)].max(0.0).sqrt()
    }

    /// The share of the last gyro innovation of variance `r` that the rate took, 0–1.
    #[must_use]
    pub fn rate_gain(&self, r: f64) -> f64 {
        // K = P⁻/S = P⁺/R for the sum ω + b that the gyro measures.
        let read = self.p[(RATE, RATE)] + 2.0 * self.p[(RATE, BIAS)] + self.p[(BIAS, BIAS)];
        (read / r.max(f64::MIN_POSITIVE)).clamp(1e-6, 1.0)
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
        for state in 0..4 {
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
