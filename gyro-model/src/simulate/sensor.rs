//! The sensor, its reference and its mounting: what differs from rig to rig.

use super::noise::stream;
use crate::Axis;
use rand::RngExt;

/// Gyro, accelerometer, reference and surroundings of one rig. The default is an MPU-6050 on a horizontal x axis with
/// an encoder of 4096 counts.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorSpec {
    /// The sensor axis that lies along the shaft.
    pub axis: Axis,
    /// Whether the shaft is horizontal, so that gravity turns in the sensor.
    pub horizontal: bool,
    /// From the shaft to the sensor, in its body frame, m.
    pub lever_arm: [f64; 3],
    /// α of the paper's equation (1).
    pub alpha: f64,
    /// δ of the paper's equation (1), rad/s.
    pub delta: f64,
    /// White noise, one-sided density, rad/s/√Hz: a row has σ = density·√(rate/2), and N = density/√2.
    pub noise_density: f64,
    /// Random walk of the bias, rad/s/√s.
    pub bias_random_walk: f64,
    /// 1/f noise, rad/s for each factor of four in time.
    pub flicker: f64,
    /// First-order noise that is correlated over some rows (0.99 from row to row), rad/s.
    pub correlated: f64,
    /// Standard deviation added to a row's noise per rate (1): scale noise.
    pub rate_noise: f64,
    /// One step of the gyro's converter, rad/s; 0 where it has none.
    pub quantum: f64,
    /// Largest reading, rad/s.
    pub full_scale: f64,
    /// Other axes: standard deviation of a row, rad/s.
    pub other_noise: f64,
    /// Peak rate of the axis after next, which moves by its own, rad/s.
    pub other_rate: f64,
    /// RMS rate of the next axis, which wobbles, rad/s.
    pub wobble: f64,
    /// How far a vertical shaft tilts to and fro, rad.
    pub tilt: f64,
    /// How often, Hz.
    pub tilt_frequency: f64,
    /// Standard deviation of an accelerometer row, m/s².
    pub accel_noise: f64,
    /// Shaking that the accelerometer and a g-sensitive gyro feel alike, m/s².
    pub shaking: f64,
    /// The reference.
    pub reference: Reference,
    /// Standard deviation of one reference value beside its quantisation, rad (rad/s for a rate).
    pub reference_noise: f64,
    /// The reference has a value at every n-th row.
    pub reference_every: usize,
    /// Heating.
    pub temperature: Temperature,
    /// Battery.
    pub supply: Supply,
}

/// What measures the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reference {
    /// A shaft encoder with so many counts a turn; 0 for an unquantised one.
    Encoder(u32),
    /// An orientation, as motion capture gives it; all three axes turn.
    Quaternion,
    /// A tachometer.
    Rate,
}

/// T = start + rise (1 − e^{−t/τ}) + swing sin(2πt/period), noise and 0.01 °C of quantisation on top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Temperature {
    /// °C.
    pub start: f64,
    /// K.
    pub rise: f64,
    /// τ, s.
    pub time_constant: f64,
    /// K.
    pub swing: f64,
    /// s.
    pub period: f64,
    /// K.
    pub noise: f64,
}

/// V = nominal − sag (1 − e^{−t/200 s}) + a wander that forgets within a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Supply {
    /// V.
    pub nominal: f64,
    /// V.
    pub sag: f64,
    /// V.
    pub wander: f64,
    /// V.
    pub noise: f64,
}

impl Temperature {
    /// Without noise, °C.
    pub(super) fn at(&self, t: f64) -> f64 {
        let heated = self.rise * -(-t / self.time_constant).exp_m1();
        self.start + heated + self.swing * (std::f64::consts::TAU * t / self.period).sin()
    }

    /// dT/dt, K/s.
    pub(super) fn slope(&self, t: f64) -> f64 {
        let omega = std::f64::consts::TAU / self.period;
        self.rise / self.time_constant * (-t / self.time_constant).exp() + self.swing * omega * (omega * t).cos()
    }
}

impl Default for SensorSpec {
    fn default() -> Self {
        Self {
            axis: Axis::X,
            horizontal: true,
            lever_arm: [0.0, 0.0, -0.06],
            alpha: 0.985,
            delta: 0.015,
            noise_density: 0.005_f64.to_radians(),
            bias_random_walk: 2e-6,
            flicker: 0.0,
            correlated: 0.0,
            rate_noise: 0.0,
            quantum: MPU_6050_QUANTUM,
            full_scale: 34.9,
            other_noise: 1e-3,
            other_rate: 0.9,
            wobble: 0.012,
            tilt: 0.12,
            tilt_frequency: 0.033,
            accel_noise: 0.02,
            shaking: 0.2,
            reference: Reference::Encoder(4096),
            reference_noise: 0.0,
            reference_every: 1,
            temperature: Temperature {
                start: 23.0,
                rise: 9.0,
                time_constant: 70.0,
                swing: 1.3,
                period: 53.0,
                noise: 0.02,
            },
            supply: Supply { nominal: 3.3, sag: 0.06, wander: 0.03, noise: 5e-4 },
        }
    }
}

/// 16.4 steps per °/s (±2000 °/s in 16 bits), rad/s.
const MPU_6050_QUANTUM: f64 = 1.0 / 16.4 / 180.0 * std::f64::consts::PI;

impl SensorSpec {
    /// The default rig with this sensor axis along its shaft, the arm across it.
    #[must_use]
    pub fn on(axis: Axis) -> Self {
        let mut lever_arm = [0.0; 3];
        lever_arm[(axis.index() + 2) % 3] = -0.06;
        Self { axis, lever_arm, ..Self::default() }
    }

    /// Another sensor, encoder, lever arm, heating and mounting axis for every seed, all as low-cost rigs have them.
    #[must_use]
    pub fn random(seed: u64) -> Self {
        let random = &mut stream(seed, 1000);
        let horizontal = random.random_bool(0.6);
        let r = random.random_range(0.02..0.1);
        let direction = random.random_range(0.0..std::f64::consts::TAU);
        let axis = if horizontal { Axis::X } else { Axis::Z };
        let mut lever_arm = [0.0; 3];
        lever_arm[(axis.index() + 1) % 3] = r * direction.cos();
        lever_arm[(axis.index() + 2) % 3] = r * direction.sin();
        Self {
            axis,
            horizontal,
            lever_arm,
            alpha: random.random_range(0.96..1.04),
            delta: random.random_range(-0.08..0.08),
            noise_density: random.random_range(0.0024_f64..0.008).to_radians(),
            bias_random_walk: 10_f64.powf(random.random_range(-6.5..-5.0)),
            quantum: MPU_6050_QUANTUM * [1.0, 1.0, 0.5, 0.25][random.random_range(0..4)],
            other_noise: random.random_range(3e-4..1.5e-3),
            other_rate: random.random_range(0.4..1.2),
            wobble: random.random_range(0.002..0.02),
            tilt: random.random_range(0.03..0.2),
            tilt_frequency: random.random_range(0.02..0.06),
            accel_noise: random.random_range(0.01..0.06),
            shaking: random.random_range(0.05..0.3),
            reference: Reference::Encoder(
                [2048, 2500, 3600, 4000, 4096, 5000, 8192, 10_000][random.random_range(0..8)],
            ),
            reference_every: if random.random_bool(0.15) { random.random_range(2..5) } else { 1 },
            temperature: Temperature {
                start: random.random_range(18.0..31.0),
                rise: random.random_range(5.0..14.0),
                time_constant: random.random_range(30.0..150.0),
                swing: random.random_range(0.3..2.0),
                period: random.random_range(35.0..90.0),
                noise: 0.02,
            },
            supply: Supply {
                nominal: 3.3,
                sag: random.random_range(0.02..0.12),
                wander: random.random_range(0.01..0.04),
                noise: 5e-4,
            },
            ..Self::default()
        }
    }

    /// Standard deviation of one reference value with its quantisation, rad.
    #[must_use]
    pub fn reference_std(&self) -> f64 {
        self.reference_noise.hypot(self.count() / 12_f64.sqrt())
    }

    /// One encoder count, rad; 0 where the reference has none.
    pub(super) fn count(&self) -> f64 {
        match self.reference {
            Reference::Encoder(counts) if counts > 0 => std::f64::consts::TAU / f64::from(counts),
            _ => 0.0,
        }
    }
}
