//! Noise known before any model is judged: from the gyro's own fastest differences and the encoder's step.
//!
//! Physics that the model lacks must not hide in the yardstick it is measured with, so nothing here looks at the
//! residual of a model: the noise is what is rough in the signals ([`super::rough`]). A reference that comes seldom holds motion
//! in its own differences; there what the gyro knows of it is taken out.

use super::{
    encoder::quantum,
    encoder_noise::ZEROS,
    gain::gain,
    incoherent::incoherent,
    integrate::integral,
    problem::Problem,
    rough::{Lines, MANY, POOR, Spread, blank, evenly, median_apart, stretches, stretches_of, walked, without_tones},
    rounding::Rounding,
    series::{Rest, Series, usual},
};
use crate::{effects::sixth_differences, order::median, record::Walk};
use std::borrow::Cow;

/// What the sensors' own signals say about their noise.
#[derive(Clone, Debug, PartialEq)]
pub struct Prior {
    /// N of the gyro's reading, rad/√s.
    pub reading: f64,
    /// The reading's rounding, where its noise does not even it out.
    pub rounding: Option<Rounding>,
    /// Whether that is a data sheet's, the motion hiding the sensor's own.
    pub assumed: bool,
    /// N of the compensated rate less the reference's, rad/√s: α times the reading's, and what the noise of a reference
    /// that is a rate adds.
    pub angle_random_walk: f64,
    /// Standard deviation of one reference reading, rad.
    pub encoder: f64,
    /// Where the two come from.
    pub source: Source,
}

/// What the noise of gyro and reference was read from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Source {
    /// Of the gyro.
    pub gyro: GyroSource,
    /// The step of its readings, where its noise is too small to average them out, rad/s.
    pub rounded: Option<f64>,
    /// Of the reference.
    pub reference: ReferenceSource,
}

/// What the noise of a gyro was read from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GyroSource {
    /// A data sheet: motion hides the sensor's own everywhere.
    DataSheet,
    /// Its readings before they were averaged.
    Unaveraged,
    /// Its quietest stretches: the motion is jerky.
    Quietest,
    /// Where the motion is smooth.
    Smooth,
    /// All of its readings.
    Reading,
}

/// What the noise of a reference was read from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ReferenceSource {
    /// An encoder's step, rad.
    Step {
        /// The step.
        step: f64,
        /// Whether its noise beyond that step counts too.
        noisy: bool,
    },
    /// What of its readings the gyro knows nothing of.
    BesideGyro,
    /// Its own readings.
    Own,
}

/// The prior noise of each axis.
#[must_use]
pub(crate) fn priors(problem: &Problem) -> Vec<Prior> {
    let of = |s: &Series| match problem.attitude() {
        None => prior(s, &s.reference_angle),
        Some(attitude) => prior(s, &attitude.turned_about(s.axis.index())),
    };
    problem.series.iter().map(of).collect()
}

/// The prior noise of one axis; `reference` is its reference angle, or for a quaternion the sum of the attitude's
/// increments about it.
fn prior(series: &Series, reference: &[f64]) -> Prior {
    // A reading between two others is no measurement.
    let own: Vec<usize> = (0..series.t.len()).filter(|&k| series.read[k]).collect();
    let at: Vec<f64> = own.iter().map(|&k| series.t[k]).collect();
    let dt = median_apart(&at);
    let known: Vec<f64> = own.iter().map(|&k| if series.missing[k] { f64::NAN } else { series.gyro[k] }).collect();
    let gyro = evenly(&at, &known, dt);
    let all_known = known.len() == series.t.len() && !series.missing.contains(&true);
    let quiet: Cow<[f64]> = if all_known { series.quiet().into() } else { without_tones(&at, &known).into() };
    let quiet = evenly(&at, &quiet, dt);
    let flat = |k: usize| k > 1 && gyro[k] == gyro[k - 1] && gyro[k] == gyro[k - 2];
    let lsb = quantum(own.iter().map(|&k| series.gyro[k]));
    let mut differences = sixth_differences(&quiet);
    let share = Lines::of(&differences).map_or(0.0, |lines| lines.share());
    blank(&mut differences, flat);
    let gyro = Spread::of(stretches_of(&differences)).less(share);
    let angle = Spread::of(stretches(reference));
    let step = counts(series);
    let known = if step > 0.0 { step } else { angle.quiet };
    // Jerky motion shows in the reference too; noise that grows with rate does not.
    let poor = POOR.powi(2) / dt;
    let reference_is_jerky = angle.mean > 3.0 * known;
    let jerky = reference_is_jerky && (gyro.uneven() || gyro.mean > poor);
    let was_found = series.walk.gyro > 0.0;
    let assumed = if was_found { series.walk.assumed } else { jerky && gyro.quiet > poor };
    let (variance, from_gyro) = if assumed {
        (poor, GyroSource::DataSheet)
    } else if was_found {
        (series.walk.gyro.powi(2) / dt, GyroSource::Unaveraged)
    } else if jerky {
        (gyro.quiet, GyroSource::Quietest)
    } else if reference_is_jerky {
        (gyro.smooth, GyroSource::Smooth)
    } else {
        (gyro.mean, GyroSource::Reading)
    };
    let variance = variance.max(lsb * lsb / 12.0);
    let rounding = Rounding::of(series, lsb);
    let (encoder, from_reference) = if step > 0.0 {
        (step.sqrt(), ReferenceSource::Step { step: series.encoder.step, noisy: series.encoder.noise > 0.0 })
    } else {
        let beside = beside_gyro(series, reference, variance * dt);
        let (least, of) = if beside.mean < angle.mean {
            (beside, ReferenceSource::BesideGyro)
        } else {
            (angle, ReferenceSource::Own)
        };
        let variance = if least.uneven() { least.quiet } else { least.mean };
        (variance.sqrt().max(1e-9), of)
    };
    let walk = (variance * dt).sqrt().max(1e-9);
    let rounded = rounding.as_ref().map(|rounding| rounding.step);
    Prior {
        reading: walk,
        rounding,
        assumed,
        angle_random_walk: (gain(&series.reference_t, &read_angle(series), reference) * walk)
            .hypot(reference_walk(series)),
        encoder,
        source: Source { gyro: from_gyro, rounded, reference: from_reference },
    }
}

/// What the sixth differences of the reference's angle less what the gyro's make say: where a reference comes so seldom that they
/// hold its motion, the gyro knows of that ([`incoherent`]). The gyro's walk of N² = `walk` is in them too.
fn beside_gyro(series: &Series, reference: &[f64], walk: f64) -> Spread {
    let alpha = gain(&series.reference_t, &read_angle(series), reference);
    let less = incoherent((&series.t, &series.gyro), &turned(series), &series.reference_rows, reference);
    let (step, apart) = (median_apart(&series.t), median_apart(&series.reference_t));
    // What means have turned by is the sum of all readings.
    let step = if series.turned.is_empty() { step } else { apart / MANY as f64 };
    let walked = alpha * alpha * walk * step * walked(apart / step);
    let variances = stretches_of(&less);
    Spread::of(variances.into_iter().map(|v| (v - walked).max(AT_LEAST * v)).collect())
}

/// Share of a variance that is left of it at least where another is taken off.
const AT_LEAST: f64 = 0.1;

/// The angle that the readings add up to.
fn turned(series: &Series) -> Cow<'_, [f64]> {
    if series.turned.is_empty() { integral(&series.t, &series.gyro).into() } else { (&series.turned).into() }
}

/// The same at the reference's rows.
pub(crate) fn read_angle(series: &Series) -> Vec<f64> {
    let own = turned(series);
    series.reference_rows.iter().map(|&k| own[k]).collect()
}

/// N of the angle that a rate with noise integrates to, rad/√s; 0 for other references.
pub(super) fn reference_walk(series: &Series) -> f64 {
    if series.walk.reference > 0.0 {
        return series.walk.reference;
    }
    let t = &series.reference_t;
    if series.reference_rate.is_empty() {
        return 0.0;
    }
    let noise = Spread::of(stretches(&evenly(t, &series.reference_rate, median_apart(t))));
    let variance = if noise.uneven() { noise.quiet } else { noise.mean };
    (variance * usual(series.reference_t.windows(2).map(|pair| pair[1] - pair[0]).collect())).max(0.0).sqrt()
}

/// The same of what a problem's axes were found to have, to be carried beside means of its rows.
#[must_use]
pub(crate) fn walks(problem: &Problem) -> Vec<Walk> {
    let each = problem.series.iter().zip(priors(problem));
    each.map(|(series, prior)| Walk { gyro: prior.reading, assumed: prior.assumed, reference: reference_walk(series) })
        .collect()
}

/// Variance of what the encoder's steps make it err by, its zero anywhere, along the motion as it shows it, and of its noise,
/// rad².
fn counts(series: &Series) -> f64 {
    let (encoder, angle) = (series.encoder, &series.reference_angle);
    if encoder.step <= 0.0 || encoder.readings == 1 {
        return encoder.step.powi(2) / 12.0 + encoder.noise.powi(2);
    }
    let zeros = (0..ZEROS).map(|k| encoder.step * f64::from(k) / f64::from(ZEROS));
    let square = |zero: f64| -> f64 {
        (0..angle.len()).map(|i| encoder.error(&|i| angle[i] + zero, angle.len(), i).powi(2)).sum()
    };
    zeros.map(square).sum::<f64>() / f64::from(ZEROS) / angle.len() as f64 + encoder.noise.powi(2)
}

/// Whether the reference of an axis shows no more than its noise, and whether its gyro neither does.
pub(super) fn rests(problem: &Problem, series: &Series, prior: &Prior) -> Rest {
    let angle = match problem.attitude() {
        None => series.reference_angle.clone(),
        Some(attitude) => attitude.turned_about(series.axis.index()),
    };
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let spread = |angle: &[f64]| {
        let level = mean(angle);
        mean(&angle.iter().map(|a| (a - level).powi(2)).collect::<Vec<_>>()).sqrt()
    };
    if spread(&angle) > TURNS * prior.encoder {
        return Rest::None;
    }
    let bias = mean(&series.gyro);
    let turned = integral(&series.t, &series.gyro.iter().map(|g| g - bias).collect::<Vec<_>>());
    let walk = prior.reading * series.span().duration.sqrt();
    if spread(&turned) > TURNS * prior.encoder.hypot(walk) && moves(series, prior) {
        Rest::OfReference
    } else {
        Rest::Whole
    }
}

/// Whether a gyro's reading keeps changing from one stretch to the next by more than its noise: a bias that drifts or steps does
/// not, a sensor that turns does.
fn moves(series: &Series, prior: &Prior) -> bool {
    let rows = ((STRETCH / series.span().dt).round() as usize).max(1);
    let means: Vec<f64> =
        series.gyro.chunks_exact(rows).map(|part| part.iter().sum::<f64>() / part.len() as f64).collect();
    let changes: Vec<f64> = means.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    // Of normal numbers the median size lies at 0.674 of the standard deviation.
    let noise = 0.674 * prior.reading * (2.0 / (rows as f64 * series.span().dt)).sqrt();
    median(changes).is_some_and(|usual| usual > TURNS * noise)
}

/// A stretch of a rest, s.
const STRETCH: f64 = 1.0;

/// Standard deviations of the reference's noise that an axis has to turn by, in the root mean square.
const TURNS: f64 = 3.0;

/// F(τ) of white gyro noise and reference noise alone, rad/s: F² = N²/τ + 2σ²/τ².
#[must_use]
pub(crate) fn weights(prior: &Prior, tau: &[f64]) -> Vec<f64> {
    tau.iter().map(|t| (prior.angle_random_walk.powi(2) / t + 2.0 * (prior.encoder / t).powi(2)).sqrt()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        Axis, Model,
        simulate::{Hidden, Motion, Scenario, SensorSpec, simulate},
    };
    use std::f64::consts::TAU;

    fn noise_found(motion: Motion, hidden: &[&str]) -> f64 {
        let hidden = hidden.iter().map(|h| Hidden::parse(h, Axis::X).expect("an effect")).collect();
        let scenario = Scenario { motion, seed: 3, hidden, sensor: SensorSpec::default(), ..Scenario::default() };
        let record = simulate(&scenario).record;
        let series = Series::new(&record, Axis::X, &Model::base_for(&record)).expect("a series");
        prior(&series, &series.reference_angle).reading * 2_f64.sqrt() / scenario.sensor.noise_density
    }

    #[test]
    fn a_vibration_is_no_noise() {
        for motion in [Motion::Multisine { travel: 6.0 }, Motion::Drive { rate: 1.2, hold: 2.0 }] {
            let quiet = noise_found(motion, &[]);
            assert!((quiet - 1.0).abs() < 0.15, "{quiet} on {motion:?}");
            let shaken = noise_found(motion, &["vibration-tone:a_sin=0.06,a_cos=0.02,f=31.7"]);
            assert!((shaken / quiet - 1.0).abs() < 0.1, "{shaken} with a tone, {quiet} without on {motion:?}");
        }
    }

    #[test]
    fn what_is_missing_is_no_noise_of_an_encoder_that_is_read_seldom() {
        let motions = [Motion::Multisine { travel: 6.0 }, Motion::Drive { rate: 1.2, hold: 2.0 }];
        let effects = ["delay:d=0.03", "encoder-backlash", "scale-asymmetry:a=0.02", "lag:tau=0.02"];
        for (motion, hidden, every) in itertools::iproduct!(motions, effects, [2, 5, 10]) {
            let step = TAU / 4096.0;
            let reference = crate::simulate::Reference::Encoder(4096);
            let sensor = SensorSpec { reference, reference_every: every, ..SensorSpec::default() };
            let hidden = vec![Hidden::parse(hidden, Axis::X).expect("an effect")];
            let record = simulate(&Scenario { motion, seed: 3, hidden, sensor, ..Scenario::default() }).record;
            let series = Series::new(&record, Axis::X, &Model::base_for(&record)).expect("a series");
            let found = prior(&series, &series.reference_angle).encoder * 12_f64.sqrt() / step;
            assert!((found - 1.0).abs() < 0.15, "{found} on {motion:?} every {every}");
        }
    }

    #[test]
    fn the_noise_of_the_angle_that_an_encoder_counts_is_found() {
        let motions = [
            Motion::Multisine { travel: 6.0 },
            Motion::Drive { rate: 1.2, hold: 2.0 },
            Motion::Sine { amplitude: 2.618, frequency: 0.25 },
        ];
        for (motion, counts) in motions.into_iter().flat_map(|motion| [0.0, 0.15, 0.3, 0.8].map(|n| (motion, n))) {
            let step = TAU / 2048.0;
            let sensor = SensorSpec {
                reference: crate::simulate::Reference::Encoder(2048),
                reference_noise: counts * step,
                ..SensorSpec::default()
            };
            let scenario = Scenario { motion, seed: 5, rate_hz: 200.0, sensor, ..Scenario::default() };
            let record = simulate(&scenario).record;
            let series = Series::new(&record, Axis::X, &Model::base_for(&record)).expect("a series");
            let found = series.encoder.noise / step;
            // So little beside the steps a drive of a minute does not tell.
            if counts < 0.2 && found == 0.0 && !matches!(motion, Motion::Multisine { .. }) {
                continue;
            }
            assert!((found - counts).abs() < 0.03 + 0.1 * counts, "{found} for {counts} counts on {motion:?}");
        }
    }
}
