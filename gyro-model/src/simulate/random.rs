//! Random causes in a simulated log, and how to say them: `ID:size=VALUE`.

use super::{Sample, motion::normal, noise::stream};
use crate::diagnosis::LimitedBy;
use std::f64::consts::TAU;

/// The random causes of a set-up; nothing where a size is 0.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RandomCauses {
    /// Standard deviation of a scale that wanders, 1, and its correlation time, s.
    pub random_scale: (f64, f64),
    /// Angle noise by the angle turned, rad/√rad.
    pub rate_noise: f64,
    /// Standard deviation of the step at each reversal, rad.
    pub reversal_steps: f64,
    /// Standard deviation of the step at each start and stop, rad.
    pub start_stop_steps: f64,
    /// Share of the log that is lost in holes, 1.
    pub lost_motion: f64,
}

/// Correlation time of a wandering scale, where none is given, s.
const FORGETS: f64 = 2.0;
/// Rate below which the axis stands, rad/s, and for how long until it starts again, s.
const STANDS: f64 = 0.02;
const RESTS: f64 = 0.3;
/// Longest hole, s.
const HOLE: f64 = 0.4;

impl RandomCauses {
    /// Their ids, each with its typical size.
    pub const TYPICAL: [(LimitedBy, &str, f64); 5] = [
        (LimitedBy::RandomScale, "random-scale", 0.005),
        (LimitedBy::RateNoise, "rate-noise", 0.002),
        (LimitedBy::ReversalSteps, "reversal-steps", 0.005),
        (LimitedBy::StartStopSteps, "start-stop-steps", 0.005),
        (LimitedBy::LostMotion, "lost-motion", 0.05),
    ];

    /// Takes `ID[:size=VALUE[,tau=VALUE]]` up; `None` where the id is no random cause.
    pub fn take(&mut self, text: &str) -> Option<Result<(), String>> {
        let (id, assignments) = text.split_once(':').unwrap_or((text, ""));
        let (cause, _, typical) = Self::TYPICAL.into_iter().find(|(_, known, _)| *known == id.trim())?;
        Some(self.set(cause, id.trim(), typical, assignments))
    }

    fn set(&mut self, cause: LimitedBy, id: &str, typical: f64, assignments: &str) -> Result<(), String> {
        let (mut size, mut tau) = (typical, FORGETS);
        for assignment in assignments.split(',').map(str::trim).filter(|text| !text.is_empty()) {
            let wanted = || format!("'{assignment}' is not NAME=VALUE with a number above zero in SI units");
            let (name, value) = assignment.split_once('=').ok_or_else(wanted)?;
            let value: f64 =
                value.trim().parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0).ok_or_else(wanted)?;
            match name.trim() {
                "size" => size = value,
                "tau" if cause == LimitedBy::RandomScale => tau = value,
                name => return Err(format!("{id} has no parameter '{name}': it has size")),
            }
        }
        match cause {
            LimitedBy::RandomScale => self.random_scale = (size, tau),
            LimitedBy::RateNoise => self.rate_noise = size,
            LimitedBy::ReversalSteps => self.reversal_steps = size,
            LimitedBy::StartStopSteps => self.start_stop_steps = size,
            _ => self.lost_motion = size.min(0.5),
        }
        Ok(())
    }

    /// What they add to the difference of gyro and reference, row by row, rad.
    pub(super) fn error(&self, samples: &[Sample], axis: usize, rate_hz: f64, seed: u64) -> Vec<f64> {
        let dt = 1.0 / rate_hz;
        let [mut scale_noise, mut rate_noise, mut steps, mut starts] = [10, 11, 12, 13].map(|k| stream(seed, 2000 + k));
        let (spread, time) = self.random_scale;
        let forgets = (-dt / time.max(dt)).exp();
        let mut scale = normal(&mut scale_noise, spread);
        let (mut sum, mut way, mut stood, mut was_resting) = (0.0, 0.0, 0.0, false);
        let each = samples.iter().map(|sample| {
            let rate = sample.true_rate[axis];
            scale = forgets * scale + normal(&mut scale_noise, spread * (1.0 - forgets * forgets).sqrt());
            sum += scale * rate * dt + normal(&mut rate_noise, self.rate_noise * (rate.abs() * dt).sqrt());
            // A motion that comes to rest swings about zero: that turns no gear round.
            if rate.abs() > STANDS {
                if way * rate < 0.0 {
                    sum += normal(&mut steps, self.reversal_steps);
                }
                way = rate.signum();
            }
            stood = if rate.abs() < STANDS { stood + dt } else { 0.0 };
            let rests = stood > RESTS;
            if rests != was_resting {
                sum += normal(&mut starts, self.start_stop_steps);
            }
            was_resting = rests;
            sum
        });
        each.collect()
    }

    /// Whether each of so many rows is lost.
    pub(super) fn lost(&self, rows: usize, rate_hz: f64, seed: u64) -> Vec<bool> {
        let (mut random, mut lost) = (stream(seed, 2014), vec![false; rows]);
        if self.lost_motion <= 0.0 {
            return lost;
        }
        let share = |random: &mut rand_chacha::ChaCha8Rng| 0.5 + (normal(random, 1.0).atan()) / (0.5 * TAU);
        let mut k = 10;
        while k < rows {
            let hole = (share(&mut random) * HOLE * rate_hz).ceil().max(1.0) as usize;
            lost[k..(k + hole).min(rows)].fill(true);
            let kept = hole as f64 * (1.0 - self.lost_motion) / self.lost_motion;
            k += hole + (2.0 * share(&mut random) * kept).ceil() as usize;
        }
        lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_causes_are_read_with_their_sizes() {
        let mut causes = RandomCauses::default();
        assert!(causes.take("delay").is_none());
        assert_eq!(causes.take("reversal-steps:size=0.01"), Some(Ok(())));
        assert_eq!(causes.take("random-scale:size=0.004,tau=5"), Some(Ok(())));
        assert_eq!((causes.reversal_steps, causes.random_scale), (0.01, (0.004, 5.0)));
        for wrong in ["rate-noise:size=x", "rate-noise:tau=1", "rate-noise:size=-1", "rate-noise:size"] {
            assert!(causes.take(wrong).is_some_and(|taken| taken.is_err()), "{wrong}");
        }
    }

    #[test]
    fn rows_are_lost_in_their_share() {
        let causes = RandomCauses { lost_motion: 0.1, ..RandomCauses::default() };
        let lost = causes.lost(100_000, 100.0, 1).into_iter().filter(|lost| *lost).count();
        assert!((8_000..12_500).contains(&lost), "{lost}");
    }
}
