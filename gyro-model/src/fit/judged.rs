//! One axis judged: its error curve beside the floor, its pictures, its parameters as reported.

use crate::{
    Axis, AxisModel, Model, Record, Term,
    detail::{self, AxisDetail, Input, channels, fails_where},
    diagnosis::{ErrorPoint, FailsWhere, NoiseValue, ParameterValue},
    evidence::{
        floor::{self, Floor},
        increments::HeldOut,
        series::Rest,
        study::{Study, grams},
    },
};

/// An axis' held-out errors beside what noise alone would leave.
#[derive(Clone, Debug)]
pub(crate) struct Judged {
    /// Averaging times, s.
    pub tau: Vec<f64>,
    /// E(τ), rad/s.
    pub error: Vec<f64>,
    /// F(τ) and its band.
    pub floor: Floor,
}

impl Judged {
    /// Judges series `series` of a study; `held` judges the parameters as they stand, without blocked refits.
    #[must_use]
    pub(crate) fn new(study: &Study, series: usize, held: bool) -> Self {
        let bench = study.bench;
        let component = bench.problem.attitude().map(|_| bench.problem.series[series].axis.index());
        let tau = &bench.windows.tau;
        let own = if component.is_some() {
            grams(bench, &study.evaluation, &study.columns, component)
        } else {
            study.grams.clone()
        };
        let errors: HeldOut =
            if held { own.as_is(tau) } else { study.grams.held_out_on(&own, tau, &bench.weights, &study.hold) };
        // What a model leaves out of the log is neither right nor wrong: a curve that fell with it would be a lie.
        let kept = bench.windows.kept(bench.problem.times(), &study.evaluation.lost);
        let mut judged =
            Self { tau: tau.clone(), error: errors.curve(), floor: floor::floor(study, series, component) };
        for curve in [&mut judged.error, &mut judged.floor.floor, &mut judged.floor.upper] {
            curve.iter_mut().zip(&kept).for_each(|(e, kept)| *e /= kept);
        }
        judged
    }

    /// Share of the error² of each averaging time that is gone from another curve, at its nearest averaging time.
    #[must_use]
    pub(crate) fn removed(&self, after: &[ErrorPoint]) -> Vec<f64> {
        let apart = |tau: f64, point: &ErrorPoint| (point.tau_s / tau).ln().abs();
        let gone = |(tau, error): (&f64, &f64)| {
            let near = after.iter().min_by(|a, b| apart(*tau, a).total_cmp(&apart(*tau, b)));
            near.and_then(|point| point.error).map_or(0.0, |left| (1.0 - (left / error).powi(2)).clamp(0.0, 1.0))
        };
        self.tau.iter().zip(&self.error).map(gone).collect()
    }

    /// The largest E/F.
    #[must_use]
    pub(crate) fn over_floor(&self) -> f64 {
        self.error.iter().zip(&self.floor.floor).map(|(e, f)| e / f).fold(0.0, f64::max)
    }

    /// J, the mean of (E/F)².
    #[must_use]
    pub(crate) fn excess(&self) -> f64 {
        self.error.iter().zip(&self.floor.floor).map(|(e, f)| (e / f).powi(2)).sum::<f64>() / self.error.len() as f64
    }

    /// Whether every error lies below the band's upper end.
    #[must_use]
    pub(crate) fn within(&self) -> bool {
        self.error.iter().zip(&self.floor.upper).all(|(e, u)| e <= u)
    }

    /// As reported. An error of nothing at all is one of no steps: a model that leaves out every one of them is not judged.
    #[must_use]
    pub(crate) fn points(&self) -> Vec<ErrorPoint> {
        (0..self.tau.len())
            .map(|k| ErrorPoint {
                tau_s: self.tau[k],
                error: finite(self.error[k]).filter(|error| *error > 0.0),
                floor: finite(self.floor.floor[k]),
                floor_99: finite(self.floor.upper[k]),
            })
            .collect()
    }
}

/// A number that JSON can hold.
#[must_use]
pub(crate) fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// The axis' part of a model; empty where it has none.
#[must_use]
pub(crate) fn axis_model(model: &Model, axis: Axis) -> AxisModel {
    model.axes[axis.index()].clone().unwrap_or_default()
}

/// The parameters of some terms, as reported.
#[must_use]
pub fn parameters(terms: &[Term], axis: Axis) -> Vec<ParameterValue> {
    terms
        .iter()
        .flat_map(|term| {
            term.parameters(axis).map(|(card, value, std_error)| ParameterValue {
                effect: term.effect.card().id.to_owned(),
                name: card.name.to_owned(),
                value: finite(value),
                std_error: finite(std_error),
                unit: card.unit.to_owned(),
                typical: finite(card.typical),
            })
        })
        .collect()
}

/// The noise, as reported.
#[must_use]
pub fn noise(model: &AxisModel) -> NoiseValue {
    NoiseValue {
        angle_random_walk: finite(model.noise.angle_random_walk),
        bias_random_walk: finite(model.noise.bias_random_walk),
        encoder: finite(model.noise.encoder),
    }
}

/// The pictures of one axis, and where it fails in words.
#[must_use]
pub(crate) fn pictures(record: &Record, study: &Study, series: usize) -> (AxisDetail, Vec<FailsWhere>) {
    let problem = &study.bench.problem;
    let s = &problem.series[series];
    let error = problem.axis_error(&study.evaluation, series);
    let mut error_angle = vec![f64::NAN; s.t.len()];
    for (&row, e) in s.reference_rows.iter().zip(&error) {
        error_angle[row] = *e;
    }
    let mut rates: [&[f64]; 3] = [&[]; 3];
    for (other, rate) in problem.series.iter().zip(&study.evaluation.tracks) {
        rates[other.axis.index()] = &rate.rate;
    }
    let mut list = channels(record, s.axis, rates, &study.warm[series].angle);
    if s.rest != Rest::None {
        // What an axis at rest reads is its error: it goes with itself.
        list.retain(|channel| !["rate", "direction", "rate-change", "angle"].contains(&channel.regressor.as_str()));
    }
    let prior = &study.bench.prior[series];
    let detail = detail::detail(&Input {
        t: &s.t,
        rate: &study.evaluation.tracks[series].rate,
        error_angle: &error_angle,
        channels: &list,
        noise: crate::Noise {
            angle_random_walk: prior.angle_random_walk,
            bias_random_walk: 0.0,
            encoder: prior.encoder,
            ..crate::Noise::default()
        },
    });
    let fails = fails_where(&detail);
    (detail, fails)
}
