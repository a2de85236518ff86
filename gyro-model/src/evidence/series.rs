//! One axis of a log, laid out for evaluation: filled columns, reference rows, time.

use super::{
    coarse::between_steps,
    encoder::{Encoder, unwrap},
    encoder_noise::encoder_noise,
    heating::heating,
    integrate::{hermite, integral, three_point_slopes},
    line,
    rough::{median_apart, without_tones},
};
use crate::{
    Axis, Model, Record,
    effects::{Signals, Span},
    order::median,
    record::{FREE_CHANNELS, ReferenceKind, Walk},
};
use std::sync::{Arc, OnceLock};

/// The columns of one axis. Inputs have no holes: what is missing is interpolated and, for the gyro, marked lost
/// where that is for long.
#[derive(Clone, Debug)]
pub struct Series {
    /// The axis.
    pub axis: Axis,
    /// What it is judged against.
    pub kind: ReferenceKind,
    /// Time of each gyro sample since the log's first row, s.
    pub t: Vec<f64>,
    /// Reading, rad/s.
    pub gyro: Vec<f64>,
    /// How far the readings have turned, rad, where they are means that do not add up to it; else empty.
    pub turned: Vec<f64>,
    /// Samples that have a reading of their own; that of the others lies between those of their neighbours.
    pub read: Vec<bool>,
    /// Samples whose reading is missing, for too long to be told from its neighbours.
    pub missing: Vec<bool>,
    /// What else the regressors see.
    around: Arc<Around>,
    /// Indices (into the samples) of the rows with a reference.
    pub reference_rows: Vec<usize>,
    /// Their times, s.
    pub reference_t: Vec<f64>,
    /// Unwrapped reference angle there, rad (empty for quaternions).
    pub reference_angle: Vec<f64>,
    /// The encoder; without a step where the reference is none.
    pub encoder: Encoder,
    /// The reference rate there, rad/s (empty for angles).
    pub reference_rate: Vec<f64>,
    /// White noise where it was found before these readings were made of others.
    pub walk: Walk,
    /// How far a reading's noise may have carried it, rad/s.
    pub margin: f64,
    /// Whether it turns at all: else nothing is known of the scale.
    pub rest: Rest,
    /// The frequency at which its shaft goes to and fro, where that is all it does, Hz.
    pub one_line: Option<f64>,
    /// How far apart the knots are between which its reference turns evenly, where it does, s.
    pub knots: Option<f64>,
    /// The reference readings that say something of their own.
    pub readings: Vec<Reading>,
    /// The gyro's readings without vibrations, once they were asked for.
    quiet: OnceLock<Vec<f64>>,
}

/// What the regressors of an axis see beside its own motion: columns without holes, empty where the log has none.
#[derive(Clone, Debug)]
struct Around {
    rates: [Vec<f64>; 3],
    accel: [Vec<f64>; 3],
    /// T − 25 °C.
    delta_temperature: Vec<f64>,
    /// What its coarse steps take away from it, K; empty where they are fine.
    temperature_steps: Vec<f64>,
    temperature_dot: Vec<f64>,
    supply: Vec<f64>,
    /// The supply that its changes count from, V.
    origin: Option<f64>,
    free: Vec<Vec<f64>>,
}

/// Of a temperature as it was read, °C: T − 25 °C between its steps, what coarse steps take away from that (empty where they are fine), and
/// dT/dt.
fn around_a_temperature(t: &[f64], read: &[f64]) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let between = between_steps(t, read);
    let steps =
        between.iter().flat_map(|between| between.iter().zip(read).map(|(between, read)| read - between)).collect();
    let delta = between.as_deref().unwrap_or(read).iter().map(|temperature| temperature - 25.0).collect();
    (delta, steps, heating(t, read))
}

/// Whether an axis turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rest {
    /// It does.
    None,
    /// Its gyro says so, its reference does not.
    OfReference,
    /// Neither says so.
    Whole,
}

/// One independent reading of the reference: where an encoder shows the same count for a while, the middle of that while.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Index into the reference rows.
    pub row: usize,
    /// Its variance over that of a reading taken while the encoder turns fast, at most 1.
    pub spread: f64,
    /// The same of what the encoder's steps alone make it err by.
    pub steps: f64,
    /// How far the shaft is from what the encoder shows there, rad: it passes a count's centre before or after the middle
    /// of its time there where it is braked or driven.
    pub off: f64,
}

/// Fills holes by interpolation between neighbours; the ends by the nearest value. `None` where nothing is finite.
pub(crate) fn fill(t: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    let known: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_finite()).collect();
    let (&first, &last) = (known.first()?, known.last()?);
    let mut out = values.to_vec();
    out[..first].fill(values[first]);
    out[last..].fill(values[last]);
    for pair in known.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        for k in a + 1..b {
            let w = (t[k] - t[a]) / (t[b] - t[a]);
            out[k] = values[a] + w * (values[b] - values[a]);
        }
    }
    Some(out)
}

/// The same along a smooth curve where readings are as far apart as they usually are: of a rate that is read seldom, straight
/// lines would turn less at each bend.
pub(crate) fn curve(t: &[f64], values: &[f64]) -> Option<Vec<f64>> {
    let mut out = fill(t, values)?;
    let known: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_finite()).collect();
    if known.len() == values.len() || known.len() < 3 {
        return Some(out);
    }
    let (at, of): (Vec<f64>, Vec<f64>) = known.iter().map(|&k| (t[k], values[k])).unzip();
    let slopes = three_point_slopes(&at, &of);
    let longest = HOLE * usual(at.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let mut hint = 0;
    for pair in known.windows(2).filter(|pair| t[pair[1]] - t[pair[0]] <= longest) {
        for k in pair[0] + 1..pair[1] {
            out[k] = hermite(&at, &of, &slopes, t[k], &mut hint);
        }
    }
    Some(out)
}

/// Samples within and at the end of holes: stretches without a reading several times as long as readings are apart. How far
/// all has turned meanwhile is not known.
pub(crate) fn holes(t: &[f64], values: &[f64]) -> Vec<bool> {
    let known: Vec<usize> = (0..values.len()).filter(|&k| values[k].is_finite()).collect();
    let mut marks = vec![false; values.len()];
    let (Some(&first), Some(&last)) = (known.first(), known.last()) else { return marks };
    marks[..first].fill(true);
    marks[last + 1..].fill(true);
    let longest = HOLE * usual(known.windows(2).map(|pair| t[pair[1]] - t[pair[0]]).collect());
    for pair in known.windows(2).filter(|pair| t[pair[1]] - t[pair[0]] > longest) {
        marks[pair[0] + 1..=pair[1]].fill(true);
    }
    marks
}

/// How far apart in time samples usually are: the median or, where they come in bursts, the mean; ∞ for none.
pub(super) fn usual(apart: Vec<f64>) -> f64 {
    let mean = apart.iter().sum::<f64>() / apart.len() as f64;
    median(apart).map_or(f64::INFINITY, |median| median.max(mean))
}

/// So many times that is a hole.
pub(super) const HOLE: f64 = 3.5;

/// Which of these rows of a reference count, by their place: where the gyro is read at every second of them or fewer, those at which it
/// is. What is between two readings is made of their noise, and less of it.
fn beside_readings(rows: &[usize], read: &[bool]) -> Vec<usize> {
    let beside: Vec<usize> = (0..rows.len()).filter(|&k| read[rows[k]]).collect();
    let readings = match (rows.first(), rows.last()) {
        (Some(&first), Some(&last)) => read[first..=last].iter().filter(|read| **read).count(),
        _ => 0,
    };
    let are_most = beside.len() as f64 > MOST_READINGS * readings as f64;
    if are_most && (beside.len() as f64) < SELDOM * rows.len() as f64 { beside } else { (0..rows.len()).collect() }
}

/// Mean rates from each row to the next; at the last one that from the row before.
fn rates_between(t: &[f64], angle: &[f64]) -> Vec<f64> {
    let pairs = t.windows(2).zip(angle.windows(2));
    let mut rates: Vec<f64> = pairs.map(|(t, angle)| (angle[1] - angle[0]) / (t[1] - t[0])).collect();
    rates.extend(rates.last().copied());
    rates
}

/// Share of a gyro's readings that stand in rows of its reference, and share of those rows in which they do, where it is read seldom.
const MOST_READINGS: f64 = 0.9;
const SELDOM: f64 = 0.7;

/// Takes off, after each hole of a reference, the turns by which it is off what the gyro has turned meanwhile.
fn unwrap_over_holes(t: &[f64], angle: &mut [f64], turned: &[f64]) {
    use std::f64::consts::TAU;
    let longest = HOLE * usual(t.windows(2).map(|pair| pair[1] - pair[0]).collect());
    let mut offset = 0.0;
    for k in 1..angle.len() {
        angle[k] += offset;
        if t[k] - t[k - 1] > longest {
            let turns = ((angle[k] - angle[k - 1] - turned[k] + turned[k - 1]) / TAU).round() * TAU;
            offset -= turns;
            angle[k] -= turns;
        }
    }
}

/// Every reading of a reference that is not quantised.
fn each(count: usize) -> Vec<Reading> {
    (0..count).map(|row| Reading { row, spread: 1.0, steps: 1.0, off: 0.0 }).collect()
}

/// One reading a count that the encoder rests on: its middle, where the shaft stands near the count's centre if it
/// passes through. How near: rows sample the passage 1/p of a count apart; where the shaft turns round or stands it may be
/// anywhere. An encoder that goes on by the same number of counts from row to row rests too, seen from a shaft that turns
/// so fast: what it reads too much is the same for so long.
pub(super) fn rests(angle: &[f64], encoder: &Encoder) -> Vec<Reading> {
    let step = encoder.step;
    let steps: Vec<f64> = angle.windows(2).map(|w| ((w[1] - w[0]) / step).round()).collect();
    let mut readings = Vec::new();
    let mut first = 0;
    while first < angle.len() {
        let pace = steps.get(first).copied().unwrap_or(0.0);
        let rows = 1 + steps[first..].iter().take_while(|&&s| s == pace).count();
        let (rows, pace) = if pace == 0.0 || rows >= COHERENT { (rows, pace) } else { (1, 0.0) };
        let next = first + rows;
        // The earlier of two middle rows and the later in turn.
        let row = usize::midpoint(first, next - 1 + readings.len() % 2);
        let passage = Passage { steps: &steps, pace, first, next };
        let (own, off) = passage.at(row).map_or((1.0, 0.0), |(off, bend)| {
            let unsure = (rows as f64).powi(-2) + 12.0 * (BEND * bend).powi(2);
            (unsure.clamp(UNEVEN, 1.0), off * step)
        });
        readings.push(Reading { row, spread: encoder.spread(own), steps: own, off });
        first = next;
    }
    readings
}

/// The rows `first..next` in which an encoder rests on a count, seen from a shaft that goes on by `pace` counts a row.
struct Passage<'a> {
    /// Counts from row to row.
    steps: &'a [f64],
    pace: f64,
    first: usize,
    next: usize,
}

impl Passage<'_> {
    /// Counts that the encoder goes on by behind row `k`, against the direction of `forward` less than none; 0 where it ends.
    fn edge(&self, k: Option<usize>, forward: f64) -> f64 {
        k.and_then(|k| self.steps.get(k)).map_or(0.0, |step| (step - self.pace) * forward)
    }

    /// How far the shaft is from the count's centre at `row`, counts, and how much of that is because it does not go evenly:
    /// on the curve through the edges of this count, where it may turn round, and of those beside. `None` where it stands,
    /// or is there for one row only.
    fn at(&self, row: usize) -> Option<(f64, f64)> {
        let Self { steps, pace, first, next } = *self;
        let (into, out) = (first.checked_sub(1)?, next - 1);
        let forward = (steps[into] - pace).signum();
        let (entry, exit) = (self.edge(Some(into), forward), self.edge(Some(out), forward));
        let before = steps[..into].iter().rev().take_while(|&&s| s == pace).count();
        let after = steps.get(next..)?.iter().take_while(|&&s| s == pace).count();
        let (own, beside) = (next - first, 1 + before.min(after));
        let longest = if exit > 0.0 { PASSES } else { TURNS };
        if exit == 0.0 || own == 1 || own > longest * beside {
            return None;
        }
        // Edges lie half-way between two rows, and between two counts.
        let time = |edge: usize| edge as f64 + 0.5 - row as f64;
        let mut edges = vec![(time(into), -0.5 * entry), (time(out), 0.5 * exit)];
        let ((t0, p0), (t1, p1)) = (edges[0], edges[1]);
        let even = p0 - t0 * (p1 - p0) / (t1 - t0);
        let (behind, ahead) = (into.checked_sub(before + 1), next + after);
        let (past, future) = (self.edge(behind, forward), self.edge(Some(ahead), forward));
        if let Some(behind) = behind.filter(|_| past > 0.0) {
            edges.push((time(behind), -entry - 0.5 * past));
        }
        if future * exit > 0.0 {
            edges.push((time(ahead), exit + 0.5 * future));
        }
        if exit < 0.0 && edges.len() < 4 {
            return None;
        }
        let term = |i: usize| {
            let others = (0..edges.len()).filter(|&j| j != i);
            others.fold(edges[i].1, |p, j| p * edges[j].0 / (edges[j].0 - edges[i].0))
        };
        let curved = (0..edges.len()).map(term).sum::<f64>().clamp(-0.5, 0.5);
        Some((curved * forward, curved - even))
    }
}

/// Share of the readings' time, at either end, in which the reference is not held against them: clocks that run apart,
/// a delay or a slow response take the reading that is valid there to times that the log has none of.
const ENDS: f64 = 0.01;
/// Rows of an even pace that are taken for one reading: over fewer the error goes through a whole step so soon that it is
/// as good as white.
const COHERENT: usize = 32;
/// Times as long as on a count beside that an encoder may rest on one that the shaft passes through, and on one in which it
/// turns round: longer, and it stands.
const PASSES: usize = 3;
const TURNS: usize = 6;
/// Share of what uneven motion takes a reading off by that remains unsure.
const BEND: f64 = 0.5;
/// Least spread of a reading: an encoder's counts are not all of one width.
const UNEVEN: f64 = 0.05;

/// All that the layout of an axis takes from a model: scale factor and bias of the other axes, and the supply's origin.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Beside {
    rates: [(f64, f64); 3],
    supply: Option<f64>,
}

impl Beside {
    /// What it takes from this one.
    pub(crate) fn of(model: &Model, axis: Axis) -> Self {
        let calibrated = |other: Axis| model.axes[other.index()].as_ref().filter(|_| other != axis);
        let rates = Axis::ALL.map(|other| calibrated(other).map_or((1.0, 0.0), |own| (own.alpha(), own.delta())));
        Self { rates, supply: model.origin.supply }
    }
}

impl Series {
    /// Lays out one axis; `None` where it has no gyro or no reference. What its effects see of the other axes is what
    /// `model`'s scale factor and bias make of their readings.
    #[must_use]
    pub fn new(record: &Record, axis: Axis, model: &Model) -> Option<Self> {
        let (i, beside) = (axis.index(), Beside::of(model, axis));
        let kind = record.reference(axis)?;
        let rows = &record.rows;
        let t: Vec<f64> = rows.iter().map(|r| r.t_ns as f64 * 1e-9).collect();
        let column = |pick: &dyn Fn(usize) -> f64| -> Vec<f64> { (0..rows.len()).map(pick).collect() };
        let raw = column(&|k| rows[k].gyro[i]);
        let (read, missing): (Vec<bool>, _) = (raw.iter().map(|v| v.is_finite()).collect(), holes(&t, &raw));
        let gyro = curve(&t, &raw)?;
        let filled = |pick: &dyn Fn(usize) -> f64| fill(&t, &column(pick)).unwrap_or_default();
        let rates = std::array::from_fn(|a| {
            let (alpha, delta) = beside.rates[a];
            curve(&t, &column(&|k| alpha * rows[k].gyro[a] + delta)).unwrap_or_default()
        });
        let temperature = fill(&t, &column(&|k| rows[k].temperature)).unwrap_or_else(|| vec![25.0; t.len()]);
        let (delta_temperature, temperature_steps, temperature_dot) = around_a_temperature(&t, &temperature);
        let around = Arc::new(Around {
            rates,
            accel: std::array::from_fn(|a| filled(&|k| rows[k].accel[a])),
            delta_temperature,
            temperature_steps,
            temperature_dot,
            supply: filled(&|k| rows[k].supply),
            origin: beside.supply,
            free: (0..record.free_names.len().min(FREE_CHANNELS)).map(|c| filled(&|k| rows[k].free[c])).collect(),
        });
        let has = |k: &usize| match kind {
            ReferenceKind::Angle => rows[*k].ref_angle[i].is_finite(),
            ReferenceKind::Rate => rows[*k].ref_rate[i].is_finite(),
            ReferenceKind::Quaternion => rows[*k].ref_quaternion.iter().all(|q| q.is_finite()),
        };
        let (first, last) = (t[0], t[t.len() - 1]);
        let ends = ENDS * (last - first);
        let within = |k: &usize| t[*k] >= first + ends && t[*k] <= last - ends;
        let every_row: Vec<usize> = (0..rows.len()).filter(has).filter(within).collect();
        let every_t: Vec<f64> = every_row.iter().map(|&k| t[k]).collect();
        // Of an encoder each row tells when it counted; those of an orientation are all axes'.
        let picked = match kind {
            ReferenceKind::Angle | ReferenceKind::Quaternion => (0..every_row.len()).collect(),
            ReferenceKind::Rate => beside_readings(&every_row, &read),
        };
        let reference_rows: Vec<usize> = picked.iter().map(|&k| every_row[k]).collect();
        let reference_t: Vec<f64> = reference_rows.iter().map(|&k| t[k]).collect();
        let quiet = OnceLock::new();
        let (reference_angle, encoder, readings) = match kind {
            ReferenceKind::Angle => {
                let mut angle: Vec<f64> = reference_rows.iter().map(|&k| rows[k].ref_angle[i]).collect();
                unwrap(&mut angle);
                let turned = integral(&t, &gyro);
                let there: Vec<f64> = reference_rows.iter().map(|&k| turned[k]).collect();
                unwrap_over_holes(&reference_t, &mut angle, &there);
                let mut encoder = Encoder::of(record, axis, &angle);
                let quiet = || quiet.get_or_init(|| without_tones(&t, &gyro)).as_slice();
                encoder.noise = encoder_noise(&encoder, (&reference_t, &angle), (&t, quiet), &reference_rows);
                let readings = if encoder.shows_counts() { rests(&angle, &encoder) } else { each(angle.len()) };
                (angle, encoder, readings)
            }
            ReferenceKind::Rate => {
                let angle: Vec<f64> = if record.turned.is_empty() {
                    let rate: Vec<f64> = every_row.iter().map(|&k| rows[k].ref_rate[i]).collect();
                    let angle = integral(&every_t, &rate);
                    picked.iter().map(|&k| angle[k]).collect()
                } else {
                    reference_rows.iter().map(|&k| record.turned[k].reference[i]).collect()
                };
                let readings = each(angle.len());
                (angle, Encoder::NONE, readings)
            }
            ReferenceKind::Quaternion => (Vec::new(), Encoder::NONE, each(reference_rows.len())),
        };
        // Its rate from one of these rows to the next.
        let reference_rate = match kind {
            ReferenceKind::Rate if picked.len() == every_row.len() => {
                every_row.iter().map(|&k| rows[k].ref_rate[i]).collect()
            }
            ReferenceKind::Rate => rates_between(&reference_t, &reference_angle),
            ReferenceKind::Angle | ReferenceKind::Quaternion => Vec::new(),
        };
        let one_line = line::only(&reference_t, &reference_angle);
        (reference_rows.len() >= 20).then_some(Self {
            axis,
            kind,
            t,
            gyro,
            turned: record.turned.iter().map(|turned| turned.gyro[i]).collect(),
            read,
            missing,
            around,
            reference_rows,
            reference_t,
            reference_angle,
            encoder,
            reference_rate,
            walk: record.means.walk[i],
            margin: 0.0,
            rest: Rest::None,
            one_line,
            knots: None,
            readings,
            quiet,
        })
    }

    /// The gyro's readings without vibrations.
    pub(super) fn quiet(&self) -> &[f64] {
        self.quiet.get_or_init(|| without_tones(&self.t, &self.gyro))
    }

    /// Forgets these, which tell of the noise and are not needed any more once that is known.
    pub(super) fn forget_quiet(&mut self) {
        self.quiet.take();
    }

    /// Time from the sample before, s; 0 at the first.
    #[inline]
    #[must_use]
    pub fn dt(&self, k: usize) -> f64 {
        if k == 0 { 0.0 } else { self.t[k] - self.t[k - 1] }
    }

    /// Whether the temperature is in coarse steps.
    pub(super) fn has_coarse_temperature(&self) -> bool {
        !self.around.temperature_steps.is_empty()
    }

    /// Takes the temperature as it was read, its steps with it.
    pub(super) fn take_temperature_as_read(&mut self) {
        let around = Arc::make_mut(&mut self.around);
        let steps = std::mem::take(&mut around.temperature_steps);
        around.delta_temperature.iter_mut().zip(&steps).for_each(|(delta, step)| *delta += step);
    }

    /// What the regressors see at sample `k`, but for the rate that is known best, its derivative, and the angle.
    #[inline]
    #[must_use]
    pub fn signals(&self, k: usize) -> Signals {
        let around = &self.around;
        let at = |column: &Vec<f64>| column.get(k).copied().unwrap_or_default();
        let supply = at(&around.supply);
        Signals {
            t: self.t[k],
            dt: self.dt(k),
            axis: self.axis.index(),
            rates: around.rates.each_ref().map(at),
            accel: around.accel.each_ref().map(at),
            delta_temperature: at(&around.delta_temperature),
            temperature_dot: at(&around.temperature_dot),
            supply,
            delta_supply: around.origin.map_or(0.0, |origin| supply - origin),
            free: std::array::from_fn(|c| around.free.get(c).map_or(0.0, at)),
            ..Signals::default()
        }
    }

    /// ∫ rate dt over these times. Where the readings are means, α times what they have turned, and the integral of the rest.
    pub(super) fn angle_of(&self, alpha: f64, rate: &[f64], times: &[f64]) -> Vec<f64> {
        if self.turned.is_empty() {
            return integral(times, rate);
        }
        let rest: Vec<f64> = rate.iter().zip(&self.gyro).map(|(rate, gyro)| rate - alpha * gyro).collect();
        let mut angle = integral(times, &rest);
        let mut turned = 0.0;
        for k in 1..angle.len() {
            let stretch = (times[k] - times[k - 1]) / (self.t[k] - self.t[k - 1]);
            turned += alpha * stretch * (self.turned[k] - self.turned[k - 1]);
            angle[k] += turned;
        }
        angle
    }

    /// What the grids of shapes are chosen by.
    #[must_use]
    pub fn span(&self) -> Span {
        let (low, high) =
            self.reference_angle.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &x| (a.min(x), b.max(x)));
        Span {
            start: self.t[0],
            duration: self.t[self.t.len() - 1] - self.t[0],
            dt: median_apart(&self.t),
            reference_dt: median_apart(&self.reference_t),
            reading_min: self.gyro.iter().map(|g| g.abs()).filter(|&g| g > 0.0).fold(f64::INFINITY, f64::min),
            reading_max: self.gyro.iter().fold(0.0, |m, g| f64::max(m, g.abs())),
            travel: if high > low { high - low } else { 0.0 },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Row, diagnose,
        simulate::{Motion, Reference, Scenario, SensorSpec, simulate},
    };

    /// Largest error over floor of the true model on a log whose rows were spoilt.
    fn over(motion: Motion, sensor: &SensorSpec, most: usize, spoil: impl Fn(&mut Vec<Row>)) -> f64 {
        let scenario = Scenario { motion, seconds: 120.0, sensor: sensor.clone(), ..Scenario::default() };
        let mut simulated = simulate(&scenario);
        spoil(&mut simulated.record.rows);
        let record = crate::thin::thinned(&simulated.record, most);
        let options = diagnose::Options { own_log: true, ..diagnose::Options::default() };
        let axes = diagnose::compare(&record, &simulated.truth, &record.fitted_axes(), &options).unwrap();
        axes.iter().map(|a| a.error_over_floor.unwrap()).fold(0.0, f64::max)
    }

    #[test]
    fn what_turned_while_nothing_was_read_is_no_error() {
        let deleted = |rows: &mut Vec<Row>| {
            rows.drain(7000..8000);
            rows.drain(3000..3200);
            rows.drain(1000..1010);
        };
        let silent = |rows: &mut Vec<Row>| {
            for hole in [1000..1010, 3000..3100, 7000..7300] {
                rows[hole].iter_mut().for_each(|row| {
                    (row.ref_angle, row.ref_quaternion) = ([f64::NAN; 3], [f64::NAN; 4]);
                });
            }
        };
        let encoder = SensorSpec::default();
        let orientation = SensorSpec { reference: Reference::Quaternion, reference_noise: 1e-3, ..encoder.clone() };
        let fast = Motion::Sine { amplitude: 20.0, frequency: 0.05 };
        let (slow, drive) = (Motion::Multisine { travel: 6.0 }, Motion::Drive { rate: 1.2, hold: 2.0 });
        let whole = usize::MAX;
        for (motion, sensor, most) in [
            (slow, &encoder, whole),
            (slow, &encoder, 3000),
            (slow, &orientation, whole),
            (drive, &encoder, whole),
            (drive, &encoder, 3000),
            (drive, &orientation, whole),
            (fast, &encoder, whole),
            (fast, &encoder, 3000),
        ] {
            let overs = [over(motion, sensor, most, deleted), over(motion, sensor, most, silent)];
            assert!(overs.iter().all(|over| *over < 2.0), "{motion:?}, {:?}: {overs:?}", sensor.reference);
        }
    }

    const COUNTS: Encoder = Encoder { step: 1.0, ..Encoder::NONE };

    #[test]
    fn an_encoder_that_is_passed_slowly_says_more_at_the_middle_of_each_count_than_one_that_stands() {
        let counts: Vec<f64> = (0..60).map(|k| if k < 40 { f64::from(k / 4) } else { 10.0 }).collect();
        let readings = rests(&counts, &COUNTS);
        assert_eq!(readings.len(), 11);
        assert!(readings[5].spread < 0.3);
        // Neither earlier than the middles of the counts, in the mean, nor later.
        let early = (0..10).map(|k| 4.0 * k as f64 + 1.5 - readings[k].row as f64).sum::<f64>();
        assert_eq!(early, 0.0);
        assert!(readings[10].row == 49 && readings[10].spread == 1.0);
    }

    #[test]
    fn an_encoder_that_goes_on_at_an_even_pace_rests_in_the_frame_that_turns_with_it() {
        // 7.01 counts a row, then 7.4: there no reading is like the one before.
        let angle = |k: usize| 7.01 * k.min(1000) as f64 + 7.4 * k.saturating_sub(1000) as f64;
        let counts: Vec<f64> = (0..1200).map(|k| angle(k).round()).collect();
        let readings = rests(&counts, &COUNTS);
        let (even, uneven): (Vec<&Reading>, Vec<&Reading>) = readings.iter().partition(|r| r.row < 990);
        assert!((9..=12).contains(&even.len()), "{}", even.len());
        assert!(even[1..9].iter().all(|r| r.spread < 0.1), "{even:?}");
        assert!(even[1..9].iter().all(|r| (counts[r.row] - angle(r.row)).abs() < 0.05), "{even:?}");
        assert!(uneven.len() > 190);
    }

    #[test]
    fn a_count_that_is_passed_ever_slower_is_read_where_the_shaft_was() {
        // To and fro over some 25 counts, by rows that fall at other places of each swing.
        let angle = |k: usize| 12.3 * (0.031 * k as f64).sin() + 5.1 * (0.0173 * k as f64).cos();
        let counts: Vec<f64> = (0..20_000).map(|k| angle(k).round()).collect();
        let readings = rests(&counts, &COUNTS);
        // Its own part of the error and what goes with the acceleration, of readings that are said to be better than others.
        let (mut squares, mut along, mut before, mut own, mut n) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for r in readings.iter().filter(|r| r.spread < 0.99 && (1..19_999).contains(&r.row)) {
            let error = counts[r.row] + r.off - angle(r.row);
            let acceleration = angle(r.row + 1) - 2.0 * angle(r.row) + angle(r.row - 1);
            squares += error * error / (r.spread / 12.0);
            along += error * acceleration;
            before += (error - r.off) * acceleration;
            own += acceleration * acceleration;
            n += 1.0;
        }
        assert!(n > 3000.0, "{n}");
        assert!((0.4..1.2).contains(&(squares / n)), "{}", squares / n);
        let (along, before) = (along / own, before / own);
        assert!(along.abs() < 0.5 && before > 1.5, "{along}, {before}");
    }

    #[test]
    fn a_wrapped_angle_unwraps() {
        use std::f64::consts::TAU;
        let truth: Vec<f64> = (0..500).map(|k| f64::from(k) * 0.1).collect();
        let mut wrapped: Vec<f64> = truth.iter().map(|a| a.rem_euclid(TAU)).collect();
        unwrap(&mut wrapped);
        assert!(truth.iter().zip(&wrapped).all(|(a, b)| (a - b).abs() < 1e-9));
    }
}
