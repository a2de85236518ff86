//! What may be missing: every effect of the catalogue that this log can show, scanned over its shapes.
//!
//! The scan is a score test in the whitened domain: with the noise identified for the present model, how much would
//! ln L rise if this column joined, everything else re-fitted linearly. It only chooses who is refitted exactly.

use super::{limits, tone, verdict::is_slow};
use crate::{
    AxisModel, Model, Term,
    effects::{CATALOGUE, Effect, Need, ParameterCard, Role, Stage, are_aliases},
    evidence::{
        noise::{self, Gls},
        prior,
        series::{Rest, Series},
        study::{Study, difference},
        whiten::Whitener,
    },
    nls::{self, dot},
    parallel,
    record::ReferenceKind,
};
use faer::Mat;
use itertools::Itertools;

/// One effect at its best grid point.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// Index into the problem's series.
    pub series: usize,
    /// The effect, with the parameters to start an exact refit from.
    pub term: Term,
    /// Rise of ln L by the linear scan.
    pub score: f64,
    /// Share of J that the scan says it removes.
    pub removes: f64,
    /// Parameters that adding it frees.
    pub freedom: usize,
}

/// Rise of ln L that each of two effects has to make beside the other to be tried with it: a rise that is not found by
/// chance among all pairs of the catalogue at all their shapes.
const TOGETHER: f64 = 15.0;

/// What two effects have to show each of its own to be tried together. On one sine, and on a drive that turns at one rate, large
/// ones cancel but for a little: a hundredth of what each does is as much as their forms are right to.
const APART: f64 = 0.01;

impl Candidate {
    /// The same with these coefficients, or with this share of its size; `None` where that is not physical.
    fn moved(&self, by: &[f64]) -> Option<Self> {
        let mut moved = self.clone();
        let cards = self.term.effect.parameters(crate::Axis::X);
        let is_linear = cards.first().is_some_and(|card| card.role == Role::Linear);
        if is_linear {
            moved.term.values[..by.len()].copy_from_slice(by);
        } else if cards.iter().all(|card| card.neutral == 0.0) {
            moved.term.values.iter_mut().for_each(|v| *v *= by[0]);
        } else if by[0] <= 0.0 {
            return None;
        }
        let inside = |(v, card): (&f64, &ParameterCard)| *v >= card.bounds.0 && *v <= card.bounds.1;
        moved.term.values.iter().zip(cards).all(inside).then_some(moved)
    }
}

/// Whether the log holds what the effect needs: an axis that rests shows what its bias goes with, and nothing else.
#[must_use]
pub fn can_show(effect: &dyn Effect, series: &Series) -> bool {
    let shows = match series.rest {
        Rest::None => true,
        Rest::OfReference => false,
        Rest::Whole => is_slow(effect.card().id),
    };
    if !shows {
        return false;
    }
    let varies = |pick: &dyn Fn(usize) -> f64, least: f64| {
        let (low, high) =
            (0..series.t.len()).map(pick).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        high - low > least
    };
    let s = &series.signals;
    effect.card().needs.iter().all(|need| match need {
        Need::OtherGyros => (0..3).filter(|&a| a != series.axis.index()).any(|a| varies(&|k| s[k].rates[a], 0.02)),
        Need::Gyro(axis) => *axis == series.axis || varies(&|k| s[k].rates[axis.index()], 0.02),
        Need::Accelerometer => (0..3).any(|a| varies(&|k| s[k].accel[a], 1e-6)),
        Need::Temperature => varies(&|k| s[k].delta_temperature, 0.5),
        Need::Supply => varies(&|k| s[k].delta_supply, 1e-3),
        Need::AngleReference => series.kind == ReferenceKind::Angle,
    })
}

/// Every absent effect that this log can show: at the grid point that raises ln L most, and at the one that lowers the
/// error most where that is another.
#[must_use]
pub fn scan(study: &Study, gls: &Gls, draws: &[Vec<Vec<f64>>], extra: &[&'static dyn Effect]) -> Vec<Candidate> {
    let scanner = Scanner::new(study, gls, draws);
    let mut wanted: Vec<(usize, &'static dyn Effect)> = Vec::new();
    for (index, series) in study.bench.problem.series.iter().enumerate() {
        let axis = series.axis;
        let empty = AxisModel::EMPTY;
        let model = study.model.axes[axis.index()].as_ref().unwrap_or(&empty);
        for effect in CATALOGUE.iter().chain(extra) {
            let present = model.terms.iter().filter(|t| t.effect.card().id == effect.card().id).count();
            if present > 0 || !can_show(*effect, series) {
                continue;
            }
            wanted.push((index, *effect));
        }
    }
    parallel::map(&wanted, |&(series, effect)| scanner.best(effect, series)).concat()
}

/// The score test of one study.
pub(super) struct Scanner<'a> {
    study: &'a Study<'a>,
    /// Whitened draws of noise alone.
    draws: &'a [Vec<Vec<f64>>],
    whitener: Whitener,
    residual: Vec<Vec<f64>>,
    columns: Vec<Vec<Vec<f64>>>,
    inverse: Mat<f64>,
    gradient: Vec<f64>,
    /// Increments of the error curve, a few of each averaging time.
    pairs: Vec<(u32, u32, f64)>,
    coarse: Coarse,
}

/// Residual and columns of the present model as increments, and their normal equations.
struct Coarse {
    normal: nls::Normal,
    residual: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl<'a> Scanner<'a> {
    pub(super) fn new(study: &'a Study<'a>, gls: &Gls, draws: &'a [Vec<Vec<f64>>]) -> Self {
        let (normal, whitener) = noise::normal(study, &gls.noise);
        let (inverse, _) = nls::invert_observable(&normal.matrix, 1e-10);
        let residual = whitener.apply_each(&study.as_read());
        let columns = study.columns.iter().map(|c| whitener.apply_each(c)).collect();
        let mut scanner = Self {
            study,
            draws,
            residual,
            columns,
            inverse,
            gradient: normal.gradient,
            whitener,
            pairs: study.bench.coarse.weighted(&prior_floor(study)),
            coarse: Coarse { normal: nls::Normal::zeros(0), residual: Vec::new(), columns: Vec::new() },
        };
        scanner.coarse = scanner.coarse(None);
        scanner
    }

    /// The present model's increments, those steps left out.
    fn coarse(&self, without: Option<&[bool]>) -> Coarse {
        let residual = self.increments(&self.study.evaluation.residual, without);
        let columns: Vec<Vec<f64>> = self.study.columns.iter().map(|c| self.increments(c, without)).collect();
        let mut normal = nls::Normal::zeros(columns.len());
        normal.add(&residual, &columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
        Coarse { normal, residual, columns }
    }

    /// Two of these candidates of one axis that hide one another: those where each raises ln L most beside the other, by at
    /// least [`TOGETHER`], each at its share.
    pub(super) fn pair(&self, list: &[Candidate]) -> Option<[Candidate; 2]> {
        let mut each: Vec<&Candidate> =
            list.iter().filter(|c| c.term.effect.stage() != Stage::Reading && c.score.is_finite()).collect();
        each.sort_by(|a, b| b.score.total_cmp(&a.score));
        each = each.into_iter().unique_by(|c| c.term.effect.card().id).collect();
        let columns = parallel::map(&each, |c| self.columns_at(c));
        let ends: Vec<usize> = columns
            .iter()
            .map(Vec::len)
            .scan(0, |end, n| {
                *end += n;
                Some(*end)
            })
            .collect();
        let all: Vec<&Vec<Vec<f64>>> = columns.iter().flatten().collect();
        let against: Vec<Vec<f64>> = all.iter().map(|c| self.against_model(c)).collect();
        let gradient: Vec<f64> = (0..all.len())
            .map(|i| Self::cross(all[i], &self.residual) - self.quadratic(&against[i], &self.gradient))
            .collect();
        let rows: Vec<usize> = (0..all.len()).collect();
        let own = parallel::map(&rows, |&i| -> Vec<f64> {
            (0..=i).map(|j| Self::cross(all[i], all[j]) - self.quadratic(&against[i], &against[j])).collect()
        });
        let block = |which: &[usize]| -> (Vec<usize>, Mat<f64>) {
            let pick: Vec<usize> = which.iter().flat_map(|&k| ends[k] - columns[k].len()..ends[k]).collect();
            let matrix = Mat::from_fn(pick.len(), pick.len(), |i, j| own[pick[i].max(pick[j])][pick[i].min(pick[j])]);
            (pick, matrix)
        };
        // What two do not share, Π(1 − ρ²) over their canonical correlations.
        let apart = |a: usize, b: usize| {
            let volume = |which: &[usize]| {
                let (_, m) = block(which);
                let scaled = |i: usize, j: usize| m[(i, j)] / (m[(i, i)] * m[(j, j)]).sqrt();
                Mat::from_fn(m.nrows(), m.nrows(), scaled).determinant()
            };
            volume(&[a, b]) / (volume(&[a]) * volume(&[b]))
        };
        let rise = |which: &[usize]| -> (f64, Vec<f64>) {
            let (pick, matrix) = block(which);
            let (inverse, _) = nls::invert_observable(&matrix, 1e-6);
            let step: Vec<f64> = (0..pick.len())
                .map(|i| -(0..pick.len()).map(|j| inverse[(i, j)] * gradient[pick[j]]).sum::<f64>())
                .collect();
            (-0.5 * step.iter().zip(&pick).map(|(s, &k)| s * gradient[k]).sum::<f64>(), step)
        };
        let alone: Vec<f64> = (0..each.len()).map(|k| rise(&[k]).0).collect();
        let gained = |a: usize, b: usize| {
            let (together, step) = rise(&[a, b]);
            let (of_a, of_b) = step.split_at(columns[a].len());
            let pair = [each[a].moved(of_a)?, each[b].moved(of_b)?];
            Some((together - alone[a].max(alone[b]), pair)).filter(|(gain, _)| *gain > TOGETHER)
        };
        // The difference of two effects that look alike is a shape of its own, which is the physics of neither.
        let id = |k: usize| each[k].term.effect.card().id;
        let pairs = (0..each.len()).tuple_combinations().filter(|&(a, b)| !are_aliases(id(a), id(b)));
        let pairs = pairs.filter(|&(a, b)| apart(a, b) > APART).filter_map(|(a, b)| gained(a, b));
        pairs.max_by(|x, y| x.0.total_cmp(&y.0)).map(|(_, pair)| pair)
    }

    /// The whitened columns of a candidate where it stands: of its coefficients, or of its share.
    fn columns_at(&self, candidate: &Candidate) -> Vec<Vec<Vec<f64>>> {
        let (term, index) = (&candidate.term, candidate.series);
        let parameters = term.effect.parameters(self.study.bench.problem.series[index].axis);
        let linear = parameters.iter().filter(|p| p.role == Role::Linear).count();
        let white = |term: &Term, h: f64| self.whitener.apply_each(&self.column(index, term, h));
        if linear == 0 {
            return vec![white(term, 1.0)];
        }
        let from_nothing = |j: usize| {
            let card = &parameters[j];
            let h = if card.typical == 0.0 { 1e-6 * card.bounds.1 } else { 0.1 * card.typical.abs() };
            let mut trial = term.clone();
            trial.values[..linear].fill(0.0);
            trial.values[j] = h;
            white(&trial, h)
        };
        (0..linear).map(from_nothing).collect()
    }

    /// One effect on one axis.
    pub(super) fn best(&self, effect: &'static dyn Effect, index: usize) -> Vec<Candidate> {
        let series = &self.study.bench.problem.series[index];
        let parameters = effect.parameters(series.axis);
        let linear = parameters.iter().filter(|p| p.role == Role::Linear).count();
        if effect.stage() == Stage::Reading {
            return limits::read_off(effect, series)
                .map(|value| Candidate {
                    series: index,
                    term: Term { effect, values: vec![value], std_errors: vec![f64::NAN] },
                    score: f64::INFINITY,
                    removes: 1.0,
                    freedom: 1,
                })
                .into_iter()
                .collect();
        }
        let span = series.span();
        let shapes: Vec<Vec<f64>> = if effect.card().id == "vibration-tone" {
            self.tone(effect, index, series).map(|f| vec![f]).into_iter().collect()
        } else if linear == parameters.len() {
            vec![Vec::new()]
        } else {
            effect.grid(&span)
        };
        let mut likeliest: Option<(usize, Candidate)> = None;
        let mut lowest: Option<(usize, Candidate)> = None;
        for (number, shape) in shapes.into_iter().enumerate() {
            let mut term = Term::neutral(effect, series.axis);
            term.values[linear..].copy_from_slice(&shape);
            let freedom = parameters.iter().filter(|p| p.role != Role::Chosen).count();
            let columns: Vec<Vec<Vec<f64>>> = if linear == 0 {
                vec![self.column(index, &term, 1.0)]
            } else {
                (0..linear)
                    .map(|j| {
                        let card = &parameters[j];
                        let h = if card.typical == 0.0 { 1e-6 * card.bounds.1 } else { 0.1 * card.typical.abs() };
                        let mut trial = term.clone();
                        trial.values[j] += h;
                        self.column(index, &trial, h)
                    })
                    .collect()
            };
            let white: Vec<Vec<Vec<f64>>> = columns.iter().map(|c| self.whitener.apply_each(c)).collect();
            let (score, by_likelihood) = if linear == 0 {
                let (score, share) = self.rise_with_share(&white[0]);
                // A width or a time is nothing at zero; a frequency is not.
                let is_size = parameters.iter().all(|card| card.neutral == 0.0);
                (score, if is_size { term.values.iter().map(|v| share * v).collect() } else { Vec::new() })
            } else {
                self.rise(&white)
            };
            let (removes, by_error) = self.lowers(&columns, linear == 0, self.unsure(index, &term).as_deref());
            let keep = |best: &mut Option<(usize, Candidate)>, values: &[f64], better: &dyn Fn(&Candidate) -> bool| {
                let mut term = term.clone();
                for (j, v) in values.iter().enumerate() {
                    let bounds = parameters[j].bounds;
                    term.values[j] = v.clamp(bounds.0, bounds.1);
                }
                if score.is_finite() && best.as_ref().is_none_or(|(_, best)| better(best)) {
                    *best = Some((number, Candidate { series: index, term, score, removes, freedom }));
                }
            };
            keep(&mut likeliest, &by_likelihood, &|b| score > b.score);
            keep(&mut lowest, &by_error, &|b| removes > b.removes);
        }
        match (likeliest, lowest) {
            (Some(a), Some(b)) if a.0 == b.0 => vec![a.1],
            (a, b) => a.into_iter().chain(b).map(|(_, candidate)| candidate).collect(),
        }
    }

    /// Where a tone may be, Hz: at a line of the reading, else at one that no noise draws.
    fn tone(&self, effect: &'static dyn Effect, index: usize, series: &Series) -> Option<f64> {
        let t = self.study.bench.problem.times();
        let lines = tone::peaks(&self.residual, t, series);
        let seen = lines.into_iter().find(|&f| self.seen_by_gyro(effect, index, series, f));
        seen.or_else(|| tone::beyond_noise(&self.residual, self.draws, t, series))
    }

    /// Whether the gyro's own reading holds the line that the residual has at `f`.
    fn seen_by_gyro(&self, effect: &'static dyn Effect, index: usize, series: &Series, f: f64) -> bool {
        let columns: Vec<Vec<Vec<f64>>> = (0..2)
            .map(|j| {
                let mut term = Term { values: vec![0.0, 0.0, f], ..Term::neutral(effect, series.axis) };
                term.values[j] = 0.01;
                self.column(index, &term, 0.01).iter().map(|c| self.whitener.apply(c)).collect()
            })
            .collect();
        // Beside the model as it stands: its scale factor, fitted anew where much else is missing, would share the line.
        let matrix = Mat::from_fn(2, 2, |i, j| Self::cross(&columns[i], &columns[j]));
        let along = [0, 1].map(|i| Self::cross(&columns[i], &self.residual));
        let (inverse, _) = nls::invert_observable(&matrix, 1e-8);
        let [sine, cosine] = [0, 1].map(|i| -(inverse[(i, 0)] * along[0] + inverse[(i, 1)] * along[1]));
        tone::in_reading(series, f, sine, cosine, self.alpha(series))
    }

    fn alpha(&self, series: &Series) -> f64 {
        self.study.model.axes[series.axis.index()].as_ref().map_or(1.0, AxisModel::alpha)
    }

    /// Share of J that is removed where the columns join, everything refitted linearly, and their coefficients; `fixed`
    /// joins the one column with coefficient 1. Steps that the suspect is unsure of count neither before nor after.
    fn lowers(&self, columns: &[Vec<Vec<f64>>], fixed: bool, without: Option<&[bool]>) -> (f64, Vec<f64>) {
        let own;
        let coarse = if without.is_some() {
            own = self.coarse(without);
            &own
        } else {
            &self.coarse
        };
        let n = self.study.columns.len();
        let increments: Vec<Vec<f64>> = columns.iter().map(|c| self.increments(c, without)).collect();
        let size = n + columns.len();
        let column = |k: usize| if k < n { &coarse.columns[k] } else { &increments[k - n] };
        let normal = nls::Normal {
            cost: coarse.normal.cost,
            gradient: (0..size)
                .map(|k| if k < n { coarse.normal.gradient[k] } else { dot(column(k), &coarse.residual) })
                .collect(),
            matrix: {
                let mut matrix = Mat::zeros(size, size);
                for i in 0..size {
                    for j in 0..=i {
                        let sum = if i < n { coarse.normal.matrix[(i, j)] } else { dot(column(i), column(j)) };
                        (matrix[(i, j)], matrix[(j, i)]) = (sum, sum);
                    }
                }
                matrix
            },
        };
        let mut before = coarse.normal.clone();
        let left = before.cost_after(&before.step_from(&before, 1e-9));
        let (after, coefficients) = if fixed {
            before.shift(&normal, n);
            (before.cost_after(&before.step_from(&before, 1e-9)), Vec::new())
        } else {
            let step = normal.step_from(&normal, 1e-9);
            (normal.cost_after(&step), step[n..].to_vec())
        };
        (1.0 - after / left, coefficients)
    }

    /// Weighted increments of one series a channel, the steps `without` standing still.
    fn increments(&self, series: &[Vec<f64>], without: Option<&[bool]>) -> Vec<f64> {
        let of = |c: &[f64]| -> Vec<f64> {
            self.pairs.iter().map(|&(i, j, w)| w * (c[j as usize] - c[i as usize])).collect()
        };
        let still = |c: &[f64], without: &[bool]| -> Vec<f64> {
            let mut skipped = 0.0;
            (0..c.len())
                .map(|i| {
                    if i > 0 && without[i] {
                        skipped += c[i] - c[i - 1];
                    }
                    c[i] - skipped
                })
                .collect()
        };
        series.iter().flat_map(|c| without.map_or_else(|| of(c), |without| of(&still(c, without)))).collect()
    }

    /// The steps that the model with the term is unsure of.
    fn unsure(&self, index: usize, term: &Term) -> Option<Vec<bool>> {
        term.effect.error_whole(&term.values, &[], &[])?;
        let (study, model) = (self.study, with_term(self.study, index, term.clone()));
        let moved = study.bench.problem.evaluate_one(&model, &study.warm, &study.evaluation, index);
        study.bench.problem.unsure(&moved, index)
    }

    /// (residual with the term − residual)/h.
    fn column(&self, index: usize, term: &Term, h: f64) -> Vec<Vec<f64>> {
        let model = with_term(self.study, index, term.clone());
        let moved = self.study.bench.problem.evaluate_one(&model, &self.study.warm, &self.study.evaluation, index);
        difference(&moved, &self.study.evaluation, h)
    }

    /// The scalar product of two columns, over all channels.
    fn cross(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
        a.iter().zip(b).map(|(x, y)| dot(x, y)).sum()
    }

    fn against_model(&self, a: &[Vec<f64>]) -> Vec<f64> {
        self.columns.iter().map(|c| Self::cross(c, a)).collect()
    }

    fn quadratic(&self, a: &[f64], b: &[f64]) -> f64 {
        let n = a.len();
        (0..n).map(|i| (0..n).map(|j| a[i] * self.inverse[(i, j)] * b[j]).sum::<f64>()).sum()
    }

    /// Rise of ln L where the columns join with free coefficients, and the coefficients.
    fn rise(&self, columns: &[Vec<Vec<f64>>]) -> (f64, Vec<f64>) {
        let n = columns.len();
        let w: Vec<Vec<f64>> = columns.iter().map(|c| self.against_model(c)).collect();
        let matrix = Mat::from_fn(n, n, |i, j| Self::cross(&columns[i], &columns[j]) - self.quadratic(&w[i], &w[j]));
        let gradient: Vec<f64> =
            (0..n).map(|i| Self::cross(&columns[i], &self.residual) - self.quadratic(&w[i], &self.gradient)).collect();
        let full: Vec<f64> = columns.iter().map(|c| Self::cross(c, c)).collect();
        // A column that the model's own nearly spans says nothing of its own.
        if (0..n).all(|i| matrix[(i, i)] < 1e-6 * full[i]) {
            return (0.0, vec![0.0; n]);
        }
        let (inverse, _) = nls::invert_observable(&matrix, 1e-8);
        let p: Vec<f64> = (0..n).map(|i| -(0..n).map(|j| inverse[(i, j)] * gradient[j]).sum::<f64>()).collect();
        let rise = -0.5 * p.iter().zip(&gradient).map(|(p, g)| p * g).sum::<f64>();
        (rise, p)
    }

    /// Rise of ln L where the best share of the column joins, and that share: what lies between this shape of a grid and the
    /// next smaller one is, to first order, a part of it.
    fn rise_with_share(&self, column: &[Vec<f64>]) -> (f64, f64) {
        let w = self.against_model(column);
        let cc = Self::cross(column, column) - self.quadratic(&w, &w);
        let cr = Self::cross(column, &self.residual) - self.quadratic(&w, &self.gradient);
        let share = (-cr / cc).clamp(SMALLER, 1.0);
        (-share * (cr + 0.5 * share * cc), share)
    }
}

/// From one shape of a grid to the next smaller one.
const SMALLER: f64 = 0.3;

/// The weights' F at the coarse windows' averaging times, which are those of the fine ones.
fn prior_floor(study: &Study) -> Vec<f64> {
    let bench = study.bench;
    let each: Vec<Vec<f64>> = bench.prior.iter().map(|p| prior::weights(p, &bench.coarse.tau)).collect();
    (0..bench.coarse.tau.len())
        .map(|k| (each.iter().map(|w| w[k] * w[k]).sum::<f64>() / each.len() as f64).sqrt())
        .collect()
}

/// Whether an effect is that of a whole sensor or reference rather than of an axis.
pub(super) fn of_whole_sensor(effect: &dyn Effect) -> bool {
    matches!(effect.stage(), Stage::Timing | Stage::Response)
}

/// The study's model with one more term and, where the axes make one orientation and the effect is of the whole sensor, with
/// as much of it on every other axis that has nothing of the kind: what one axis reads late the others read late too, and
/// their errors are carried into its own.
#[must_use]
pub fn with_term_throughout(study: &Study, series: usize, term: &Term) -> Model {
    let mut model = with_term(study, series, term.clone());
    let problem = &study.bench.problem;
    if problem.attitude().is_none() || !of_whole_sensor(term.effect) {
        return model;
    }
    for other in problem.series.iter().enumerate().filter(|(k, s)| *k != series && can_show(term.effect, s)) {
        let own = model.axes[other.1.axis.index()].get_or_insert_with(|| AxisModel::base(other.1.axis));
        if !own.terms.iter().any(|t| of_whole_sensor(t.effect)) {
            own.terms.push(term.clone());
        }
    }
    model
}

/// The study's model with one more term.
#[must_use]
pub fn with_term(study: &Study, series: usize, term: Term) -> Model {
    let mut model = study.model.clone();
    let axis = study.bench.problem.series[series].axis;
    model.axes[axis.index()].get_or_insert_with(|| AxisModel::base(axis)).terms.push(term);
    model
}
