//! A suspect refitted exactly, and what that is worth.

use super::{Options, averages::is_mean, chance::chance};
use crate::{
    Model, Term,
    effects::{Effect, Stage},
    evidence::{
        draws::draw_through,
        identify,
        increments::BLOCKS as BLOCKS_OF_INCREMENTS,
        noise::{self, Gls},
        series::Series,
        study::Study,
        warm::Warm,
        whiten::NoiseModel,
    },
    nls, parallel,
    record::ReferenceKind,
    scan::{Candidate, Scanner, draws_of_noise, scan_for, with_term_throughout},
    statistics::Estimate,
    thresholds as limit,
};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::sync::OnceLock;

/// The incumbent model: what suspects are measured against.
#[derive(Clone, Debug)]
pub(crate) struct Incumbent<'a> {
    /// Fitted.
    pub study: Study<'a>,
    /// Whitened draws of noise alone, once they are asked for.
    draws: OnceLock<Vec<Vec<Vec<f64>>>>,
    /// Its noise and likelihood.
    pub gls: Gls,
    /// What it is worth, axis by axis.
    measures: Vec<Measure>,
    /// The same by fewer readings.
    seldom: OnceLock<Box<Self>>,
    /// What the scan found for it.
    scanned: OnceLock<Vec<Candidate>>,
}

/// What a fitted model is worth, its error being that about one axis.
#[derive(Clone, Debug)]
struct Measure {
    log_likelihood: f64,
    held_out: Vec<f64>,
    excess: f64,
    /// E/F, averaging time by averaging time.
    curve: Vec<f64>,
    blocks: Vec<Option<f64>>,
}

impl Measure {
    fn of(study: &Study, gls: &Gls, series: usize) -> Self {
        let (held, weights) = study.held_out_about(series);
        Self {
            log_likelihood: gls.log_likelihood,
            held_out: gls.held_out.clone(),
            excess: held.excess(&weights),
            curve: held.curve().iter().zip(&weights).map(|(error, floor)| error / floor).collect(),
            blocks: held.by_block(&weights),
        }
    }

    /// The same with the noise that was taken out of it: what the motion says is left.
    fn with_noise(&mut self, shaped: &Shaped, floor: &[f64]) {
        let over_floor: Vec<f64> = shaped.takes.iter().zip(floor).map(|(takes, floor)| takes / floor.powi(2)).collect();
        let mean = over_floor.iter().sum::<f64>() / over_floor.len() as f64;
        self.excess += mean;
        self.blocks.iter_mut().flatten().for_each(|block| *block += mean);
        self.curve.iter_mut().zip(&over_floor).for_each(|(curve, takes)| *curve = (curve.powi(2) + takes).sqrt());
        let blocks = self.held_out.len() as f64;
        self.held_out.iter_mut().for_each(|held_out| *held_out -= shaped.gain / blocks);
    }
}

/// What undoing a response, or comparing with what a reference shows, does to noise alone.
#[derive(Debug, Default)]
struct Shaped {
    /// Gain in ln L.
    gain: f64,
    /// What it takes out of E², averaging time by averaging time, (rad/s)².
    takes: Vec<f64>,
}

/// One suspect at its exact optimum.
#[derive(Clone, Debug)]
pub(crate) struct Challenger<'a> {
    /// Where it came from.
    pub candidate: Candidate,
    /// The model with it, fitted.
    pub study: Study<'a>,
    /// Noise and likelihood with it.
    pub gls: Gls,
    /// J of its axis with it (on the samples of the incumbent model).
    pub excess: f64,
    /// J on the samples that it does not leave out.
    pub(super) kept: f64,
    /// The most that E grows by at any averaging time, beyond what noise leaves there.
    pub(super) grows: f64,
    /// Rise of ln L.
    pub rise: f64,
    /// How much noise alone raises ln L beyond what white noise would.
    pub inflation: f64,
    /// Gain in ln L on blocks that were not fitted, their sum.
    pub held_out: Estimate,
    /// Chance of such a rise from noise, priced for the whole search.
    pub p_value: f64,
    /// Fall of the held-out error, ln(J₀/J₁), mean over the blocks.
    pub fall: Estimate,
    /// Whether it makes the noise less too.
    pub(super) is_mean: bool,
    /// Rise of the held-out ln L, block by block.
    pub(super) gains: Vec<f64>,
    /// ln(J₀/J₁), block by block.
    pub(super) falls: Vec<Option<f64>>,
}

impl<'a> Incumbent<'a> {
    /// Takes a fitted model's measure.
    #[must_use]
    pub(crate) fn new(study: Study<'a>) -> Self {
        let gls = study.identify();
        Self::with(study, gls)
    }

    /// The same beside a noise that is known to be near.
    #[must_use]
    pub(crate) fn near(study: Study<'a>, noise: &NoiseModel) -> Self {
        let gls = study.identify_near(noise);
        Self::with(study, gls)
    }

    /// The same with the noise known.
    #[must_use]
    pub(crate) fn with(study: Study<'a>, gls: Gls) -> Self {
        let measures = (0..study.bench.problem.series.len()).map(|k| Measure::of(&study, &gls, k)).collect();
        Self { study, draws: OnceLock::new(), gls, measures, seldom: OnceLock::new(), scanned: OnceLock::new() }
    }

    fn draws(&self) -> &[Vec<Vec<f64>>] {
        self.draws.get_or_init(|| draws_of_noise(&self.study, &self.gls))
    }

    /// The same model judged by what a suspect can be told from: undoing a delay or a response is a filter, and beside a
    /// reference that is a rate, as fast and as noisy as the gyro, nothing hides what that makes of the noise from one row
    /// to the next. Over many rows the noise adds up to what it was, and the motion is still there.
    pub(super) fn beside(&self, effect: &dyn Effect, series: usize) -> &Self {
        let series = &self.study.bench.problem.series[series];
        if self.study.every > 1 || !effect.is_of_whole_sensor() || series.kind != ReferenceKind::Rate {
            return self;
        }
        let t = &series.reference_t;
        let often = series.readings.len() as f64 / (t[t.len() - 1] - t[0]);
        let every = (often / SELDOM).round().max(1.0) as usize;
        self.seldom.get_or_init(|| Box::new(Incumbent::near(self.study.clone().reading(every), &self.gls.noise)))
    }

    /// J, the mean over τ of (E/F)², held out, of one axis.
    #[must_use]
    pub(crate) fn excess(&self, series: usize) -> f64 {
        self.measures[series].excess
    }

    /// How much more noise alone raises ln L along the columns of the terms that `refit` has more than white noise of one size
    /// would: an encoder's quantisation under a regular motion is anything but white, and noise that grows with the rate
    /// is not everywhere the same.
    fn inflation(&self, refit: &Study) -> f64 {
        let n = self.draws().len() as f64;
        let (normal, whitener) = noise::normal(refit, &self.gls.noise);
        let (all, _) = nls::invert_observable(&normal.matrix, 1e-10);
        let own: Vec<bool> = refit.slots.iter().map(|slot| slot.term >= self.terms(slot.series)).collect();
        let rest: Vec<usize> = (0..own.len()).filter(|&k| !own[k]).collect();
        let few = faer::Mat::from_fn(rest.len(), rest.len(), |i, j| normal.matrix[(rest[i], rest[j])]);
        let (few, _) = nls::invert_observable(&few, 1e-10);
        let columns: Vec<Vec<Vec<f64>>> = refit.columns.iter().map(|c| whitener.apply_each(c)).collect();
        let (mut sum, mut largest) = (0.0, 0.0_f64);
        for draw in self.draws() {
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
        let residual = whitener.apply_each(&refit.as_read());
        let uneven = noise::unevenness(&columns, &residual, &all);
        let uneven = uneven.iter().zip(&own).filter(|(_, own)| **own).map(|(u, _)| u).sum::<f64>() / (2.0 * usual);
        (sum / n / usual).max(largest / rare).max(uneven).max(1.0)
    }

    /// How many terms its model of an axis has.
    fn terms(&self, series: usize) -> usize {
        let axis = self.study.bench.problem.series[series].axis.index();
        self.study.model.axes[axis].as_ref().map_or(0, |model| model.terms.len())
    }

    /// What undoing a sensor's response does to noise alone: an inverse shapes the reading's noise as well as
    /// its motion, and a notch takes some of it out; and of noise that an inverse made large from one sample to the next,
    /// reading between samples takes some out too. So does comparing with a reference that shows a mean.
    fn shaped(&self, study: &Study, gls: &Gls, candidate: &Candidate) -> Shaped {
        let (bench, series) = (study.bench, candidate.series);
        let axis = bench.problem.series[series].axis.index();
        let [before, after] =
            [&self.study, study].map(|study| study.model.axes[axis].as_ref().map_or(&[][..], |model| &model.terms));
        let shapes = before.iter().any(|term| term.effect.stage() == Stage::Response);
        match candidate.term.effect.stage() {
            Stage::Response | Stage::Shown => {}
            Stage::Timing if shapes => {}
            _ => return Shaped::default(),
        }
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
        // A gyro may be noisier than it was taken for: what the log shows from row to row is noise.
        let channels = &self.study.evaluation.residual;
        let steps = of_steps(&channels[series.min(channels.len() - 1)]);
        let mut shaped = Shaped { gain: 0.0, takes: vec![0.0; bench.windows.tau.len()] };
        for seed in 0..SHAPED {
            let [mut plain, mut undone] = draw_through(bench, series, &study.warm[series], [before, after], seed);
            let larger = (steps / of_steps(&plain)).clamp(1.0, NOISIER);
            plain.iter_mut().chain(&mut undone).for_each(|x| *x *= larger);
            shaped.gain += (likeliest(&plain) - likeliest(&undone)) / SHAPED as f64;
            let [plain, undone] = [plain, undone].map(|noise| bench.windows.mean_squares(&noise));
            for (takes, (plain, undone)) in shaped.takes.iter_mut().zip(plain.iter().zip(&undone)) {
                *takes += (plain - undone) / SHAPED as f64;
            }
        }
        shaped.gain = (shaped.gain * bench.problem.channels() as f64).max(0.0);
        shaped.takes.iter_mut().for_each(|takes| *takes = takes.max(0.0));
        shaped
    }

    /// The score test beside this model.
    pub(super) fn scanner(&self) -> Scanner<'_> {
        Scanner::new(&self.study, &self.gls, self.draws())
    }

    /// What the scan says an effect may begin at: by the likelihood and, where that is another, by the error.
    #[must_use]
    pub(crate) fn starts(&self, effect: &'static dyn Effect, series: usize) -> Vec<Candidate> {
        self.scanner().best(effect, series)
    }

    /// What may be missing, at the shapes to start from: of the catalogue and of the user's own effects, which are the same
    /// throughout a search.
    pub(super) fn scanned(&self, options: &Options) -> &[Candidate] {
        self.scanned.get_or_init(|| scan_for(&self.scanner(), options.own_effects, |_, _| true))
    }

    /// Whether what the model has already makes all that a term could.
    pub(super) fn spans(&self, term: &Term, series: usize) -> bool {
        self.scanner().spans(series, term)
    }

    /// Those suspects of one axis that `wanted` names, refitted beside the others as they stand in `joint`.
    #[must_use]
    pub(crate) fn rivals(
        &self,
        series: usize,
        joint: &Model,
        options: &Options,
        wanted: impl Fn(&str) -> bool,
    ) -> Vec<Challenger<'a>> {
        let mut list: Vec<Candidate> = match self.scanned.get() {
            Some(all) => {
                all.iter().filter(|c| c.series == series && wanted(c.term.effect.card().id)).cloned().collect()
            }
            None => scan_for(&self.scanner(), options.own_effects, |k, id| k == series && wanted(id)),
        };
        list.retain(|c| c.term.effect.stage() != Stage::Reading);
        parallel::map(&list, |candidate| self.refit_beside(candidate.clone(), joint))
    }

    /// A suspect at its exact optimum, held against this model.
    pub(super) fn refit(&self, candidate: Candidate) -> Challenger<'a> {
        self.refit_beside(candidate, &self.study.model)
    }

    /// The same, the other effects setting out from where they stand in `joint`, a model that has the suspect or its like:
    /// without it they have moved to take its place, and may not find back.
    pub(super) fn refit_beside(&self, candidate: Candidate, joint: &Model) -> Challenger<'a> {
        self.beside(candidate.term.effect, candidate.series).refit_there(candidate, joint)
    }

    fn refit_there(&self, candidate: Candidate, joint: &Model) -> Challenger<'a> {
        let trial = self.trial(&candidate, joint);
        self.judged(&trial, candidate)
    }

    /// Candidates that are one and the same model, since what a whole sensor has joins on every axis of an orientation: fitted
    /// once, from `start`, and judged about each axis.
    pub(super) fn refit_throughout(&self, start: &Candidate, each: Vec<Candidate>) -> Vec<Challenger<'a>> {
        let trial = self.trial(start, &self.study.model);
        each.into_iter().map(|candidate| self.judged(&trial, candidate)).collect()
    }

    fn trial(&self, candidate: &Candidate, joint: &Model) -> Trial<'a> {
        let mut model = with_term_throughout(&self.study, candidate.series, &candidate.term);
        stand_as_in(&mut model, joint, candidate.term.effect);
        let every = self.study.every;
        let own = candidate.term.effect.card().id;
        let study = self.study.fit_from(&model, &self.study.frozen()).in_best_form_but(|id| id != own).reading(every);
        let has_more = |(k, s): (usize, &Series)| {
            model.axes[s.axis.index()].as_ref().is_some_and(|model| model.terms.len() > self.terms(k))
        };
        let axes = self.study.bench.problem.series.iter().enumerate().filter(|s| has_more(*s)).count();
        let gls = study.identify_near(&self.gls.noise);
        let (study, gls) = study.refine_tones(gls);
        let without = if study.leaves_out() {
            let warm: Vec<Warm> = self.study.warm.iter().zip(&study.warm).map(|(w, own)| w.without(own)).collect();
            let base = Study::fit(self.study.bench, &self.study.model, Some(&warm)).reading(every);
            let gls = base.identify_near(&self.gls.noise);
            Without::LeftOut(Box::new(base), gls)
        } else {
            identify::likelier(&self.study, &self.gls, &gls.noise).map_or(Without::AsItIs, Without::Likelier)
        };
        let inflation = self.inflation(&study);
        Trial { study, gls, axes, inflation, without }
    }

    fn judged(&self, trial: &Trial<'a>, mut candidate: Candidate) -> Challenger<'a> {
        let Trial { study, gls, axes, inflation, without } = trial;
        let series = candidate.series;
        candidate.freedom *= axes;
        let base = match without {
            Without::AsItIs => self.measures[series].clone(),
            Without::Likelier(gls) => {
                let measure = self.measures[series].clone();
                Measure { log_likelihood: gls.log_likelihood, held_out: gls.held_out.clone(), ..measure }
            }
            Without::LeftOut(base, gls) => Measure::of(base, gls, series),
        };
        let axis = study.bench.problem.series[series].axis;
        if let Some(term) = study.model.axes[axis.index()].as_ref().and_then(|m| m.terms.last()) {
            candidate.term = term.clone();
        }
        let mut own = Measure::of(study, gls, series);
        let shaped = self.shaped(study, gls, &candidate);
        if candidate.term.effect.stage() == Stage::Shown {
            own.with_noise(&shaped, &study.weights(series));
        }
        let read_off = candidate.term.effect.stage() == Stage::Reading;
        let rise =
            if read_off { f64::INFINITY } else { own.log_likelihood - base.log_likelihood - SHAPES * shaped.gain };
        let gains: Vec<f64> = own.held_out.iter().zip(&base.held_out).map(|(a, b)| a - b).collect();
        let held_out = if read_off { Estimate::exact(f64::INFINITY) } else { Estimate::sum(&gains) };
        let falls: Vec<Option<f64>> =
            base.blocks.iter().zip(&own.blocks).map(|(a, b)| Some((a.as_ref()? / b.as_ref()?).ln())).collect();
        let fall = Estimate::mean(&falls.iter().copied().flatten().collect::<Vec<_>>(), BLOCKS_APART);
        let p_value = chance(rise / inflation, &candidate, study);
        let excess = own.excess * self.excess(series) / base.excess;
        let kept = own.excess;
        let pairs = own.curve.iter().zip(&base.curve);
        let grows = pairs.map(|(own, base)| own / base.max(limit::ABOVE.value)).fold(0.0, f64::max);
        let is_mean = is_mean(&candidate.term, study, series);
        Challenger {
            candidate,
            is_mean,
            study: study.clone(),
            gls: gls.clone(),
            excess,
            kept,
            grows,
            rise,
            inflation: *inflation,
            held_out,
            p_value,
            fall,
            gains,
            falls,
        }
    }
}

impl Challenger<'_> {
    /// J and ln L of this suspect on the rows that another one keeps.
    pub(super) fn on_rows_of(&self, other: &Self) -> (f64, f64) {
        let pairs = self.study.warm.iter().zip(&other.study.warm);
        let warm: Vec<Warm> = pairs.map(|(own, other)| own.without(other)).collect();
        let study = Study::fit(self.study.bench, &self.study.model, Some(&warm)).reading(self.study.every);
        let gls = study.identify_near(&other.gls.noise);
        let measure = Measure::of(&study, &gls, self.candidate.series);
        (measure.excess, measure.log_likelihood)
    }
}

/// Root mean square of the steps from row to row.
fn of_steps(series: &[f64]) -> f64 {
    let squares = series.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
    (squares.sum::<f64>() / series.len().max(2) as f64).sqrt()
}

/// The incumbent with one suspect, fitted.
struct Trial<'a> {
    study: Study<'a>,
    gls: Gls,
    /// How many axes it joined on.
    axes: usize,
    inflation: f64,
    without: Without<'a>,
}

/// The incumbent that a trial is held against.
enum Without<'a> {
    /// As it stands.
    AsItIs,
    /// Under the noise that was found beside the suspect, which is the likelier one without it too.
    Likelier(Gls),
    /// On the samples that the suspect does not leave out.
    LeftOut(Box<Study<'a>>, Gls),
}

/// Puts the terms of a model, but those of one effect, where they stand in another one.
fn stand_as_in(model: &mut Model, joint: &Model, but: &dyn Effect) {
    for (own, joint) in model.axes.iter_mut().zip(&joint.axes) {
        let (Some(own), Some(joint)) = (own, joint) else { continue };
        for term in own.terms.iter_mut().filter(|term| term.effect.card().id != but.card().id) {
            if let Some(there) = joint.term(term.effect.card().id) {
                term.values.clone_from(&there.values);
            }
        }
    }
}

/// Blocks that the longest increments reach into: neighbours are alike.
pub(super) const BLOCKS_APART: usize = BLOCKS_OF_INCREMENTS / 10;
/// Readings a second of a reference that is a rate, where undoing a delay or a response filters the noise: many rows of
/// it, and more than a shaft's motion needs.
const SELDOM: f64 = 12.0;
/// Times what undoing a response gains on white noise that it has to gain: noise that grows with the rate gains more.
const SHAPES: f64 = 2.0;
/// Times that the noise of a log may be larger than what its sensors' own signals say.
const NOISIER: f64 = 2.0;
/// Draws of noise alone that a response is undone on.
const SHAPED: u64 = 4;
/// Share of draws that white noise leaves below what the largest is compared with.
const RARE: f64 = 0.99;
