//! What is known of one axis once the search has ended, as plain facts: all that its finding depends on.

use super::challenger::{Challenger, Incumbent};
use crate::{
    AxisModel,
    budget::{Budget, Floors},
    diagnosis::{DataFault, LimitedBy},
    effects::{Stage, Trait},
    evidence::{
        identify,
        integrate::integral,
        noise::{self, Gls},
        series::{Rest, Series},
        study::Study,
    },
    finding::{NamedEffect, Wander, Why, ZeroMoves},
    fit::judged::Judged,
    scan::tone,
    statistics::Estimate,
    thresholds as limit,
};

/// Another zero as the explanation of an error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct OtherZero {
    /// The other zero minus the usual one (at rest, before and after, in the mean over all angles), rad/s.
    pub size: Estimate,
    /// When it is another one.
    pub when: ZeroMoves,
    /// J with it.
    pub excess: f64,
}

/// The facts.
#[derive(Clone, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "facts that are independent of one another")]
pub(super) struct Observed {
    /// Whether effects were looked for.
    pub searched: bool,
    /// Whether the search was stopped before its end.
    pub unfinished: bool,
    /// The fault of the data that makes every verdict worthless.
    pub fault: Option<DataFault>,
    /// Effects that are missing and named.
    pub named: Vec<NamedEffect>,
    /// Largest error over floor with all of them, where the search went on to its end.
    pub with_named: Option<f64>,
    /// Whether what is named dominates the error, whatever the motion lacks.
    pub dominates: bool,
    /// What the motion lacks for the base model itself.
    pub unexcited: Option<Why>,
    /// By how much the zero is another one, where that explains the error and no accelerometer tells why.
    pub other_zero: Option<OtherZero>,
    /// Whether the axis does not turn at all.
    pub at_rest: bool,
    /// Effects that were added and cannot be told from others.
    pub alike: Vec<NamedEffect>,
    /// Whether the error is within the band of noise alone.
    pub within: bool,
    /// Length of the log, s.
    pub seconds: f64,
    /// Share of the log in which the rate is not known.
    pub silent: f64,
    /// Whether noise of a size that sensors have explains the error; asked where it is not within the band.
    pub is_sensor_noise: bool,
    /// Whether its largest part is a bias that wanders.
    pub wanders: bool,
    /// That bias.
    pub wander: Wander,
    /// White noise of gyro, rad/√s, and reference, rad.
    pub white: [f64; 2],
    /// A slow suspect that such a bias may hide.
    pub slow: Option<String>,
    /// The best suspect that is significant.
    pub likely: Option<String>,
    /// Whether the bias explains all that the suspect might.
    pub wander_explains: bool,
    /// The error over three floors.
    pub floors: Floors,
    /// Share of the error² over the middle of the curve that has no known cause.
    pub unattributed: f64,
    /// What limits the log most.
    pub limited_by: LimitedBy,
}

impl Observed {
    /// Of a model with the suspects that did not pass; what its error is made of is not known yet ([`Self::divided`]).
    pub(super) fn of(incumbent: &Incumbent, suspects: &[&Challenger], judged: &Judged, series: usize) -> Self {
        let (study, noise) = (&incumbent.study, &incumbent.gls.noise);
        let own = &study.bench.problem.series[series];
        let span = study.bench.windows.tau.last().map_or(1.0, |t| 10.0 * t);
        // What is forgotten within some readings is white to whoever looks for longer.
        let (lasting, white) = if noise.correlation_time < limit::FORGOTTEN.value * own.span().dt {
            (0.0, noise.angle_random_walk.hypot(noise.walk_of_correlated()))
        } else {
            (noise.correlated, noise.angle_random_walk)
        };
        let walked = noise.bias_random_walk * span.sqrt();
        let wanders = walked.max(lasting) * span.sqrt() > white;
        let within = judged.within();
        let sensors = noise::of_sensors(&study.bench.prior[series]);
        // Many noises may explain what is left: physics is missing where none of those that sensors have does.
        let is_sensor_noise =
            !within && identify::cost_of_limits(study, &incumbent.gls, &sensors) < limit::UNUSUAL.value;
        let id = |suspect: &&Challenger| suspect.candidate.term.effect.card().id.to_owned();
        let is_hidden = |suspect: &&&Challenger| {
            suspect.rise > limit::SLOW_HIDDEN.value && suspect.candidate.term.effect.is(Trait::Slow)
        };
        let slow = if wanders { suspects.iter().find(is_hidden).map(id) } else { None };
        // A line that the reference shows, too, is motion.
        let is_motion = |suspect: &Challenger| {
            let term = &suspect.candidate.term;
            let may_be = term.effect.is(Trait::Line) && tone::may_be_aliased(&suspect.study, series, term);
            may_be && tone::is_in_reference(&suspect.study, series, term)
        };
        let likely = suspects.iter().find(|suspect| suspect.significant() && !is_motion(suspect)).map(id);
        let budget = || Budget::of(study, series, judged, noise, Some(&[]));
        let wander_explains = wanders && is_sensor_noise && likely.is_some() && budget().is_wander(judged);
        Self {
            searched: true,
            unfinished: false,
            fault: None,
            named: Vec::new(),
            with_named: None,
            dominates: false,
            other_zero: None,
            unexcited: unexcited(study, &incumbent.gls, series),
            at_rest: own.rest == Rest::Whole,
            alike: Vec::new(),
            within,
            seconds: own.span().duration,
            silent: study.evaluation.silent(),
            is_sensor_noise,
            wanders,
            wander: if walked >= lasting {
                Wander { size: walked, within_s: None }
            } else {
                Wander { size: lasting, within_s: Some(noise.correlation_time) }
            },
            white: [white, noise.encoder],
            slow,
            likely,
            wander_explains,
            floors: Floors::UNKNOWN,
            unattributed: 1.0,
            limited_by: LimitedBy::Unattributed,
        }
    }

    /// With what the error is made of.
    pub(super) fn divided(self, budget: &Budget, judged: &Judged) -> Self {
        Self { floors: budget.floors(judged), unattributed: budget.unattributed, limited_by: budget.limited_by, ..self }
    }

    /// Whether only noise is left, of a size that sensors have.
    pub(super) const fn leaves_noise(&self) -> bool {
        self.within || self.is_sensor_noise
    }
}

/// A quarter turn, rad.
const QUARTER: f64 = std::f64::consts::FRAC_PI_2;

/// What the log lacks for the base model itself.
pub(super) fn unexcited(study: &Study, gls: &Gls, series: usize) -> Option<Why> {
    let own = &study.bench.problem.series[series];
    let model = study.model.axes[own.axis.index()].as_ref()?;
    match own.rest {
        // What its bias does shows all the same.
        Rest::Whole => return None,
        Rest::OfReference => return Some(Why::ReferenceAtRest),
        Rest::None => {}
    }
    for (k, slot) in study.slots.iter().enumerate() {
        let effect = model.terms.get(slot.term).map(|term| term.effect);
        let Some(effect) = effect.filter(|effect| slot.series == series && effect.stage() == Stage::Calibration) else {
            continue;
        };
        let value = model.terms[slot.term].values[slot.parameter];
        let sigma = gls.std_error(k);
        if !effect.is(Trait::Gain) {
            continue;
        }
        if value <= effect.parameters(own.axis)[slot.parameter].bounds.0 {
            return Some(Why::Disagrees);
        }
        if sigma.is_nan() || sigma > limit::UNEXCITED.value * value.abs() {
            let uncertainty = (sigma / value.abs()).min(10.0);
            let travel = travel(own, model);
            return Some(if travel > QUARTER {
                Why::OneRate { uncertainty }
            } else {
                Why::NotExcited { travel, uncertainty }
            });
        }
    }
    None
}

/// How far an axis turns from one end to the other, rad: by its reference where that gives an angle of it, else by its gyro.
fn travel(series: &Series, model: &AxisModel) -> f64 {
    if !series.reference_angle.is_empty() {
        return series.span().travel;
    }
    let rate: Vec<f64> = series.gyro.iter().map(|reading| model.alpha() * reading + model.delta()).collect();
    let angle = integral(&series.t, &rate);
    let (low, high) = angle.iter().fold((0.0_f64, 0.0_f64), |(low, high), &turned| (low.min(turned), high.max(turned)));
    high - low
}
