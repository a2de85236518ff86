//! Random causes: errors of random size and sign, of which only the variance follows the motion.
//!
//! An effect of the catalogue is a function of the motion: the same motion makes the same error. Of a random cause only the size of
//! the error can be foretold: each reversal adds a step of random size, each hole of the log what was missed. The increments y of the
//! angle error over windows of several lengths are looked at. The variance of each is a sum,
//!
//! ```text
//! Var y = level of its length + σ_t² (ω² at both ends) + steps of the reference + Σ over causes, forms of c z        c ≥ 0
//! ```
//!
//! with z known from the motion and the time stamps alone. Whatever noise is the same all through the log is in the levels, one free
//! level a length. So a cause is named only if the error is larger just where the cause acts: by its likelihood ratio, tested at the
//! boundary (½χ²₀ + ½χ², Self and Liang 1987), corrected for the number of causes, and on blocks that it was not fitted on.

mod cause;
mod components;
mod course;
mod joint;

use crate::{
    evidence::{series::Rest, study::Study},
    nls::Normal,
    parallel,
    statistics::Estimate,
    thresholds as limit,
};
pub(crate) use cause::{Cause, SLOWLY};
use components::{BLOCKS, Components, Squares};
pub(crate) use course::ErrorOf;
use course::{Course, Window};
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// Windows of one length at most.
const WINDOWS: usize = 600;
/// Rows of the shortest, and share of the log that the longest lasts.
const SHORTEST: f64 = 8.0;
const LONGEST: f64 = 1.0 / 15.0;
/// Windows that one length needs.
const FEWEST: usize = 15;
/// Steps of a reference that are tried where none are seen, over the way that it turns in one of the shortest windows.
const STEPS: [f64; 3] = [0.25, 1.0, 4.0];
/// How often the same error is counted: windows overlap by half, and each length holds those of half its own.
const ALIKE: f64 = 4.0;

/// A random cause that was found.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    /// Which.
    pub cause: Cause,
    /// Its size and standard error.
    pub size: Estimate,
    /// Events in the log, where it is made of events.
    pub count: Option<u64>,
    /// Others that would explain the same nearly as well in its place.
    pub aliases: Vec<Cause>,
    /// Whether it changes over [`SLOWLY`] s and longer, most of it.
    pub is_slow: bool,
    /// Share of the angle error's mean square that it makes over each averaging time. In an attitude, errors of one axis turn into the others'
    /// while the body turns; the share is of what the axis itself adds.
    pub shares: Vec<f64>,
}

/// The random causes of one axis' error.
#[derive(Default)]
pub(crate) struct Random {
    /// Those that were found, the largest first.
    pub found: Vec<Found>,
    /// The error, where there is enough of it.
    course: Option<Course>,
}

impl Random {
    /// Of one axis of a study; `tau` are the averaging times of its error curve.
    #[must_use]
    pub(crate) fn of(study: &Study, series: usize, error: ErrorOf, tau: &[f64]) -> Self {
        // Beside a reference that rests there is no motion that a cause could go with.
        if study.bench.problem.series[series].rest != Rest::None {
            return Self::default();
        }
        let course = Course::of(study, series, error).filter(|course| course.t.len() >= FEWEST * SHORTEST as usize);
        course.and_then(Trial::new).map_or_else(Self::default, |trial| trial.random(tau))
    }

    /// What ln L ([`joint`]) gains from this error to that of a model `with` one effect more, beside the random causes of either.
    #[must_use]
    pub(crate) fn gain(&self, with: &Self) -> Option<f64> {
        let found = |cause: &Cause| self.found.iter().chain(&with.found).any(|found| found.cause == *cause);
        let causes: Vec<Cause> = Cause::ALL.into_iter().filter(found).collect();
        let log_likelihood = |of: &Self| joint::log_likelihood(of.course.as_ref()?, with.course.as_ref()?, &causes);
        let (with, own) = parallel::both(|| log_likelihood(with), || log_likelihood(self));
        Some(with? - own?)
    }

    /// Whether there is one.
    #[must_use]
    pub(crate) fn has_found(&self) -> bool {
        !self.found.is_empty()
    }

    /// The cause's share of the mean square error over averaging time `k`.
    #[must_use]
    pub(crate) fn share(&self, cause: Cause, k: usize) -> f64 {
        self.found.iter().filter(|found| found.cause == cause).map(|found| found.shares[k]).sum()
    }
}

/// Whether chance alone gives so many parameters such a gain in ln L too often (χ²).
#[must_use]
pub(crate) fn is_by_chance(gain: f64, parameters: usize) -> bool {
    ChiSquared::new(parameters as f64).map_or(1.0, |law| law.sf(2.0 * gain.max(0.0))) > limit::PLAIN.value
}

/// The windows of a log, and the causes that may act there.
struct Trial {
    course: Course,
    squares: Squares,
    causes: Vec<Cause>,
    /// Columns that are no cause's.
    always: usize,
    /// The first column of each cause.
    first: Vec<usize>,
}

impl Trial {
    fn new(course: Course) -> Option<Self> {
        let span = course.t.last()? - course.t.first()?;
        let lengths = std::iter::successors(Some(SHORTEST * course.dt), |length| Some(2.0 * length));
        let lengths: Vec<Vec<Window>> = lengths
            .take_while(|length| *length < LONGEST * span)
            .map(|length| course.windows(length, WINDOWS))
            .take_while(|windows| windows.len() >= FEWEST)
            .collect();
        if lengths.len() < 2 {
            return None;
        }
        let causes: Vec<Cause> = Cause::ALL.into_iter().filter(|cause| cause.may_act(&course)).collect();
        let windows: Vec<(usize, Window)> =
            lengths.iter().enumerate().flat_map(|(k, own)| own.iter().map(move |window| (k, *window))).collect();
        let step = |window: &Window| course.error[window.to] - course.error[window.from];
        let square: Vec<f64> = windows.iter().map(|(_, window)| step(window).powi(2)).collect();
        let usual: Vec<f64> = lengths
            .iter()
            .map(|own| own.iter().map(|window| step(window).powi(2)).sum::<f64>() / own.len() as f64)
            .collect();
        if usual.iter().any(|usual| !usual.is_finite() || *usual <= 0.0) {
            return None;
        }
        let ends = |w: &Window| course.rate[w.from].powi(2) + course.rate[w.to].powi(2);
        let way = |w: &Window| course.travelled[w.to] - course.travelled[w.from];
        // Noise that a reference has only while it turns, by its steps: where these are not known, of several sizes.
        let usual_way = lengths[0].iter().map(way).sum::<f64>() / lengths[0].len() as f64;
        let steps = if course.count > 0.0 { vec![course.count] } else { STEPS.map(|share| share * usual_way).to_vec() };
        let counts = |w: &Window, step: f64| if step > 0.0 { (way(w) / step).min(1.0) } else { 0.0 };
        let mut columns: Vec<Vec<f64>> = (0..lengths.len())
            .map(|length| windows.iter().map(|(own, _)| f64::from(*own == length)).collect())
            .collect();
        columns.push(windows.iter().map(|(_, window)| ends(window)).collect());
        for step in steps {
            columns.push(windows.iter().map(|(_, window)| counts(window, step)).collect());
        }
        let (always, mut first) = (columns.len(), Vec::new());
        for cause in &causes {
            first.push(columns.len());
            let forms: Vec<Vec<f64>> = windows.iter().map(|(_, window)| cause.forms(&course, *window)).collect();
            columns.extend((0..cause.count()).map(|form| forms.iter().map(|forms| forms[form]).collect()));
        }
        let start = course.t[0];
        let block = |window: &Window| {
            let share = (course.t[window.from] - start) / span;
            ((share * BLOCKS as f64) as usize).min(BLOCKS - 1)
        };
        let block = windows.iter().map(|(_, window)| block(window)).collect();
        // An encoder at rest may show one count more at any time.
        let count = course.count.powi(2) / 12.0;
        let least = windows.iter().map(|(length, _)| (LEAST * usual[*length]).max(count)).collect();
        let error = windows.iter().map(|(_, window)| step(window)).collect();
        let over = |summed: &[f64]| windows.iter().map(|(_, w)| summed[w.to] - summed[w.from]).collect();
        let fitted = [over(&course.turned), over(&course.t), over(&course.rate), over(&course.acceleration())];
        let mut trial = Self { squares: Squares { square, columns, block, least }, course, causes, always, first };
        trial.free_of_fit(error, &fitted);
        Some(trial)
    }

    /// Frees the windows of what the fit of scale, bias and delay made of the random errors: it weights all rows equally, so that a few
    /// large steps move it, and what that makes of the error is correlated with the motion. So is what a slow or late sensor makes of a change of
    /// the acceleration, of second order in its time, which would pass for a step at each start and stop. With the variances V of all causes
    /// (generalised least squares)
    ///
    /// ```text
    /// y − X (Xᵀ V⁻¹ X)⁻¹ Xᵀ V⁻¹ y,   X = [∫ω dt, Δt, Δω, Δω′] of each window
    /// ```
    fn free_of_fit(&mut self, mut error: Vec<f64>, fitted: &[Vec<f64>]) {
        let causes: Vec<usize> = (0..self.causes.len()).collect();
        for _ in 0..ROUNDS {
            let weight: Vec<f64> = self.with(&causes).variances.iter().map(|v| v.sqrt().recip()).collect();
            let weighted = |column: &Vec<f64>| -> Vec<f64> { column.iter().zip(&weight).map(|(x, w)| x * w).collect() };
            let columns: Vec<Vec<f64>> = fitted.iter().map(weighted).collect();
            let mut normal = Normal::zeros(columns.len());
            normal.add(&weighted(&error), &columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
            let (_, step) = normal.rise(1e-10);
            for (column, step) in fitted.iter().zip(step) {
                error.iter_mut().zip(column).for_each(|(y, x)| *y += step * x);
            }
            self.squares.square = error.iter().map(|y| y * y).collect();
        }
    }

    /// The components with these causes alone.
    fn with(&self, causes: &[usize]) -> Components {
        let own =
            |j: usize| causes.iter().any(|&c| (self.first[c]..self.first[c] + self.causes[c].count()).contains(&j));
        let used: Vec<bool> = (0..self.squares.columns.len()).map(|j| j < self.always || own(j)).collect();
        self.squares.components(&used)
    }

    /// Backward elimination: of the causes that may act, the least is left out until each of the rest is needed. What looked like another
    /// one may have gone in its place: each that was left out is tried once more beside those that stayed, and so on.
    fn random(self, tau: &[f64]) -> Random {
        let mut causes: Vec<usize> = (0..self.causes.len()).collect();
        let mut all = self.with(&causes);
        for _ in 0..=self.causes.len() {
            while let Some((least, rest)) = self.least(&causes, &all) {
                causes.retain(|c| *c != least);
                all = rest;
            }
            let Some((best, with)) = self.best(&causes, &all) else { break };
            causes.push(best);
            all = with;
        }
        let named = causes.iter().filter(|&&c| self.causes[c].may_show(&self.course));
        let found = named.map(|&c| Found { aliases: self.aliases(c, &causes, &all), ..self.found(c, &all, tau) });
        // One that makes less than half of what may have no known cause, at every averaging time, limits nothing.
        let is_much = |share: &f64| *share > 0.5 * limit::EXPLAINED.value;
        let is_named = |found: &Found| found.shares.is_empty() || found.shares.iter().any(is_much);
        let mut found: Vec<Found> = found.filter(|found| found.size.value > 0.0 && is_named(found)).collect();
        let last = |found: &Found| found.shares.last().copied().unwrap_or(0.0);
        found.sort_by(|a, b| last(b).total_cmp(&last(a)));
        Random { found, course: Some(self.course) }
    }

    /// Of some causes the one that gains least, where it is not needed, and the components without it.
    fn least(&self, causes: &[usize], all: &Components) -> Option<(usize, Components)> {
        let without = |&c: &usize| {
            let rest: Vec<usize> = causes.iter().copied().filter(|other| *other != c).collect();
            (c, self.with(&rest))
        };
        let unneeded = causes.iter().map(without).filter(|(c, rest)| !self.is_needed(*c, all, rest));
        unneeded.max_by(|a, b| sum(&a.1.log_likelihood).total_cmp(&sum(&b.1.log_likelihood)))
    }

    /// Of the others the one that gains most, where one is needed, and the components with it.
    fn best(&self, causes: &[usize], all: &Components) -> Option<(usize, Components)> {
        let open = (0..self.causes.len()).filter(|c| !causes.contains(c));
        let needed =
            open.map(|c| (c, self.with(&[causes, &[c]].concat()))).filter(|(c, with)| self.is_needed(*c, with, all));
        needed.max_by(|a, b| sum(&a.1.log_likelihood).total_cmp(&sum(&b.1.log_likelihood)))
    }

    /// Those of the other causes that take the place of this one at nearly the same likelihood.
    fn aliases(&self, cause: usize, causes: &[usize], all: &Components) -> Vec<Cause> {
        let in_its_place =
            |other: usize| -> Vec<usize> { causes.iter().map(|&c| if c == cause { other } else { c }).collect() };
        let loses =
            |other: usize| (sum(&all.log_likelihood) - sum(&self.with(&in_its_place(other)).log_likelihood)) / ALIKE;
        let others = (0..self.causes.len())
            .filter(|other| !causes.contains(other) && self.causes[*other].may_show(&self.course));
        others.filter(|&other| loses(other) < NEARLY).map(|other| self.causes[other]).collect()
    }

    /// Whether noise alone would rarely gain as much, and the gain holds where it was not fitted.
    fn is_needed(&self, cause: usize, with: &Components, without: &Components) -> bool {
        let gain = (sum(&with.log_likelihood) - sum(&without.log_likelihood)) / ALIKE;
        let chance =
            ChiSquared::new(self.causes[cause].count() as f64).map_or(1.0, |law| 0.5 * law.sf(2.0 * gain.max(0.0)));
        // What events make is in a few blocks: one of them decides no more than BLOCK_COUNTED.
        let pairs = with.held_out.iter().zip(&without.held_out);
        let counted = pairs.map(|(a, b)| ((a - b) / ALIKE).clamp(-BLOCK_COUNTED, BLOCK_COUNTED));
        let held = Estimate::sum(&counted.collect::<Vec<_>>());
        chance * (Cause::ALL.len() as f64) < limit::SIGNIFICANCE.value
            && held.in_errors() > limit::HELD_OUT.value
            && held.value > limit::HOLDS.value * gain.min(limit::GAIN_COUNTED.value)
    }

    fn found(&self, cause: usize, all: &Components, tau: &[f64]) -> Found {
        let (of, first) = (self.causes[cause], self.first[cause]);
        let columns: Vec<usize> = (first..first + of.count()).collect();
        let means: Vec<f64> = columns.iter().map(|&j| sum(&self.squares.columns[j])).collect();
        let weights = of.size_weights(&means, &self.course);
        let square: f64 = columns.iter().zip(&weights).map(|(&j, w)| w * all.values[j]).sum();
        let pairs = |i: usize| (0..columns.len()).map(move |j| (i, j));
        let variance: f64 = (0..columns.len())
            .flat_map(pairs)
            .map(|(i, j)| weights[i] * weights[j] * all.covariance[columns[i]][columns[j]])
            .sum();
        let size = square.max(0.0).sqrt();
        let std_error = (ALIKE * variance.max(0.0)).sqrt() / (2.0 * size);
        let share = |tau: &f64| {
            let windows = self.course.windows(*tau, WINDOWS);
            let makes = |window: &Window| -> f64 {
                of.forms(&self.course, *window).iter().zip(&columns).map(|(z, &j)| z * all.values[j]).sum()
            };
            let square = |w: &Window| (self.course.error[w.to] - self.course.error[w.from]).powi(2);
            windows.iter().map(makes).sum::<f64>() / windows.iter().map(square).sum::<f64>().max(f64::MIN_POSITIVE)
        };
        Found {
            cause: of,
            size: Estimate { value: size, std_error },
            count: of.events(&self.course),
            aliases: Vec::new(),
            is_slow: of == Cause::RandomScale && columns.last().is_some_and(|&j| all.values[j] > 0.5 * square),
            shares: tau.iter().map(share).collect(),
        }
    }
}

/// Loss in ln L up to which another cause explains the same nearly as well: odds of 20 to 1.
const NEARLY: f64 = 3.0;
/// Largest gain in ln L of one block: odds of 150 to 1.
const BLOCK_COUNTED: f64 = 5.0;
/// Rounds in which variances and what the fit made of the errors are found in turn.
const ROUNDS: usize = 2;
/// Share of the mean square of its length that the variance of a window is at least.
const LEAST: f64 = 1e-3;

fn sum(values: &[f64]) -> f64 {
    values.iter().sum()
}
