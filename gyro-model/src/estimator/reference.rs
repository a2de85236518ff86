//! A reference of one axis beside its gyro: what the gyro has turned between two readings, how noisy the readings are, and what
//! they say of the gyro's bias and scale error.

use super::{
    cross_check::{CrossCheck, Shown},
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
    /// The instant that it shows.
    pub shown: Shown,
    /// Bias, rad/s, and scale error of the gyro's signal by the main filter; by these, the rate and acceleration at that instant, …
    pub bias: f64,
    pub scale: f64,
    pub rate: f64,
    pub acceleration: f64,
    /// … and what was turned since, rad, and by how much the rate has grown, rad/s.
    pub turned: f64,
    pub faster: f64,
}

/// See the module's head.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    noise: ReferenceNoise,
    pub check: CrossCheck,
    /// Time of the last reading, ns, the gyro's signal there (its integral beside an angle), and the reading.
    last: Option<(i64, f64, f64)>,
    /// Time that the last reading has shown, s, and the gyro's signal then.
    shown: Option<(f64, f64)>,
}

impl Reference {
    /// A reference that nothing is known of but its delay, to `delay_std`, s.
    pub(super) fn new(delay_std: f64) -> Self {
        Self { noise: ReferenceNoise::default(), check: CrossCheck::new(delay_std), last: None, shown: None }
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
        let (first, shown) = (self.last.is_none(), &known.shown);
        let (dt, turned) = self.turned(t_ns, signal, known);
        let signalled = self.last.map_or(0.0, |(_, before, _)| signal - before);
        self.last = Some((t_ns, signal, angle));
        let [over, more] = self.as_shown(t_ns, signal - shown.since);
        let as_shown = self.check.turned(over, more);
        let fresh = self.noise.take(t_ns as f64 * 1e-9, angle, [turned, as_shown], known.encoder);
        self.check.predict(dt, self.check.turned(dt, signalled), known.walk);
        if fresh == Reading::Old {
            return None;
        }
        let variance = self.variance(known);
        if let Some(surely) = self.noise.at_most(known.walk, known.over) {
            self.check.take_angle(signal - shown.since - angle, shown, surely * self.noise.repeated());
        }
        (!first).then_some([known.turned, variance? + self.lateness(known.rate)])
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
        let faster = (signal - before) / (1.0 + known.scale);
        let [_, as_shown] = self.as_shown(t_ns, known.shown.signal);
        let fresh = self.noise.take(t_ns as f64 * 1e-9, reading, [faster, self.check.turned(0.0, as_shown)], None);
        self.check.predict(seconds(t_ns, then), 0.0, 0.0);
        if fresh == Reading::Old {
            return None;
        }
        let white = (self.noise.at_most(0.0, known.over)? * self.noise.repeated()).max(least);
        let shown = &known.shown;
        self.check.take_rate(shown.signal - reading, shown, white);
        Some([known.faster, white + self.lateness(known.acceleration)])
    }

    /// Time between the instants that the last reading and this one show, s, and the change of the gyro's signal from one to the other.
    fn as_shown(&mut self, t_ns: i64, signal: f64) -> [f64; 2] {
        let t = t_ns as f64 * 1e-9 - self.check.delay().0;
        let (then, before) = self.shown.replace((t, signal)).unwrap_or((t, signal));
        [t - then, signal - before]
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

    /// Variance of what a reference that changes at `changing` lacks because it is late, as if it were white.
    fn lateness(&self, changing: f64) -> f64 {
        let (_, std) = self.check.delay();
        let correlated = (DELAY_CORRELATED / self.noise.interval().max(1e-6)).max(1.0);
        (std * changing).powi(2) * correlated
    }

    /// What the gyro says has turned since the last reading is wrong: the next one begins anew.
    pub(super) fn break_off(&mut self) {
        (self.last, self.shown) = (None, None);
        self.noise.break_off();
        self.check.break_off();
    }

    /// Another model with the same effects: u becomes `gain` u + `offset`, while something turns at `rate`.
    pub(super) fn rescale(&mut self, gain: f64, offset: f64, rate: f64) {
        self.check.rescale(gain, offset, rate);
    }

    /// The same of a reference rate, whose signal is u itself.
    pub(super) fn rescale_signal(&mut self, gain: f64, offset: f64) {
        for signal in
            self.last.iter_mut().map(|last| &mut last.1).chain(self.shown.iter_mut().map(|shown| &mut shown.1))
        {
            *signal = gain * *signal + offset;
        }
    }
}
