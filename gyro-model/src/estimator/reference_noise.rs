//! The noise of a reference, found from the stream before the reference is trusted.
//!
//! The gyro knows what the reference does between two of its readings, but for a bias and a scale error. So
//!
//! ```text
//! d_k = θ_ref(t_k) − ∫ (u − b̂)/(1 + ŝ) dt
//! ```
//!
//! holds the reference's noise and a straight line, and second differences leave the noise alone, at rest and moving. They
//! are taken of the means M of 1, 2, 4, … readings, as in an Allan variance: a noise that is correlated over many readings weighs as much as white
//! noise of the larger variance
//!
//! ```text
//! R = max over n of  n · E (M_{k+1} − 2 M_k + M_{k−1})²/6 − n² N² dt/6
//! ```
//!
//! (the last term is the gyro's own angle random walk N). A wrong b̂, ŝ or delay makes noise of a motion, never less of it. So d is taken twice,
//! with what the main filter knows of b and s, and with what the second one knows of them and of the delay, and the smaller mean square counts: a
//! filter that is certain of a wrong model shall not think its reference noisy. Of few differences a mean square says little: R is bounded from above and from below by
//! the χ² law, at 1 % each.
//!
//! A reading that repeats the last one to the last digit is either old (a slow reference whose value is held from row to row), or says that less than
//! one step was turned. It is taken for old as long as it has stood no longer than readings lately did before they changed and, where the gyro is
//! calibrated, the gyro has turned by more than a step meanwhile. Else the k-th of them in a row
//! counts with k times the variance, since its noise is no draw of its own: of all of them together the slope is known to about one step over their duration.

/// Means of up to 2¹² readings.
const OCTAVES: usize = 13;

/// Means of angles are taken over no longer than this, s: the scale error's and the bias' own changes are slower.
pub(super) const LONGEST: f64 = 2.0;

/// The same of an orientation, s: over longer times the axes' errors turn into each other.
pub(super) const LONGEST_TURNING: f64 = 0.05;

/// Over how many differences the mean square is taken; older ones fade.
const MEMORY: f64 = 64.0;

/// Second differences of white noise are correlated (−2/3, 1/6): of so many of them one is independent.
const PER_INDEPENDENT: f64 = 2.0;

/// Fewest independent differences that a bound is given from.
const FEWEST: f64 = 3.0;

/// The same from which a noise that is correlated is told from white noise.
const TOLD: f64 = 12.0;

/// Times by which an unknown correlation over longer times may raise R, as long as means over [`CORRELATED`] are not known.
const UNKNOWN: f64 = 4.0;

/// A noise that is not correlated over this time, s, is taken for white.
const CORRELATED: f64 = 1.0;

/// Readings that differ by less of their size are the same number.
const SAME: f64 = 1e-12;

/// A reading that stands this many times as long as readings lately did has not been held over: nothing moves.
const STANDSTILL: f64 = 1.5;

/// How long readings stand before they change, as long as none has changed, s.
const STOOD_UNKNOWN: f64 = 0.7;

/// By what the longest standing is forgotten from change to change.
const FADE: f64 = 0.9;

/// Standard deviations of a reading that a calibrated gyro has to turn by for a repeated one to be old: one and a half steps.
const MOVED: f64 = 5.0;

/// Standard normal quantile of 1 %.
const ONE_PER_CENT: f64 = -2.326_347_87;

/// Standard deviation of a reference that has only repeated itself so far, rad (1°).
const NEVER_CHANGED: f64 = 0.0175;

/// Means of 2ⁿ readings, and the mean square of their second differences.
#[derive(Clone, Copy, Debug, Default)]
struct Octave {
    last: [f64; 2],
    held: u8,
    /// The first of two means that make one of the next octave.
    half: Option<f64>,
    square: f64,
    count: f64,
}

impl Octave {
    /// Takes a mean; gives one of twice the length where that is complete.
    fn take(&mut self, mean: f64) -> Option<f64> {
        if self.held == 2 {
            let square = (mean - 2.0 * self.last[0] + self.last[1]).powi(2);
            self.count += 1.0;
            self.square += (square - self.square) / self.count.min(MEMORY);
        }
        self.last = [mean, self.last[0]];
        self.held = (self.held + 1).min(2);
        let Some(half) = self.half.take() else {
            self.half = Some(mean);
            return None;
        };
        Some(0.5 * (half + mean))
    }

    /// Independent differences in the mean square.
    fn independent(&self) -> f64 {
        self.count.min(MEMORY) / PER_INDEPENDENT
    }
}

/// See the module's head.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ReferenceNoise {
    octaves: [[Octave; OCTAVES]; 2],
    /// d of the last reading that was not old, its value and time, s; the gyro's integral since.
    d: [f64; 2],
    last: Option<(f64, f64)>,
    ahead: [f64; 2],
    /// The gyro's integral since the reading changed.
    since_change: f64,
    /// Time between readings, s.
    interval: f64,
    /// Smallest change between two readings that was seen.
    step: f64,
    repeats: f64,
    /// When the reading changed last, s, and how long readings lately stood before they changed, s.
    changed: f64,
    stood: Option<f64>,
}

/// What a reading is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reading {
    /// A new one, or a standstill.
    Fresh,
    /// The last one once more.
    Old,
}

impl ReferenceNoise {
    /// Takes a reading at `t` seconds; `turned` is the gyro's integral since the last one, by either filter, `encoder` its standard
    /// deviation by a fitted model.
    pub(super) fn take(&mut self, t: f64, reading: f64, turned: [f64; 2], encoder: Option<f64>) -> Reading {
        let Some((before, then)) = self.last else {
            (self.last, self.changed) = (Some((reading, t)), t);
            return Reading::Fresh;
        };
        for (ahead, turned) in self.ahead.iter_mut().zip(turned) {
            *ahead += turned;
        }
        self.since_change += turned[0];
        if (reading - before).abs() > SAME * reading.abs().max(1.0) {
            let stood = t - self.changed;
            self.stood = Some(self.stood.map_or(stood, |longest| stood.max(FADE * longest)));
            (self.changed, self.since_change) = (t, 0.0);
            let change = (reading - before).abs();
            self.step = if self.step > 0.0 { self.step.min(change) } else { change };
            self.repeats = 0.0;
        } else if t - self.changed < STANDSTILL * self.stood.unwrap_or(STOOD_UNKNOWN)
            && encoder.is_none_or(|encoder| self.since_change.abs() > MOVED * encoder.max(self.step / 12.0_f64.sqrt()))
        {
            return Reading::Old;
        } else {
            self.repeats += 1.0;
        }
        let (dt, turned) = (t - then, std::mem::take(&mut self.ahead));
        self.last = Some((reading, t));
        if self.interval > 0.0 && dt > 3.0 * self.interval {
            self.break_off();
        }
        self.interval =
            if self.interval > 0.0 { self.interval + 0.1 * (dt.min(3.0 * self.interval) - self.interval) } else { dt };
        for ((d, octaves), turned) in self.d.iter_mut().zip(&mut self.octaves).zip(turned) {
            *d += reading - before - turned;
            let mut mean = Some(*d);
            for octave in octaves {
                mean = match mean {
                    Some(mean) => octave.take(mean),
                    None => break,
                };
            }
        }
        Reading::Fresh
    }

    /// Time between readings, s; 0 where it is not known.
    pub(super) fn interval(&self) -> f64 {
        self.interval
    }

    /// What comes next does not continue what was: means that are not complete are dropped.
    pub(super) fn break_off(&mut self) {
        for octave in self.octaves.as_flattened_mut() {
            (octave.held, octave.half) = (0, None);
        }
    }

    /// Each octave's R up to a length of `longest`, less what the gyro's random walk of density `walk` = N² makes; its independent differences; its
    /// length, s.
    fn known(&self, walk: f64, longest: f64) -> impl Iterator<Item = (f64, f64, f64)> + '_ {
        let (mut n, interval) = (0.5, self.interval);
        self.octaves[0].iter().zip(&self.octaves[1]).map_while(move |(octave, other)| {
            n *= 2.0;
            let (independent, length) = (octave.independent(), n * interval);
            let r = n * octave.square.min(other.square) / 6.0 - n * n * walk * interval / 6.0;
            (independent >= FEWEST && (n == 1.0 || length <= longest)).then_some((r.max(0.0), independent, length))
        })
    }

    /// Variance of a reading that is surely not too small, by means over up to `over` seconds; `None` as long as too little is known.
    pub(super) fn at_most(&self, walk: f64, over: f64) -> Option<f64> {
        let (mut variance, mut longest) = (None::<f64>, 0.0_f64);
        for (r, independent, length) in self.known(walk, over) {
            let bound = r / chi_square_per_degree(independent, ONE_PER_CENT);
            variance = Some(variance.map_or(bound, |v| v.max(bound)));
            longest = length;
        }
        let step = if self.step > 0.0 { self.step / 12.0_f64.sqrt() } else { NEVER_CHANGED };
        let unknown = if longest < CORRELATED { UNKNOWN } else { 1.0 };
        variance.map(|v| (unknown * v).max(step * step))
    }

    /// Whether enough differences of means over [`CORRELATED`], or over the longest time there is, have been seen to tell a noise that is
    /// correlated.
    pub(super) fn is_told(&self, walk: f64, over: f64) -> bool {
        let longest =
            |(_, independent, length): (f64, f64, f64)| independent >= TOLD && 2.0 * length > CORRELATED.min(over);
        self.known(walk, over).any(longest)
    }

    /// Variance of a reading that it has at least.
    pub(super) fn at_least(&self, walk: f64, over: f64) -> f64 {
        self.known(walk, over)
            .map(|(r, independent, _)| r / chi_square_per_degree(independent, -ONE_PER_CENT))
            .fold(0.0, f64::max)
    }

    /// By what the variance of the last reading grows because it repeats those before it.
    pub(super) fn repeated(&self) -> f64 {
        1.0 + self.repeats
    }
}

/// χ² of `n` degrees of freedom over n, at the standard normal quantile `z` (Wilson and Hilferty, 1931).
fn chi_square_per_degree(n: f64, z: f64) -> f64 {
    let v = 2.0 / (9.0 * n);
    (1.0 - v + z * v.sqrt()).powi(3)
}
