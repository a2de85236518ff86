//! One axis as the random causes see it: the angle error at its rows, and what the motion does there.

use crate::{
    budget::coherent::{self, Response},
    evidence::{prior::read_angle, series::Rest, study::Study},
    order::median,
};

/// A stretch of the log, from one row to another.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    /// Its first row.
    pub from: usize,
    /// Its last row.
    pub to: usize,
}

/// Angle error and motion, row by row; what is counted is summed up from the first row on.
#[derive(Clone, Debug, Default)]
pub(crate) struct Course {
    /// Times of the rows, s.
    pub t: Vec<f64>,
    /// Angle error, rad.
    pub error: Vec<f64>,
    /// Rate without its fastest noise, rad/s.
    pub rate: Vec<f64>,
    /// ∫ω dt, rad.
    pub turned: Vec<f64>,
    /// ∫|ω| dt, rad, and ∫ω² dt, rad²/s.
    pub travelled: Vec<f64>,
    pub squared: Vec<f64>,
    /// Reversals of the motion.
    pub reversals: Vec<f64>,
    /// Starts and stops.
    pub starts: Vec<f64>,
    /// Holes between rows.
    pub holes: Vec<f64>,
    /// Σ (length · |ω|)² and Σ (length · change of ω)² over them, rad².
    pub lost: Vec<f64>,
    pub lost_changes: Vec<f64>,
    /// Rows of which the model says that their reading tells nothing.
    silent: Vec<f64>,
    /// Along the log, rad: what a small change of each fitted parameter of the model makes of the error.
    pub fitted: Vec<Vec<f64>>,
    /// One step of an encoder, rad; 0 of another reference.
    pub count: f64,
    /// From one row to the next, s.
    pub dt: f64,
}

/// Whose error is looked at.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum ErrorOf {
    /// The model's: effects were looked for, and the model has what was found.
    Model,
    /// What the model leaves and the catalogue's columns do not foretell either: nobody has looked for effects.
    ModelAndColumns,
}

/// Half of the time over which the rate is averaged, s.
const STEADY: f64 = 0.04;
/// Share of the root mean square rate within which an axis stands.
const STANDS: f64 = 0.03;
/// Share of it from which on a rate the other way is a reversal: what swings back as it comes to rest is one, too.
const TURNS: f64 = 0.01;
/// Standard deviations of its noise within which a rate is none.
const NOISE: f64 = 4.0;
/// Time that an axis stands for, s, before it starts again.
const RESTS: f64 = 0.3;
/// Length of a hole, in steps from row to row.
const HOLE: f64 = 1.8;

/// Half of the time over which the rate is averaged, in rows.
fn half_of_steady(dt: f64) -> usize {
    ((STEADY / dt).round() as usize).max(1)
}

/// Change per second of a signal at each row, between the rows `half` before and after it.
fn slope(t: &[f64], signal: &[f64], half: usize) -> Vec<f64> {
    let at = |k: usize| {
        let (a, b) = (k.saturating_sub(half), (k + half).min(t.len() - 1));
        if t[b] > t[a] { (signal[b] - signal[a]) / (t[b] - t[a]) } else { 0.0 }
    };
    (0..t.len()).map(at).collect()
}

impl Course {
    /// Of one axis of a study; `None` where it does not turn.
    pub(crate) fn of(study: &Study, series: usize, of: ErrorOf) -> Option<Self> {
        let (problem, evaluation) = (&study.bench.problem, &study.evaluation);
        let s = &problem.series[series];
        let t = problem.times().to_vec();
        let dt = median(t.windows(2).map(|pair| pair[1] - pair[0]).collect()).filter(|dt| *dt > 0.0)?;
        if s.rest == Rest::Whole {
            return None;
        }
        let raw = problem.axis_error(evaluation, series);
        let shown = problem.attitude().map_or_else(
            || evaluation.tracks[series].reference().to_vec(),
            |attitude| attitude.turned_about(s.axis.index()),
        );
        let n = t.len();
        // Over what is lost nothing changes.
        let kept = |angle: &[f64]| -> Vec<f64> {
            let step = |k: usize| if k == 0 || evaluation.lost[k] { 0.0 } else { angle[k] - angle[k - 1] };
            (0..n)
                .scan(0.0, |sum, k| {
                    *sum += step(k);
                    Some(*sum)
                })
                .collect()
        };
        let mut error = kept(&raw);
        let turned: Vec<f64> = kept(&shown).iter().zip(&error).map(|(shown, error)| shown + error).collect();
        let own = study.slots.iter().zip(&study.columns).filter(|(slot, _)| slot.series == series);
        let fitted = own.map(|(_, column)| kept(&problem.about_axis(column, series))).collect();
        if of == ErrorOf::ModelAndColumns {
            let tau = &study.bench.windows.tau;
            error = coherent::conditioned(s, &read_angle(s), &error, (tau, dt), Response::Column).rest;
        }
        let half = half_of_steady(dt);
        let rate = slope(&t, &turned, half);
        let mean_square = rate.iter().map(|w| w * w).sum::<f64>() / n.max(1) as f64;
        let noise = study.bench.prior[series].angle_random_walk / (2.0 * half as f64 * dt).sqrt();
        let least = |share: f64| (share * mean_square.sqrt()).max(NOISE * noise);
        let (reversals, starts) = (reversals(&t, &rate, least(TURNS)), starts(&t, &rate, least(STANDS)));
        let mut course = Self {
            error,
            fitted,
            turned: vec![0.0; n],
            travelled: vec![0.0; n],
            squared: vec![0.0; n],
            reversals: vec![0.0; n],
            starts: vec![0.0; n],
            holes: vec![0.0; n],
            lost: vec![0.0; n],
            lost_changes: vec![0.0; n],
            silent: evaluation.lost.iter().map(|lost| f64::from(*lost)).collect(),
            count: s.encoder.step,
            rate,
            t,
            dt,
        };
        spread(&reversals, &mut course.reversals);
        spread(&starts, &mut course.starts);
        for k in 1..n {
            let (step, rate) = (course.t[k] - course.t[k - 1], 0.5 * (course.rate[k] + course.rate[k - 1]));
            course.turned[k] = rate * step;
            course.travelled[k] = rate.abs() * step;
            course.squared[k] = rate * rate * step;
            if step > HOLE * dt {
                course.holes[k] = 1.0;
                course.lost[k] = (step * rate).powi(2);
                course.lost_changes[k] = (step * (course.rate[k] - course.rate[k - 1])).powi(2);
            }
        }
        let Self { turned, travelled, squared, reversals, starts, holes, lost, lost_changes, silent, .. } = &mut course;
        for counted in [turned, travelled, squared, reversals, starts, holes, lost, lost_changes, silent] {
            (1..n).for_each(|k| counted[k] += counted[k - 1]);
        }
        Some(course)
    }

    /// dω/dt, rad/s².
    pub(crate) fn acceleration(&self) -> Vec<f64> {
        slope(&self.t, &self.rate, half_of_steady(self.dt))
    }

    /// Windows of one length, s, that overlap by half, `most` of them at most. One with silent rows has less noise than its length
    /// says: it is left out.
    pub(crate) fn windows(&self, length: f64, most: usize) -> Vec<Window> {
        let n = self.t.len();
        let rows = ((length / self.dt).round() as usize).max(1);
        let stride = (rows / 2).max(n / most.max(1)).max(1);
        let ends = |from: usize| self.t.partition_point(|&t| t < self.t[from] + length - 0.5 * self.dt);
        let whole = |window: &Window| window.to < n && self.silent[window.to] <= self.silent[window.from];
        (0..n).step_by(stride).map(|from| Window { from, to: ends(from) }).filter(whole).collect()
    }

    /// ∬ ω(a) ω(b) e^(−|a − b|/T) da db over a window, rad².
    pub(crate) fn scale_walk(&self, window: Window, time: f64) -> f64 {
        let mut remembered = 0.0;
        let mut sum = 0.0;
        // A twentieth of T is fine enough.
        let every = ((time / 20.0 / self.dt) as usize).max(1);
        let mut k = window.from;
        while k < window.to {
            let next = (k + every).min(window.to);
            let step = self.t[next] - self.t[k];
            let turned = 0.5 * (self.rate[k] + self.rate[next]) * step;
            remembered *= (-step / time).exp();
            sum += turned * (turned + 2.0 * remembered);
            remembered += turned;
            k = next;
        }
        sum.max(0.0)
    }

    /// Over a window: ∫ ω(a) e^(−(a − start)/T) da and ∫ ω(a) e^(−(end − a)/T) da, rad, and ∬ as [`Self::scale_walk`] has it, row by row.
    pub(crate) fn remembered(&self, window: Window, time: f64) -> Remembered {
        let (start, end) = (self.t[window.from], self.t[window.to]);
        let mut of = Remembered::default();
        let (mut before, mut last) = (0.0, start);
        for k in window.from..window.to {
            let (step, at) = (self.t[k + 1] - self.t[k], 0.5 * (self.t[k] + self.t[k + 1]));
            let turned = 0.5 * (self.rate[k] + self.rate[k + 1]) * step;
            of.from_start += turned * ((start - at) / time).exp();
            of.to_end += turned * ((at - end) / time).exp();
            before *= ((last - at) / time).exp();
            of.inside += turned * (turned + 2.0 * before);
            before += turned;
            last = at;
        }
        of
    }
}

/// What a scale that forgets makes of the turn in one window: as others share it after and before, and alone.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Remembered {
    pub from_start: f64,
    pub to_end: f64,
    pub inside: f64,
}

/// An event happens after its first row and up to its last, at a time that nobody knows: each row in between has a share of it.
type Event = (usize, usize);

fn spread(events: &[Event], counted: &mut [f64]) {
    for &(from, to) in events {
        let rows = from + 1..=to.max(from + 1).min(counted.len() - 1);
        let share = 1.0 / rows.clone().count().max(1) as f64;
        rows.for_each(|k| counted[k] += share);
    }
}

/// The start of a motion that shows from row `k` on.
fn start(t: &[f64], k: usize) -> Event {
    (row_at(t, t[k] - 2.0 * STEADY), row_at(t, t[k] + STEADY))
}

/// The first row at this time or later, s.
fn row_at(t: &[f64], time: f64) -> usize {
    t.partition_point(|&t| t < time).min(t.len() - 1)
}

/// Where the rate changes its sign, between two rows at which it is one for certain: as the motion the other way begins.
fn reversals(t: &[f64], rate: &[f64], stands: f64) -> Vec<Event> {
    let mut last: Option<usize> = None;
    let mut events = Vec::new();
    for (k, &w) in rate.iter().enumerate() {
        if w.abs() <= stands {
            continue;
        }
        if let Some(before) = last.filter(|&before| rate[before] * w < 0.0) {
            events.push(if t[k] - t[before] > RESTS { start(t, k) } else { (before, k) });
        }
        last = Some(k);
    }
    events
}

/// Where the axis stops for longer than a moment, while it comes to rest, and where it starts again.
fn starts(t: &[f64], rate: &[f64], stands: f64) -> Vec<Event> {
    let (mut from, mut events): (Option<usize>, _) = (None, Vec::new());
    for k in 0..rate.len() {
        match (rate[k].abs() <= stands, from) {
            (true, None) => from = Some(k),
            (false, Some(first)) => {
                if t[k] - t[first] > RESTS && first > 0 {
                    events.extend([(row_at(t, t[first] - STEADY), row_at(t, t[first] + RESTS)), start(t, k)]);
                }
                from = None;
            }
            _ => {}
        }
    }
    events
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reversals_are_counted_once_and_noise_about_nothing_is_none() {
        let t: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        let noise = |k: u32| 1e-3 * f64::from(k * 7919 % 13) - 6e-3;
        let rate: Vec<f64> = (0..1000).map(|k| (0.0628 * f64::from(k)).sin() + noise(k)).collect();
        assert_eq!(reversals(&t, &rate, 0.05).len(), 19);
        let still: Vec<f64> = (0..1000).map(noise).collect();
        assert!(reversals(&t, &still, 0.05).is_empty());
    }

    #[test]
    fn an_axis_that_pauses_stops_and_starts() {
        let t: Vec<f64> = (0..1000).map(|k| 0.01 * f64::from(k)).collect();
        let rate: Vec<f64> = t.iter().map(|t| if (3.0..5.0).contains(t) { 0.0 } else { 1.0 }).collect();
        let events = starts(&t, &rate, 0.05);
        assert!(
            events.len() == 2 && (events[0].0..events[0].1).contains(&300) && (events[1].0..events[1].1).contains(&500)
        );
        let mut counted = vec![0.0; t.len()];
        spread(&events, &mut counted);
        assert!((counted.iter().sum::<f64>() - 2.0).abs() < 1e-9);
        let reverses: Vec<f64> = t.iter().map(|t| (3.0 * t).sin()).collect();
        assert!(starts(&t, &reverses, 0.05).is_empty());
    }
}
