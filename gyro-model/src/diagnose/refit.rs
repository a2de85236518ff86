//! A suspect refitted exactly, and what that is worth.

use super::{
    candidates::{Candidate, scan, with_term},
    tone, verdict,
};
use crate::{
    Axis, Term,
    effects::{Effect, Memory, Role, Stage},
    evidence::{
        floor,
        increments::BLOCKS as BLOCKS_OF_INCREMENTS,
        noise::{self, BLOCKS, Gls},
        problem::Warm,
        study::Study,
    },
    nls, parallel,
};
use itertools::Itertools;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// The present model: what suspects are measured against.
#[derive(Clone, Debug)]
pub struct Present<'a> {
    /// Fitted.
    pub study: Study<'a>,
    /// Whitened draws of noise alone.
    draws: Vec<Vec<Vec<f64>>>,
    /// Its noise and likelihood.
    pub gls: Gls,
    /// J, the mean over τ of (E/F)², held out.
    pub excess: f64,
    measure: Measure,
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

/// What a fitted model is worth.
#[derive(Clone, Debug)]
struct Measure {
    log_likelihood: f64,
    held_out: Vec<f64>,
    excess: f64,
    blocks: Vec<Option<f64>>,
}

impl Measure {
    fn of(study: &Study, gls: &Gls) -> Self {
        let (held, weights) = (study.held_out(), &study.bench.weights);
        Self {
            log_likelihood: gls.log_likelihood,
            held_out: gls.held_out.clone(),
            excess: held.excess(weights),
            blocks: held.by_block(weights),
        }
    }
}

/// One suspect at its exact optimum.
#[derive(Clone, Debug)]
pub struct Refit<'a> {
    /// Where it came from.
    pub candidate: Candidate,
    /// The model with it, fitted.
    pub study: Study<'a>,
    /// Noise and likelihood with it.
    pub gls: Gls,
    /// J with it (on the samples of the present model).
    pub excess: f64,
    /// Rise of ln L.
    pub rise: f64,
    /// How much noise alone raises ln L beyond what white noise would.
    pub inflation: f64,
    /// Rise of the held-out ln L over the blocks, and its standard error.
    pub held_out: (f64, f64),
    /// Chance of such a rise from noise, priced for the whole search.
    pub p_value: f64,
    /// Fall of the held-out error: mean over blocks of ln(J₀/J₁), and its standard error.
    pub fall: (f64, f64),
    /// Rise of the held-out ln L, block by block.
    gains: Vec<f64>,
    /// ln(J₀/J₁), block by block.
    falls: Vec<Option<f64>>,
}

/// How many suspects are refitted exactly.
const LEADERS: usize = 5;
/// Share of J that the scan has to promise for a refit that its likelihood does not ask for.
const LOWERS: f64 = 0.02;
/// Significance, priced for the whole search, that a suspect needs.
const GATE: f64 = 2e-3;
/// Rise of ln L below which the scan's suspects are not refitted.
const NOTICEABLE: f64 = 4.0;

impl<'a> Present<'a> {
    /// Takes a fitted model's measure.
    #[must_use]
    pub fn new(study: Study<'a>) -> Self {
        let gls = study.identify(&[]);
        Self::with(study, gls)
    }

    /// The same with the noise known.
    #[must_use]
    pub fn with(study: Study<'a>, gls: Gls) -> Self {
        let whitener = noise::whitener(&study, &gls.noise);
        let draws = (0..DRAWS)
            .map(|seed| whitener.apply_each(&floor::draw(study.bench, 0, &study.warm[0], &study.evaluation.lost, seed)))
            .collect();
        let measure = Measure::of(&study, &gls);
        Self { excess: measure.excess, measure, draws, study, gls }
    }

    /// How much more noise alone raises ln L along the columns of the last term of `study` than white noise of one size
    /// would: an encoder's quantisation under a regular motion is anything but white, and noise that grows with the rate
    /// is not everywhere the same.
    fn inflation(&self, refit: &Study, candidate: &Candidate) -> f64 {
        let n = self.draws.len() as f64;
        let (normal, whitener) = noise::normal(refit, &self.gls.noise);
        let (all, _) = nls::invert_observable(&normal.matrix, 1e-10);
        let own: Vec<bool> = refit.slots.iter().map(|s| refit.is_last_term(*s, candidate.series)).collect();
        let rest: Vec<usize> = (0..own.len()).filter(|&k| !own[k]).collect();
        let few = faer::Mat::from_fn(rest.len(), rest.len(), |i, j| normal.matrix[(rest[i], rest[j])]);
        let (few, _) = nls::invert_observable(&few, 1e-10);
        let columns: Vec<Vec<Vec<f64>>> = refit.columns.iter().map(|c| whitener.apply_each(c)).collect();
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        for draw in &self.draws {
            let g: Vec<f64> = columns.iter().map(|c| c.iter().zip(draw).map(|(a, b)| nls::dot(a, b)).sum()).collect();
            let form = |m: &faer::Mat<f64>, pick: &[usize]| -> f64 {
                (0..pick.len()).map(|i| (0..pick.len()).map(|j| g[pick[i]] * m[(i, j)] * g[pick[j]]).sum::<f64>()).sum()
            };
            let every: Vec<usize> = (0..g.len()).collect();
            let rise = 0.5 * (form(&all, &every) - form(&few, &rest));
            (sum, largest) = (sum + rise, largest.max(rise));
        }
        let freedom = own.iter().filter(|o| **o).count() as f64;
        let usual = 0.5 * freedom;
        // An encoder's errors may add up on a few draws and cancel on the others: the largest counts too.
        let rare = ChiSquared::new(freedom).map_or(f64::INFINITY, |law| 0.5 * law.inverse_cdf(RARE));
        let residual = whitener.apply_each(&refit.evaluation.residual);
        let uneven = noise::unevenness(&columns, &residual, &all);
        let uneven = uneven.iter().zip(&own).filter(|(_, own)| **own).map(|(u, _)| u).sum::<f64>() / (2.0 * usual);
        (sum / n / usual).max(largest / rare).max(uneven).max(1.0)
    }

    /// What undoing a sensor's response gains in ln L on noise alone: an inverse shapes the reading's noise as well as
    /// its motion, and a notch takes some of it out.
    fn shaped(&self, study: &Study, gls: &Gls, candidate: &Candidate) -> f64 {
        let term = &candidate.term;
        if term.effect.stage() != Stage::Response {
            return 0.0;
        }
        let bench = study.bench;
        let series = &bench.problem.series[candidate.series];
        let undo = |noise: &[f64]| term.effect.undo_response_whole(&term.values, &series.t, noise);
        // Each by the likelier of the two noises: what differs is what the response did to the noise, not what the noise
        // found without the suspect was made to hold of it.
        let whiteners = [noise::whitener(study, &gls.noise), noise::whitener(&self.study, &self.gls.noise)];
        let likeliest = |r: &[f64]| {
            let costs = whiteners.iter().map(|whitener| {
                let white = whitener.apply(r);
                0.5 * (whitener.log_determinant + nls::dot(&white, &white))
            });
            costs.fold(f64::INFINITY, f64::min)
        };
        let gains = (0..SHAPED).map(|seed| {
            let [plain, undone] =
                floor::draw_through(bench, candidate.series, &study.warm[candidate.series], &undo, seed);
            likeliest(&plain) - likeliest(&undone)
        });
        (gains.sum::<f64>() / SHAPED as f64 * bench.problem.channels() as f64).max(0.0)
    }

    /// The suspects of this model, refitted, best first.
    #[must_use]
    pub fn suspects(&self, extra: &[&'static dyn Effect], mut progress: impl FnMut(&str)) -> Vec<Refit<'a>> {
        let list = leaders(scan(&self.study, &self.gls, &self.draws, extra));
        progress(&list.iter().map(|c| c.term.effect.card().id).collect::<Vec<_>>().join(", "));
        let mut refits = parallel::map(&list, |candidate| self.refit(candidate.clone()));
        drop_driven(&mut refits);
        rank(&mut refits);
        prefer_plainer(&mut refits, self);
        let mut seen: Vec<(usize, &str)> = Vec::new();
        refits.retain(|r| {
            let key = (r.candidate.series, r.candidate.term.effect.card().id);
            let first = !seen.contains(&key);
            seen.push(key);
            first
        });
        refits
    }

    /// Those suspects of one axis that `wanted` names, refitted.
    #[must_use]
    pub fn rivals(
        &self,
        series: usize,
        extra: &[&'static dyn Effect],
        wanted: impl Fn(&str) -> bool,
    ) -> Vec<Refit<'a>> {
        let mut list = scan(&self.study, &self.gls, &self.draws, extra);
        list.retain(|c| {
            c.series == series && c.term.effect.stage() != Stage::Reading && wanted(c.term.effect.card().id)
        });
        parallel::map(&list, |candidate| self.refit(candidate.clone()))
    }

    /// A suspect at its exact optimum, held against this model.
    pub(super) fn refit(&self, mut candidate: Candidate) -> Refit<'a> {
        let model = with_term(&self.study, candidate.series, candidate.term.clone());
        let study = Study::fit(self.study.bench, &model, Some(&self.study.frozen()));
        let gls = study.identify(&[self.gls.noise]);
        let (study, gls) = study.refine_tones(gls);
        let gls = noise::likelier(&study, &gls, &self.gls.noise).unwrap_or(gls);
        // What the suspect leaves out, the present model has to be judged without; and a noise that was found beside the
        // suspect may be the likelier one without it too.
        let other;
        let base = if study.leaves_out() {
            let warm: Vec<Warm> = self.study.warm.iter().zip(&study.warm).map(|(w, own)| w.without(own)).collect();
            let base = Study::fit(self.study.bench, &self.study.model, Some(&warm));
            let gls = base.identify(&[self.gls.noise]);
            other = Measure::of(&base, &gls);
            &other
        } else if let Some(gls) = noise::likelier(&self.study, &self.gls, &gls.noise) {
            other = Measure { log_likelihood: gls.log_likelihood, held_out: gls.held_out, ..self.measure.clone() };
            &other
        } else {
            &self.measure
        };
        let axis = study.bench.problem.series[candidate.series].axis;
        if let Some(term) = study.model.axes[axis.index()].as_ref().and_then(|m| m.terms.last()) {
            candidate.term = term.clone();
        }
        let own = Measure::of(&study, &gls);
        let read_off = candidate.term.effect.stage() == Stage::Reading;
        let rise = if read_off {
            f64::INFINITY
        } else {
            own.log_likelihood - base.log_likelihood - SHAPES * self.shaped(&study, &gls, &candidate)
        };
        let gains: Vec<f64> = own.held_out.iter().zip(&base.held_out).map(|(a, b)| a - b).collect();
        let held_out = if read_off { (f64::INFINITY, 0.0) } else { total(&gains) };
        let falls: Vec<Option<f64>> =
            base.blocks.iter().zip(&own.blocks).map(|(a, b)| Some((a.as_ref()? / b.as_ref()?).ln())).collect();
        let fall = mean(&falls.iter().copied().flatten().collect::<Vec<_>>());
        let inflation = self.inflation(&study, &candidate);
        let p_value = chance(rise / inflation, &candidate, &study);
        let excess = own.excess * self.excess / base.excess;
        Refit { candidate, study, gls, excess, rise, inflation, held_out, p_value, fall, gains, falls }
    }
}

/// The suspects that are worth an exact refit: first by the error that they remove, and by likelihood.
fn leaders(mut list: Vec<Candidate>) -> Vec<Candidate> {
    list.sort_by(|a, b| b.removes.total_cmp(&a.removes));
    let mut chosen: Vec<Candidate> = list.extract_if(.., |c| c.removes > LOWERS).collect();
    list.extend(chosen.drain(LEADERS.min(chosen.len())..));
    list.retain(|c| c.score - c.freedom as f64 > NOTICEABLE - 1.0);
    list.sort_by(|a, b| b.score.total_cmp(&a.score));
    list.truncate(LEADERS);
    chosen.extend(list);
    chosen
}

impl Present<'_> {
    /// Whether its model of this axis is the base: a scale factor and a bias.
    fn is_base(&self, series: usize) -> bool {
        let axis = self.study.bench.problem.series[series].axis;
        let terms = self.study.model.axes[axis.index()].as_ref().map_or(&[][..], |m| &m.terms);
        terms.iter().all(|t| t.effect.stage() == Stage::Calibration)
    }

    /// Whether a model without `term` needs it: `with` is this model and the term, fitted.
    #[must_use]
    pub fn needs(&self, with: &Present, term: &Term) -> bool {
        let rise = with.gls.log_likelihood - self.gls.log_likelihood;
        let candidate =
            Candidate { series: 0, term: term.clone(), score: rise, removes: 0.0, freedom: term.values.len() };
        let lower = with.excess < self.excess;
        lower && (chance(rise, &candidate, &with.study) < GATE || with.excess < (1.0 - SHARE) * self.excess)
    }
}

/// Sum of block values and its standard error.
fn total(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    if n < 2.0 {
        return (values.iter().sum(), f64::INFINITY);
    }
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (n * mean, (n * variance).sqrt())
}

/// Mean of block values and its standard error. The longest increments span three blocks, so neighbours are alike: their
/// covariances count (Newey and West 1987).
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len();
    if n < 4 {
        return (values.iter().sum::<f64>() / n.max(1) as f64, f64::INFINITY);
    }
    let mean = values.iter().sum::<f64>() / n as f64;
    let covariance =
        |lag: usize| values.windows(lag + 1).map(|w| (w[0] - mean) * (w[lag] - mean)).sum::<f64>() / (n - 1) as f64;
    let reach = BLOCKS_OF_INCREMENTS / 10;
    let neighbours: f64 = (1..=reach).map(|k| 2.0 * (1.0 - k as f64 / (reach + 1) as f64) * covariance(k)).sum();
    let variance = (covariance(0) + neighbours).max(0.5 * covariance(0));
    (mean, (variance / n as f64).sqrt())
}

/// Chance that noise alone raises ln L as much, for any effect at any shape of the search.
fn chance(rise: f64, candidate: &Candidate, study: &Study) -> f64 {
    let effect = candidate.term.effect;
    let series = &study.bench.problem.series[candidate.series];
    let (shapes, freedom) = if effect.card().id != "vibration-tone" {
        // Neighbouring shapes of a grid are not independent.
        ((effect.grid(&series.span()).len().max(1) as f64).sqrt(), candidate.freedom)
    } else if !study.evaluation.lost.contains(&true) && tone::is_read(study, candidate.series, &candidate.term) {
        // Where the reading has the line, it gives amplitude and phase too: only whether the shaft shares it is open. (Where
        // it is cut off, it has lines that no one turned.)
        (tone::LINES as f64, 1)
    } else {
        // Every line of a spectrum is its own.
        (tone::frequencies(study.bench.problem.times()), candidate.freedom)
    };
    let effects = (crate::effects::CATALOGUE.len() * study.bench.problem.series.len()) as f64;
    let Ok(law) = ChiSquared::new(freedom as f64) else { return 1.0 };
    (law.sf((2.0 * rise).max(0.0)) * effects * shapes).min(1.0)
}

/// By the held-out error where that tells them apart, else by the held-out likelihood, which tells more finely.
fn rank(refits: &mut Vec<Refit>) {
    let mut left = std::mem::take(refits);
    while let Some(lowest) = left.iter().min_by(|a, b| a.excess.total_cmp(&b.excess)) {
        let close = |r: &Refit| {
            let nearly = lowest.excess.max(r.excess) < ROUGH;
            let (mean, spread) = lowest.against(r);
            r.excess <= lowest.excess || nearly && (r.excess <= lowest.excess * (1.0 + CLOSE) || mean < 2.0 * spread)
        };
        let best = (0..left.len())
            .filter(|&k| close(&left[k]))
            .max_by(|&a, &b| left[a].held_out.0.total_cmp(&left[b].held_out.0))
            .unwrap_or(0);
        refits.push(left.remove(best));
    }
}

/// Drops a resonance where a tone of its frequency does as well: what the motion sets ringing does not ring in one phase
/// throughout the log, while the inverse of a resonance is a notch, which takes out any line.
fn drop_driven(refits: &mut Vec<Refit>) {
    let is = |r: &Refit, id: &str| r.candidate.term.effect.card().id == id;
    let frequency = |r: &Refit| {
        let cards = r.candidate.term.effect.parameters(Axis::X);
        cards.iter().position(|card| card.unit == "Hz").map_or(f64::NAN, |k| r.candidate.term.values[k])
    };
    let (mut resonances, others): (Vec<Refit>, Vec<Refit>) =
        std::mem::take(refits).into_iter().partition(|r| is(r, "mount-resonance"));
    let drives = |tone: &Refit, r: &Refit| {
        is(tone, "vibration-tone")
            && tone.candidate.series == r.candidate.series
            && (frequency(r) / frequency(tone) - 1.0).abs() < NEAR_A_TONE
            && tone.equals(r)
    };
    resonances.retain(|r| !others.iter().any(|tone| drives(tone, r)));
    *refits = others;
    refits.append(&mut resonances);
}

/// How near to a tone's the frequency of a resonance is that was fitted to it.
const NEAR_A_TONE: f64 = 0.1;

/// Puts before the best what cannot be told from it and is plainer: fewer parameters, or a measured channel instead of
/// a free shape.
fn prefer_plainer(refits: &mut [Refit], present: &Present) {
    let Some(best) = refits.first() else { return };
    let measured = |r: &Refit| !r.candidate.term.effect.card().needs.is_empty();
    let plainer = (1..refits.len()).find(|&k| {
        let r = &refits[k];
        let simpler = r.candidate.freedom < best.candidate.freedom || (measured(r) && !measured(best));
        r.candidate.series == best.candidate.series
            && simpler
            && (r.significant() || r.passes(present))
            && (best.alike(r) || best.hardly_beats(r))
    });
    if let Some(k) = plainer {
        refits[..=k].rotate_right(1);
    }
}

impl Refit<'_> {
    /// Share of the held-out excess that it removes; `None` where there is none.
    #[must_use]
    pub fn share(&self, present: &Present) -> Option<f64> {
        (present.excess > 1.0).then(|| (present.excess - self.excess) / (present.excess - 1.0))
    }

    /// Whether it is significant, holds on data it was not fitted on, and matters.
    #[must_use]
    pub fn passes(&self, present: &Present) -> bool {
        if self.candidate.term.effect.stage() == Stage::Reading {
            return true;
        }
        // A tone that the gyro's own spectrum shows is real however little it moves the angle. Beside effects that were
        // added, whose forms are right to a small share of what they remove, so small a fall may be what they left.
        let tone = self.candidate.term.effect.card().id == "vibration-tone";
        let relevant = match (tone, present.is_base(self.candidate.series)) {
            (true, _) => -0.01,
            (false, true) => 0.0,
            (false, false) => RELEVANT,
        };
        if self.at_bound() || self.excess >= present.excess * (1.0 - relevant) {
            return false;
        }
        if self.p_value >= GATE && !self.dominates(present) {
            return false;
        }
        if present.excess > UNEVEN && self.share(present).is_none_or(|s| s < SHARE) {
            return false;
        }
        if self.excess > ROUGH && (self.is_outsized() || tone && self.share(present).is_none_or(|s| s < DOMINATES)) {
            return false;
        }
        // What shows at one instant (a step) cannot be held out block by block in likelihood, but in the error it can.
        let throughout = self.held_out.0 > 1.5 * self.held_out.1 || self.fall.0 > 2.0 * self.fall.1;
        let holds = self.held_out.0 > 0.25 * self.rise.min(40.0) && throughout;
        (holds || self.fall.0 > 4.0 * self.fall.1)
            && (!one_shot(self) || self.p_value < ONE_SHOT || self.dominates(present))
    }

    /// Whether a coefficient is far beyond what such sensors have: where much is left unexplained, the fit bends whatever
    /// can be bent.
    fn is_outsized(&self) -> bool {
        let axis = self.study.bench.problem.series[self.candidate.series].axis;
        let term = &self.candidate.term;
        let pairs = term.effect.parameters(axis).iter().zip(&term.values);
        pairs
            .filter(|(card, _)| card.role == Role::Linear && card.typical != 0.0)
            .any(|(card, v)| v.abs() > OUTSIZED * card.typical.abs())
    }

    /// Whether it removes much of an error that is far beyond what a gyro's own wander makes, throughout the log. Other
    /// missing physics inflates the identified noise until a slow effect drowns in it; the error itself does not lie.
    fn dominates(&self, present: &Present) -> bool {
        present.excess > ROUGH
            && present.gls.noise.beyond_wander()
            && self.share(present).is_some_and(|s| s > DOMINATES)
            && self.fall.0 > 4.0 * self.fall.1
    }

    /// Whether a parameter ran to the end of what is physical: the fit looks for something else.
    pub(super) fn at_bound(&self) -> bool {
        let series = &self.study.bench.problem.series[self.candidate.series];
        let span = series.span();
        let nyquist = 0.5 / span.dt;
        // A step has to be seen from both sides.
        let (first, last) = (series.t[0] + ENDS * span.duration, series.t[0] + (1.0 - ENDS) * span.duration);
        let term = &self.candidate.term;
        let fitted =
            term.effect.parameters(series.axis).iter().zip(&term.values).filter(|(c, _)| c.role != Role::Chosen);
        fitted.into_iter().any(|(card, &v)| {
            if card.name == "t0" && !(first..last).contains(&v) {
                return true;
            }
            let near = |bound: f64| bound.is_finite() && (v - bound).abs() <= 1e-6 * bound.abs().max(1e-12);
            near(card.bounds.0) || near(card.bounds.1) || (card.unit == "Hz" && v > nyquist)
        })
    }

    /// Whether noise alone would hardly do as well, and it lowers the error.
    #[must_use]
    pub fn significant(&self) -> bool {
        self.p_value < GATE && (self.held_out.0 > 0.0 || self.fall.0 > 4.0 * self.fall.1) && !self.at_bound()
    }

    /// Whether this log cannot tell it from `other`: both their held-out likelihoods and their held-out errors differ by
    /// less than two standard errors over the blocks, or by less than either is found to.
    #[must_use]
    pub fn alike(&self, other: &Refit) -> bool {
        let gains: Vec<f64> = self.gains.iter().zip(&other.gains).map(|(a, b)| a - b).collect();
        let (difference, error) = total(&gains);
        let (mean, spread) = self.against(other);
        difference.abs() < FOUND_TO.0.max(2.0 * error)
            && gains.len() == BLOCKS
            && mean.abs() < FOUND_TO.1.max(2.0 * spread)
    }

    /// Whether it does as well as `other`: better, or alike.
    fn equals(&self, other: &Refit) -> bool {
        self.alike(other) || (self.excess <= other.excess && self.held_out.0 >= other.held_out.0)
    }

    /// Whether it belongs in the place of the effect that `present` has and it has not: by likelihood where both are
    /// nearly right, and never with more error.
    #[must_use]
    pub fn replaces(&self, present: &Present) -> bool {
        let nearly = self.excess.max(present.excess) < ROUGH;
        nearly
            && !self.at_bound()
            && self.excess <= (1.0 + CLOSE) * present.excess
            && self.gls.log_likelihood > present.gls.log_likelihood + PARAMETER
    }

    /// Rise of ln L less what its parameters are worth, to choose among some that are all good enough.
    #[must_use]
    pub fn worth(&self) -> f64 {
        self.rise - PARAMETER * self.candidate.freedom as f64
    }

    /// Whether, both being nearly right, its likelihood is not worth a parameter more than that of `other`.
    fn hardly_beats(&self, other: &Refit) -> bool {
        self.excess.max(other.excess) < ROUGH
            && other.excess < (1.0 + SHARE) * self.excess
            && self.rise - other.rise < PARAMETER
    }

    /// ln(J_other/J_self) over the blocks: mean and standard error.
    #[must_use]
    pub fn against(&self, other: &Refit) -> (f64, f64) {
        let logs: Vec<f64> =
            self.falls.iter().zip(&other.falls).filter_map(|(a, b)| Some(a.as_ref()? - b.as_ref()?)).collect();
        mean(&logs)
    }
}

/// What an optimum's ln L and ln J are found to: two shapes of one motion may differ by less, and always to the same side.
const FOUND_TO: (f64, f64) = (0.25, 1e-3);
/// J above which the noise is not all there is: likelihoods then trust a wrong model, and the held-out error decides.
const ROUGH: f64 = 1.5;
/// Significance that an effect needs which shows once in a log (a warming, a drift, a step): the bias of such sensors
/// wanders, and a wander is easily taken for it.
const ONE_SHOT: f64 = 1e-5;
/// J above which something is left that is not noise.
pub(super) const UNEVEN: f64 = 1.2;
/// Share of the held-out excess that an effect has to remove there.
const SHARE: f64 = 0.1;
/// Share of J that an effect has to remove beside others.
const RELEVANT: f64 = 4e-3;
/// Times its typical size that a coefficient may have while much is left unexplained.
const OUTSIZED: f64 = 20.0;
/// Share of the log at its ends where no step is looked for.
const ENDS: f64 = 0.05;
/// Rise of ln L that one more parameter is worth (half the logarithm of some thousand readings).
const PARAMETER: f64 = 4.0;
/// Held-out errors that differ by less than this share count as equal.
const CLOSE: f64 = 0.03;
/// Share of the held-out excess that makes up for a likelihood that drowns it.
const DOMINATES: f64 = 0.4;
/// Times what undoing a response gains on white noise that it has to gain: noise that grows with the rate gains more.
const SHAPES: f64 = 2.0;
/// Draws of noise alone that a response is undone on.
const SHAPED: u64 = 4;
/// Share of draws that white noise leaves below what the largest is compared with.
const RARE: f64 = 0.99;
/// Draws of noise alone.
const DRAWS: u64 = 20;

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
