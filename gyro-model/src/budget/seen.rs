//! What the components of a budget look at: one axis' error, step by step, beside gyro and reference.

use super::{
    coherent::{self, Conditioned, Response},
    folded_lines::{self, Line},
    spectra::{Band, bands},
};
use crate::{
    AxisModel,
    evidence::{
        prior::{Prior, read_angle},
        rough::median_apart,
        series::Rest,
        study::Study,
        whiten::NoiseModel,
    },
    record::ReferenceKind,
};

/// One axis of a study.
#[derive(Clone, Debug)]
pub(crate) struct Seen<'a> {
    /// From one to the next, s.
    pub dt: f64,
    /// Steps of the angle error from row to row, what goes with the catalogue's columns taken out, rad.
    pub error: Vec<f64>,
    /// Steps of the compensated gyro's angle, rad.
    pub gyro: Vec<f64>,
    /// How far apart the knots are between which the reference turns evenly, s.
    pub knots: Option<f64>,
    /// Spectra of error, gyro and reference.
    pub bands: Vec<Band>,
    /// Lines of motion faster than half the sampling rate.
    pub folded: Vec<Line>,
    /// Share of the error² of each averaging time that goes with the catalogue's columns.
    pub with_columns: Vec<f64>,
    /// One step of the reference where it is an encoder, rad.
    pub count: f64,
    /// Whether the axis does not turn: all that is left of its error is then the gyro's.
    pub rests: bool,
    /// N of the gyro's own white noise, and of a reference that is a rate, rad/√s.
    pub walks: (f64, f64),
    /// Noise known beforehand.
    pub prior: &'a Prior,
    /// Noise identified in the error.
    pub noise: &'a NoiseModel,
}

impl<'a> Seen<'a> {
    /// Series `series` of a study with the noise that was identified in its error.
    #[must_use]
    pub(crate) fn new(study: &'a Study, series: usize, noise: &'a NoiseModel) -> Self {
        let problem = &study.bench.problem;
        let s = &problem.series[series];
        let t = problem.times();
        let dt = median_apart(t);
        let error = problem.axis_error(&study.evaluation, series);
        let angle = problem.attitude().map_or_else(
            || study.evaluation.tracks[series].reference().to_vec(),
            |attitude| attitude.turned_about(s.axis.index()),
        );
        let lost = &study.evaluation.lost;
        let steps = |angle: &[f64]| -> Vec<f64> {
            (1..angle.len()).map(|k| if lost[k] { 0.0 } else { angle[k] - angle[k - 1] }).collect()
        };
        let tau = &study.bench.windows.tau;
        let whole = read_angle(s);
        let reference = steps(&angle);
        let raw = steps(&error);
        let read: Vec<f64> = reference.iter().zip(&raw).map(|(r, e)| r + e).collect();
        let folded = folded_lines::lines([&raw, &read, &reference], dt);
        // The columns are made of the gyro, which shows folded motion too: what is most of the error is not theirs.
        let found = if folded_lines::share(&folded, &raw, dt) > MOST {
            Conditioned { rest: error, share: vec![0.0; tau.len()] }
        } else {
            coherent::conditioned(s, &whole, &error, (tau, dt), Response::ToSpectra)
        };
        let error = steps(&found.rest);
        let gyro: Vec<f64> = reference.iter().zip(&error).map(|(r, e)| r + e).collect();
        let bands = bands([&error, &gyro, &reference], dt);
        let prior = &study.bench.prior[series];
        let alpha = study.model.axes[s.axis.index()].as_ref().map_or(1.0, AxisModel::alpha);
        let own = (alpha.abs() * prior.reading).min(prior.angle_random_walk);
        let walks = match s.kind {
            ReferenceKind::Rate => (own, (prior.angle_random_walk.powi(2) - own * own).sqrt()),
            ReferenceKind::Angle | ReferenceKind::Quaternion => (prior.angle_random_walk, 0.0),
        };
        Self {
            dt,
            error,
            gyro,
            knots: s.knots,
            bands,
            folded,
            with_columns: found.share,
            count: s.encoder.step,
            rests: s.rest == Rest::Whole,
            walks,
            prior,
            noise,
        }
    }

    /// One-sided density of the gyro's white noise, (rad/s)²/Hz.
    #[must_use]
    pub(crate) fn white(&self) -> f64 {
        2.0 * self.walks.0.powi(2)
    }

    /// One-sided density in a band of the reference's white noise as it is known beforehand, (rad/s)²/Hz.
    #[must_use]
    pub(crate) fn white_of_reference(&self, band: &Band) -> f64 {
        2.0 * self.walks.1.powi(2) + self.of_white_angle(band, self.prior.encoder)
    }

    /// One-sided density, in a band, of the rate that an angle of white noise σ, rad, shows.
    #[must_use]
    pub(crate) fn of_white_angle(&self, band: &Band, sigma: f64) -> f64 {
        2.0 * self.dt * (2.0 * sigma * (std::f64::consts::PI * band.frequency() * self.dt).sin() / self.dt).powi(2)
    }
}

/// Share of the error in lines of folded motion from which on its columns are not asked.
const MOST: f64 = 0.3;
