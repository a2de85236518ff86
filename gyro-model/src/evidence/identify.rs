//! The likeliest noise of a model's residual: where nothing is known of it, and beside one that is known to be near.
//!
//! Noise and parameters are sought in turn: the noise that is likeliest for the present residual
//! ([`super::likelihood`]), from starts that the periodogram gives ([`super::whittle`]), then generalised least squares
//! with that noise.

use super::{
    growth,
    likelihood::{self, AFTER, FIRST, Limits, WORTH},
    noise::{Gls, LASTS, WALK, at_noise, moved, normal, rows, solve},
    study::Study,
    whiten::{NoiseModel, Rows},
    whittle::Periodogram,
};

/// Rows that the search looks at, at most about so many. The estimate itself uses every row.
const SEARCH_ROWS: usize = 20_000;
/// Starts that are tried at first: the likeliest ones.
const TRIED: usize = 2;
/// Turns of noise and parameters at most: where nothing is known of the noise, and beside a known one.
const ROUNDS: usize = 4;
const NEAR_ROUNDS: usize = 2;
/// Fall of −2 ln L that is not sought any more beside a known noise.
const NEAR_ENOUGH: f64 = 0.02;
/// Rise of ln L from one turn to the next below which both are found.
const SETTLED: f64 = 0.05;
/// Rise of the approximate ln L with a correlated rate that is worth a look by the exact one: less than [`WORTH`], since the
/// two differ by a few.
const PROMISED: f64 = 2.0;
/// The same above which the exact one will find it worth its two parameters too.
const CERTAIN: f64 = 20.0;
/// What a start may lie above a known noise in −ln L after [`FIRST`] steps and still come to be the likelier one.
const HOPELESS: f64 = 10.0;
/// Correlation times that a walk is tried to be, as shares of the log.
const FORGETS: [f64; 2] = [5e-3, 0.05];
/// How far the angle random walk may lie below its prior.
const BELOW_PRIOR: f64 = 0.1;
/// Bias random walk over the angle's that is as good as none, 1/s.
const NO_WALK: f64 = 1e-6;
/// Fall of ln L up to which nobody sees a walk.
const UNSEEN: f64 = 0.5;

/// Maximum-likelihood noise with the parameters profiled out.
pub(crate) fn identify(study: &Study) -> Gls {
    let rows = search_rows(study);
    let limits = limits(study, &rows);
    let first = prior_noise(study);
    let mut step = vec![0.0; study.columns.len()];
    let span = rows.t.last().unwrap_or(&0.0) - rows.t.first().unwrap_or(&0.0);
    let mut noise = first;
    let mut before = f64::INFINITY;
    let mut known = vec![first];
    for round in 0..ROUNDS {
        let residual = moved(study, &step);
        let mut from = known;
        if let Some(periodogram) = Periodogram::new(&residual, study.bench.problem.times()) {
            let (few, many) = periodogram.search(&first);
            from.extend([few, many]);
        }
        let seek = |start: &NoiseModel, steps: usize| likelihood::seek(start, &rows, &residual, &limits, steps);
        // From the likelier starts for a while, from the best of them to the end.
        let polish = |from: &[NoiseModel], wide: bool, enough: f64| {
            let starts = from.iter().filter(|noise| (noise.correlated > 0.0) == wide);
            let mut starts: Vec<_> = starts.map(|start| (*start, seek(start, 0).1)).collect();
            starts.sort_by(|a, b| a.1.total_cmp(&b.1));
            starts.truncate(if round == 0 { TRIED } else { 1 });
            let best = starts.iter().map(|start| seek(&start.0, FIRST)).min_by(|a, b| a.1.total_cmp(&b.1))?;
            (best.1 < enough).then(|| seek(&best.0, AFTER))
        };
        let few = polish(&from, false, f64::INFINITY);
        if let Some((few, _)) = &few {
            from.extend(as_correlated(few, span, 2.0 * limits.shortest));
        }
        // A wider noise that comes no nearer will not come to be worth its two parameters.
        let many = polish(&from, true, few.as_ref().map_or(f64::INFINITY, |few| few.1));
        known = few.iter().chain(&many).map(|found| found.0).collect();
        let best = match (few, many) {
            (Some(few), Some(many)) if many.1 < few.1 - WORTH => many,
            (Some(few), _) => few,
            (None, Some(many)) => many,
            (None, None) => break,
        };
        noise = best.0;
        if best.1 > before - SETTLED {
            break;
        }
        before = best.1;
        step = solve(&normal(study, &noise).0).0;
    }
    finish(study, noise, step, &rows, &limits)
}

/// The same beside a noise that is known to be near: what a model leaves that differs in one effect.
pub(crate) fn near(study: &Study, known: &NoiseModel) -> Gls {
    let rows = search_rows(study);
    let limits = limits(study, &rows);
    let mut step = vec![0.0; study.columns.len()];
    let mut noise = *known;
    for round in 0..NEAR_ROUNDS {
        let residual = moved(study, &step);
        let (from, steps) = match round {
            0 => (near_starts(study, &residual, known), FIRST),
            _ => (vec![noise], AFTER),
        };
        let seek = |start| likelihood::seek_to(start, &rows, &residual, &limits, steps, NEAR_ENOUGH);
        let cost = |found: &(NoiseModel, f64)| found.1 + if found.0.correlated > 0.0 { WORTH } else { 0.0 };
        let Some(best) = from.iter().map(seek).min_by(|a, b| cost(a).total_cmp(&cost(b))) else { break };
        noise = best.0;
        step = solve(&normal(study, &noise).0).0;
    }
    finish(study, noise, step, &rows, &limits)
}

/// Where the likelihood sets out from beside a known noise: that, or what the periodogram says of a noise with and without a
/// correlated rate, as far as either may come to be the likelier one.
fn near_starts(study: &Study, residual: &[Vec<f64>], known: &NoiseModel) -> Vec<NoiseModel> {
    // A periodogram does not know what grows with the rate.
    let may_tell = known.rate_random_walk <= 0.0;
    let periodogram = may_tell.then(|| Periodogram::new(residual, study.bench.problem.times())).flatten();
    let Some(periodogram) = periodogram else { return vec![*known] };
    let (few, many) = periodogram.search(&prior_noise(study));
    let likelier = |a: NoiseModel, b: NoiseModel| if periodogram.cost(&a) < periodogram.cost(&b) { a } else { b };
    let few = likelier(few, NoiseModel { correlated: 0.0, ..*known });
    let many = if known.correlated > 0.0 { likelier(many, *known) } else { many };
    match periodogram.cost(&few) - periodogram.cost(&many) {
        promised if promised < PROMISED => vec![few],
        promised if promised > CERTAIN => vec![many],
        _ => vec![few, many],
    }
}

/// What the sensors' own signals say of the noise.
fn prior_noise(study: &Study) -> NoiseModel {
    let prior = &study.bench.prior[0];
    let n = prior.angle_random_walk.max(1e-12);
    NoiseModel {
        angle_random_walk: n,
        bias_random_walk: 0.01 * n,
        encoder: prior.encoder.max(1e-12),
        correlated: 0.0,
        correlation_time: 1.0,
        rate_random_walk: 0.0,
    }
}

/// What a noise without correlated rate may as well be: white noise that forgets within some rows, over `short` s, and, where a
/// walk rules the longer half of the averaging times, a rate that forgets.
fn as_correlated(noise: &NoiseModel, span: f64, short: f64) -> Vec<NoiseModel> {
    let mut list = vec![NoiseModel {
        angle_random_walk: 0.7 * noise.angle_random_walk,
        correlated: 0.5 * noise.angle_random_walk / short.sqrt(),
        correlation_time: short,
        ..*noise
    }];
    if noise.bias_random_walk * 0.05 * span > noise.angle_random_walk {
        list.extend(FORGETS.map(|share| {
            let time = share * span;
            let correlated = noise.bias_random_walk * (0.5 * time).sqrt();
            let bias_random_walk = 1e-3 * noise.bias_random_walk;
            NoiseModel { bias_random_walk, correlated, correlation_time: time, ..*noise }
        }));
    }
    list
}

/// What was found on some of the rows, the parameters having moved by `step`: whether it grows with the rate, and how large it
/// is on every row.
fn finish(study: &Study, found: NoiseModel, step: Vec<f64>, rows: &Rows, limits: &Limits) -> Gls {
    let (mut noise, mut step) = (found, step);
    if let Some(growing) = growth::growing(&noise, rows, &moved(study, &step), limits) {
        noise = growing;
        step = solve(&normal(study, &noise).0).0;
    }
    at_noise(study, &on_every_row(study, noise, &step, rows.index.len()))
}

/// The likeliest noise on every row, from one that was found on so many of them, the parameters having moved by `step`.
fn on_every_row(study: &Study, found: NoiseModel, step: &[f64], looked_at: usize) -> NoiseModel {
    let mut noise = found;
    // What was found on some of the rows is not the likeliest on all: noise that goes on from row to row looks another way
    // where every other row is left out.
    let all = rows(study, 1);
    if all.index.len() > looked_at {
        let (residual, limits) = (moved(study, step), limits(study, &all));
        noise = likelihood::seek_to(&noise, &all, &residual, &limits, ROUNDS * AFTER, NEAR_ENOUGH).0;
    }
    // A walk that hardly raises ln L is found now here, now there: none is as likely.
    let still = NoiseModel { bias_random_walk: NO_WALK * noise.angle_random_walk, ..noise };
    if noise.bias_random_walk > still.bias_random_walk {
        let (residual, limits) = (moved(study, step), limits(study, &all));
        let cost = |noise: &NoiseModel| likelihood::seek(noise, &all, &residual, &limits, 0).1;
        if cost(&still) < cost(&noise) + UNSEEN {
            noise = still;
        }
    }
    noise
}

/// Generalised least squares under the noise that is likeliest from `start` on, where that is likelier than `known`: what
/// is found for one model is tried on the other before the two are compared.
pub(crate) fn likelier(study: &Study, known: &Gls, start: &NoiseModel) -> Option<Gls> {
    let rows = rows(study, 1);
    let (residual, limits) = (moved(study, &known.step), limits(study, &rows));
    let seek =
        |start: &NoiseModel, steps: usize| likelihood::seek_to(start, &rows, &residual, &limits, steps, NEAR_ENOUGH);
    // From a walk that is nothing none would come back.
    let start = NoiseModel { bias_random_walk: start.bias_random_walk.max(known.noise.bias_random_walk), ..*start };
    let before = seek(&known.noise, 0).1;
    let (mut noise, mut cost) = seek(&start, FIRST);
    if cost > before + HOPELESS {
        return None;
    }
    let more = noise.logs().len().saturating_sub(known.noise.logs().len());
    let worth = SETTLED.max(0.5 * WORTH * more as f64);
    if cost > before - worth {
        (noise, cost) = seek(&noise, AFTER);
    }
    (cost < before - worth).then(|| at_noise(study, &noise)).filter(|gls| gls.log_likelihood > known.log_likelihood)
}

/// Generalised least squares under the largest bias random walk that the log does not speak against, ln L falling by at most
/// [`MAY_WALK`]: a walk too small to be seen still makes the bias of a log another than that of the next.
pub(crate) fn with_unseen_walk(study: &Study, gls: &Gls) -> Gls {
    let (rows, residual) = (search_rows(study), moved(study, &gls.step));
    let walking = |walk: f64| NoiseModel { bias_random_walk: walk, ..gls.noise };
    let cost = |walk: f64| likelihood::seek(&walking(walk), &rows, &residual, &limits(study, &rows), 0).1;
    let (mut low, mut high) = (gls.noise.bias_random_walk.max(1e-4 * WALK), WALK);
    let most = cost(gls.noise.bias_random_walk) + MAY_WALK;
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        *(if cost(middle) < most { &mut low } else { &mut high }) = middle;
    }
    if low > gls.noise.bias_random_walk { at_noise(study, &walking(low)) } else { gls.clone() }
}

/// Fall of ln L up to which a walk may well be there.
const MAY_WALK: f64 = 0.75;
/// Halvings of the range of such a walk, by its logarithm: it is found to a fifth.
const HALVINGS: usize = 6;

/// By how much ln L falls where no parameter of the noise may be larger than in `most`.
pub(crate) fn cost_of_limits(study: &Study, gls: &Gls, most: &NoiseModel) -> f64 {
    let rows = search_rows(study);
    let residual = moved(study, &gls.step);
    let any = limits(study, &rows);
    let limited = Limits { most: NoiseModel { correlation_time: any.most.correlation_time, ..*most }, ..any };
    let correlated = |time: f64| NoiseModel { correlated: most.correlated, correlation_time: time, ..gls.noise };
    let longest = any.most.correlation_time;
    let starts = [gls.noise, correlated(longest), correlated(0.1 * longest), correlated(0.01 * longest)];
    let seek = |start: &NoiseModel| likelihood::seek(start, &rows, &residual, &limited, FIRST + AFTER).1;
    let least = starts.iter().map(seek).fold(f64::INFINITY, f64::min);
    least - likelihood::seek(&gls.noise, &rows, &residual, &any, FIRST + AFTER).1
}

/// The readings over which noise is searched for.
fn search_rows(study: &Study) -> Rows {
    rows(study, (study.bench.problem.series[0].readings.len() / study.every).div_ceil(SEARCH_ROWS).max(1))
}

/// Any noise, but for how short and how long a correlated rate may last: below two rows it is white, beyond a share of the
/// log a drift. And but for how little white noise there is: a reading between two rows counts half on either side, so
/// beside a reference that is as good as exact the noise looks smoother than white, and less and less of it does as well.
fn limits(study: &Study, rows: &Rows) -> Limits {
    let span = rows.t.last().unwrap_or(&0.0) - rows.t.first().unwrap_or(&0.0);
    let step = rows.t.windows(2).map(|w| w[1] - w[0]).fold(f64::INFINITY, f64::min);
    let most = NoiseModel { correlation_time: (1.0 - 1e-9) * LASTS * span, ..NoiseModel::UNLIMITED };
    let quietest = BELOW_PRIOR * study.bench.prior[0].angle_random_walk;
    Limits { most, shortest: 2.0 * step, quietest }
}
