//! One log reduced to its normal equations.
//!
//! ```text
//! r(θ) ≈ r₀ − X (θ − θ₀)        A = XᵀV⁻¹X   b = XᵀV⁻¹r₀   ‖r₀‖² = r₀ᵀV⁻¹r₀
//! ```
//!
//! r is the residual angle, θ₀ the model at which it is linearised, V the covariance of the identified noise. The columns X are those of
//! the model's own parameters and of every effect of the catalogue at fixed shapes. Nothing is bounded: a lag may come out negative,
//! because what is cut off at zero is too large in the mean of many logs.
//!
//! Beside them stand, column by column: the score that noise alone is expected to make (undoing a delay or a response filters the reading's
//! noise, so that the column goes with the noise in the residual; an encoder under a motion that repeats itself errs the same way in every
//! period; else it is zero), and the inflation, the variance of the score of draws of noise alone over
//! what A says.

use super::column::{Column, Key, Taken, is_own, taken};
use crate::{
    Axis, Model, Record, Term,
    effects::{CATALOGUE, Role, Stage, Trait, find},
    evidence::{
        draws::{Draws, draw_through},
        noise,
        problem::Slot,
        study::{Bench, Study},
        whiten::{NoiseModel, Whitener},
    },
    fit::{FitError, calibrated, groups},
    nls::{self, dot},
    scan::{Scanner, Whitened, can_show},
};
use faer::Mat;
use serde::{Deserialize, Serialize};

/// The normal equations of one log, on axes that share a reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Piece {
    /// The axes.
    pub axes: Vec<Axis>,
    /// The columns.
    pub columns: Vec<Column>,
    /// A, the lower triangle row by row.
    pub information: Vec<f64>,
    /// b.
    pub score: Vec<f64>,
    /// What b is expected to be of noise alone.
    pub expected: Vec<f64>,
    /// Variance of the score of noise alone over what A says; at least 1.
    pub inflation: Vec<f64>,
    /// How much J, the mean of (E/F)², grows by with the square of each coefficient.
    pub shows: Vec<f64>,
    /// ‖r₀‖².
    pub squares: f64,
    /// Readings of the reference that count.
    pub readings: u64,
    /// The noise.
    pub noise: Noise,
}

/// The identified noise, as the equations have it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Noise {
    /// N, rad/√s.
    pub angle_random_walk: f64,
    /// B, rad/s/√s.
    pub bias_random_walk: f64,
    /// Of one reading of the reference, rad.
    pub encoder: f64,
    /// Of an exponentially correlated rate, rad/s.
    pub correlated: f64,
    /// How long that lasts, s.
    pub correlation_time: f64,
    /// N that grows with the rate, √s.
    pub rate_random_walk: f64,
}

impl From<&NoiseModel> for Noise {
    fn from(noise: &NoiseModel) -> Self {
        let NoiseModel { angle_random_walk, bias_random_walk, encoder, correlated, correlation_time, rate_random_walk } =
            *noise;
        Self { angle_random_walk, bias_random_walk, encoder, correlated, correlation_time, rate_random_walk }
    }
}

/// The largest error over its floor up to which generalised least squares can be trusted.
const WRONG: f64 = 2.0;
/// Share by which rounding may break an inequality.
const ROUNDED: f64 = 1e-6;
/// How many times the residual's own noise a score of noise alone may be expected to be at most.
const BESIDE: f64 = 10.0;
/// Numbers whose square or inverse square overflows are of no log.
const LARGEST: f64 = 1e150;
/// Draws of noise alone from which inflation and expectation are known.
const DRAWS: u64 = 50;
/// Standard deviations above 1 by which a column's scores of noise alone have to vary more than A says.
const SURE: f64 = 2.0;

fn is_number(value: f64) -> bool {
    value.abs() < LARGEST
}

impl Piece {
    /// A at row `i` and column `j`.
    #[must_use]
    pub fn entry(&self, i: usize, j: usize) -> f64 {
        let (a, b) = (i.max(j), i.min(j));
        self.information[a * (a + 1) / 2 + b]
    }

    /// Where a column stands.
    #[must_use]
    pub fn place(&self, key: &Key) -> Option<usize> {
        self.columns.iter().position(|column| column.key == *key)
    }

    /// What no log makes, in words; `None` where the numbers can be those of a log. They are finite and as many as there have to be, A is
    /// that of real columns, and neither score is larger than its column and a residual allow (Cauchy and Schwarz):
    ///
    /// ```text
    /// A_ij² ≤ A_ii A_jj        b_i² ≤ A_ii ‖r₀‖²
    /// ```
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        let n = self.columns.len();
        let lists: [(&str, &[f64], usize); 5] = [
            ("information", &self.information, n * (n + 1) / 2),
            ("score", &self.score, n),
            ("expected", &self.expected, n),
            ("inflation", &self.inflation, n),
            ("shows", &self.shows, n),
        ];
        for (name, list, length) in lists {
            if list.len() != length || n == 0 {
                return Some(format!("`{name}` has {} numbers for {n} columns", list.len()));
            }
            if let Some(value) = list.iter().find(|value| !is_number(**value)) {
                return Some(format!("`{name}` has {value:e}"));
            }
        }
        if !(self.squares >= 0.0 && is_number(self.squares)) {
            return Some(format!("`squares` is {:e}, and a sum of squares is 0 or more", self.squares));
        }
        // Of white noise of one standard deviation, as many values as were read.
        let of_noise = self.squares.max((self.readings * self.axes.len() as u64) as f64);
        let of_column = |k: usize| -> Option<String> {
            let (own, Column { key, at, .. }) = (self.entry(k, k), &self.columns[k]);
            let at_most = |squares: f64| ((1.0 + ROUNDED) * own * squares).sqrt() + f64::MIN_POSITIVE;
            let what = format!("of {}.{} on axis {}", key.effect, key.name, key.axis);
            if own < 0.0 {
                return Some(format!(
                    "the diagonal of `information` {what} is {own:e}, and a sum of squares is 0 or more"
                ));
            }
            if !is_number(*at) {
                return Some(format!("`at` {what} is {at:e}"));
            }
            let (score, most) = (self.score[k].abs(), at_most(self.squares));
            if score > most {
                return Some(format!("`score` {what} is {score:e}, and column and residual allow {most:e}"));
            }
            let (expected, most) = (self.expected[k].abs(), BESIDE * at_most(of_noise));
            if expected > most {
                return Some(format!("`expected` {what} is {expected:e}, and column and noise allow {most:e}"));
            }
            if self.inflation[k] < 1.0 || self.shows[k] < 0.0 {
                return Some(format!("`inflation` or `shows` {what} is too small"));
            }
            let too_large = (0..k)
                .find(|&j| self.entry(k, j).powi(2) > (1.0 + ROUNDED) * own * self.entry(j, j) + f64::MIN_POSITIVE);
            too_large.map(|j| {
                let other = &self.columns[j].key;
                format!("`information` {what} with {}.{} is more than both columns allow", other.effect, other.name)
            })
        };
        (0..n).find_map(of_column)
    }

    /// Whether it has numbers that a log can make.
    #[must_use]
    pub fn is_whole(&self) -> bool {
        self.fault().is_none()
    }

    fn of(study: &Study, seed: u64, over: Over) -> Self {
        let gls = study.identify();
        let scanner = Scanner::new(study, &gls, &[]);
        let whitener = noise::whitener(study, &gls.noise);
        let mut columns = own_columns(study);
        let mut of_noise: Vec<Mean> = if over == Over::TheModel {
            vec![Mean::NOTHING; columns.len()]
        } else {
            study.slots.iter().map(|slot| of_own(study, slot, &whitener, seed)).collect()
        };
        let Whitened { residual, columns: own, increments: coarse } = scanner.own();
        let (mut white, mut coarse) = (own.to_vec(), coarse.to_vec());
        let mut plain = study.columns.clone();
        for (index, series) in study.bench.problem.series.iter().enumerate() {
            for effect in CATALOGUE {
                let present = study.model.axes[series.axis.index()]
                    .as_ref()
                    .is_some_and(|own| own.term(effect.card().id).is_some());
                if over != Over::Everything || present || !can_show(*effect, series) {
                    continue;
                }
                for taken in taken(*effect, series.axis) {
                    for (key, unit, term, h) in terms(*effect, series.axis, &taken) {
                        let column = scanner.change(index, &term, h);
                        of_noise.push(of_joining(study, index, &term, h, &whitener, seed));
                        coarse.push(scanner.coarse_of(&column));
                        white.push(whitener.apply_each(&column));
                        plain.push(column);
                        columns.push(Column { key, unit, at: 0.0, own: is_own(*effect) });
                    }
                }
            }
        }
        let n = columns.len();
        // X is what the reading of θ changes by, the residual's derivative with its sign turned.
        let cross = |a: &[Vec<f64>], b: &[Vec<f64>]| -> f64 { a.iter().zip(b).map(|(x, y)| dot(x, y)).sum() };
        let matrix = Mat::from_fn(n, n, |i, j| cross(&white[i.max(j)], &white[i.min(j)]));
        let mut information: Vec<f64> =
            (0..n).flat_map(|i| (0..=i).map(|j| matrix[(i, j)]).collect::<Vec<_>>()).collect();
        let mut score: Vec<f64> = white.iter().map(|column| -cross(column, residual)).collect();
        if over == Over::TheModel && study.over_floor() > WRONG {
            // Whitening trusts a model that is wrong: the error curve's own equations, as heavy as the others in the mean.
            let plain = study.grams.normal(&study.bench.windows.tau, &study.bench.weights);
            let ratio = |k: usize| matrix[(k, k)] / plain.matrix[(k, k)];
            let weight = (0..n).map(ratio).filter(|ratio| ratio.is_finite()).sum::<f64>() / n as f64;
            information =
                (0..n).flat_map(|i| (0..=i).map(|j| weight * plain.matrix[(i, j)]).collect::<Vec<_>>()).collect();
            score = plain.gradient.iter().map(|g| -weight * g).collect();
        }
        let beside = Beside::new(&matrix, own.len());
        let along = |draws: &Draws| -> Vec<Vec<f64>> {
            (0..DRAWS)
                .map(|k| {
                    let white_noise = whitener.apply_each(&draws.read(seed.wrapping_add(k).max(1)));
                    white.iter().map(|column| -cross(column, &white_noise)).collect()
                })
                .collect()
        };
        let (seen, anywhere) = (Draws::where_seen(study, 0), Draws::anywhere(study, 0));
        let draws = seen.as_ref().unwrap_or(&anywhere);
        let scores = along(draws);
        if over != Over::TheModel {
            let counted = of_counts(study, draws, &gls.noise, &whitener, [&plain, &white], seed);
            of_noise.iter_mut().zip(counted).for_each(|(sum, own)| *sum = sum.and(own));
        }
        let mean = |k: usize| scores.iter().map(|score| score[k]).sum::<f64>() / DRAWS as f64;
        let of_draws: Vec<f64> = (0..n).map(|k| if seen.is_some() { mean(k) } else { 0.0 }).collect();
        let expected: Vec<f64> = of_draws.iter().zip(&of_noise).map(|(draws, noise)| draws + noise.value).collect();
        let uneven = uneven(&white, residual, &beside);
        let threshold = 1.0 + SURE * (2.0 / DRAWS as f64).sqrt();
        let inflation = (0..n)
            .map(|k| {
                let variance = beside.variance(k);
                let square = |score: &Vec<f64>| {
                    let less: Vec<f64> = score.iter().zip(&of_draws).map(|(score, mean)| score - mean).collect();
                    beside.left(k, &less).powi(2)
                };
                let scattered = scores.iter().map(square).sum::<f64>() / DRAWS as f64 / variance;
                let most = if scattered > threshold { scattered } else { 1.0 };
                // What is taken off is known to so much.
                let most = most.max(uneven[k])
                    + of_noise[k].variance / variance
                    + between_rows(study, &columns[k].key).powi(2) * variance;
                if most.is_finite() { most.max(1.0) } else { 1.0 }
            })
            .collect();
        let taus = study.bench.coarse.tau.len() as f64;
        let increments = Mat::from_fn(n, n, |i, j| dot(&coarse[i.max(j)], &coarse[i.min(j)]));
        let besides = Beside::new(&increments, own.len());
        let shows = (0..n).map(|k| (besides.variance(k) / taus).max(0.0)).collect();
        Self {
            axes: study.bench.problem.series.iter().map(|series| series.axis).collect(),
            columns,
            information,
            score,
            expected,
            inflation,
            shows,
            squares: residual.iter().map(|channel| dot(channel, channel)).sum(),
            readings: study.bench.problem.series[0].readings.len() as u64,
            noise: Noise::from(&gls.noise),
        }
    }
}

/// Columns beside the model's own, which are fitted anew: of one of those the others.
struct Beside<'m> {
    matrix: &'m Mat<f64>,
    own: usize,
    inverse: Mat<f64>,
}

impl<'m> Beside<'m> {
    fn new(matrix: &'m Mat<f64>, own: usize) -> Self {
        let whole = Mat::from_fn(own, own, |i, j| matrix[(i, j)]);
        let inverse = if own == 0 { whole } else { nls::invert_observable(&whole, 1e-10).0 };
        Self { matrix, own, inverse }
    }

    /// By how much of the own columns one column is made of them.
    fn shares(&self, k: usize) -> Vec<f64> {
        if k < self.own {
            // Beside the others: the row of the inverse tells it.
            let own = self.inverse[(k, k)];
            return (0..self.own)
                .map(|j| if j == k || own <= 0.0 { 0.0 } else { -self.inverse[(k, j)] / own })
                .collect();
        }
        (0..self.own).map(|i| (0..self.own).map(|j| self.inverse[(i, j)] * self.matrix[(j, k)]).sum()).collect()
    }

    fn left(&self, k: usize, score: &[f64]) -> f64 {
        score[k] - self.shares(k).iter().zip(score).map(|(share, score)| share * score).sum::<f64>()
    }

    fn variance(&self, k: usize) -> f64 {
        self.matrix[(k, k)]
            - self.shares(k).iter().enumerate().map(|(j, share)| share * self.matrix[(j, k)]).sum::<f64>()
    }
}

/// Variance of each score over what A says, where the residual is not everywhere of one size (White 1980).
fn uneven(white: &[Vec<Vec<f64>>], residual: &[Vec<f64>], beside: &Beside) -> Vec<f64> {
    let of = |k: usize| -> f64 {
        let shares = beside.shares(k);
        let mut sum = 0.0;
        for (channel, e) in residual.iter().enumerate() {
            let mut left = white[k][channel].clone();
            for (share, column) in shares.iter().zip(white) {
                left.iter_mut().zip(&column[channel]).for_each(|(left, own)| *left -= share * own);
            }
            sum += left.iter().zip(e).map(|(left, e)| (left * e).powi(2)).sum::<f64>();
        }
        sum / beside.variance(k)
    };
    (0..white.len()).map(of).collect()
}

/// How much of a mount's resonance, as a share, the log does not tell from what the motion does between two rows: both go with the second
/// derivative of the rate. A sum over rows (trapezoids) is off by dt²/12 of it, a resonance by 1/ω².
fn between_rows(study: &Study, key: &Key) -> f64 {
    let is_resonance = find(&key.effect).is_some_and(|effect| effect.is(Trait::Resonance)) && key.name == "share";
    let series = study.bench.problem.series.iter().find(|series| series.axis == key.axis);
    match (is_resonance, series, key.shape.first()) {
        (true, Some(series), Some(frequency)) => (series.span().dt * std::f64::consts::TAU * frequency).powi(2) / 12.0,
        _ => 0.0,
    }
}

/// A mean and the variance of it.
#[derive(Clone, Copy, Debug)]
struct Mean {
    value: f64,
    variance: f64,
}

impl Mean {
    const NOTHING: Self = Self { value: 0.0, variance: 0.0 };

    /// Of these draws; nothing where they are no numbers.
    fn of(draws: &[f64]) -> Self {
        let n = draws.len() as f64;
        let value = draws.iter().sum::<f64>() / n;
        let variance = draws.iter().map(|draw| (draw - value).powi(2)).sum::<f64>() / (n - 1.0) / n;
        if value.is_finite() && variance.is_finite() { Self { value, variance } } else { Self::NOTHING }
    }

    /// The sum of two that know nothing of each other.
    fn and(self, other: Self) -> Self {
        Self { value: self.value + other.value, variance: self.variance + other.variance }
    }
}

/// A column, channel by channel.
type Channels = Vec<Vec<f64>>;

/// Draws of an encoder's counts that single out other readings.
const COUNTED: u64 = 24;

/// The score that an encoder's counts are expected to make because they themselves say which rows are read, and how surely: the same
/// draw at the rows that they single out, less that at the rows of the log.
fn of_counts(
    study: &Study,
    draws: &Draws,
    noise: &NoiseModel,
    whitener: &Whitener,
    columns: [&[Channels]; 2],
    seed: u64,
) -> Vec<Mean> {
    let [plain, white] = columns;
    let columns: Vec<&[f64]> = plain.iter().map(|column| column[0].as_slice()).collect();
    let draw = |k: u64| -> Option<Vec<f64>> {
        let counted = draws.recounted(seed.wrapping_mul(5).wrapping_add(k))?;
        let own = noise::whitener_of(study, noise, &counted.readings);
        let (there, here) = (own.apply(&counted.read), whitener.apply(&counted.plain));
        let whitened = own.apply_all(&columns);
        Some(whitened.iter().zip(white).map(|(own, fixed)| dot(&fixed[0], &here) - dot(own, &there)).collect())
    };
    let draws: Option<Vec<Vec<f64>>> = (0..COUNTED).map(draw).collect();
    let of = |column: usize| {
        draws.as_ref().map_or(Mean::NOTHING, |draws| Mean::of(&draws.iter().map(|own| own[column]).collect::<Vec<_>>()))
    };
    (0..white.len()).map(of).collect()
}

/// Draws of noise that a response or another time is undone on.
const SHAPED: u64 = 24;

/// The score that noise alone is expected to make for one of these terms in the place of the other, h apart: undoing a response or a delay
/// filters the reading's noise, and the column then goes with the very noise that the residual has.
///
/// ```text
/// E[(r_b(n) − r_a(n))ᵀ V⁻¹ r_a(n)]/h        n noise alone, r_a and r_b what is left of it
/// ```
fn of_noise(study: &Study, index: usize, terms: [&[Term]; 2], h: f64, whitener: &Whitener, seed: u64) -> Mean {
    let scores: Vec<f64> = (0..SHAPED)
        .map(|k| {
            let seed = seed.wrapping_mul(3).wrapping_add(k);
            let [plain, other] = draw_through(study.bench, index, &study.warm[index], terms, seed);
            let change: Vec<f64> = other.iter().zip(&plain).map(|(other, plain)| (other - plain) / h).collect();
            -dot(&whitener.apply(&change), &whitener.apply(&plain))
        })
        .collect();
    Mean::of(&scores)
}

fn filters(term: &Term) -> bool {
    matches!(term.effect.stage(), Stage::Response | Stage::Timing)
}

/// The same for a term that joins.
fn of_joining(study: &Study, index: usize, term: &Term, h: f64, whitener: &Whitener, seed: u64) -> Mean {
    if !filters(term) {
        return Mean::NOTHING;
    }
    let axis = study.bench.problem.series[index].axis.index();
    let own = study.model.axes[axis].as_ref().map_or(&[][..], |own| &own.terms);
    let with: Vec<Term> = own.iter().chain([term]).cloned().collect();
    of_noise(study, index, [own, &with], h, whitener, seed)
}

/// The same for a parameter that the model has.
fn of_own(study: &Study, slot: &Slot, whitener: &Whitener, seed: u64) -> Mean {
    let axis = study.bench.problem.series[slot.series].axis;
    let Some(own) = study.model.axes[axis.index()].as_ref().map(|own| &own.terms) else { return Mean::NOTHING };
    let Some(term) = own.get(slot.term).filter(|term| filters(term)) else { return Mean::NOTHING };
    let card = &term.effect.parameters(axis)[slot.parameter];
    let typical = if card.typical.is_finite() { card.typical.abs() } else { 0.0 };
    let mut h = SMALL * typical.max(term.values[slot.parameter].abs());
    if term.values[slot.parameter] + h > card.bounds.1 {
        h = -h;
    }
    let mut moved = own.clone();
    moved[slot.term].values[slot.parameter] += h;
    of_noise(study, slot.series, [own, &moved], h, whitener, seed)
}

/// Share of its size by which a parameter is moved for that.
const SMALL: f64 = 1e-2;

/// The model's own parameters.
fn own_columns(study: &Study) -> Vec<Column> {
    let problem = &study.bench.problem;
    let of = |slot: &Slot| {
        let axis = problem.series[slot.series].axis;
        let term = study.model.axes[axis.index()].as_ref().and_then(|own| own.terms.get(slot.term))?;
        let card = &term.effect.parameters(axis)[slot.parameter];
        Some(Column {
            key: Key::new(axis, term.effect.card().id, card.name),
            unit: card.unit.to_owned(),
            at: term.values[slot.parameter],
            own: is_own(term.effect),
        })
    };
    study.slots.iter().filter_map(of).collect()
}

/// The columns that an effect is taken by: each with its name, its unit, and the term whose change over h it is.
fn terms(effect: &'static dyn crate::effects::Effect, axis: Axis, taken: &Taken) -> Vec<(Key, String, Term, f64)> {
    let cards = effect.parameters(axis);
    let linear = cards.iter().filter(|card| card.role == Role::Linear).count();
    let key = |name: &str, shape: &[f64]| Key { shape: shape.to_vec(), ..Key::new(axis, effect.card().id, name) };
    let neutral = Term::neutral(effect, axis);
    match taken {
        Taken::Coefficients(shape) => (0..linear)
            .map(|j| {
                let card = &cards[j];
                let h = if card.typical == 0.0 { 1e-6 * card.bounds.1 } else { 0.1 * card.typical.abs() };
                let mut term = neutral.clone();
                term.values[linear..].copy_from_slice(shape);
                term.values[j] += h;
                (key(card.name, shape), card.unit.to_owned(), term, h)
            })
            .collect(),
        Taken::Size(size) => {
            let mut term = neutral;
            term.values[0] = *size;
            vec![(key(cards[0].name, &[]), cards[0].unit.to_owned(), term, *size)]
        }
        Taken::Share(values) => {
            let mut term = neutral;
            term.values.copy_from_slice(values);
            vec![(key("share", values), "1".to_owned(), term, 1.0)]
        }
    }
}

/// Which columns a piece has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Over {
    /// The model's own.
    TheModel,
    /// The same, with what noise alone is expected to make of them.
    TheModelAndNoise,
    /// Those of every effect besides.
    Everything,
}

/// A log reduced at this model, one piece for axes that share a reference. `seed` chooses the draws of noise: another one for each log,
/// or what is left of chance in them would add up.
///
/// # Errors
/// Where an axis has no reference or too few rows of it.
pub fn pieces(record: &Record, model: &Model, axes: &[Axis], seed: u64) -> Result<Vec<Piece>, FitError> {
    reduced(record, model, axes, seed, Over::Everything)
}

/// The same over the model's own parameters alone.
///
/// # Errors
/// As [`pieces`].
pub(super) fn fitted(record: &Record, model: &Model, axes: &[Axis]) -> Result<Vec<Piece>, FitError> {
    reduced(record, model, axes, 1, Over::TheModel)
}

/// The same, with what noise alone is expected to make of them.
///
/// # Errors
/// As [`pieces`].
pub(super) fn beside_noise(record: &Record, model: &Model, axes: &[Axis], seed: u64) -> Result<Vec<Piece>, FitError> {
    reduced(record, model, axes, seed, Over::TheModelAndNoise)
}

fn reduced(record: &Record, model: &Model, axes: &[Axis], seed: u64, over: Over) -> Result<Vec<Piece>, FitError> {
    let beside = calibrated(record, model);
    let one = |group: &Vec<Axis>| {
        let bench = Bench::new(record, group, &beside).ok_or(FitError::TooShort(group[0]))?;
        let study = Study::held(&bench, model);
        Ok(Piece::of(&study, seed, over))
    };
    groups(record, axes).iter().map(one).collect()
}
