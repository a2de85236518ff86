//! What may be missing: every effect of the catalogue that this log can show, scanned over its shapes.
//!
//! The scan is a score test in the whitened domain: with the noise identified for the present model, how much would
//! ln L rise if this column joined, everything else re-fitted linearly. It only chooses who is refitted exactly.

pub(crate) mod read_off;
pub(crate) mod tone;

use crate::{
    AxisModel, Model, Term,
    effects::{CATALOGUE, Effect, Need, ParameterCard, Role, Stage, Trait},
    evidence::{
        draws::Draws,
        line::Line,
        noise::{self, Gls},
        prior,
        series::{Rest, Series},
        study::{Study, scaled},
        whiten::Whitener,
    },
    nls::{self, dot},
    parallel,
    record::ReferenceKind,
};
use faer::Mat;

/// Bins of a spectrum on either side that belong to a line.
const BESIDE: f64 = 2.0;
/// Multiples of a sine's frequency at which a nonlinearity leaves lines.
const MULTIPLES: f64 = 9.0;

/// One effect at its best grid point.
#[derive(Clone, Debug)]
pub(crate) struct Candidate {
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

/// Whether the log holds what the effect needs: an axis that rests shows what its bias goes with, and nothing else.
#[must_use]
pub(crate) fn can_show(effect: &dyn Effect, series: &Series) -> bool {
    let shows = match series.rest {
        Rest::None => true,
        // What the other axes turn may leak into a gyro whose own shaft rests.
        Rest::OfReference => effect.card().needs.contains(&Need::OtherGyros),
        Rest::Whole => effect.is(Trait::Slow),
    };
    // On one line a mount is a gain and a lateness, which scale factor and delay are already.
    if !shows || series.one_line.is_some() && effect.is(Trait::Resonance) {
        return false;
    }
    // Straight lines between knots leave fast motion out too: neither a smoothing nor what a mount adds to the gyro.
    if series.knots.is_some() && (effect.stage() == Stage::Shown || effect.is(Trait::Resonance)) {
        return false;
    }
    let varies = |pick: &dyn Fn(usize) -> f64, least: f64| {
        let (low, high) =
            (0..series.t.len()).map(pick).fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        high - low > least
    };
    let s = |k: usize| series.signals(k);
    effect.card().needs.iter().all(|need| match need {
        Need::OtherGyros => (0..3).filter(|&a| a != series.axis.index()).any(|a| varies(&|k| s(k).rates[a], 0.02)),
        Need::Gyro(axis) => *axis == series.axis || varies(&|k| s(k).rates[axis.index()], 0.02),
        Need::Accelerometer => (0..3).any(|a| varies(&|k| s(k).accel[a], 1e-6)),
        Need::Temperature => varies(&|k| s(k).delta_temperature, 0.5),
        Need::Supply => varies(&|k| s(k).delta_supply, 1e-3),
        Need::AngleReference => series.kind == ReferenceKind::Angle,
    })
}

/// Every absent effect that this log can show: at the grid point that raises ln L most, and at the one that lowers the
/// error most where that is another. Only those effects of those series that `of` says.
#[must_use]
pub(crate) fn scan_for(
    scanner: &Scanner,
    extra: &[&'static dyn Effect],
    of: impl Fn(usize, &str) -> bool,
) -> Vec<Candidate> {
    let study = scanner.study;
    let mut wanted: Vec<(usize, &'static dyn Effect)> = Vec::new();
    for (index, series) in study.bench.problem.series.iter().enumerate() {
        let axis = series.axis;
        let empty = AxisModel::EMPTY;
        let model = study.model.axes[axis.index()].as_ref().unwrap_or(&empty);
        for effect in CATALOGUE.iter().chain(extra) {
            let present = model.terms.iter().filter(|t| t.effect.card().id == effect.card().id).count();
            if present > 0 || !of(index, effect.card().id) || !can_show(*effect, series) {
                continue;
            }
            wanted.push((index, *effect));
        }
    }
    parallel::map(&wanted, |&(series, effect)| scanner.best(effect, series)).concat()
}

/// What an effect may begin at beside a fitted model: by the likelihood and, where that is another, by the error.
#[must_use]
pub(crate) fn starts(study: &Study, effect: &'static dyn Effect, series: usize) -> Vec<Candidate> {
    let gls = study.identify();
    Scanner::new(study, &gls, &draws_of_noise(study, &gls)).best(effect, series)
}

/// Whitened draws of noise alone on the motion of a fitted model.
#[must_use]
pub(crate) fn draws_of_noise(study: &Study, gls: &Gls) -> Vec<Vec<Vec<f64>>> {
    let whitener = noise::whitener(study, &gls.noise);
    let noise_alone = Draws::anywhere(study, 0);
    parallel::map(&(0..DRAWS).collect::<Vec<_>>(), |&seed| whitener.apply_each(&noise_alone.read(seed)))
}

/// Draws of noise alone.
pub(crate) const DRAWS: u64 = 20;

/// The score test of one study.
pub(crate) struct Scanner<'a> {
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

/// What the present model leaves, whitened, channel by channel, and its columns; those as increments of the error curve, too.
pub(crate) struct Whitened<'a> {
    pub residual: &'a [Vec<f64>],
    pub columns: &'a [Vec<Vec<f64>>],
    pub increments: &'a [Vec<f64>],
}

/// Residual and columns of the present model as increments, and their normal equations.
struct Coarse {
    normal: nls::Normal,
    residual: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

impl<'a> Scanner<'a> {
    pub(crate) fn new(study: &'a Study<'a>, gls: &Gls, draws: &'a [Vec<Vec<f64>>]) -> Self {
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

    /// One effect on one axis.
    pub(crate) fn best(&self, effect: &'static dyn Effect, index: usize) -> Vec<Candidate> {
        let series = &self.study.bench.problem.series[index];
        let parameters = effect.parameters(series.axis);
        let linear = parameters.iter().filter(|p| p.role == Role::Linear).count();
        if effect.stage() == Stage::Reading {
            return read_off::read_off(effect, self.study, index)
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
        let is_tone = effect.is(Trait::Line);
        let shapes: Vec<Vec<f64>> = if is_tone {
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
            // The lines that a log has room for are counted, and not the frequency besides.
            let is_free = |p: &&ParameterCard| if is_tone { p.role == Role::Linear } else { p.role != Role::Chosen };
            let freedom = parameters.iter().filter(is_free).count();
            let columns = self.along(index, &term);
            let white = self.whitened(&columns);
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
                // What has one sign only says nothing with the other one.
                let has_wrong_sign = |(v, card): (&f64, &ParameterCard)| {
                    card.role == Role::Linear && card.bounds.0 == card.neutral && *v <= card.bounds.0
                };
                if values.iter().zip(parameters).any(has_wrong_sign) {
                    return;
                }
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
            (Some(a), Some(b)) if a.0 == b.0 || linear == 0 && is_near(&a.1.term, &b.1.term) => vec![a.1],
            (a, b) => a.into_iter().chain(b).map(|(_, candidate)| candidate).collect(),
        }
    }

    /// Where a tone may be, Hz: at a line of the reading, else at one that no noise draws.
    fn tone(&self, effect: &'static dyn Effect, index: usize, series: &Series) -> Option<f64> {
        let t = self.study.bench.problem.times();
        // What is nonlinear makes of a sine lines at its first multiples, in the reading too; one whose peaks are cut off has all.
        let most = if self.study.is_whole() { MULTIPLES } else { f64::INFINITY };
        let is_of_motion = |f: f64| {
            series.one_line.is_some_and(|own| {
                let multiple = (f / own).round();
                multiple <= most && (f - own * multiple).abs() * series.span().duration < BESIDE
            })
        };
        let lines = tone::peaks(&self.residual, t, series).into_iter().filter(|&f| !is_of_motion(f));
        let seen = { lines }.find(|&f| self.is_felt(effect, index, f));
        seen.or_else(|| tone::beyond_noise(&self.residual, self.draws, t, series).filter(|&f| !is_of_motion(f)))
    }

    /// Whether the gyro itself felt the line that the residual has at `f`.
    fn is_felt(&self, effect: &'static dyn Effect, index: usize, f: f64) -> bool {
        let axis = self.study.bench.problem.series[index].axis;
        let term = Term { values: vec![0.0, 0.0, f], ..Term::neutral(effect, axis) };
        let columns = self.white_along(index, &term);
        // Beside the model as it stands: its scale factor, fitted anew where much else is missing, would share the line.
        let mut normal = nls::Normal::zeros(2);
        for (channel, residual) in self.residual.iter().enumerate() {
            normal.add(residual, &[&columns[0][channel], &columns[1][channel]]);
        }
        let (_, step) = normal.rise(1e-8);
        tone::is_felt(self.study, index, Line { frequency: f, sine: step[0], cosine: step[1] })
    }

    /// Share of J that is left where all these candidates of one axis join at their shapes, everything refitted linearly: fewer
    /// of them leave no less.
    pub(crate) fn leaves(&self, list: &[&Candidate]) -> f64 {
        let columns = parallel::map(list, |c| self.along(c.series, &c.term)).concat();
        1.0 - self.lowers(&columns, false, None).0
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
        if !term.effect.is_play() {
            return None;
        }
        let (study, model) = (self.study, with_term(self.study, index, term.clone()));
        let moved = study.bench.problem.evaluate(&model, &study.warm);
        study.bench.problem.unsure(&moved, index)
    }

    /// What the residual changes by with each coefficient of a term, from none of it; or with its share, where it has none.
    fn along(&self, index: usize, term: &Term) -> Vec<Vec<Vec<f64>>> {
        let parameters = term.effect.parameters(self.study.bench.problem.series[index].axis);
        let coefficients = parameters.iter().filter(|p| p.role == Role::Linear).count();
        if coefficients == 0 {
            return vec![self.column(index, term, 1.0)];
        }
        let with_one = |j: usize| {
            let card = &parameters[j];
            let h = if card.typical == 0.0 { 1e-6 * card.bounds.1 } else { 0.1 * card.typical.abs() };
            let mut trial = term.clone();
            trial.values.iter_mut().zip(&parameters[..coefficients]).for_each(|(v, card)| *v = card.neutral);
            trial.values[j] += h;
            self.column(index, &trial, h)
        };
        (0..coefficients).map(with_one).collect()
    }

    /// The same whitened.
    pub(crate) fn white_along(&self, index: usize, term: &Term) -> Vec<Vec<Vec<f64>>> {
        self.whitened(&self.along(index, term))
    }

    fn whitened(&self, columns: &[Vec<Vec<f64>>]) -> Vec<Vec<Vec<f64>>> {
        columns.iter().map(|column| self.whitener.apply_each(column)).collect()
    }

    /// (residual with the term − residual)/h.
    fn column(&self, index: usize, term: &Term, h: f64) -> Vec<Vec<f64>> {
        let Study { bench, model, warm, evaluation, .. } = self.study;
        let axis = bench.problem.series[index].axis.index();
        let last = model.axes[axis].as_ref().map_or(0, |own| own.terms.len());
        scaled(bench.problem.difference(model, warm, evaluation, (index, last), term), h)
    }

    /// The whitened residual, the model's own whitened columns, and those as increments of the error curve.
    pub(crate) fn own(&self) -> Whitened<'_> {
        Whitened { residual: &self.residual, columns: &self.columns, increments: &self.coarse.columns }
    }

    /// What the residual changes by with a term that joins, over h.
    pub(crate) fn change(&self, index: usize, term: &Term, h: f64) -> Vec<Vec<f64>> {
        self.column(index, term, h)
    }

    /// A column as increments of the error curve.
    pub(crate) fn coarse_of(&self, column: &[Vec<f64>]) -> Vec<f64> {
        self.increments(column, None)
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

    /// Normal equations of whitened columns, the model's own fitted anew beside them.
    pub(crate) fn beside_model(&self, columns: &[&[Vec<f64>]]) -> nls::Normal {
        let own: Vec<Vec<f64>> = columns.iter().map(|c| self.against_model(c)).collect();
        let mut normal = nls::Normal::zeros(columns.len());
        for (i, column) in columns.iter().enumerate() {
            normal.gradient[i] = Self::cross(column, &self.residual) - self.quadratic(&own[i], &self.gradient);
            for j in 0..=i {
                let both = Self::cross(column, columns[j]) - self.quadratic(&own[i], &own[j]);
                (normal.matrix[(i, j)], normal.matrix[(j, i)]) = (both, both);
            }
        }
        normal
    }

    /// Rise of ln L where the columns join with free coefficients, and the coefficients.
    fn rise(&self, columns: &[Vec<Vec<f64>>]) -> (f64, Vec<f64>) {
        let normal = self.beside_model(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>());
        if Self::spanned(&normal, columns) {
            return (0.0, vec![0.0; columns.len()]);
        }
        normal.rise(1e-8)
    }

    /// Whether the model's own columns nearly span these, so that they say nothing of their own.
    fn spanned(normal: &nls::Normal, columns: &[Vec<Vec<f64>>]) -> bool {
        let says_nothing = |(i, c): (usize, &Vec<Vec<f64>>)| normal.matrix[(i, i)] <= 1e-6 * Self::cross(c, c);
        columns.iter().enumerate().all(says_nothing)
    }

    /// The same of a term's coefficients at its shapes.
    pub(crate) fn spans(&self, index: usize, term: &Term) -> bool {
        let columns = self.white_along(index, term);
        Self::spanned(&self.beside_model(&columns.iter().map(Vec::as_slice).collect::<Vec<_>>()), &columns)
    }

    /// Rise of ln L where the best share of the column joins, and that share: what lies between this shape of a grid and the
    /// next smaller one is, to first order, a part of it.
    fn rise_with_share(&self, column: &[Vec<f64>]) -> (f64, f64) {
        let normal = self.beside_model(&[column]);
        let (cc, cr) = (normal.matrix[(0, 0)], normal.gradient[0]);
        let share = (-cr / cc).clamp(SMALLER, 1.0);
        (-share * (cr + 0.5 * share * cc), share)
    }
}

/// Whether two terms of one effect begin so near one another that a fit ends at the same place.
pub(crate) fn is_near(a: &Term, b: &Term) -> bool {
    a.values.iter().zip(&b.values).all(|(a, b)| a * b > 0.0 && (a / b).ln().abs() < NEAR)
}

/// ln of the ratio of two such values: neighbours on a grid.
const NEAR: f64 = 0.5;

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

/// The study's model with one more term and, where the axes make one orientation and the effect joins on all of them, with it on
/// every other axis that has nothing of the kind: what one axis reads late the others read late too, as much of it, and a sensor that is
/// turned is so for all; and their errors are carried into its own.
#[must_use]
pub(crate) fn with_term_throughout(study: &Study, series: usize, term: &Term) -> Model {
    let mut model = with_term(study, series, term.clone());
    let problem = &study.bench.problem;
    if problem.attitude().is_none() || !term.effect.joins_throughout() {
        return model;
    }
    for other in problem.series.iter().enumerate().filter(|(k, s)| *k != series && can_show(term.effect, s)) {
        let own = model.axes[other.1.axis.index()].get_or_insert_with(|| AxisModel::base(other.1.axis));
        if !own.terms.iter().any(|t| t.effect.is_like(term.effect)) {
            let as_much = term.effect.is_of_whole_sensor();
            own.terms.push(if as_much { term.clone() } else { Term::neutral(term.effect, other.1.axis) });
        }
    }
    model
}

/// The study's model with one more term.
#[must_use]
pub(crate) fn with_term(study: &Study, series: usize, term: Term) -> Model {
    let mut model = study.model.clone();
    let axis = study.bench.problem.series[series].axis;
    model.axes[axis.index()].get_or_insert_with(|| AxisModel::base(axis)).terms.push(term);
    model
}
