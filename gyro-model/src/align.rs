//! How far the clock of a second log lies from that of the first, by the motion that both saw.

use crate::Row;
use realfft::RealFftPlanner;

/// Time between two speeds that are held against each other, ns.
const STEP: i64 = 20_000_000;
/// The longest log that is looked at, steps: eleven days.
const LONGEST: i64 = 1 << 24;
/// Both have to overlap by this share of the shorter.
const OVERLAP: f64 = 0.3;

/// Where the clocks are most alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Alignment {
    /// What the second clock's times have to be given to be the first's, ns.
    pub offset_ns: i64,
    /// Correlation of the speeds of turn there, 1 at most.
    pub likeness: f64,
    /// Correlation at the local maximum that is nearest to the expected offset; 0 where the two do not overlap there.
    pub likeness_near: f64,
    /// The offset of that maximum, ns.
    pub near_ns: i64,
}

/// Aligns the times of a reference's rows to those of a gyro's; `said_ns` is the offset that is expected. `None` where either
/// hardly moves or is too short.
#[must_use]
pub fn align(gyro: &[Row], reference: &[Row], said_ns: i64) -> Option<Alignment> {
    let (a, a_from) = evenly(&gyro_speeds(gyro))?;
    let (b, b_from) = evenly(&reference_speeds(reference))?;
    let correlation = correlate(&a, &b);
    let (a_len, b_len) = (i64::try_from(a.len()).ok()?, i64::try_from(b.len()).ok()?);
    let (shortest, size) = (a_len.min(b_len) as f64, i64::try_from(correlation.len()).ok()?);
    let (a_sums, b_sums) = (squares(&a), squares(&b));
    // Lag k: the second's step j stands beside the first's step j + k.
    let likeness = |k: i64| -> f64 {
        if k.unsigned_abs() > (a_len + b_len).unsigned_abs() {
            return 0.0;
        }
        let from = k.max(0);
        let to = a_len.min(b_len + k);
        if ((to - from) as f64) < (OVERLAP * shortest).max(50.0) {
            return 0.0;
        }
        let energy = |sums: &[f64], from: i64, to: i64| sums[to as usize] - sums[from as usize];
        let energies = energy(&a_sums, from, to) * energy(&b_sums, from - k, to - k);
        let place = k.rem_euclid(size) as usize;
        if energies > 0.0 { correlation[place] / energies.sqrt() } else { 0.0 }
    };
    let lags = -b_len..a_len;
    let best = lags.max_by(|&k, &l| likeness(k).total_cmp(&likeness(l)))?;
    let offset_ns = |lag: i64| {
        let (before, at, after) = (likeness(lag - 1), likeness(lag), likeness(lag + 1));
        let bend = before - 2.0 * at + after;
        let part = if bend < 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        (a_from - b_from).saturating_add(lag.saturating_mul(STEP)).saturating_add((part * STEP as f64) as i64)
    };
    // Uphill from the expected offset: where the motion repeats itself, every other maximum is as high.
    let mut near = (b_from - a_from).saturating_add(said_ns).div_euclid(STEP);
    for _ in 0..FARTHEST {
        let beside = (near.saturating_sub(BESIDE)..=near.saturating_add(BESIDE))
            .max_by(|&k, &l| likeness(k).total_cmp(&likeness(l)));
        match beside.filter(|beside| likeness(*beside) > likeness(near)) {
            Some(higher) => near = higher,
            None => break,
        }
    }
    Some(Alignment {
        offset_ns: offset_ns(best),
        likeness: likeness(best),
        likeness_near: likeness(near),
        near_ns: offset_ns(near),
    })
}

/// Steps to either side among which the way uphill is looked for, and how often at most.
const BESIDE: i64 = 3;
const FARTHEST: usize = 50;

/// Time, ns, and speed of turn from the row before on, rad/s.
type Speeds = Vec<(i64, f64)>;

fn gyro_speeds(rows: &[Row]) -> Speeds {
    rows.iter().filter_map(|row| length(&row.gyro).map(|speed| (row.t_ns, speed))).collect()
}

/// Length of what there is of a vector; `None` where there is nothing.
fn length(of: &[f64; 3]) -> Option<f64> {
    let there = of.iter().filter(|x| x.is_finite());
    there.map(|x| x * x).reduce(|a, b| a + b).map(f64::sqrt)
}

fn reference_speeds(rows: &[Row]) -> Speeds {
    let mut speeds = Vec::new();
    let mut before: Option<&Row> = None;
    for row in rows {
        if let Some(speed) = length(&row.ref_rate) {
            speeds.push((row.t_ns, speed));
            continue;
        }
        if row.ref_quaternion[0].is_nan() && row.ref_angle.iter().all(|x| x.is_nan()) {
            continue;
        }
        let Some(last) = before else {
            before = Some(row);
            continue;
        };
        // Over a step at least, for the noise of an angle is large against what it turns between two rows.
        if row.t_ns - last.t_ns < STEP * 3 / 4 {
            continue;
        }
        let turned = if row.ref_quaternion[0].is_finite() {
            let dot: f64 = row.ref_quaternion.iter().zip(&last.ref_quaternion).map(|(a, b)| a * b).sum();
            2.0 * dot.abs().min(1.0).acos()
        } else {
            let wrapped = |x: f64| x - std::f64::consts::TAU * (x / std::f64::consts::TAU).round();
            length(&std::array::from_fn(|i| wrapped(row.ref_angle[i] - last.ref_angle[i]))).unwrap_or(f64::NAN)
        };
        let seconds = (row.t_ns - last.t_ns) as f64 / 1e9;
        if turned.is_finite() {
            speeds.push((row.t_ns.midpoint(last.t_ns), turned / seconds));
        }
        before = Some(row);
    }
    speeds
}

/// Speeds at even steps, their mean taken off, and the time of the first.
fn evenly(speeds: &[(i64, f64)]) -> Option<(Vec<f64>, i64)> {
    let (from, to) = (speeds.first()?.0, speeds.last()?.0);
    let count = (to - from) / STEP + 1;
    if !(50..LONGEST).contains(&count) {
        return None;
    }
    let mut sums = vec![(0.0, 0_u32); count as usize];
    for &(t, speed) in speeds {
        if let Some((sum, rows)) = sums.get_mut(((t - from) / STEP) as usize) {
            (*sum, *rows) = (*sum + speed, *rows + 1);
        }
    }
    let mut held = 0.0;
    let mut even: Vec<f64> = (sums.into_iter())
        .map(|(sum, rows)| {
            held = if rows > 0 { sum / f64::from(rows) } else { held };
            held
        })
        .collect();
    let mean = even.iter().sum::<f64>() / even.len() as f64;
    for x in &mut even {
        *x -= mean;
    }
    (even.iter().map(|x| x * x).sum::<f64>() > 0.0).then_some((even, from))
}

/// Sums of squares up to each place.
fn squares(of: &[f64]) -> Vec<f64> {
    let mut sum = 0.0;
    std::iter::once(0.0)
        .chain(of.iter().map(|x| {
            sum += x * x;
            sum
        }))
        .collect()
}

/// Σ a[j + k] b[j] for every k, that of −k at the end.
fn correlate(a: &[f64], b: &[f64]) -> Vec<f64> {
    let size = (a.len() + b.len()).next_power_of_two();
    let mut planner = RealFftPlanner::new();
    let forward = planner.plan_fft_forward(size);
    let transformed = |of: &[f64]| {
        let mut padded = of.to_vec();
        padded.resize(size, 0.0);
        let mut spectrum = forward.make_output_vec();
        // The lengths are the plan's own.
        let _ = forward.process(&mut padded, &mut spectrum);
        spectrum
    };
    let (mut product, other) = (transformed(a), transformed(b));
    for (x, y) in product.iter_mut().zip(&other) {
        *x *= y.conj();
    }
    let last = product.len() - 1;
    (product[0].im, product[last].im) = (0.0, 0.0);
    let back = planner.plan_fft_inverse(size);
    let mut correlation = back.make_output_vec();
    let _ = back.process(&mut product, &mut correlation);
    for x in &mut correlation {
        *x /= size as f64;
    }
    correlation
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(t: f64) -> f64 {
        (1.3 * t).sin() * (0.21 * t).cos() * 2.0 + (0.37 * t * t / 20.0).sin()
    }

    /// Half a minute of turning from `from` on, on a clock that begins at `clock`; as a gyro's or a reference's rows.
    fn rows(from: f64, clock: f64, as_gyro: bool) -> Vec<Row> {
        let mut angle = 0.0;
        (0..3000_i32)
            .map(|k| {
                let t = f64::from(k) * 0.01;
                angle += rate(from + t) * 0.01;
                let mut row = Row { t_ns: ((clock + t) * 1e9) as i64, ..Row::EMPTY };
                if as_gyro {
                    row.gyro[2] = rate(from + t) + 0.02;
                } else {
                    row.ref_quaternion = [(angle / 2.0).cos(), 0.0, 0.0, (angle / 2.0).sin()];
                }
                row
            })
            .collect()
    }

    #[test]
    fn clocks_that_run_apart_are_brought_together_by_the_motion() {
        let found = align(&rows(0.0, 0.0, true), &rows(4.0, 1000.0, false), 0).unwrap();
        let wanted = -996.0;
        assert!((found.offset_ns as f64 / 1e9 - wanted).abs() < 0.03 && found.likeness > 0.9, "{found:?}");
        assert_eq!(found.likeness_near, 0.0);
    }

    #[test]
    fn one_clock_is_known_as_one() {
        let found = align(&rows(0.0, 0.0, true), &rows(0.0, 0.0, false), 0).unwrap();
        assert!(found.near_ns.abs() < 30_000_000 && found.likeness_near > 0.9, "{found:?}");
    }

    #[test]
    fn the_nearest_of_many_offsets_is_found_where_the_motion_repeats_itself() {
        let sine = |from: f64, as_gyro: bool| -> Vec<Row> {
            let of = |k: i32| {
                let (t, mut row) = (f64::from(k) * 0.01, Row::EMPTY);
                row.t_ns = (t * 1e9) as i64;
                let rate = 1.5 + (1.3 * (from + t)).sin();
                *(if as_gyro { &mut row.gyro[2] } else { &mut row.ref_rate[2] }) = rate;
                row
            };
            (0..4000).map(of).collect()
        };
        for late in [-0.4, 0.1, 0.7] {
            let found = align(&sine(0.0, true), &sine(-late, false), 0).unwrap();
            assert!(
                (found.near_ns as f64 / 1e9 + late).abs() < 0.02 && found.likeness_near > 0.95,
                "{late}: {found:?}"
            );
        }
    }

    #[test]
    fn what_does_not_move_is_not_aligned() {
        let still = vec![Row { gyro: [0.0; 3], ..Row::EMPTY }; 10];
        assert_eq!(align(&still, &rows(0.0, 0.0, false), 0), None);
    }
}
