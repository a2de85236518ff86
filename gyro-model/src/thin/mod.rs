//! Fewer rows that say the same of slow things: means over blocks, of gyro and reference alike.
//!
//! A mean over time commutes with everything linear and steady: the mean angle's rate is the mean rate, so scale, bias and
//! delay stay what they were. How far the gyro has turned is averaged beside its rate: the mean rates of blocks alone do
//! not add up to it where a turn begins or ends within one. Gyro and reference have to be averaged about the same instant;
//! where a reference comes at every n-th row only, a block reaches from the middle between two references to the middle
//! between two others, a row that stands in such a middle counting half on each side.

mod growing;

pub use growing::Growing;

use crate::{
    Axis, Model, Record, Row,
    evidence::{
        encoder::Encoder,
        integrate::integral,
        prior::walks,
        problem::Problem,
        series::{curve, holes},
    },
    limits::Limits,
    order::median,
    record::{Means, Turned, Walk},
};
use std::f64::consts::{PI, TAU};

/// At most about `most` rows of this record, over its whole length; the newest rows where references of different
/// columns stand in different rows, which no block has about one instant.
#[must_use]
pub fn thinned(record: &Record, most: usize) -> Record {
    let most = most.max(1);
    if record.len() <= most {
        return record.clone();
    }
    let Some(manner) = Manner::of(record) else {
        let free_names = record.free_names.clone();
        return Record { free_names, ..record.part(record.len() - most..record.len()) };
    };
    let besides = besides(record, &manner.axes);
    let mut means = means(record, &besides, record.len().div_ceil(most), &manner);
    means.means.steps = Some(Encoder::steps(record));
    means.means.walk = walks_of(record, &manner.axes);
    means
}

/// How the rows of a log are averaged.
#[derive(Clone, Debug, PartialEq)]
struct Manner {
    axes: Vec<Axis>,
    /// The columns of the reference that count.
    reference: Pattern,
    limits: [Limits; 3],
}

impl Manner {
    /// `None` where references of different columns stand in different rows.
    fn of(record: &Record) -> Option<Self> {
        let (axes, reference) = (record.fitted_axes(), common_reference(record)?);
        let mut limits = [Limits::default(); 3];
        for i in axes.iter().map(|axis| axis.index()) {
            limits[i] = Limits::of(record.rows.iter().map(|row| row.gyro[i]));
        }
        Some(Self { axes, reference, limits })
    }
}

/// Means over blocks of so many rows at least. What has to be known of the log at its full rate is left open.
fn means(record: &Record, besides: &[Beside], block: usize, manner: &Manner) -> Record {
    let mut thinner = Thinner::new(block, manner.reference != NONE);
    thinner.limits = manner.limits;
    let counted = |row: &Row| if pattern(row) == manner.reference { *row } else { without_reference(row) };
    let rows = record.rows.iter().zip(besides);
    let (rows, turned) = rows.filter_map(|(row, beside)| thinner.push_beside(&counted(row), *beside)).unzip();
    let means = Means { readings: record.means.readings * thinner.readings(), ..record.means };
    Record { rows, free_names: record.free_names.clone(), means, turned, ..Record::default() }
}

/// White noise on these axes: the median of what stretches all over the record say.
fn walks_of(record: &Record, axes: &[Axis]) -> [Walk; 3] {
    let references = record.rows.iter().filter(|row| is_referenced(row)).count().max(1);
    let rows = STRETCH.max(REFERENCES * record.len().div_ceil(references)).min(record.len());
    let apart = (record.len() / STRETCHES).max(rows);
    let starts = (0..=record.len() - rows).step_by(apart);
    let stretches: Vec<Record> = starts.map(|start| record.part(start..start + rows)).collect();
    let mut found = [Walk::UNKNOWN; 3];
    for &axis in axes {
        let of = |stretch: &Record| Some(walks(&Problem::new(stretch, &[axis], &Model::default())?)[0]);
        let all: Vec<Walk> = stretches.iter().filter_map(of).collect();
        let median = |part: fn(&Walk) -> f64| median(all.iter().map(part).collect()).unwrap_or(f64::NAN);
        found[axis.index()] = Walk {
            gyro: median(|walk| walk.gyro),
            assumed: 2 * all.iter().filter(|walk| walk.assumed).count() > all.len(),
            reference: median(|walk| walk.reference),
        };
    }
    found
}

/// Stretches that N is found from, and the rows and references of each at least.
const STRETCHES: usize = 9;
const STRETCH: usize = 1000;
const REFERENCES: usize = 40;

/// What comes with a row: how far all has turned by then, and which gyros' readings a hole has swallowed.
#[derive(Clone, Copy, Debug, Default)]
struct Beside {
    turned: Turned,
    hole: [bool; 3],
}

/// What comes with each row about these axes; how far the reference has turned only where it has a rate.
fn besides(record: &Record, axes: &[Axis]) -> Vec<Beside> {
    let t: Vec<f64> = record.rows.iter().map(|row| row.t_ns as f64 * 1e-9).collect();
    let mut all = vec![Beside::default(); t.len()];
    for i in axes.iter().map(|axis| axis.index()) {
        let gyro: Vec<f64> = record.rows.iter().map(|row| row.gyro[i]).collect();
        for (beside, hole) in all.iter_mut().zip(holes(&t, &gyro)) {
            beside.hole[i] = hole;
        }
        for (beside, angle) in all.iter_mut().zip(curve(&t, &gyro).map_or_else(Vec::new, |gyro| integral(&t, &gyro))) {
            beside.turned.gyro[i] = angle;
        }
        let known: Vec<usize> = (0..t.len()).filter(|&k| record.rows[k].ref_rate[i].is_finite()).collect();
        let of = |value: &dyn Fn(usize) -> f64| -> Vec<f64> { known.iter().map(|&k| value(k)).collect() };
        let angle = integral(&of(&|k| t[k]), &of(&|k| record.rows[k].ref_rate[i]));
        for (&k, angle) in known.iter().zip(angle) {
            all[k].turned.reference[i] = angle;
        }
    }
    for (beside, turned) in all.iter_mut().zip(&record.turned) {
        beside.turned = *turned;
    }
    all
}

/// The columns whose references stand in nearly all rows that have one; `None` where there are no such columns.
fn common_reference(record: &Record) -> Option<Pattern> {
    let mut counts = [0_usize; 1 << 7];
    record.rows.iter().for_each(|row| counts[usize::from(pattern(row))] += 1);
    counts[usize::from(NONE)] = 0;
    let all: usize = counts.iter().sum();
    let (common, count) = (NONE..1 << 7).zip(counts).max_by_key(|(_, count)| *count)?;
    if all == 0 {
        return Some(NONE);
    }
    (count as f64 >= NEARLY * all as f64).then_some(common)
}

/// Share of the rows with a reference that have it in all of its columns.
const NEARLY: f64 = 0.9;

/// Which columns of a reference a row has: a bit each for three angles, three rates and the orientation.
type Pattern = u8;

const NONE: Pattern = 0;

fn without_reference(row: &Row) -> Row {
    Row { ref_angle: [f64::NAN; 3], ref_rate: [f64::NAN; 3], ref_quaternion: [f64::NAN; 4], ..*row }
}

fn pattern(row: &Row) -> Pattern {
    let bit = |value: f64, place: usize| u8::from(value.is_finite()) << place;
    (0..3).fold(bit(row.ref_quaternion[0], 6), |bits, i| bits | bit(row.ref_angle[i], i) | bit(row.ref_rate[i], 3 + i))
}

fn is_referenced(row: &Row) -> bool {
    pattern(row) != NONE
}

/// Means over blocks of a stream, block by block.
#[derive(Clone, Debug)]
pub struct Thinner {
    /// Rows of a block at least.
    rows: usize,
    /// Blocks end between references; else after so many rows.
    by_reference: bool,
    /// The block's rows so far.
    pending: Vec<(Row, Beside)>,
    /// Those of them that have a reference.
    anchors: Vec<usize>,
    /// Whether the first one counts half, the other half being the block's before.
    shared: bool,
    /// Whether the block begins at the middle between two references, and not at the stream's first row.
    begun: bool,
    /// Of each axis, the last reference angle and how far the gyro had turned by then.
    angle: [Option<(f64, f64)>; 3],
    /// Blocks so far, and the rows with a reference in them.
    blocks: usize,
    referenced: usize,
    /// Of each axis' readings: a block that touches one stands at it, for what it would have read is not known.
    limits: [Limits; 3],
}

impl Thinner {
    /// Blocks of `rows` rows at least. `by_reference`: they end between two rows that have one.
    #[must_use]
    pub fn new(rows: usize, by_reference: bool) -> Self {
        Self {
            rows: rows.max(1),
            by_reference,
            pending: Vec::new(),
            anchors: Vec::new(),
            shared: false,
            begun: false,
            angle: [None; 3],
            blocks: 0,
            referenced: 0,
            limits: [Limits::default(); 3],
        }
    }

    /// Takes a row; the mean of a block that is complete with it. Angles come out unwrapped.
    pub fn push(&mut self, row: &Row) -> Option<Row> {
        self.push_beside(row, Beside::default()).map(|(row, _)| row)
    }

    /// The same with what comes with the row.
    fn push_beside(&mut self, row: &Row, beside: Beside) -> Option<(Row, Turned)> {
        let mut row = *row;
        for (i, angle) in row.ref_angle.iter_mut().enumerate().filter(|(_, angle)| angle.is_finite()) {
            // The whole turns of an encoder that wraps, or was not read for a while, are the gyro's.
            if let Some((last, turned)) = self.angle[i] {
                let expected = last + beside.turned.gyro[i] - turned;
                *angle = expected + (*angle - expected + PI).rem_euclid(TAU) - PI;
            }
            self.angle[i] = Some((*angle, beside.turned.gyro[i]));
        }
        let is_anchor = !self.by_reference || is_referenced(&row);
        self.pending.push((row, beside));
        if !is_anchor {
            return None;
        }
        let new = self.pending.len() - 1;
        let Some(&last) = self.anchors.last() else {
            self.anchors.push(new);
            // What came before the stream's first reference says nothing.
            if !self.begun {
                self.pending.drain(..new);
                self.anchors[0] = 0;
            }
            return None;
        };
        // The middle between the two references, in half rows: on a row where it is even.
        let middle = last + new;
        if middle + 1 < 2 * self.rows + usize::from(self.shared) {
            self.anchors.push(new);
            return None;
        }
        let shares = middle.is_multiple_of(2);
        let end = middle / 2 + 1;
        // A first block that lacks its first half has gyro and reference about different instants.
        let whole = self.begun || new == last + 1;
        let mean = whole.then(|| self.mean(end, shares));
        self.blocks += 1;
        self.referenced += self.anchors.len();
        self.pending.drain(..if shares { end - 1 } else { end });
        self.anchors.clear();
        self.anchors.push(self.pending.len() - 1);
        (self.shared, self.begun) = (shares, true);
        mean
    }

    /// Readings of the reference in a block, about.
    #[must_use]
    pub fn readings(&self) -> usize {
        (self.referenced / self.blocks.max(1)).max(1)
    }

    /// The mean of the first `end` pending rows, the last one counting half where it is shared.
    fn mean(&self, end: usize, shares: bool) -> (Row, Turned) {
        let rows = &self.pending[..end];
        let weight = |k: usize| {
            let first = if k == 0 && self.shared { 0.5 } else { 1.0 };
            if k + 1 == end && shares { 0.5 * first } else { first }
        };
        let read =
            |value: &dyn Fn(&Row) -> f64| mean(rows.iter().enumerate().map(|(k, (row, _))| (weight(k), value(row))));
        let anchors = || self.anchors.iter().map(|&k| &rows[k]);
        let referred = |value: &dyn Fn(&Row) -> f64| mean(anchors().map(|(row, _)| (1.0, value(row))));
        let (first, _) = rows[self.anchors[0]];
        let later = referred(&|row| (row.t_ns - first.t_ns) as f64);
        let row = Row {
            t_ns: first.t_ns + later.round() as i64,
            gyro: std::array::from_fn(|i| {
                if rows.iter().any(|(_, beside)| beside.hole[i]) {
                    return f64::NAN;
                }
                let touched = rows.iter().find_map(|(row, _)| self.limits[i].stands_at(row.gyro[i]));
                touched.unwrap_or_else(|| read(&|row| row.gyro[i]))
            }),
            accel: std::array::from_fn(|i| read(&|row| row.accel[i])),
            ref_angle: std::array::from_fn(|i| referred(&|row| row.ref_angle[i])),
            ref_rate: std::array::from_fn(|i| referred(&|row| row.ref_rate[i])),
            ref_quaternion: mean_rotation(first.ref_quaternion, anchors().map(|(row, _)| row.ref_quaternion)),
            temperature: read(&|row| row.temperature),
            supply: read(&|row| row.supply),
            free: std::array::from_fn(|i| read(&|row| row.free[i])),
        };
        let angle = |value: &dyn Fn(&Turned) -> f64| mean(anchors().map(|(_, beside)| (1.0, value(&beside.turned))));
        let turned = Turned {
            gyro: std::array::from_fn(|i| angle(&|turned| turned.gyro[i])),
            reference: std::array::from_fn(|i| angle(&|turned| turned.reference[i])),
        };
        (row, turned)
    }
}

/// Weighted mean of the finite values; `NaN` where there is none.
fn mean(values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (sum, weight) =
        values.filter(|(_, v)| v.is_finite()).fold((0.0, 0.0), |(sum, all), (w, v)| (sum + w * v, all + w));
    if weight > 0.0 { sum / weight } else { f64::NAN }
}

/// Quaternions of one block lie close together: their mean on the side of `first`, made a unit again.
fn mean_rotation(first: [f64; 4], all: impl Iterator<Item = [f64; 4]>) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for q in all {
        let side = if (0..4).map(|i| first[i] * q[i]).sum::<f64>() < 0.0 { -1.0 } else { 1.0 };
        sum.iter_mut().zip(q).for_each(|(s, v)| *s += side * v);
    }
    let length = sum.iter().map(|v| v * v).sum::<f64>().sqrt();
    sum.map(|v| v / length)
}

#[cfg(test)]
mod tests {
    use super::{TAU, thinned};
    use crate::{
        Axis, Model, Record, Row, Term, diagnose, effects,
        fit::fit,
        simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
    };

    /// A late gyro whose reference comes at every n-th row.
    fn late(every: usize, rate_hz: f64) -> (Record, Model) {
        let motion = Motion::Drive { rate: 1.2, hold: 2.0 };
        let sensor = SensorSpec { reference_every: every, ..SensorSpec::default() };
        let hidden = vec![Hidden::parse("delay:d=0.012", Axis::X).unwrap()];
        let simulated = simulate(&Scenario { motion, seconds: 60.0, rate_hz, sensor, hidden, ..Scenario::default() });
        (simulated.record, simulated.truth)
    }

    #[test]
    fn a_thinned_log_has_the_same_parameters_however_rare_its_reference() {
        for every in [1, 2, 3, 4, 5] {
            let (record, truth) = late(every, 400.0);
            let thin = thinned(&record, 6000);
            assert!(thin.len() <= 6000 && thin.len() > 3000, "{every}: {}", thin.len());
            let mut model = Model::base_for(&thin);
            if let Some(axis) = &mut model.axes[0] {
                axis.terms.push(Term::neutral(effects::find("delay").unwrap(), Axis::X));
            }
            let model = fit(&thin, &model, &[Axis::X]).unwrap();
            let found = model.axes[0].as_ref().unwrap();
            for term in &truth.axes[0].as_ref().unwrap().terms {
                let id = term.effect.card().id;
                let (value, std_error) = found.term(id).map(|t| (t.values[0], t.std_errors[0])).unwrap();
                let error = value - term.values[0];
                assert!(error.abs() < 5.0 * std_error, "every {every}, {id}: off by {error}, ± {std_error}");
            }
        }
    }

    #[test]
    fn what_an_encoders_steps_leave_in_means_is_known_from_the_steps() {
        let (record, truth) = late(1, 1000.0);
        for most in [15_000, 4000, 1500] {
            let thin = thinned(&record, most);
            let steps = thin.means.steps.unwrap();
            assert!((steps[0] / (TAU / 4096.0) - 1.0).abs() < 0.01, "{steps:?}");
            let options = diagnose::Options { own_log: true, ..diagnose::Options::default() };
            let judged = diagnose::compare(&thin, &truth, &[Axis::X], &options).unwrap();
            let over = judged[0].error_over_floor.unwrap();
            assert!(over < 1.3, "{most} rows: {over} times the floor");
        }
    }

    #[test]
    fn a_turn_that_begins_and_ends_within_a_block_is_no_error() {
        for every in [1, 4] {
            let (record, truth) = late(every, 100.0);
            for most in [2000, 600, 150] {
                let thin = thinned(&record, most);
                let options = diagnose::Options { own_log: true, ..diagnose::Options::default() };
                let judged = diagnose::compare(&thin, &truth, &[Axis::X], &options).unwrap();
                let points = &judged[0].error_curve;
                let over =
                    points.iter().map(|p| p.error.unwrap() / p.floor.unwrap()).sum::<f64>() / points.len() as f64;
                assert!((0.75..1.3).contains(&over), "every {every}, {most} rows: {over} times the floor");
            }
        }
    }

    #[test]
    fn a_line_stays_where_it_is_in_time() {
        for every in [1, 2, 3, 4, 7] {
            let rows = (0..1000_i64).map(|k| {
                let t = k as f64 * 1e-3;
                let mut row = Row { t_ns: k * 1_000_000, ..Row::EMPTY };
                row.gyro[2] = 3.0 * t;
                if k % every == 0 {
                    row.ref_angle[2] = (40.0 * t).rem_euclid(TAU);
                }
                row
            });
            let thin = thinned(&Record { rows: rows.collect(), ..Record::default() }, 40);
            assert!(thin.len() > 20 && thin.len() <= 40, "{every}: {}", thin.len());
            for row in &thin.rows {
                let t = row.t_ns as f64 * 1e-9;
                assert!((row.gyro[2] - 3.0 * t).abs() < 1e-9, "{every}: {row:?}");
                assert!((row.ref_angle[2] - 40.0 * t).abs() < 1e-6, "{every}: {row:?}");
            }
        }
    }

    #[test]
    fn where_references_stand_in_different_rows_the_newest_rows_are_kept() {
        let (mut record, _) = late(1, 100.0);
        for k in (0..record.len()).step_by(2) {
            record.rows[k].ref_rate[1] = 0.1;
        }
        let thin = thinned(&record, 500);
        assert_eq!((thin.len(), thin.rows[499].t_ns), (500, record.rows.last().unwrap().t_ns));
    }
}
