//! A reference of one axis beside its gyro: what the gyro has turned between two readings, how noisy the readings are, and what
//! they say of the gyro's bias and scale error.

use super::{
    cross_check::CrossCheck,
    reference_noise::{Reading, ReferenceNoise},
};
use crate::history::seconds;

/// What is not known of the delay makes one error as long as the rate stays the same: for about this time, s.
const DELAY_CORRELATED: f64 = 10.0;

/// What is known of the reference's noise beforehand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// Standard deviation of an angle by the model, rad; `None` where it has none, or is not believed.
    pub encoder: Option<f64>,
    /// N² of the gyro, rad²/s.
    pub walk: f64,
    /// Over what time noise may be averaged, s.
    pub over: f64,
    /// Rate and acceleration at the reference's time.
    pub motion: [f64; 2],
    /// Bias, rad/s, and scale error of the gyro's signal by the main filter.
    pub bias: f64,
    pub scale: f64,
}

/// See the module's head.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    noise: ReferenceNoise,
    pub check: CrossCheck,
    /// Time of the last reading, ns, the gyro's signal there (its integral beside an angle), and the reading.
    last: Option<(i64, f64, f64)>,
}

impl Reference {
    /// A reference that nothing is known of but its delay, to `delay_std`, s.
    pub(super) fn new(delay_std: f64) -> Self {
        Self { noise: ReferenceNoise::default(), check: CrossCheck::new(delay_std), last: None }
    }

    /// Time since the last reading, s, and what the gyro says has turned since, its bias and scale error taken out. `signal` is ∫u dt.
    fn turned(&self, t_ns: i64, signal: f64, known: &Known) -> (f64, f64) {
        let Some((then, before, _)) = self.last else { return (0.0, 0.0) };
        let dt = seconds(t_ns, then);
        (dt, (signal - before - known.bias * dt) / (1.0 + known.scale))
    }

    /// The last reading turned on by the gyro.
    pub(super) fn continued(&self, t_ns: i64, signal: f64, known: &Known) -> Option<f64> {
        let (_, _, last) = self.last?;
        Some(last + self.turned(t_ns, signal, known).1)
    }

    /// The reading that the last one and the gyro make expect, where the rate is known to `rate_std` and that is less than `most`.
    pub(super) fn expected(&self, t_ns: i64, signal: f64, known: &Known, [rate_std, most]: [f64; 2]) -> Option<f64> {
        let (dt, _) = self.turned(t_ns, signal, known);
        self.continued(t_ns, signal, known).filter(|_| dt * rate_std < most)
    }

    /// Takes an angle, ∫u dt being `signal`. Returns what it lacks because it is late, and its variance
    /// without that, where it is worth taking.
    pub(super) fn take_angle(&mut self, t_ns: i64, signal: f64, angle: f64, known: &Known) -> Option<[f64; 2]> {
        let first = self.last.is_none();
        let (dt, turned) = self.turned(t_ns, signal, known);
        self.last = Some((t_ns, signal, angle));
        let fresh = self.noise.take(t_ns as f64 * 1e-9, angle, turned, known.encoder);
        self.check.predict(dt, turned, known.walk);
        if fresh == Reading::Old {
            return None;
        }
        let variance = self.variance(known);
        let [rate, _] = known.motion;
        if let Some(surely) = self.noise.at_most(known.walk, known.over) {
            self.check.take_angle(signal - angle, rate, surely * self.noise.repeated());
        }
        let (late, unknown) = self.lateness(rate);
        (!first).then_some([late, variance? + unknown])
    }

    /// Takes a rate, u being `signal`; at least `least` is its variance. Returns the same.
    pub(super) fn take_rate(
        &mut self,
        t_ns: i64,
        signal: f64,
        reading: f64,
        least: f64,
        known: &Known,
    ) -> Option<[f64; 2]> {
        let (then, before) = self.last.map_or((t_ns, signal), |(then, before, _)| (then, before));
        self.last = Some((t_ns, signal, reading));
        let fresh = self.noise.take(t_ns as f64 * 1e-9, reading, (signal - before) / (1.0 + known.scale), None);
        self.check.predict(seconds(t_ns, then), 0.0, 0.0);
        if fresh == Reading::Old {
            return None;
        }
        let white = (self.noise.at_most(0.0, known.over)? * self.noise.repeated()).max(least);
        self.check.take_rate(signal - reading, known.motion, white);
        let (late, unknown) = self.lateness(known.motion[1]);
        Some([late, white + unknown])
    }

    /// Variance of the last angle: what the readings surely do not exceed, as long as they are too few to contradict the model's, which
    /// knows nothing of noise that is correlated; then the model's, if they do not. `None` as long as nothing is known.
    fn variance(&self, known: &Known) -> Option<f64> {
        let at_most = || self.noise.at_most(known.walk, known.over);
        let white = match known.encoder.map(|encoder| encoder * encoder) {
            Some(model) if self.noise.is_told(known.walk, known.over) => {
                model.max(self.noise.at_least(known.walk, known.over))
            }
            Some(model) => at_most()?.max(model),
            None => at_most()?,
        };
        Some(white * self.noise.repeated())
    }

    /// What a reference that changes at `changing` lacks because it is late, and the variance of that, as if it were white.
    fn lateness(&self, changing: f64) -> (f64, f64) {
        let (delay, std) = self.check.delay();
        let correlated = (DELAY_CORRELATED / self.noise.interval().max(1e-6)).max(1.0);
        (delay * changing, (std * changing).powi(2) * correlated)
    }

    /// What the gyro says has turned since the last reading is wrong: the next one begins anew.
    pub(super) fn break_off(&mut self) {
        self.last = None;
        self.noise.break_off();
        self.check.break_off();
    }

    /// Another model with the same effects: u becomes `gain` u + `offset`.
    pub(super) fn rescale(&mut self, gain: f64, offset: f64) {
        self.check.rescale(gain, offset);
    }
}
