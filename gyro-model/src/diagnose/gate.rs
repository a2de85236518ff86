//! Whether a suspect is let in: significant, holding on data that it was not fitted on, and worth having.

use super::{
    candidates::Candidate,
    rank::ROUGH,
    refit::{Present, Refit},
    tone, verdict,
};
use crate::{
    Axis, Term,
    effects::{Memory, ParameterCard, Role, Stage},
    evidence::{
        noise::{self, Gls},
        problem::Slot,
        series::Series,
        study::Study,
    },
};
use itertools::Itertools;
use statrs::distribution::{ChiSquared, ContinuousCDF};

impl Present<'_> {
    /// Whether its model of this axis is the base: a scale factor and a bias.
    fn is_base(&self, series: usize) -> bool {
        let axis = self.study.bench.problem.series[series].axis;
        let terms = self.study.model.axes[axis.index()].as_ref().map_or(&[][..], |m| &m.terms);
        terms.iter().all(|t| t.effect.stage() == Stage::Calibration)
    }

    /// Whether a model without `term`, of this series, needs it: `with` is this model and the term, fitted.
    #[must_use]
    pub fn needs(&self, with: &Present, series: usize, term: &Term) -> bool {
        let gls = |present: &Present| present.beside(term.effect, series).gls.log_likelihood;
        let rise = gls(with) - gls(self);
        let candidate = Candidate { series, term: term.clone(), score: rise, removes: 0.0, freedom: term.values.len() };
        let (before, after) = (self.excess(series), with.excess(series));
        let scatters = before < UNEVEN && is_noise(&with.study, &with.gls);
        let most = if scatters { (1.0 + SCATTERS) * before } else { before };
        after < most && (chance(rise, &candidate, &with.study) < GATE || after < (1.0 - SHARE) * before)
    }
}

impl Refit<'_> {
    /// J of its axis without it.
    #[must_use]
    pub fn before(&self, present: &Present) -> f64 {
        present.excess(self.candidate.series)
    }

    /// Share of the held-out excess that it removes; `None` where there is none.
    #[must_use]
    pub fn share(&self, present: &Present) -> Option<f64> {
        let before = self.before(present);
        (before > 1.0).then(|| (before - self.excess) / (before - 1.0))
    }

    /// Whether it is significant, holds on data it was not fitted on, and matters.
    #[must_use]
    pub fn passes(&self, present: &Present) -> bool {
        if self.candidate.term.effect.stage() == Stage::Reading {
            return true;
        }
        // A tone that the gyro's own spectrum shows is real however little it moves the angle. Where what is left is noise that
        // sensors have, the likelihood weighs each reading by what it tells, and J, which does not, may scatter by more than so
        // small an effect removes. But beside effects that were added, whose forms are right to a small share of what they
        // remove, it may be what they left, unless it is clear throughout the log.
        let tone = self.candidate.term.effect.card().id == "vibration-tone";
        let is_base = present.is_base(self.candidate.series);
        let is_clear = self.p_value < ONE_SHOT && self.held_out.0 > CLEAR * self.held_out.1;
        let scatters = self.before(present) < UNEVEN && self.leaves_noise() && (is_base || is_clear);
        let relevant = match (tone, scatters, is_base) {
            (true, ..) => -0.01,
            (false, true, _) => -SCATTERS,
            (false, false, true) => 0.0,
            (false, false, false) => RELEVANT,
        };
        let before = self.before(present);
        if self.is_stuck(present) || self.excess >= before * (1.0 - relevant) {
            return false;
        }
        if !self.is_no_chance() && !self.dominates(present) {
            return false;
        }
        let little = before > UNEVEN && self.share(present).is_none_or(|s| s < SHARE);
        if little && !self.leaves_it_out(present) && !self.is_plain(present) {
            return false;
        }
        let hides = tone && !self.is_plain_line() && self.share(present).is_none_or(|s| s < DOMINATES);
        if self.excess > ROUGH && (self.is_outsized() || hides) {
            return false;
        }
        // What shows at one instant (a step) cannot be held out block by block in likelihood, but in the error it can.
        // What shows at a few instants (a play, where a shaft turns back) does so unevenly; but what one block alone shows is
        // not there for those who have not seen it, and where much else is left a likelihood alone says little.
        let at_times = self.excess < ROUGH && self.p_value < ONE_SHOT && self.held_out.0 > HOLDS * self.rise;
        let throughout = self.held_out.0 > THROUGHOUT * self.held_out.1 || self.fall.0 > 2.0 * self.fall.1 || at_times;
        let holds = self.held_out.0 > 0.25 * self.rise.min(40.0) && throughout;
        (holds || self.fall.0 > 4.0 * self.fall.1)
            && (!one_shot(self)
                || self.p_value < ONE_SHOT
                || self.p_value < SMOOTH && self.leaves_nothing(present)
                || self.dominates(present))
    }

    /// Whether it takes all of an error that is no noise, throughout the log: what wanders leaves something beside a shape so
    /// simple.
    fn leaves_nothing(&self, present: &Present) -> bool {
        self.before(present) > ROUGH && self.excess < UNEVEN && self.fall.0 > 4.0 * self.fall.1
    }

    /// Whether it is plain on the samples that it keeps, and the excess stands in those that it has to leave out: where it
    /// says that nobody can know the rate. What is left has to be noise that sensors have, or little: else likelihoods
    /// mean nothing.
    fn leaves_it_out(&self, present: &Present) -> bool {
        let before = self.before(present);
        let most = before - SHARE * (before - 1.0);
        self.study.leaves_out()
            && self.p_value < ONE_SHOT
            && self.kept < most
            && (self.leaves_noise() || self.kept < ROUGH)
    }

    /// Whether it is plain beside a bias that wanders, of which the excess is, no more than such wander makes: whatever the
    /// share of that it removes.
    fn is_plain(&self, present: &Present) -> bool {
        self.before(present) < ROUGH && self.p_value < ONE_SHOT && self.leaves_noise() || self.is_plain_line()
    }

    /// Whether it is a tone that the sensor felt, plain beside a bias that wanders, however much: no wander draws a line.
    fn is_plain_line(&self) -> bool {
        let Candidate { series, ref term, .. } = self.candidate;
        term.effect.card().id == "vibration-tone"
            && self.p_value < ONE_SHOT
            && self.leaves_noise()
            && tone::is_read(&self.study, series, term)
    }

    /// Whether what it leaves is noise that sensors have.
    fn leaves_noise(&self) -> bool {
        is_noise(&self.study, &self.gls)
    }

    /// Whether a coefficient is far beyond what such sensors have: where much is left unexplained, the fit bends whatever
    /// can be bent.
    fn is_outsized(&self) -> bool {
        let Candidate { series, ref term, .. } = self.candidate;
        // How much a vehicle shakes is no matter of the sensor, and the reading shows it.
        let is_shaken = term.effect.card().id == "vibration-tone" && tone::is_read(&self.study, series, term);
        !is_shaken && is_outsized(term, self.study.bench.problem.series[series].axis)
    }

    /// Whether it removes much of an error that is far beyond what a gyro's own wander makes, throughout the log. Other
    /// missing physics inflates the identified noise until a slow effect drowns in it; the error itself does not lie.
    fn dominates(&self, present: &Present) -> bool {
        // What is slow differs from its mean in some blocks more than in others.
        let least = if verdict::is_slow(self.candidate.term.effect.card().id) { SLOWLY } else { 4.0 };
        self.before(present) > ROUGH
            && present.gls.noise.beyond_wander()
            && self.share(present).is_some_and(|s| s > DOMINATES)
            && self.fall.0 > least * self.fall.1
    }

    /// Whether a parameter ran to the end of what is physical: the fit looks for something else.
    pub(super) fn at_bound(&self) -> bool {
        self.ends().into_iter().any(|parameter| self.goes_beyond(parameter))
    }

    /// The same, but for a shape of what is plain in the error: other missing physics may press it there.
    fn is_stuck(&self, present: &Present) -> bool {
        let may_stand = |parameter| self.is_extreme_shape(parameter) && self.dominates(present);
        self.ends().into_iter().any(|parameter| self.goes_beyond(parameter) && !may_stand(parameter))
    }

    fn card(&self, parameter: usize) -> &'static ParameterCard {
        let axis = self.study.bench.problem.series[self.candidate.series].axis;
        &self.candidate.term.effect.parameters(axis)[parameter]
    }

    fn ends(&self) -> Vec<usize> {
        ends(&self.candidate.term, &self.study.bench.problem.series[self.candidate.series])
    }

    /// Whether the likelihood asks for more than an end that a parameter stands at. A shape which the log hardly tells, a damping
    /// say, may stand there.
    fn goes_beyond(&self, parameter: usize) -> bool {
        let Candidate { series, ref term, .. } = self.candidate;
        let of_suspect = |slot: &Slot| slot.series == series && slot.parameter == parameter;
        let row = self.study.slots.iter().rposition(of_suspect);
        let beyond = |row: usize| {
            let step = if term.values[parameter] <= self.card(parameter).bounds.0 {
                -self.gls.step[row]
            } else {
                self.gls.step[row]
            };
            step > BEYOND * self.gls.std_error(row)
        };
        !self.is_extreme_shape(parameter) || row.is_none_or(beyond)
    }

    /// Whether a parameter that stands at an end is a shape there: what is nothing at that end is not there, and some ends lie
    /// within the bounds.
    fn is_extreme_shape(&self, parameter: usize) -> bool {
        let card = self.card(parameter);
        let (value, (low, high)) = (self.candidate.term.values[parameter], card.bounds);
        card.role == Role::Shape && low < card.neutral && card.neutral < high && !(low < value && value < high)
    }

    /// Whether noise alone would hardly do as well.
    #[must_use]
    pub fn is_no_chance(&self) -> bool {
        self.p_value < GATE
    }

    /// The same, and whether it lowers the error.
    #[must_use]
    pub fn significant(&self) -> bool {
        self.is_no_chance() && (self.held_out.0 > 0.0 || self.fall.0 > 4.0 * self.fall.1) && !self.at_bound()
    }
}

/// Whether a parameter stands at the end of what is physical.
pub(super) fn is_at_bound(term: &Term, series: &Series) -> bool {
    !ends(term, series).is_empty()
}

/// The fitted parameters that stand at the end of what is physical.
fn ends(term: &Term, series: &Series) -> Vec<usize> {
    let span = series.span();
    let nyquist = 0.5 / span.dt;
    // A step has to be seen from both sides.
    let (first, last) = (series.t[0] + ENDS * span.duration, series.t[0] + (1.0 - ENDS) * span.duration);
    let is_at_end = |card: &ParameterCard, v: f64| {
        if term.effect.card().id == "bias-step" && card.name == "t0" && !(first..last).contains(&v) {
            return true;
        }
        let near = |bound: f64| bound.is_finite() && (v - bound).abs() <= 1e-6 * bound.abs().max(1e-12);
        near(card.bounds.0) || near(card.bounds.1) || (card.unit == "Hz" && v > nyquist)
    };
    let cards = term.effect.parameters(series.axis);
    (0..cards.len()).filter(|&k| cards[k].role != Role::Chosen && is_at_end(&cards[k], term.values[k])).collect()
}

/// Whether what a model leaves is noise that sensors have.
fn is_noise(study: &Study, gls: &Gls) -> bool {
    noise::sober(study, &gls.noise).is_none()
}

/// Whether a coefficient is far beyond what such sensors have.
pub(super) fn is_outsized(term: &Term, axis: Axis) -> bool {
    let pairs = term.effect.parameters(axis).iter().zip(&term.values);
    pairs
        .filter(|(card, _)| card.role == Role::Linear && card.typical != 0.0)
        .any(|(card, v)| v.abs() > OUTSIZED * card.typical.abs())
}

/// Whether hardly any of a log is cut off or left out.
pub(super) fn is_whole(study: &Study) -> bool {
    study.evaluation.silent() < 0.01
}

/// Chance that noise alone raises ln L as much, for any effect at any shape of the search.
pub(super) fn chance(rise: f64, candidate: &Candidate, study: &Study) -> f64 {
    let effect = candidate.term.effect;
    let series = &study.bench.problem.series[candidate.series];
    let is_chosen = effect.parameters(series.axis).iter().any(|card| card.role == Role::Chosen);
    let grid = effect.grid(&series.span()).len().max(1) as f64;
    let (shapes, freedom) = if effect.card().id != "vibration-tone" {
        // Neighbouring shapes of a grid are not independent, one harmonic and the next are.
        (if is_chosen { grid } else { grid.sqrt() }, candidate.freedom)
    } else if is_whole(study) && tone::is_read(study, candidate.series, &candidate.term) {
        // Where the reading has the line, it gives amplitude and phase too: only whether the shaft shares it is open. (One
        // that is cut off has lines that nobody turned.)
        (tone::LINES as f64, 1)
    } else {
        // Every line of a spectrum is its own.
        (tone::frequencies(study.bench.problem.times()), candidate.freedom)
    };
    let effects = (crate::effects::CATALOGUE.len() * study.bench.problem.series.len()) as f64;
    let Ok(law) = ChiSquared::new(freedom as f64) else { return 1.0 };
    (law.sf((2.0 * rise).max(0.0)) * effects * shapes).min(1.0)
}

/// Whether it shows once in the log: the error of a slow effect, where what it goes with does not come again.
fn one_shot(refit: &Refit) -> bool {
    let term = &refit.candidate.term;
    if !verdict::is_slow(term.effect.card().id) {
        return false;
    }
    let mut memory = Memory::default();
    let signals = &refit.study.bench.problem.series[refit.candidate.series].signals;
    let error: Vec<f64> = signals.iter().map(|s| term.effect.error(&term.values, s, &mut memory)).collect();
    swings(&error) < SWINGS
}

/// How often a signal goes from half a standard deviation on one side of its mean to as much on the other.
fn swings(signal: &[f64]) -> usize {
    let n = signal.len() as f64;
    let mean = signal.iter().sum::<f64>() / n;
    let half = 0.5 * (signal.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt();
    let sides = signal.iter().map(|x| x - mean).filter(|x| x.abs() > half).map(f64::is_sign_positive);
    sides.tuple_windows().filter(|(a, b)| a != b).count()
}

/// Swings from which on a wandering bias would have to follow too often to be taken for it.
const SWINGS: usize = 6;
/// Significance, priced for the whole search, that a suspect needs.
const GATE: f64 = 2e-3;
/// Significance that an effect needs which shows once in a log (a warming, a drift, a step): the bias of such sensors
/// wanders, and a wander is easily taken for it.
const ONE_SHOT: f64 = 1e-4;
/// The same where it takes all of an error that is no noise.
const SMOOTH: f64 = 5e-4;
/// Standard errors over the blocks that the rise of the held-out ln L has to have: what a single block gains has one.
const THROUGHOUT: f64 = 1.2;
/// Share of the rise of ln L that has to hold on data that were not fitted, where it does so unevenly.
const HOLDS: f64 = 0.5;
/// J above which something is left that is not noise.
pub(super) const UNEVEN: f64 = 1.2;
/// Share of the held-out excess that an effect has to remove there.
pub(super) const SHARE: f64 = 0.1;
/// Share of J by which it scatters where an effect near the floor comes in.
const SCATTERS: f64 = 1e-2;
/// Standard errors over the blocks that the held-out ln L has to rise by for an effect to be clear throughout the log.
const CLEAR: f64 = 4.0;
/// Share of J that an effect has to remove beside others.
const RELEVANT: f64 = 4e-3;
/// Times its typical size that a coefficient may have while much is left unexplained.
const OUTSIZED: f64 = 20.0;
/// Share of the log at its ends where no step is looked for.
const ENDS: f64 = 0.05;
/// Standard errors beyond such an end that are no chance.
const BEYOND: f64 = 3.0;
/// Standard errors over the blocks that the error has to fall by for a slow effect to do so throughout the log.
const SLOWLY: f64 = 3.0;
/// Share of the held-out excess that makes up for a likelihood that drowns it.
const DOMINATES: f64 = 0.4;

#[cfg(test)]
mod tests {
    use super::swings;

    #[test]
    fn a_drift_swings_once_and_three_periods_five_times() {
        let line: Vec<f64> = (0..600).map(|k| f64::from(k) + 5.0 * f64::from(k % 7)).collect();
        assert_eq!(swings(&line), 1);
        let sine: Vec<f64> = (0..600).map(|k| (f64::from(k) * 0.01 * std::f64::consts::PI).sin()).collect();
        assert_eq!(swings(&sine), 5);
    }
}
