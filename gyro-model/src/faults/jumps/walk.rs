//! Which pieces of a reference belong together.

use crate::{
    faults::thresholds::{AWAY, STAYS},
    order::median,
};
use nalgebra::UnitQuaternion;
use std::{f64::consts::TAU, ops::Range};

/// By how much a reference is away from the gyro's integral.
pub(super) trait Offset: Copy {
    /// How far two are apart, rad.
    fn apart(self, other: Self) -> f64;
}

impl Offset for f64 {
    fn apart(self, other: Self) -> f64 {
        // Whole turns are none: where an angle jumps by half a turn, either way may be counted.
        let away = (self - other).rem_euclid(TAU);
        away.min(TAU - away)
    }
}

impl Offset for UnitQuaternion<f64> {
    fn apart(self, other: Self) -> f64 {
        self.angle_to(&other)
    }
}

/// A jump that stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moved<O> {
    /// The first reading after it.
    pub(super) index: usize,
    pub(super) before: O,
    pub(super) after: O,
}

/// What became of the pieces.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Walked<O> {
    /// Readings that belong to no piece that counts.
    pub(super) out: Vec<Range<usize>>,
    /// Where the reference moved and stays, in time.
    pub(super) moved: Vec<Moved<O>>,
}

impl<O: Offset> Walked<O> {
    /// How far the reference jumps, rad.
    pub(super) fn sizes(&self, offsets: &[O]) -> Vec<f64> {
        let away = |span: &Range<usize>| {
            let beside = span.start.checked_sub(1).unwrap_or(span.end.min(offsets.len() - 1));
            median(offsets[span.clone()].iter().map(|o| o.apart(offsets[beside])).collect())
        };
        self.out.iter().filter_map(away).chain(self.moved.iter().map(|m| m.before.apart(m.after))).collect()
    }
}

/// Goes from the longest piece to either end; `None` where nothing is cut, or no piece is long enough to start from.
///
/// `may` says how far the offsets of two readings may be apart.
pub(super) fn walk<O: Offset>(
    offsets: &[O],
    t: &[f64],
    is_cut: &[bool],
    may: impl Fn(usize, usize) -> f64,
) -> Option<Walked<O>> {
    let cuts: Vec<usize> = (1..is_cut.len()).filter(|&k| is_cut[k]).collect();
    let edges: Vec<usize> = std::iter::once(0).chain(cuts.iter().copied()).chain([offsets.len()]).collect();
    let pieces: Vec<Range<usize>> = edges.windows(2).map(|pair| pair[0]..pair[1]).collect();
    let lasts = |piece: &Range<usize>| t[piece.end - 1] - t[piece.start];
    let longest = (0..pieces.len()).max_by(|&a, &b| lasts(&pieces[a]).total_cmp(&lasts(&pieces[b])))?;
    if cuts.is_empty() || lasts(&pieces[longest]) < STAYS {
        return None;
    }
    let mut found = Walked { out: Vec::new(), moved: Vec::new() };
    for is_forward in [true, false] {
        let way: Vec<&Range<usize>> =
            if is_forward { pieces[longest..].iter().collect() } else { pieces[..=longest].iter().rev().collect() };
        // Of a piece: where one comes to it, and where one leaves it.
        let ends = |piece: &Range<usize>| {
            if is_forward { (piece.start, piece.end - 1) } else { (piece.end - 1, piece.start) }
        };
        let (mut good, mut next) = (way[0], 1);
        while let Some(piece) = way.get(next) {
            let left = ends(good).1;
            let goes_on = |piece: &&&Range<usize>| {
                let come = ends(piece).0;
                offsets[come].apart(offsets[left]) < may(come, left)
            };
            let within = |piece: &&&Range<usize>| (t[ends(piece).0] - t[left]).abs() < AWAY;
            if let Some(back) = way[next..].iter().take_while(within).position(|piece| goes_on(&piece)) {
                found.out.extend(way[next..next + back].iter().map(|piece| (*piece).clone()));
                good = way[next + back];
                next += back + 1;
                continue;
            }
            if lasts(piece) >= STAYS {
                let (earlier, later) = if is_forward { (left, piece.start) } else { (piece.end - 1, left) };
                found.moved.push(Moved { index: later, before: offsets[earlier], after: offsets[later] });
                good = piece;
            } else {
                found.out.push((*piece).clone());
            }
            next += 1;
        }
    }
    found.out.sort_by_key(|span| span.start);
    found.out.dedup_by(|next, last| {
        let joins = last.end == next.start;
        if joins {
            last.end = next.end;
        }
        joins
    });
    found.moved.sort_by_key(|moved| moved.index);
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn walked(offsets: &[f64]) -> Option<Walked<f64>> {
        let t: Vec<f64> = (0..offsets.len()).map(|k| k as f64 * 0.01).collect();
        let is_cut: Vec<bool> =
            (0..offsets.len()).map(|k| k > 0 && (offsets[k] - offsets[k - 1]).abs() > 0.1).collect();
        walk(offsets, &t, &is_cut, |_, _| 0.1)
    }

    #[test]
    fn what_comes_back_is_left_out_and_what_stays_has_moved() {
        let mut offsets = vec![0.0; 3000];
        assert_eq!(walked(&offsets), None);
        offsets[200..240].fill(2.0);
        offsets[240..250].fill(3.0);
        offsets[1000..].fill(1.0);
        offsets[2000..2001].fill(0.0);
        let found = walked(&offsets).unwrap();
        assert_eq!(found.out, [200..250, 2000..2001]);
        assert_eq!(found.moved, [Moved { index: 1000, before: 0.0, after: 1.0 }]);
    }

    #[test]
    fn after_a_break_nothing_counts() {
        let offsets: Vec<f64> = (0..3000).map(|k| if k < 2000 { 0.0 } else { f64::from(1 + k / 7 % 3) }).collect();
        let found = walked(&offsets).unwrap();
        assert_eq!((found.out.len(), found.out[0].clone(), found.moved.len()), (1, 2000..3000, 0));
    }

    #[test]
    fn pieces_too_short_to_start_from_say_nothing() {
        let offsets: Vec<f64> = (0..3000).map(|k| f64::from(1 + k / 7 % 3)).collect();
        assert_eq!(walked(&offsets), None);
    }
}
