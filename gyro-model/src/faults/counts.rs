//! Counts that an encoder loses above a rate.
//!
//! An interrupt or a counter that cannot follow misses edges from some rate on: below it encoder and gyro agree, above it the
//! encoder shows too little, whichever way the shaft turns. A gyro whose scale factor bends (an asymmetry, a square, a cube of the rate)
//! may look like that: both are fitted to the same pieces of the log, and counts are lost only where that is the likelier.

use super::{
    Report,
    channel::{Channel, Readings},
    reference::regress,
    thresholds::{LOST, LOST_EITHER_WAY, LOST_FOR_SURE, NOT_LOST},
    witness::{Witness, integral},
};
use crate::{Axis, Record, fault::FaultKind, nls::Normal, order::quantile, record::ReferenceKind};
use std::ops::Range;

/// Rate of a piece over its fastest reading, 1, at least.
const STEADY: f64 = 0.7;
/// Share of the rate, 1, from which on pieces are left out.
const MARGIN: f64 = 0.9;
/// Pieces in which rates are compared, s.
const PIECE: f64 = 0.1;
/// Pieces that are needed below the rate, and above it either way.
const FEWEST: usize = 10;
/// What the two differ by below the rate, over what they do above it, 1, at most.
const STANDS_OUT: f64 = 0.4;
/// Times that the shaft is fast either way, and the share of its way in them, 1, in which counts are lost: what drifts, lacks in
/// some and has too much in others.
const VISITS: usize = 2;
const ALL: f64 = 0.9;
/// Share of the fastest rate, 1, below which none is lost.
const FAST: f64 = 0.25;
/// Shares of the pieces below the rate that are tried.
const BELOW: Range<usize> = 30..97;

/// Reports counts that are lost, and sets the encoder's angle on by what the gyro turned meanwhile.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    for axis in Axis::ALL {
        if record.reference(axis) == Some(ReferenceKind::Angle) {
            of_axis(record, axis, report);
        }
    }
}

/// How fast gyro and encoder turned in a piece, rad/s.
struct Piece {
    /// Its place in time.
    index: usize,
    rate: f64,
    shown: f64,
    /// The fastest that the gyro reads in it.
    peak: f64,
    /// The gyro's readings in it.
    samples: Range<usize>,
}

impl Piece {
    /// Twice the rate, by both: signed by one alone, its noise would make that one larger.
    fn by_both(&self) -> f64 {
        self.rate + self.shown
    }
}

fn of_axis(record: &mut Record, axis: Axis, report: &mut Report) -> Option<()> {
    let witness = Witness::of(record, axis)?;
    let gyro = Readings::of(record, Channel::Gyro(axis));
    let angle = Readings::of(record, Channel::Angle(axis));
    let reading = Turned { t: &gyro.t, turned: integral(&gyro.t, &gyro.values) };
    let edges = edges(&angle.t);
    let pieces: Vec<Piece> = edges
        .windows(2)
        .enumerate()
        .map(|(index, pair)| {
            let (i, j) = (pair[0], pair[1]);
            let dt = angle.t[j] - angle.t[i];
            let rate = (reading.at(angle.t[j]) - reading.at(angle.t[i])) / dt;
            let sample = |t: f64| gyro.t.partition_point(|&at| at < t);
            Piece {
                samples: sample(angle.t[i])..sample(angle.t[j]),
                index,
                rate: witness.slope.signum() * rate + witness.offset / witness.slope.abs(),
                shown: (angle.values[j] - angle.values[i]) / dt,
                peak: fastest_in(&gyro, angle.t[i], angle.t[j]),
            }
        })
        .collect();
    if !shows_less(&pieces) {
        return None;
    }
    let rates: Vec<f64> =
        gyro.values.iter().map(|g| witness.slope.signum() * g + witness.offset / witness.slope.abs()).collect();
    let found = lost(&pieces).or_else(|| likely(&pieces, &rates))?;
    let (left, fitted) = rivals(&pieces, &rates)?;
    if gain(left, pieces.len()) < LIKELIER {
        return None;
    }
    // The fit to all pieces knows that rate best.
    let (above, share) = (found.above.min(fitted.above), found.share);
    // A piece just below that rate may have been above it for a while.
    let is_fast = |piece: &Piece| piece.peak > MARGIN * above;
    let (x, y): (Vec<f64>, Vec<f64>) = pieces.iter().filter(|p| !is_fast(p)).map(|p| (p.rate, p.shown)).unzip();
    let (slope, _) = regress(&x, &y);
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let offset = mean(&y) - slope * mean(&x);
    // What is lost in a piece is given back to all that follows.
    let (mut back, mut fast, mut first) = (0.0, 0, None);
    let mut placed = angle.values.clone();
    let last = *edges.last()?;
    for (piece, pair) in pieces.iter().zip(edges.windows(2)) {
        let lost_here = is_fast(piece);
        let dt = angle.t[pair[1]] - angle.t[pair[0]];
        for value in &mut placed[pair[0]..pair[1]] {
            *value = if lost_here { f64::NAN } else { *value + back };
        }
        if lost_here {
            back += (slope * piece.rate + offset - piece.shown) * dt;
            fast += pair[1] - pair[0];
            first.get_or_insert(angle.t[pair[0]]);
        }
    }
    for value in &mut placed[last..] {
        *value += back;
    }
    for (k, &row) in angle.rows.iter().enumerate() {
        *Channel::Angle(axis).place(&mut record.rows[row]) = placed[k];
    }
    let says = format!(
        "ref_angle_{axis} loses counts above about {:.0} °/s: there it shows {:.0} % less than gyro_{axis}, in {}, and below as much. \
         These readings are left out, and the angle goes on from where the gyro says. Count by hardware (a timer's encoder mode), \
         or turn more slowly",
        above.to_degrees(),
        100.0 * share,
        super::counted(fast, "row")
    );
    report.add_on(axis, FaultKind::LostCounts, fast as u64, first, says);
    Some(())
}

/// The first reading of each piece that has one: as many as there are readings at most, however far apart they are in time.
fn edges(t: &[f64]) -> Vec<usize> {
    let from = t.first().copied().unwrap_or_default();
    let piece = |t: f64| {
        let place = ((t - from) / PIECE).floor();
        let begins = |place: f64| from + place * PIECE;
        if t < begins(place) { place - 1.0 } else { place + f64::from(t >= begins(place + 1.0)) }
    };
    let mut before = f64::NEG_INFINITY;
    let begins_one = |&k: &usize| {
        let own = piece(t[k]);
        std::mem::replace(&mut before, own) < own
    };
    (0..t.len()).filter(begins_one).collect()
}

/// The largest size of a gyro's readings between two times, rad/s.
fn fastest_in(gyro: &Readings, from: f64, to: f64) -> f64 {
    let (i, j) = (gyro.t.partition_point(|&t| t < from), gyro.t.partition_point(|&t| t <= to));
    gyro.values[i..j].iter().map(|x| x.abs()).fold(0.0, f64::max)
}

/// A gyro's angle.
struct Turned<'a> {
    t: &'a [f64],
    turned: Vec<f64>,
}

impl Turned<'_> {
    fn at(&self, t: f64) -> f64 {
        let k = self.t.partition_point(|&x| x <= t).clamp(1, self.t.len() - 1);
        let share = ((t - self.t[k - 1]) / (self.t[k] - self.t[k - 1])).clamp(0.0, 1.0);
        self.turned[k - 1] + share * (self.turned[k] - self.turned[k - 1])
    }
}

/// From which rate on counts are lost, and which share of them.
struct Lost {
    above: f64,
    share: f64,
}

/// Sums over pieces that follow one another: of one visit to their rates. What drifts slowly errs alike all through one.
fn visits(part: &[&Piece], of: impl Fn(&Piece) -> f64) -> Vec<f64> {
    let mut in_time: Vec<&Piece> = part.to_vec();
    in_time.sort_by_key(|p| p.index);
    let sum = |visit: &[&Piece]| visit.iter().map(|p| of(p)).sum();
    in_time.chunk_by(|a, b| b.index - a.index <= 1).map(sum).collect()
}

/// The rate that parts the pieces best into those that agree and those in which too little is shown.
fn lost(pieces: &[Piece]) -> Option<Lost> {
    let mut by_rate: Vec<&Piece> = pieces.iter().filter(|p| p.rate.is_finite() && p.shown.is_finite()).collect();
    by_rate.sort_by(|a, b| a.peak.total_cmp(&b.peak));
    let n = by_rate.len();
    // The encoder's rate over the gyro's, as the ratio of sums, which noise of either leaves alone.
    let squares = |part: &[&Piece], slope: f64| part.iter().map(|p| (p.shown - slope * p.rate).powi(2)).sum::<f64>();
    let slope = |part: &[&Piece]| {
        let way = |p: &Piece| p.by_both().signum();
        let (shown, rate) = part.iter().fold((0.0, 0.0), |(s, r), p| (s + way(p) * p.shown, r + way(p) * p.rate));
        let of = shown / rate;
        let beyond = |p: &Piece| way(p) * (p.shown - of * p.rate);
        (of, visits(part, beyond).iter().map(|sum| sum * sum).sum::<f64>().sqrt() / rate.abs())
    };
    let way_of = |part: &[&Piece]| part.iter().map(|p| p.rate.abs()).sum::<f64>();
    let fastest = by_rate.last()?.peak;
    let parted = |percent: usize| {
        let (below, above) = by_rate.split_at(n * percent / 100);
        let (forth, back): (Vec<&Piece>, Vec<&Piece>) = above.iter().partition(|p| p.by_both() > 0.0);
        if below.len().min(forth.len()).min(back.len()) < FEWEST || above[0].peak < FAST * fastest {
            return None;
        }
        let (of_below, error) = slope(below);
        let (slow, _) = slope(&below[..below.len() * 9 / 10]);
        let agrees = (slow / of_below - 1.0).abs() < NOT_LOST;
        // What is lost stands out of what the two differ by anyway.
        let (of_above, _) = slope(above);
        let apart = |part: &[&Piece]| (squares(part, of_below) / part.len() as f64).sqrt();
        if apart(below) > STANDS_OUT * apart(above) {
            return None;
        }
        let lacks = |part: &[&Piece], for_sure: f64| {
            let (of_above, own) = (slope(part).0, squares(part, slope(part).0).sqrt() / way_of(part));
            let share = 1.0 - of_above / of_below;
            let ways = visits(part, |p| p.rate.abs());
            let lost = visits(part, |p| p.by_both().signum() * (of_below * p.rate - p.shown));
            let lacking = ways.iter().zip(&lost).filter(|(way, lost)| **lost > 0.5 * LOST * **way * of_below.abs());
            let in_all =
                ways.len() >= VISITS && lacking.map(|(way, _)| way).sum::<f64>() > ALL * ways.iter().sum::<f64>();
            share > LOST && in_all && share > for_sure * error.hypot(own) / of_below.abs()
        };
        let left = squares(below, of_below) + squares(above, of_above);
        let found = Lost { above: above[0].peak, share: 1.0 - of_above / of_below };
        // Where readings shake much more than they turn, the fastest of them says nothing of the rate.
        let turns = quantile(above.iter().map(|p| 0.5 * p.by_both().abs() / p.peak).collect(), 0.5)?;
        if turns < STEADY {
            return None;
        }
        // What the encoder itself shows fastest lacks something too: a gyro that shakes more only seems faster.
        let mut shown = by_rate.clone();
        shown.sort_by(|a, b| b.shown.abs().total_cmp(&a.shown.abs()));
        let by_encoder = 1.0 - slope(&shown[..above.len()]).0 / of_below;
        let either_way = lacks(&forth, LOST_EITHER_WAY) && lacks(&back, LOST_EITHER_WAY);
        (agrees && either_way && lacks(above, LOST_FOR_SURE) && by_encoder > 0.5 * LOST).then_some((left, found))
    };
    BELOW.filter_map(parted).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, lost)| lost)
}

/// Whether the encoder shows less, from any rate on, of what the gyro reads than below it.
fn shows_less(pieces: &[Piece]) -> bool {
    let mut by_rate: Vec<&Piece> = pieces.iter().filter(|p| p.rate.is_finite() && p.shown.is_finite()).collect();
    by_rate.sort_by(|a, b| a.peak.total_cmp(&b.peak));
    let turned = |p: &Piece| {
        let way = p.by_both().signum();
        (way * p.shown, way * p.rate)
    };
    let (shown, rate) = by_rate.iter().map(|p| turned(p)).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    let (mut below, mut next) = ((0.0, 0.0), BELOW.start);
    by_rate.iter().enumerate().any(|(k, piece)| {
        let own = turned(piece);
        below = (below.0 + own.0, below.1 + own.1);
        if k + 1 < by_rate.len() * next / 100 || next >= BELOW.end {
            return false;
        }
        next += 1;
        let share = 1.0 - (shown - below.0) / (rate - below.1) * below.1 / below.0;
        share > 0.5 * LOST
    })
}

/// What is left of the pieces, in the mean square, by a gyro that bends, and by an encoder that loses counts from some rate on: a share of
/// all, or of what is faster; and that rate and share. `rates` are the gyro's.
fn rivals(pieces: &[Piece], rates: &[f64]) -> Option<([f64; 2], Lost)> {
    let is_known = |p: &&Piece| p.rate.is_finite() && p.shown.is_finite() && !p.samples.is_empty();
    let all: Vec<&Piece> = pieces.iter().filter(is_known).collect();
    let shown: Vec<f64> = all.iter().map(|p| p.shown).collect();
    // A piece may be fast in part.
    let column = |of: &dyn Fn(f64) -> f64| -> Vec<f64> {
        let mean = |p: &&Piece| rates[p.samples.clone()].iter().map(|w| of(*w)).sum::<f64>() / p.samples.len() as f64;
        all.iter().map(mean).collect()
    };
    let (one, rate) = (column(&|_| 1.0), all.iter().map(|p| p.rate).collect::<Vec<f64>>());
    let left = |more: &[Vec<f64>]| {
        let columns: Vec<&[f64]> = [&one, &rate].into_iter().chain(more).map(Vec::as_slice).collect();
        let mut normal = Normal::zeros(columns.len());
        normal.add(&shown, &columns);
        let step = normal.step_from(&normal, 1e-12);
        (normal.cost_after(&step).max(0.0) / all.len() as f64, step)
    };
    let bends = left(&[column(&f64::abs), column(&|w| w * w), column(&|w| w * w.abs()), column(&|w| w.powi(3))]).0;
    let mut peaks: Vec<f64> = all.iter().map(|p| p.rate.abs()).collect();
    peaks.sort_by(f64::total_cmp);
    let slowest = FAST * peaks.last()?;
    let loses = BELOW
        .filter_map(|percent| peaks.get(peaks.len() * percent / 100).copied())
        .filter(|from| *from >= slowest)
        .flat_map(|from| [(from, false), (from, true)])
        .map(|(from, beyond)| {
            let beyond_it = move |w: f64| if w.abs() > from { w - w.signum() * from } else { 0.0 };
            let of_all = move |w: f64| if w.abs() > from { w } else { 0.0 };
            let (left, step) = left(&[if beyond { column(&beyond_it) } else { column(&of_all) }]);
            // The step is that of a descent: both have the other sign.
            let slope = -step[1];
            let fast = || all.iter().filter(|p| p.rate.abs() > from);
            let way: f64 = fast().map(|p| slope * p.rate * p.rate.signum()).sum();
            let seen: f64 = fast().map(|p| p.shown * p.rate.signum()).sum();
            (left, from, if way == 0.0 { 0.0 } else { 1.0 - seen / way })
        })
        .min_by(|a, b| a.0.total_cmp(&b.0))?;
    let (loses, above, share) = loses;
    Some(([bends, loses], Lost { above, share }))
}

/// Gain in ln L of lost counts over a gyro that bends; pieces that follow one another err alike.
fn gain([bends, loses]: [f64; 2], pieces: usize) -> f64 {
    0.5 * pieces as f64 / FOLLOW * (bends / loses.max(1e-300)).ln()
}

/// Lost counts that are so much likelier than a bend that nothing else is asked but that the encoder shows less.
fn likely(pieces: &[Piece], rates: &[f64]) -> Option<Lost> {
    let (left, lost) = rivals(pieces, rates)?;
    let slope_up_to = |rate: f64| {
        let slow = pieces.iter().filter(|p| p.rate.abs() <= rate);
        let (shown, turned) = slow.fold((0.0, 0.0), |(shown, turned), p| {
            let way = p.by_both().signum();
            (shown + way * p.shown, turned + way * p.rate)
        });
        shown / turned
    };
    let agrees = (slope_up_to(SLOWER * lost.above) / slope_up_to(lost.above) - 1.0).abs() < NOT_LOST;
    // Either way, and often enough: what a lag or a delay makes of a start goes with the change of the rate, not with the rate.
    let either_way = [1.0, -1.0].into_iter().all(|way| {
        let fast = || pieces.iter().filter(|p| p.by_both() * way > 0.0 && p.rate.abs() > lost.above);
        let sum = |of: fn(&Piece) -> f64| fast().map(of).sum::<f64>();
        let slope = slope_up_to(lost.above);
        fast().count() >= FEWEST && 1.0 - sum(|p| p.shown) / (slope * sum(|p| p.rate)) > LOST
    });
    (gain(left, pieces.len()) > CERTAINLY && agrees && either_way && lost.share > LOST && lost.share < 1.0)
        .then_some(lost)
}

/// Pieces that err alike, and gains in ln L for one explanation beside the other, and for one alone.
const FOLLOW: f64 = 4.0;
const LIKELIER: f64 = 5.0;
const CERTAINLY: f64 = 40.0;
/// Share of the rate above which counts are lost up to which gyro and encoder agree as they do up to that rate.
const SLOWER: f64 = 0.8;

#[cfg(test)]
mod tests {
    use super::*;

    fn is_likelier_than_a_bend(pieces: &[Piece]) -> bool {
        rivals(pieces, &rates(pieces)).is_some_and(|(left, _)| gain(left, pieces.len()) > LIKELIER)
    }

    fn rates(pieces: &[Piece]) -> Vec<f64> {
        pieces.iter().map(|piece| piece.rate).collect()
    }

    fn pieces(shown: impl Fn(f64) -> f64) -> Vec<Piece> {
        let rate = |k: u32| 10.0 * (f64::from(k) * 0.013).sin() * (0.3 + 0.7 * (f64::from(k) * 0.0017).sin().abs());
        let noise = |k: u32| 2e-3 * (f64::from(k * 7919 % 13) - 6.0);
        let piece = |k: u32| Piece {
            index: k as usize,
            rate: rate(k),
            shown: shown(rate(k)) + noise(k),
            peak: rate(k).abs(),
            samples: k as usize..k as usize + 1,
        };
        (0..2000).map(piece).collect()
    }

    #[test]
    fn counts_that_are_lost_above_a_rate_are_found_with_that_rate() {
        let found = lost(&pieces(|w| if w.abs() > 6.0 { 0.93 * w } else { w })).unwrap();
        assert!(
            (found.above - 6.0).abs() < 0.3 && (found.share - 0.07).abs() < 0.01,
            "{}, {}",
            found.above,
            found.share
        );
        assert!(lost(&pieces(|w| w.clamp(-7.0, 7.0))).is_some());
        let beyond = |w: f64| if w.abs() > 6.0 { w - 0.5 * (w - 6.0 * w.signum()) } else { w };
        for loses in [&(|w: f64| if w.abs() > 6.0 { 0.93 * w } else { w }) as &dyn Fn(f64) -> f64, &beyond] {
            assert!(is_likelier_than_a_bend(&pieces(loses)));
        }
    }

    #[test]
    fn a_gyro_that_bends_is_likelier_than_lost_counts_where_it_bends() {
        assert!(!shows_less(&pieces(|w| 1.01 * w)));
        for size in [1e-5, 5e-4, -5e-4] {
            let bent = pieces(|w| w - size * w.powi(3));
            assert!(!is_likelier_than_a_bend(&bent) && likely(&bent, &rates(&bent)).is_none(), "{size}");
        }
        assert!(!is_likelier_than_a_bend(&pieces(|w| w - 0.01 * w.abs())));
    }

    #[test]
    fn a_scale_factor_that_bends_loses_no_counts() {
        assert!(lost(&pieces(|w| 0.98 * w)).is_none());
        assert!(lost(&pieces(|w| w - 1e-5 * w.powi(3))).is_none());
        assert!(lost(&pieces(|w| w + 2e-4 * w * w.abs())).is_none());
    }

    #[test]
    fn a_bias_that_drifts_with_a_load_loses_no_counts() {
        for period in [0.004, 0.01, 0.04, 0.13] {
            let mut pieces = pieces(|w| w);
            for piece in &mut pieces {
                piece.shown -= 0.4 * (piece.index as f64 * period).sin() * (1.0 + 0.1 * piece.rate.abs());
            }
            assert!(lost(&pieces).is_none() && likely(&pieces, &rates(&pieces)).is_none(), "{period}");
        }
    }

    #[test]
    fn pieces_are_those_that_hold_readings_however_long_nothing_came() {
        assert_eq!(edges(&[0.0, 0.05, 0.1, 0.17, 0.31, 1e12, 1e12 + 0.5]), [0, 2, 4, 5, 6]);
        assert!(edges(&[]).is_empty());
        // At each edge of a piece, as a time that is a sum of steps has it.
        let t: Vec<f64> = (0..1000).map(|k| 7.3 + f64::from(k) * 0.01).collect();
        let at = |k: usize| t.partition_point(|&t| t < 7.3 + k as f64 * PIECE);
        let mut one_by_one: Vec<usize> = (0..100).map(at).filter(|&k| k < t.len()).collect();
        one_by_one.dedup();
        assert_eq!(edges(&t), one_by_one);
    }
}
