//! The limit of a reading as a suspect: read off the readings, and held against the reference.
//!
//! The residual could not tell: where the information is gone it can be bridged, and bridging removes every error.

use crate::{
    effects::{Effect, Trait, white_noise},
    evidence::{gain::gain, prior::read_angle, study::Study},
    limits::{hole, rail, stands_alone},
};

/// The limit that the readings of an axis show, if they do.
#[must_use]
pub(crate) fn read_off(effect: &dyn Effect, study: &Study, index: usize) -> Option<f64> {
    let series = &study.bench.problem.series[index];
    let readings: Vec<f64> = series.gyro.iter().zip(&series.read).filter(|(_, read)| **read).map(|(g, _)| *g).collect();
    if effect.is(Trait::Ceiling) {
        let most = |rail| if stands_alone(&readings, rail) { BEYOND_ALONE } else { BEYOND };
        rail(&readings).filter(|&rail| !is_held(study, index, rail, most(rail)))
    } else if effect.is(Trait::Hole) {
        hole(&readings)
    } else {
        None
    }
}

/// Whether the reference shows that the rate itself stands wherever the reading stands at this rail, as on a rate table: it turns
/// evenly, and as far as readings do elsewhere, or farther by less than `most` of the rail. What is cut off a motion is beyond the
/// rail, or arched, faster in the middle of its time than near its ends.
fn is_held(study: &Study, index: usize, rail: f64, most: f64) -> bool {
    let problem = &study.bench.problem;
    let series = &problem.series[index];
    let t = &series.reference_t;
    // What turns about the other axes is in the angle of an orientation: there the model's own is what was read.
    let (read, angle) = match problem.attitude() {
        Some(attitude) => {
            let angle = attitude.turned_about(series.axis.index());
            let error = problem.axis_error(&study.evaluation, index);
            (angle.iter().zip(&error).map(|(angle, error)| angle + error).collect(), angle)
        }
        None => (read_angle(series), series.reference_angle.clone()),
    };
    if angle.is_empty() {
        return false;
    }
    let edge = rail - series.margin.max(1e-6 * rail);
    let is_at = |step: &[usize]| series.gyro[step[0]..=step[1]].iter().all(|g| g.abs() > edge);
    let at: Vec<bool> = series.reference_rows.windows(2).map(is_at).collect();
    let (alpha, delta) = calibration_off(&at, t, &read, &angle);
    // What the shaft turns beyond that in the middle half of each such time and in the rest of it, and how long these are.
    let (mut middle, mut rest, mut count, mut first) = ((0.0, 0.0), (0.0, 0.0), 0.0, 0);
    for run in at.chunk_by(|a, b| a == b) {
        let (a, d) = (first, first + run.len());
        first = d;
        if run[0] && run.len() >= 4 {
            let (b, c) = (a + run.len() / 4, d - run.len() / 4);
            let side = series.gyro[series.reference_rows[a]].signum();
            let beyond = |i: usize| side * (angle[i] - alpha * read[i] - delta * t[i]);
            middle = (middle.0 + beyond(c) - beyond(b), middle.1 + t[c] - t[b]);
            rest = (rest.0 + beyond(b) - beyond(a) + beyond(d) - beyond(c), rest.1 + t[b] - t[a] + t[d] - t[c]);
            count += 1.0;
        }
    }
    if count == 0.0 {
        return false;
    }
    let arch = middle.0 / middle.1 - rest.0 / rest.1;
    // Two rows bound the middle, four the rest.
    let noise = white_noise(&angle) * f64::sqrt(count) * (2_f64.sqrt() / middle.1 + 2.0 / rest.1);
    let beyond = (middle.0 + rest.0) / (middle.1 + rest.1);
    arch.abs() + 3.0 * noise < ARCHED * rail && beyond < most * rail
}

/// Scale factor and bias of the steps that are not marked, about: the reference's angle is α times the readings' and δ times t.
fn calibration_off(marked: &[bool], t: &[f64], read: &[f64], reference: &[f64]) -> (f64, f64) {
    let without = |values: &[f64]| -> Vec<f64> {
        let steps = values.windows(2).zip(marked).filter(|(_, marked)| !**marked).map(|(pair, _)| pair[1] - pair[0]);
        let sums = steps.scan(0.0, |sum, step| {
            *sum += step;
            Some(*sum)
        });
        std::iter::once(0.0).chain(sums).collect()
    };
    let [t, read, reference] = [t, read, reference].map(without);
    let last = t.len() - 1;
    let alpha = gain(&t, &read, &reference);
    (alpha, (reference[last] - alpha * read[last]) / t[last])
}

/// Share of a rail by which the middle of a motion that is cut off is faster, and by which all of it is; a rate that reads too small
/// by as little is taken for one that is held. Less where readings stand still there alone.
const ARCHED: f64 = 2e-3;
const BEYOND: f64 = 5e-3;
const BEYOND_ALONE: f64 = 5e-4;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Axis, Model,
        effects::find,
        evidence::study::Bench,
        simulate::{Hidden, Motion, Reference, Scenario, SensorSpec, simulate},
    };

    /// A rate table beside an orientation: readings that pile up at its fastest rate show no limit, also where the axes are not square.
    #[test]
    fn a_rate_that_is_held_beside_an_orientation_is_no_limit() {
        let (axis, reference, seed) = (Axis::X, Reference::Quaternion, 86);
        let sensor = SensorSpec { axis, reference, reference_every: 1, ..SensorSpec::random(seed) };
        let motion = Motion::RateTable { rate: 2.0, hold: 4.0 };
        let hidden = vec![Hidden::parse("cross-axis", axis).unwrap()];
        let scenario = Scenario { motion, seed, seconds: 60.0, sensor, hidden, ..Scenario::default() };
        let record = simulate(&scenario).record;
        assert!(rail(&record.rows.iter().map(|row| row.gyro[0]).collect::<Vec<f64>>()).is_some());
        let mut model = Model::base_for(&record);
        model.axes[0].as_mut().unwrap().terms.push(crate::Term::neutral(find("cross-axis").unwrap(), axis));
        let bench = Bench::new(&record, &Axis::ALL, &model).unwrap();
        assert_eq!(read_off(find("saturation").unwrap(), &Study::fit(&bench, &model, None), 0), None);
    }
}
