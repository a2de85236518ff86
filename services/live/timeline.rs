//! A source's own times made times that only grow: single ones out of place are left out, and where the clock begins
//! again or jumps the stream's time goes on by ours, over a hole that keeps apart what does not belong together.

use super::{Fault, Tally};
use gyro_model::Row;

/// A row that goes on.
#[derive(Clone, Copy, Debug)]
pub struct Timed {
    /// With its time in the stream, ns.
    pub row: Row,
    /// When it came, ns.
    pub arrived_ns: u64,
    /// The source's own time of the stream's beginning, by which the row's time is told, ns.
    pub start_ns: i128,
}

/// What an earlier life gave last.
#[derive(Clone, Copy, Debug)]
pub struct Given {
    /// The row's time in the stream, ns.
    pub time_ns: i64,
    /// When it came, ns of our clock.
    pub arrived_ns: u64,
    /// The source's own time of the stream's beginning, ns.
    pub start_ns: i128,
}

/// The times of one stream.
#[derive(Debug)]
pub struct Timeline {
    /// What is taken off the source's own time, ns.
    offset: i128,
    last: Option<Last>,
    /// The source's usual step, ns, and steps seen.
    step: f64,
    steps: u64,
    /// A row far ahead of its time, until the next one tells whether it was right.
    ahead: Option<(Timed, i128)>,
    /// Rows in a row that were behind, and the last one's time.
    behind: (u64, i128),
    begins: bool,
    /// A clock that is ahead of ours by more has jumped, ns.
    jump: i128,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    own: i128,
    given_ns: i64,
    arrived_ns: u64,
}

/// A step counts as ahead where it is this many usual ones.
const AHEAD: f64 = 10.0;
/// Steps after which it is known what is usual.
const KNOWN: u64 = 8;
/// So many rows behind, each later than the one before, are a clock that began again.
const BEGAN_AGAIN: u64 = 5;
/// Usual steps that keep two segments apart: more than any hole that is bridged.
const APART: f64 = 6.0;
/// How late a row may have come that an earlier life gave last: by as much may a source's clock be ahead of ours after it, ns.
const CAME_LATE: i128 = 1_000_000_000;
/// Later than any time that a source can tell, ns.
const NEVER: i128 = 10_i128.pow(30);
/// A jump of a live source's clock, ns.
pub const LIVE_JUMP_NS: i128 = 10_000_000_000;
/// A jump in a pipe, where a log may come faster than it was recorded, ns.
pub const PIPE_JUMP_NS: i128 = 3_600_000_000_000;

impl Timeline {
    /// A stream that begins, or goes on after what an earlier life gave.
    #[must_use]
    pub fn new(jump: i128, given: Option<Given>) -> Self {
        let of = |given: Given| Last { own: NEVER, given_ns: given.time_ns, arrived_ns: given.arrived_ns };
        let (last, offset) = (given.map(of), given.map_or(0, |given| given.start_ns));
        Self { offset, last, step: 0.0, steps: 0, ahead: None, behind: (0, 0), begins: last.is_some(), jump }
    }

    /// The source may have begun again: the next time that goes back does it.
    pub fn expect_beginning(&mut self) {
        self.begins = true;
    }

    /// The source's own time of the stream's beginning, ns.
    #[must_use]
    pub fn start_ns(&self) -> i128 {
        self.offset
    }

    /// Takes a row of the source's time `own`; gives on what is in order.
    pub fn take(&mut self, row: Row, own: i128, arrived_ns: u64, tally: &mut Tally, mut give: impl FnMut(Timed)) {
        let timed = Timed { row, arrived_ns, start_ns: self.offset };
        let Some(last) = self.last else {
            self.offset = own;
            self.pass(timed, own, &mut give);
            return;
        };
        if last.own == NEVER && self.is_same_clock(last, own, arrived_ns) {
            self.pass(timed, own, &mut give);
            return;
        }
        if let Some((ahead, ahead_own)) = self.ahead {
            if own > ahead_own {
                self.ahead = None;
                self.accept(ahead, ahead_own, tally, &mut give);
                self.take(row, own, arrived_ns, tally, give);
                return;
            }
            if own > last.own {
                self.ahead = None;
                tally.add(Fault::Time, "the time jumped ahead for one row");
            }
        }
        let step = own - last.own;
        if step <= 0 {
            self.fall_behind(timed, own, tally, &mut give);
        } else if self.is_ahead(step, arrived_ns - last.arrived_ns.min(arrived_ns)) {
            self.ahead = Some((timed, own));
        } else {
            self.accept(timed, own, tally, &mut give);
        }
    }

    /// Whether a source's clock went on since an earlier life: the times between are then known by it. What came late would shift
    /// them by as much, and the angle of a reference would seem to jump.
    ///
    /// The same clock is later than it was, and by no more than went by. One that began again since shows no more than what went by:
    /// where it showed more before, it is earlier now. Where it showed less before, only what is later than that is certain, and what
    /// is not certain counts as begun again.
    fn is_same_clock(&self, last: Last, own: i128, arrived_ns: u64) -> bool {
        let before = self.offset + i128::from(last.given_ns);
        let elapsed = i128::from(arrived_ns.saturating_sub(last.arrived_ns));
        let cannot_have_begun_again = before > elapsed || own > elapsed;
        before < own && own <= before + elapsed + CAME_LATE && cannot_have_begun_again
    }

    fn is_ahead(&self, step: i128, elapsed_ns: u64) -> bool {
        let usual = self.steps >= KNOWN && step as f64 > AHEAD * self.step;
        let first = self.steps < KNOWN && step > 1_000_000_000;
        (usual || first) && step > 2 * i128::from(elapsed_ns)
    }

    fn fall_behind(&mut self, timed: Timed, own: i128, tally: &mut Tally, give: &mut impl FnMut(Timed)) {
        let (count, before) = self.behind;
        self.behind = (if count == 0 || own > before { count + 1 } else { 1 }, own);
        if self.begins || self.behind.0 >= BEGAN_AGAIN {
            if self.ahead.take().is_some() {
                tally.add(Fault::Time, "the time jumped ahead for one row");
            }
            self.begin_segment(timed, own, tally, "the source's clock began again", give);
        } else {
            tally.add(Fault::Time, "the time repeats or goes back");
        }
    }

    /// A row whose time is later than the last, be it by much.
    fn accept(&mut self, timed: Timed, own: i128, tally: &mut Tally, give: &mut impl FnMut(Timed)) {
        let Some(last) = self.last else { return };
        let elapsed = i128::from(timed.arrived_ns.saturating_sub(last.arrived_ns));
        let step = own - last.own;
        if step - elapsed > self.jump || i64::try_from(own - self.offset).is_err() {
            self.begin_segment(timed, own, tally, "the source's clock jumped ahead", give);
            return;
        }
        let weight = 1.0 / (self.steps + 1).min(64) as f64;
        let usual =
            if self.steps < KNOWN { step as f64 } else { (step as f64).clamp(0.3 * self.step, 3.0 * self.step) };
        self.step += weight * (usual - self.step);
        self.steps += 1;
        self.pass(timed, own, give);
    }

    fn begin_segment(&mut self, timed: Timed, own: i128, tally: &mut Tally, says: &str, give: &mut impl FnMut(Timed)) {
        let Some(last) = self.last else { return };
        let elapsed = i64::try_from(timed.arrived_ns.saturating_sub(last.arrived_ns)).unwrap_or(i64::MAX);
        let hole = (APART * self.step) as i64;
        let given = last.given_ns.saturating_add(elapsed.max(hole).max(1));
        self.offset = own - i128::from(given);
        tally.begin_segment(says);
        self.pass(timed, own, give);
    }

    fn pass(&mut self, mut timed: Timed, own: i128, give: &mut impl FnMut(Timed)) {
        timed.row.t_ns = (own - self.offset) as i64;
        timed.start_ns = self.offset;
        self.last = Some(Last { own, given_ns: timed.row.t_ns, arrived_ns: timed.arrived_ns });
        self.behind = (0, 0);
        self.begins = false;
        give(timed);
    }
}

#[cfg(test)]
mod tests {
    use super::{Given, LIVE_JUMP_NS, Row, Tally, Timeline};
    use gyro_model::{
        Axis, AxisModel, Model,
        estimator::{Estimator, Options},
    };

    const MS: i128 = 1_000_000;

    /// Times given, ms, of own times that arrive at these times, both in ms.
    fn given(own_and_arrived: &[(i128, u64)]) -> (Vec<i64>, Tally) {
        let (mut timeline, mut tally, mut out) = (Timeline::new(LIVE_JUMP_NS, None), Tally::default(), Vec::new());
        for &(own, arrived) in own_and_arrived {
            timeline.take(Row::EMPTY, own * MS, arrived * 1_000_000, &mut tally, |t| out.push(t.row.t_ns / 1_000_000));
        }
        (out, tally)
    }

    fn even(from: i128, rows: u64, arrived: u64) -> Vec<(i128, u64)> {
        (0..rows).map(|k| (from + 10 * i128::from(k), arrived + 10 * k)).collect()
    }

    #[test]
    fn a_single_time_out_of_place_costs_its_own_row() {
        for wrong in [5_000_000, 150, 3] {
            let mut rows = even(1000, 40, 0);
            rows[20].0 = wrong + i128::from(wrong == 5_000_000) * 1000;
            let (out, tally) = given(&rows);
            assert_eq!((out.len(), tally.counts.times, tally.counts.segments), (39, 1, 0), "{wrong}");
            assert!(out.windows(2).all(|w| w[0] < w[1]));
        }
    }

    #[test]
    fn a_clock_that_begins_again_makes_a_segment_after_the_time_that_went_by() {
        let mut rows = even(50_000, 100, 0);
        rows.extend(even(0, 100, 3000));
        let (out, tally) = given(&rows);
        assert_eq!((tally.counts.segments, tally.counts.times), (1, 4));
        assert_eq!((out.len(), out[99], out[100]), (196, 990, 3040));
    }

    #[test]
    fn a_clock_that_is_set_ahead_makes_a_segment_and_loses_no_row() {
        let mut rows = even(0, 50, 0);
        rows.extend(even(1_700_000_000_000, 50, 500));
        let (out, tally) = given(&rows);
        assert_eq!((out.len(), tally.counts.segments, tally.counts.times), (100, 1, 0));
        assert_eq!(out[50] - out[49], 60, "a hole that is not bridged");
    }

    #[test]
    fn silence_is_no_jump() {
        let mut rows = even(0, 50, 0);
        rows.extend(even(60_000, 50, 60_003));
        let (out, tally) = given(&rows);
        assert_eq!((out.len(), out[50], tally.counts.segments), (100, 60_000, 0));
    }

    #[test]
    fn a_life_that_follows_another_goes_on_in_its_time() {
        // The earlier life gave 5 s of the stream, which began at 2 s of the source's own time.
        let given = Given { time_ns: 5_000_000_000, arrived_ns: 1_000_000_000, start_ns: 2000 * MS };
        let after = |own: [i128; 2]| {
            let mut timeline = Timeline::new(LIVE_JUMP_NS, Some(given));
            let (mut tally, mut out) = (Tally::default(), Vec::new());
            for own in own {
                timeline.take(Row::EMPTY, own * MS, 1_300_000_000, &mut tally, |t| out.push(t.row.t_ns / 1_000_000));
            }
            (out, tally.counts.segments)
        };
        // Its clock went on: 270 ms by it, though the first row came 300 ms after the last one.
        assert_eq!(after([7270, 7280]), (vec![5270, 5280], 0));
        // It began again: what went by is known by our clock alone.
        assert_eq!(after([7, 17]), (vec![5300, 5310], 1));
        assert_eq!(after([6990, 7000]), (vec![5300, 5310], 1));
        assert_eq!(after([90_000, 90_010]), (vec![5300, 5310], 1));
    }

    #[test]
    fn a_clock_younger_than_the_hole_is_the_same_only_where_it_cannot_have_begun_again() {
        // The sensor's clock showed `before` when the last row came; the next one comes after `hole` and shows `own`, all in ms.
        let segments = |before: i64, hole: u32, own: i64| {
            let given = Given { time_ns: before * 1_000_000, arrived_ns: 0, start_ns: 0 };
            let (mut timeline, mut tally) = (Timeline::new(LIVE_JUMP_NS, Some(given)), Tally::default());
            let mut given = None;
            let (own_ns, arrived_ns) = (i128::from(own) * MS, u64::from(hole) * 1_000_000);
            timeline.take(Row::EMPTY, own_ns, arrived_ns, &mut tally, |t| given = Some(t.row.t_ns));
            // What went by is known by its clock, or by ours.
            let went = if tally.counts.segments == 0 { own - before } else { hole.into() };
            assert_eq!(given, Some((before + went) * 1_000_000), "{before} {hole} {own}");
            tally.counts.segments
        };
        // It went on; its first row waited or not.
        assert_eq!((segments(300, 500, 800), segments(300, 500, 501)), (0, 0));
        // It began again 400 ms before: later than it was, though it had only run for 300 ms.
        assert_eq!((segments(300, 500, 400), segments(300, 450, 310)), (1, 1));
        // One that had run for longer than the hole would be earlier.
        assert_eq!((segments(600, 500, 610), segments(600, 500, 400)), (0, 1));
        // Rows that waited for the whole of a long hole.
        assert_eq!(segments(60_000, 5_000, 60_010), 0);
        // A clock that was set ahead.
        assert_eq!((segments(60_000, 500, 61_400), segments(60_000, 500, 62_000)), (0, 1));
    }

    /// What a filter makes of a slow swing at 1 kHz, read in two lives, the first row of the second having waited; the bias was just
    /// fitted and is hardly known. How far its rate is off at most, rad/s.
    fn off_after_a_hole(dead_ms: i128, waited_ms: i128) -> f64 {
        let motion = |ms: i128| {
            let phase = 0.1256 * ms as f64 * 1e-3;
            (0.5 * phase.sin(), -0.5 / 0.1256 * phase.cos())
        };
        let mut axis = AxisModel::base(Axis::Z);
        axis.terms[1].std_errors[0] = 0.1;
        let mut model = Model::default();
        model.axes[Axis::Z.index()] = Some(axis);
        let mut filter = Estimator::new(Options::default());
        let (mut worst, mut tally, mut given) = (0_f64, Tally::default(), None);
        let died = 12_500;
        for (from, until, waited) in [(0, died, 0), (died + dead_ms, died + 2000, waited_ms)] {
            let mut timeline = Timeline::new(LIVE_JUMP_NS, given);
            for own in from..until {
                if own == died - 100 {
                    filter.set_model(&model);
                }
                let (rate, angle) = motion(own);
                let mut row = Row::EMPTY;
                (row.gyro[2], row.ref_angle[2]) = (rate + 4e-3 * ((own as f64 * 0.618).fract() - 0.5), angle);
                let arrived_ns = (own.max(from + waited) * MS) as u64;
                timeline.take(row, own * MS, arrived_ns, &mut tally, |timed| {
                    let estimate = filter.step(&timed.row).axes[2];
                    if own >= died {
                        worst = worst.max((estimate.rate_filtered - rate).abs());
                    }
                    let Row { t_ns: time_ns, .. } = timed.row;
                    given = Some(Given { time_ns, arrived_ns: timed.arrived_ns, start_ns: timed.start_ns });
                });
            }
        }
        worst
    }

    #[test]
    fn the_first_rates_of_another_life_are_right_however_late_its_first_row_came() {
        for (dead_ms, waited_ms) in [(20, 0), (20, 15), (50, 30), (100, 30), (300, 150)] {
            let worst = off_after_a_hole(dead_ms, waited_ms);
            assert!(worst < 0.02, "dead for {dead_ms} ms, the first row waited {waited_ms}: off by {worst}");
        }
    }

    #[test]
    fn times_of_any_size_are_no_trouble() {
        let far = 9_000_000_000_000_000_000_000;
        let (out, _) =
            given(&[(0, 0), (far, 1), (far + 1, 2), (-far, 3), (2 * far, 3), (0, 4), (1, 5), (2, 5), (9, 9)]);
        assert!(out.windows(2).all(|w| w[0] < w[1]), "{out:?}");
    }
}
