//! How the shaft moves: rate, its derivative and its exact integral at any time.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::Distribution;
use std::{collections::VecDeque, f64::consts::TAU, str::FromStr};

/// The kind of motion of the axis under test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// To and fro: θ = A sin 2πft. The default is the paper's, ±150° at 0.25 Hz.
    Sine {
        /// A, rad.
        amplitude: f64,
        /// f, Hz.
        frequency: f64,
    },
    /// Seven incommensurate lines between 0.1 and 3.5 Hz with random phases.
    Multisine {
        /// Largest less smallest angle, rad (about; more than 2π for full turns).
        travel: f64,
    },
    /// A vehicle: random turns, each held for a while, some of them stops, through a second-order filter.
    Drive {
        /// RMS of the rate while turning, rad/s.
        rate: f64,
        /// Mean time that a turn is held, s.
        hold: f64,
    },
    /// A rate table: random rates, each held for a while, some of them stops, and reached along a ramp that never overshoots.
    RateTable {
        /// RMS of the rate while turning, rad/s.
        rate: f64,
        /// Mean time from one rate to the next, s.
        hold: f64,
    },
    /// Stands still until [`Simulator::steer`](super::Simulator::steer) gives it a rate.
    Steered,
}

impl Default for Motion {
    fn default() -> Self {
        Self::Sine { amplitude: 150_f64.to_radians(), frequency: 0.25 }
    }
}

impl FromStr for Motion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "sine" => Ok(Self::default()),
            "multisine" => Ok(Self::Multisine { travel: 5.0 }),
            "drive" => Ok(Self::Drive { rate: 1.2, hold: 2.0 }),
            "rate-table" => Ok(Self::RateTable { rate: 1.2, hold: 4.0 }),
            _ => Err(format!("'{text}' is not a motion: use sine, multisine, drive or rate-table")),
        }
    }
}

/// One instant of a motion.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Instant {
    /// θ, rad.
    pub angle: f64,
    /// ω = dθ/dt, rad/s.
    pub rate: f64,
    /// dω/dt, rad/s².
    pub rate_dot: f64,
}

/// A motion that can be asked for any instant, in any order within the last minutes.
#[derive(Clone, Debug)]
pub enum Shaft {
    /// Sum of lines; none is standing still.
    Lines(Vec<Line>),
    /// Random turns.
    Drive(Box<Drive>),
    /// Turns as it is told while it goes.
    Steered(Steered),
}

/// ω = a cos(2πft + φ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// a, rad/s.
    pub rate: f64,
    /// f, Hz.
    pub frequency: f64,
    /// φ, rad.
    pub phase: f64,
}

/// Lines of the multisine, Hz: no two have a small common multiple.
const FREQUENCIES: [f64; 7] = [0.107, 0.253, 0.433, 0.7, 1.3, 2.1, 3.4];
/// Their share of the rate, falling with frequency as a driven mass does.
const SHARES: [f64; 7] = [0.5, 0.9, 0.85, 1.2, 1.05, 0.85, 0.55];

impl Shaft {
    /// The motion with the random choices of this seed.
    #[must_use]
    pub fn new(motion: Motion, seed: u64) -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        match motion {
            Motion::Sine { amplitude, frequency } => {
                Self::Lines(vec![Line { rate: amplitude * TAU * frequency, frequency, phase: 0.0 }])
            }
            Motion::Multisine { travel } => {
                let lines = FREQUENCIES.iter().zip(SHARES).map(|(frequency, rate)| Line {
                    rate,
                    frequency: frequency * random.random_range(0.95..1.05),
                    phase: random.random_range(0.0..TAU),
                });
                Self::travelling(lines.collect(), travel)
            }
            Motion::Drive { rate, hold } => Self::Drive(Box::new(Drive::new(rate, hold, Reached::BySettling, random))),
            Motion::RateTable { rate, hold } => {
                Self::Drive(Box::new(Drive::new(rate, hold, Reached::AlongARamp, random)))
            }
            Motion::Steered => Self::Steered(Steered::default()),
        }
    }

    /// These lines scaled so that the angle travels this far (seen over 60 s).
    fn travelling(lines: Vec<Line>, travel: f64) -> Self {
        let mut shaft = Self::Lines(lines);
        let (low, high) = (0..3000).fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), k| {
            let angle = shaft.at(f64::from(k) * 0.02).angle;
            (low.min(angle), high.max(angle))
        });
        if let Self::Lines(lines) = &mut shaft {
            for line in lines {
                line.rate *= travel / (high - low);
            }
        }
        shaft
    }

    /// Angle, rate and acceleration at `t` (s; it may be negative).
    pub fn at(&mut self, t: f64) -> Instant {
        match self {
            Self::Lines(lines) => lines.iter().fold(Instant::default(), |sum, line| {
                let omega = TAU * line.frequency;
                let (sin, cos) = (omega * t + line.phase).sin_cos();
                Instant {
                    angle: sum.angle + line.rate / omega * sin,
                    rate: sum.rate + line.rate * cos,
                    rate_dot: sum.rate_dot - line.rate * omega * sin,
                }
            }),
            Self::Drive(drive) => drive.at(t),
            Self::Steered(steered) => steered.at(t),
        }
    }

    /// From `t` on it goes towards this rate, where it is one that is steered.
    pub(super) fn steer(&mut self, t: f64, rate: f64) {
        if let Self::Steered(steered) = self {
            steered.steer(t, rate);
        }
    }
}

/// A shaft that is told its rate while it goes: it comes to each as a vehicle or a hand does, by settling.
#[derive(Clone, Debug)]
pub struct Steered {
    /// The last one has no end.
    holds: VecDeque<Hold>,
}

impl Default for Steered {
    fn default() -> Self {
        let stands = Hold { start: STAND.0, end: f64::INFINITY, target: 0.0, from: Instant::default() };
        Self { holds: VecDeque::from([stands]) }
    }
}

impl Steered {
    fn at(&self, t: f64) -> Instant {
        let hold = self.holds.iter().rev().find(|hold| hold.start <= t).or(self.holds.front());
        hold.map_or(Instant::default(), |hold| hold.settling(t.max(hold.start) - hold.start))
    }

    fn steer(&mut self, t: f64, target: f64) {
        if self.holds.back().is_some_and(|last| last.target == target || last.start >= t) {
            return;
        }
        let from = self.at(t);
        self.holds.push_back(Hold { start: t, end: f64::INFINITY, target, from });
        while self.holds.len() > 1 && self.holds[1].start < t - REMEMBERED {
            self.holds.pop_front();
        }
    }
}

/// Random turns: a target rate that jumps, and how it is reached.
#[derive(Clone, Debug)]
pub struct Drive {
    random: ChaCha8Rng,
    rate: f64,
    hold: f64,
    reached: Reached,
    /// Holds of the last minutes, in time.
    holds: VecDeque<Hold>,
}

/// How a shaft comes to the rate that it is to turn at.
#[derive(Clone, Copy, Debug)]
enum Reached {
    /// ω'' = Ω² (target − ω) − 2ZΩ ω', solved in closed form.
    BySettling,
    /// ω = from + (target − from)(3x² − 2x³), x the share of the ramp's time; then it stays.
    AlongARamp,
}

/// From `start` on towards `target`.
#[derive(Clone, Copy, Debug)]
struct Hold {
    start: f64,
    end: f64,
    target: f64,
    from: Instant,
}

/// Ω: a vehicle or a servo settles in some 0.3 s.
const DRIVE_FREQUENCY: f64 = TAU * 2.5;
/// Z.
const DRIVE_DAMPING: f64 = 0.7;
/// How long a rate table takes from one rate to the next, s.
const RAMP: f64 = 0.3;
/// Share of holds that are stops.
const STOPS: f64 = 0.25;
/// How long it stands before the log and at its beginning, s.
const STAND: (f64, f64) = (-120.0, 1.5);
/// Holds kept for questions about the past, s.
const KEPT: f64 = 120.0;
/// The same of a shaft that is steered, whose holds are short.
const REMEMBERED: f64 = 10.0;

impl Drive {
    fn new(rate: f64, hold: f64, reached: Reached, random: ChaCha8Rng) -> Self {
        let first = Hold { start: STAND.0, end: STAND.1, target: 0.0, from: Instant::default() };
        Self { random, rate, hold, reached, holds: VecDeque::from([first]) }
    }

    fn at(&mut self, t: f64) -> Instant {
        while self.holds.back().is_some_and(|last| last.end <= t) {
            self.turn();
        }
        let hold = self.holds.iter().rev().find(|hold| hold.start <= t).or(self.holds.front());
        hold.map_or(Instant::default(), |hold| hold.at(t.max(hold.start), self.reached))
    }

    /// Appends the next turn.
    fn turn(&mut self) {
        let Some(last) = self.holds.back().copied() else { return };
        let stops = self.random.random_bool(STOPS);
        let normal: f64 = rand_distr::StandardNormal.sample(&mut self.random);
        let length = self.hold * self.random.random_range(0.5..1.5);
        self.holds.push_back(Hold {
            start: last.end,
            end: last.end + length,
            target: if stops { 0.0 } else { self.rate * normal.clamp(-2.5, 2.5) },
            from: last.at(last.end, self.reached),
        });
        while self.holds.len() > 1 && self.holds[1].start < last.end - KEPT {
            self.holds.pop_front();
        }
    }
}

impl Hold {
    fn at(&self, t: f64, reached: Reached) -> Instant {
        match reached {
            Reached::BySettling => self.settling(t - self.start),
            Reached::AlongARamp => self.along_a_ramp(t - self.start),
        }
    }

    fn along_a_ramp(&self, s: f64) -> Instant {
        let x = (s / RAMP).min(1.0);
        let rise = self.target - self.from.rate;
        Instant {
            angle: self.from.angle
                + self.from.rate * s
                + rise * (RAMP * x.powi(3) * (1.0 - 0.5 * x) + (s - RAMP).max(0.0)),
            rate: self.from.rate + rise * x * x * (3.0 - 2.0 * x),
            rate_dot: rise * 6.0 * x * (1.0 - x) / RAMP,
        }
    }

    /// With x = ω − target: x = e^{−ZΩs}(A cos Ds + B sin Ds), D = Ω√(1 − Z²).
    fn settling(&self, s: f64) -> Instant {
        let decay = DRIVE_DAMPING * DRIVE_FREQUENCY;
        let damped = DRIVE_FREQUENCY * (1.0 - DRIVE_DAMPING * DRIVE_DAMPING).sqrt();
        let a = self.from.rate - self.target;
        let b = (self.from.rate_dot + decay * a) / damped;
        let (sin, cos) = (damped * s).sin_cos();
        let fall = (-decay * s).exp();
        let rate_dot = fall * ((b * damped - decay * a) * cos - (a * damped + decay * b) * sin);
        // ∫ x ds = e^{−ds}[(AD − Bd) sin Ds − (Ad + BD) cos Ds]/Ω², with d = ZΩ and d² + D² = Ω².
        let antiderivative = |fall: f64, sin: f64, cos: f64| {
            fall * ((a * damped - b * decay) * sin - (a * decay + b * damped) * cos) / DRIVE_FREQUENCY.powi(2)
        };
        Instant {
            angle: self.from.angle + self.target * s + antiderivative(fall, sin, cos) - antiderivative(1.0, 0.0, 1.0),
            rate: self.target + fall * (a * cos + b * sin),
            rate_dot,
        }
    }
}

/// A normal number of this standard deviation.
pub(super) fn normal(random: &mut ChaCha8Rng, std: f64) -> f64 {
    let unit: f64 = rand_distr::StandardNormal.sample(random);
    std * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motions() -> [Motion; 4] {
        ["sine", "multisine", "drive", "rate-table"].map(|name| name.parse().unwrap())
    }

    #[test]
    fn the_integral_of_the_rate_is_the_angle_and_of_the_acceleration_the_rate() {
        for motion in motions() {
            let mut shaft = Shaft::new(motion, 3);
            let (start, h) = (shaft.at(-1.0), 1e-3);
            let (mut angle, mut rate) = (start.angle, start.rate);
            for k in 0..20_000 {
                let t = f64::from(k) * h - 1.0;
                let [a, m, b] = [t, t + 0.5 * h, t + h].map(|t| shaft.at(t));
                angle += h / 6.0 * (a.rate + 4.0 * m.rate + b.rate);
                rate += h / 6.0 * (a.rate_dot + 4.0 * m.rate_dot + b.rate_dot);
                // A turn begins between two grid points: its jerk jumps there, so Simpson's rule errs by O(h³).
                assert!((angle - b.angle).abs() < 1e-6, "{motion:?} at {t}: {angle} {}", b.angle);
                assert!((rate - b.rate).abs() < 1e-3, "{motion:?} at {t}: {rate} {}", b.rate);
            }
        }
    }

    #[test]
    fn the_same_seed_moves_the_same_way_and_another_does_not() {
        for &motion in &motions()[1..] {
            let rates = |seed| {
                let mut shaft = Shaft::new(motion, seed);
                (0..500).map(|k| shaft.at(f64::from(k) * 0.1).rate).collect::<Vec<_>>()
            };
            assert_eq!(rates(1), rates(1));
            assert_ne!(rates(1), rates(2));
        }
    }

    #[test]
    fn a_question_about_the_past_gets_the_answer_it_had() {
        let mut shaft = Shaft::new(motions()[2], 5);
        let early: Vec<_> = (0..100).map(|k| shaft.at(50.0 + f64::from(k) * 0.1)).collect();
        shaft.at(100.0);
        let late: Vec<_> = (0..100).map(|k| shaft.at(50.0 + f64::from(k) * 0.1)).collect();
        assert_eq!(early, late);
    }

    #[test]
    fn a_steered_shaft_stands_until_it_is_told_and_its_angle_is_the_integral_of_its_rate() {
        let mut shaft = Shaft::new(Motion::Steered, 1);
        assert_eq!(shaft.at(3.0), Instant::default());
        let h = 1e-3;
        let mut angle = 0.0;
        for k in 0..6000 {
            let t = f64::from(k) * h;
            if k % 20 == 0 {
                shaft.steer(t, (2.0 * t).sin());
            }
            let [a, m, b] = [t, t + 0.5 * h, t + h].map(|t| shaft.at(t).rate);
            angle += h / 6.0 * (a + 4.0 * m + b);
        }
        assert!((shaft.at(6.0).angle - angle).abs() < 1e-5, "{} {angle}", shaft.at(6.0).angle);
        assert!((shaft.at(6.0).rate - 11.8_f64.sin()).abs() < 0.1);
    }

    #[test]
    fn a_multisine_travels_as_far_as_told_and_a_drive_stands_still_at_times() {
        let mut shaft = Shaft::new(Motion::Multisine { travel: 8.0 }, 2);
        let angles: Vec<_> = (0..3000).map(|k| shaft.at(f64::from(k) * 0.02).angle).collect();
        let (low, high) = angles.iter().fold((0.0_f64, 0.0_f64), |(l, h), &a| (l.min(a), h.max(a)));
        assert!((high - low - 8.0).abs() < 0.1);
        let mut shaft = Shaft::new(motions()[2], 2);
        let still = (0..20_000).filter(|&k| shaft.at(f64::from(k) * 0.01).rate.abs() < 1e-3).count();
        assert!((1000..8000).contains(&still), "{still}");
    }
}
