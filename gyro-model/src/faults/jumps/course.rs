//! A reference beside the gyro's integral: what the two turn by, from each reading of the reference to the next.

use crate::{
    Axis, Record,
    faults::{
        channel::{Channel, Readings},
        quantum,
        thresholds::{
            COMPARABLE, DELAY_SEEN, DRIFT, FELT, HOLE, JUMP, LEAST_JUMP, LEAST_SLIP, NEAR_THE_END, SCALED, SLIP,
        },
        witness::{Witness, integral},
    },
    order::{median, quantile},
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Readings at the very end of a range that is too small.
const CUT_OFF: usize = 5;
/// Steps on either side that are nearby.
const NEARBY: usize = 25;
/// Share of the times that tell a delay, those in which least is turned more; how often it is found anew; the longest one, s.
const KEPT: f64 = 0.9;
const DELAYS: usize = 4;
const LATEST: f64 = 0.3;
/// Rows on either side in which a gyro may feel a jump.
const AROUND: usize = 5;

/// Step k leads from reading k − 1 to reading k; an angle's are along z alone.
pub(super) struct Course {
    /// Rows of the reference's readings.
    pub(super) rows: Vec<usize>,
    /// Their times, and how far they are usually apart, s.
    pub(super) t: Vec<f64>,
    pub(super) step: f64,
    /// What the gyro turned by, rad.
    pub(super) turned: Vec<Vector3<f64>>,
    /// What the reference turned by beyond that, rad; zero where nobody knows.
    pub(super) error: Vec<Vector3<f64>>,
    /// The gyro's rate there, rad/s.
    pub(super) rate: Vec<Vector3<f64>>,
    /// Steps that nobody knows: readings are missing, or at the range's end.
    pub(super) is_hole: Vec<bool>,
    /// From where on an error is a jump, rad.
    pub(super) limit: Vec<f64>,
    /// Whether it is of one shaft.
    pub(super) is_angle: bool,
    /// What the gyro's jerk makes in a step nearby, rad.
    felt: Vec<f64>,
    /// The least error that is far beyond the usual one, rad.
    pub(super) least: f64,
}

/// A gyro, calibrated by the reference as far as that is good.
struct Gyro {
    t: Vec<f64>,
    rate: Vec<f64>,
    turned: Vec<f64>,
    longest: f64,
    end: f64,
}

impl Gyro {
    fn of(record: &Record, axis: Axis) -> Option<Self> {
        let witness = Witness::of(record, axis)?;
        if !COMPARABLE.contains(&witness.slope.abs()) {
            return None;
        }
        let readings = Readings::of(record, Channel::Gyro(axis));
        let rate: Vec<f64> = readings.values.iter().map(|x| witness.slope * x + witness.offset).collect();
        let turned = integral(&readings.t, &rate);
        let end = readings.values.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let at_it = readings.values.iter().filter(|x| x.abs() >= end * (1.0 - 1e-9)).count();
        let near_it = (NEAR_THE_END * end - witness.offset.abs()) * witness.slope.abs();
        let end = if at_it < CUT_OFF { f64::INFINITY } else { near_it };
        Some(Self { longest: longest(&readings.t)?, t: readings.t, rate, turned, end })
    }

    /// Rate and angle at a time, and whether they are known.
    fn at(&self, t: f64) -> Option<(f64, f64)> {
        let k = self.t.partition_point(|&x| x <= t).clamp(1, self.t.len() - 1);
        let (from, to) = (self.t[k - 1], self.t[k]);
        let known = to - from <= self.longest && from - t <= self.longest && t - to <= self.longest;
        let is_cut = self.rate[k - 1].abs().max(self.rate[k].abs()) >= self.end;
        let share = ((t - from) / (to - from)).clamp(0.0, 1.0);
        let between = |values: &[f64]| values[k - 1] + share * (values[k] - values[k - 1]);
        (known && !is_cut).then(|| (between(&self.rate), between(&self.turned)))
    }

    /// How far the rate near a time goes from its middle there, rad/s.
    fn jerk(&self, t: f64) -> f64 {
        let k = self.t.partition_point(|&x| x < t);
        let near = &self.rate[k.saturating_sub(AROUND)..(k + AROUND + 1).min(self.rate.len())];
        let middle = median(near.to_vec()).unwrap_or(0.0);
        near.iter().map(|rate| (rate - middle).abs()).fold(0.0, f64::max)
    }
}

/// The longest that two readings may be apart.
fn longest(t: &[f64]) -> Option<f64> {
    let apart: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mean = apart.iter().sum::<f64>() / apart.len().max(1) as f64;
    Some(HOLE * quantile(apart, 0.5)?.max(mean))
}

/// The usual error of the steps near one, rad.
fn usual_near(error: &[Vector3<f64>], is_hole: &[bool], k: usize) -> f64 {
    let near = (k.saturating_sub(NEARBY)..(k + NEARBY + 1).min(error.len())).filter(|&i| !is_hole[i] && i != k);
    median(near.map(|i| error[i].norm()).collect()).unwrap_or(0.0)
}

impl Course {
    /// A shaft's, and its angles.
    pub(super) fn of_angle(record: &Record, axis: Axis) -> Option<(Self, Vec<f64>)> {
        let readings = Readings::of(record, Channel::Angle(axis));
        let gyro = [None, None, Some(Gyro::of(record, axis)?)];
        let values = readings.values.clone();
        let beyond = |k: usize, turned: Vector3<f64>| Vector3::new(0.0, 0.0, values[k] - values[k - 1] - turned.z);
        let count = quantum(&values);
        let count = if count.is_finite() { count } else { 0.0 };
        let course = Self::beside(&readings.rows, &readings.t, &gyro, beyond, count)?;
        Some((course, values))
    }

    /// An orientation's, and its attitudes; all three gyros are needed.
    pub(super) fn of_orientation(record: &Record) -> Option<(Self, Vec<UnitQuaternion<f64>>)> {
        let mut gyro = [None, None, None];
        for axis in Axis::ALL {
            gyro[axis.index()] = Some(Gyro::of(record, axis)?);
        }
        let has = |k: &usize| record.rows[*k].ref_quaternion.iter().all(|q| q.is_finite());
        let rows: Vec<usize> = (0..record.len()).filter(has).collect();
        let t: Vec<f64> = rows.iter().map(|&k| record.rows[k].t_ns as f64 * 1e-9).collect();
        let attitude: Vec<UnitQuaternion<f64>> = rows
            .iter()
            .map(|&k| {
                let [w, x, y, z] = record.rows[k].ref_quaternion;
                UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
            })
            .collect();
        let beyond = |k: usize, turned: Vector3<f64>| {
            let by = attitude[k - 1].inverse() * attitude[k];
            (UnitQuaternion::from_scaled_axis(turned).inverse() * by).scaled_axis()
        };
        let course = Self { is_angle: false, ..Self::beside(&rows, &t, &gyro, beyond, 0.0)? };
        Some((course, attitude))
    }

    /// The course with the delay between the two taken out as far as it is known.
    fn beside(
        rows: &[usize],
        t: &[f64],
        gyro: &[Option<Gyro>; 3],
        beyond: impl Fn(usize, Vector3<f64>) -> Vector3<f64>,
        count: f64,
    ) -> Option<Self> {
        let mut earlier = 0.0;
        let mut course = Self::along(rows, t, gyro, &beyond, count, earlier)?;
        for _ in 0..DELAYS {
            let more = course.slope(1, course.rows.len())?;
            if more.abs() < 0.1 * course.step || (earlier + more).abs() > LATEST {
                break;
            }
            earlier += more;
            course = Self::along(rows, t, gyro, &beyond, count, earlier)?;
        }
        Some(course)
    }

    fn along(
        rows: &[usize],
        t: &[f64],
        gyro: &[Option<Gyro>; 3],
        beyond: impl Fn(usize, Vector3<f64>) -> Vector3<f64>,
        count: f64,
        earlier: f64,
    ) -> Option<Self> {
        let n = rows.len();
        let longest = longest(t)?;
        let at = |t: f64| {
            let mut both = (Vector3::zeros(), Vector3::zeros());
            for (i, gyro) in gyro.iter().enumerate() {
                let Some(gyro) = gyro else { continue };
                (both.0[i], both.1[i]) = gyro.at(t)?;
            }
            Some(both)
        };
        let known: Vec<Option<(Vector3<f64>, Vector3<f64>)>> = t.iter().map(|&t| at(t + earlier)).collect();
        let (mut turned, mut error, mut is_hole) =
            (vec![Vector3::zeros(); n], vec![Vector3::zeros(); n], vec![true; n]);
        for k in 1..n {
            let (Some(before), Some(after)) = (known[k - 1], known[k]) else { continue };
            if t[k] - t[k - 1] <= longest {
                turned[k] = after.1 - before.1;
                error[k] = beyond(k, turned[k]);
                is_hole[k] = false;
            }
        }
        let sizes: Vec<f64> = (1..n).filter(|&k| !is_hole[k]).map(|k| error[k].norm()).collect();
        let whole = median(sizes)?.max(count);
        let least = LEAST_JUMP.max(JUMP * whole);
        // What is near matters, and is looked at, only where an error is large.
        let nearby = |k: usize| usual_near(&error, &is_hole, k);
        let limit = |k: usize| if error[k].norm() > least { least.max(JUMP * nearby(k)) } else { least };
        let limit = (0..n).map(limit).collect();
        let least_slip = LEAST_SLIP.max(SLIP * whole);
        let felt = (0..n).map(|k| {
            // Only where it matters: the median of each row's surroundings is dear.
            if k == 0 || error[k].norm() < LEAST_JUMP {
                return 0.0;
            }
            gyro.iter().flatten().map(|gyro| gyro.jerk(t[k] + earlier)).fold(0.0, f64::max) * (t[k] - t[k - 1])
        });
        let step = median(t.windows(2).map(|pair| pair[1] - pair[0]).collect())?;
        let (felt, rate) = (felt.collect(), known.iter().map(|at| at.map_or(Vector3::zeros(), |at| at.0)).collect());
        let (rows, t) = (rows.to_vec(), t.to_vec());
        Some(Self { rows, t, step, turned, error, rate, is_hole, limit, is_angle: true, felt, least: least_slip })
    }

    /// Whether each reading is reached by a jump.
    pub(super) fn cuts(&self) -> Vec<bool> {
        let is_cut = |k: usize| {
            let size = self.error[k].norm();
            size > self.limit[k] && self.felt[k] < FELT * size
        };
        (0..self.rows.len()).map(is_cut).collect()
    }

    /// The readings that are reached by a step far beyond the usual ones.
    pub(super) fn steps(&self) -> Vec<usize> {
        let is_step = |&k: &usize| {
            let size = self.error[k].norm();
            size > self.least && self.felt[k] < FELT * size && size > SLIP * usual_near(&self.error, &self.is_hole, k)
        };
        (1..self.rows.len()).filter(is_step).collect()
    }

    /// How far the reference at two readings may be apart from what the gyro turned between them, rad.
    pub(super) fn may_differ(&self, a: usize, b: usize) -> f64 {
        let way: f64 = self.turned[a.min(b) + 1..=a.max(b)].iter().map(Vector3::norm).sum();
        self.limit[a].max(self.limit[b]) + DRIFT * (self.t[a] - self.t[b]).abs() + SCALED * way
    }

    /// By how much earlier the gyro is against the reference behind a reading than before it, s.
    pub(super) fn change_of_delay(&self, index: usize) -> Option<f64> {
        let reach = (DELAY_SEEN.0 / self.step) as usize;
        let before = self.slope(index.saturating_sub(reach).max(1), index.saturating_sub(1))?;
        let after = self.slope(index + 1, (index + reach).min(self.rows.len()))?;
        Some(after - before)
    }

    /// By how much the gyro is earlier between two readings, s: the slope of what the reference turns more in some time on how
    /// the rate changes in it, without the times in which that is most, which may be jumps.
    fn slope(&self, from: usize, to: usize) -> Option<f64> {
        let over = ((DELAY_SEEN.1 / self.step).round() as usize).max(1);
        let times = (from..to.saturating_sub(over)).step_by((over / 3).max(1));
        let known = times.filter(|&k| !self.is_hole[k..=k + over].contains(&true));
        let both: Vec<(Vector3<f64>, Vector3<f64>)> =
            known.map(|k| (self.error[k + 1..=k + over].iter().sum(), self.rate[k + over] - self.rate[k])).collect();
        let most = quantile(both.iter().map(|(more, _)| more.norm()).collect(), KEPT)?;
        let kept = both.iter().filter(|(more, _)| more.norm() <= most);
        let (along, own) =
            kept.fold((0.0, 0.0), |(a, o), (more, change)| (a + more.dot(change), o + change.norm_squared()));
        (own > 0.0).then(|| along / own)
    }
}
