//! What a recording tells by now, and what a manoeuvre would add to it.
//!
//! The information of a recording about the parameters p of a model is that of its whitened residual r (Fisher's matrix); a
//! manoeuvre that is made after it adds its own, computed on simulated rows of that manoeuvre under the noise that the recording
//! shows:
//!
//! ```text
//! I = Xᵀ V⁻¹ X,   X = ∂r/∂p        cov p = (I + I_manoeuvre)⁻¹
//! ```
//!
//! The manoeuvre whose sum of ln σ of what is still lacking falls most is the next one: the sequential design of experiments
//! (Fedorov 1972, *Theory of Optimal Experiments*).

use super::{Goal, Kind, Manoeuvre};
use crate::{
    Axis, AxisModel, Model, Record, Row, Term,
    effects::find,
    evidence::{
        noise,
        prior::Prior,
        study::{Bench, Study},
        whiten::NoiseModel,
    },
    fit::{FitError, fit, groups},
    nls,
    record::ReferenceKind,
    simulate::{Motion, Reference, Scenario, SensorSpec, Simulator, Supply, Temperature},
};
use faer::Mat;
use std::f64::consts::TAU;

/// Rows a second of a rehearsal at most: the noise is known as a density, and no hand is faster.
const REHEARSED_HZ: f64 = 100.0;
/// How unsure a parameter is of which nothing is known, in its typical sizes.
const UNKNOWN: f64 = 30.0;
/// Change of temperature and of supply that a manoeuvre makes, K and V.
const WARMED: f64 = 6.0;
const CHANGED: f64 = 0.15;

/// What is known.
#[derive(Clone, Debug)]
pub struct Knowledge {
    /// The model, with standard errors.
    pub model: Model,
    groups: Vec<Group>,
    last: Row,
    rate_hz: f64,
}

/// Axes that share a reference.
#[derive(Clone, Debug)]
struct Group {
    axes: Vec<Axis>,
    prior: Vec<Prior>,
    noise: NoiseModel,
    reference: Reference,
    information: Mat<f64>,
}

/// The base model with the effects that these goals are of.
#[must_use]
pub(super) fn model_of(record: &Record, goals: &[Goal]) -> Model {
    let mut model = Model { origin: Model::base_for(record).origin, ..Model::default() };
    for goal in goals {
        let own = model.axes[goal.axis.index()].get_or_insert_with(|| AxisModel::base(goal.axis));
        if own.term(goal.effect).is_none() {
            own.terms.extend(find(goal.effect).map(|effect| Term::neutral(effect, goal.axis)));
        }
    }
    model
}

/// Every parameter of these axes: axis, place of the term, place in it.
fn places(model: &Model, axes: &[Axis]) -> Vec<(Axis, usize, usize)> {
    let terms = |axis: Axis| model.axes[axis.index()].iter().flat_map(|own| own.terms.iter().enumerate());
    let of = |axis: Axis| terms(axis).flat_map(move |(k, term)| (0..term.values.len()).map(move |p| (axis, k, p)));
    axes.iter().flat_map(|&axis| of(axis)).collect()
}

impl Knowledge {
    /// What a recording tells of these goals.
    ///
    /// # Errors
    /// Where it is too short, or has no reference.
    pub fn of(record: &Record, goals: &[Goal], before: Option<&Model>) -> Result<Self, FitError> {
        let mut start = model_of(record, goals);
        if let Some(before) = before {
            begin_at(&mut start, before);
        }
        let mut axes: Vec<Axis> = goals.iter().map(|goal| goal.axis).collect();
        axes.dedup();
        let model = fit(record, &start, &axes)?;
        let last = record.rows.last().copied().unwrap_or(Row::EMPTY);
        let rate_hz = (record.len() as f64 / record.duration().max(1e-3)).min(REHEARSED_HZ);
        Ok(Self { model, groups: Vec::new(), last, rate_hz })
    }

    /// Looks at the recording's information, which [`Self::gains`] need.
    pub fn weigh(&mut self, record: &Record) {
        let axes: Vec<Axis> = Axis::ALL.into_iter().filter(|axis| self.model.axes[axis.index()].is_some()).collect();
        self.groups = groups(record, &axes).into_iter().filter_map(|axes| self.group(record, axes)).collect();
    }

    fn group(&self, record: &Record, axes: Vec<Axis>) -> Option<Group> {
        let bench = Bench::new(record, &axes, &self.model)?;
        let study = Study::held(&bench, &self.model);
        let noise = study.identify().noise;
        let reference = match bench.problem.series[0].kind {
            ReferenceKind::Quaternion => Reference::Quaternion,
            ReferenceKind::Rate => Reference::Rate,
            ReferenceKind::Angle => {
                let step = bench.problem.series[0].encoder.step;
                Reference::Encoder(if step > 0.0 { (TAU / step).round() as u32 } else { 0 })
            }
        };
        let information = self.information(&study, &noise, &axes);
        Some(Group { axes, prior: bench.prior.clone(), noise, reference, information })
    }

    /// Fisher's matrix over every parameter of these axes; of what a study does not free it says nothing.
    fn information(&self, study: &Study, noise: &NoiseModel, axes: &[Axis]) -> Mat<f64> {
        let places = places(&self.model, axes);
        let (normal, _) = noise::normal(study, noise);
        let slot = |place: &(Axis, usize, usize)| {
            let own = |slot: &crate::evidence::problem::Slot| {
                (study.bench.problem.series[slot.series].axis, slot.term, slot.parameter) == *place
            };
            study.slots.iter().position(own)
        };
        let slots: Vec<Option<usize>> = places.iter().map(slot).collect();
        Mat::from_fn(places.len(), places.len(), |i, j| match (slots[i], slots[j]) {
            (Some(a), Some(b)) if normal.matrix[(a, b)].is_finite() => normal.matrix[(a, b)],
            _ => 0.0,
        })
    }

    /// By how much each manoeuvre would make smaller what is lacking: the sum of ln σ, down to what is wanted.
    #[must_use]
    pub fn gains(&self, manoeuvres: &[Manoeuvre], goals: &[Goal]) -> Vec<f64> {
        let gain = |manoeuvre: &Manoeuvre| -> f64 {
            let of = |group: &Group| self.gain(group, manoeuvre, goals);
            let gain: f64 = self.groups.iter().map(of).sum();
            if gain.is_finite() { gain } else { 0.0 }
        };
        manoeuvres.iter().map(gain).collect()
    }

    fn gain(&self, group: &Group, manoeuvre: &Manoeuvre, goals: &[Goal]) -> f64 {
        if !group.axes.contains(&manoeuvre.axis) || !goals.iter().any(|g| g.lacks() && group.axes.contains(&g.axis)) {
            return 0.0;
        }
        let record = self.rehearsed(group, manoeuvre);
        let Some(mut bench) = Bench::new(&record, &group.axes, &self.model) else { return 0.0 };
        bench.know(&group.prior);
        let own = self.information(&Study::held(&bench, &self.model), &group.noise, &group.axes);
        let places = places(&self.model, &group.axes);
        let before = self.std_errors(&places, &group.information);
        let after = self.std_errors(
            &places,
            &Mat::from_fn(places.len(), places.len(), |i, j| group.information[(i, j)] + own[(i, j)]),
        );
        let fall = |goal: &Goal| {
            let Some(k) = places.iter().position(|place| self.is_of(*place, goal)) else { return 0.0 };
            // Standard errors as they are reported count what the information alone does not know of.
            let beyond = goal.std_error.map_or(1.0, |error| (error / before[k]).max(1.0));
            let ratio = |sigma: f64| (beyond * sigma / goal.wanted).max(1.0).ln();
            ratio(before[k]) - ratio(after[k])
        };
        goals.iter().filter(|goal| goal.lacks()).map(fall).sum()
    }

    fn is_of(&self, (axis, term, parameter): (Axis, usize, usize), goal: &Goal) -> bool {
        let own = self.model.axes[axis.index()].as_ref().and_then(|own| own.terms.get(term));
        let is_named = |term: &Term| {
            let card = term.effect.card();
            card.id == goal.effect && term.effect.parameters(axis)[parameter].name == goal.name
        };
        axis == goal.axis && own.is_some_and(is_named)
    }

    /// Of a parameter of which nothing is known it is many times its typical size.
    fn std_errors(&self, places: &[(Axis, usize, usize)], information: &Mat<f64>) -> Vec<f64> {
        let unsure = |&(axis, term, parameter): &(Axis, usize, usize)| {
            let effect = self.model.axes[axis.index()].as_ref().map(|own| own.terms[term].effect);
            let card = effect.map(|effect| effect.parameters(axis)[parameter]);
            let size = card.map_or(1.0, |card| (card.typical - card.neutral).abs());
            UNKNOWN * if size.is_finite() && size > 0.0 { size } else { 1.0 }
        };
        let unsure: Vec<f64> = places.iter().map(unsure).collect();
        let whole = Mat::from_fn(places.len(), places.len(), |i, j| {
            information[(i, j)] + if i == j { unsure[i].powi(-2) } else { 0.0 }
        });
        let (inverse, _) = nls::invert_observable(&whole, 1e-13);
        (0..places.len()).map(|k| inverse[(k, k)].max(0.0).sqrt().min(unsure[k])).collect()
    }

    /// Rows of a manoeuvre, made where the recording ends.
    fn rehearsed(&self, group: &Group, manoeuvre: &Manoeuvre) -> Record {
        let or = |value: f64, other: f64| if value.is_finite() { value } else { other };
        let seconds = manoeuvre.seconds().max(2.0 * manoeuvre.period().min(5.0));
        let sensor = SensorSpec {
            noise_density: 2_f64.sqrt() * group.prior[0].reading,
            bias_random_walk: 0.0,
            other_rate: 0.0,
            wobble: 0.0,
            reference: group.reference,
            reference_noise: if matches!(group.reference, Reference::Encoder(_)) {
                0.0
            } else {
                group.prior[0].encoder
            },
            temperature: Temperature {
                start: or(self.last.temperature, 25.0),
                rise: if manoeuvre.kind == Kind::Warm { WARMED } else { 0.0 },
                time_constant: seconds / 3.0,
                swing: 0.0,
                period: 60.0,
                noise: 0.0,
            },
            supply: Supply { nominal: or(self.last.supply, 3.3), sag: 0.0, wander: 0.0, noise: 0.0 },
            ..SensorSpec::on(manoeuvre.axis)
        };
        let scenario = Scenario { motion: Motion::Steered, rate_hz: self.rate_hz, sensor, ..Scenario::default() };
        let mut simulator = Simulator::new(&scenario);
        let row = |k: usize| {
            let t = k as f64 / self.rate_hz;
            simulator.steer(manoeuvre.axis, manoeuvre.rate_at(t));
            let mut row = simulator.step().row;
            row.t_ns += self.last.t_ns;
            if manoeuvre.kind == Kind::Supply {
                row.supply -= CHANGED * t / seconds;
            }
            row
        };
        Record { rows: (0..(seconds * self.rate_hz) as usize).map(row).collect(), ..Record::default() }
    }
}

/// Parameters that are known from before.
fn begin_at(model: &mut Model, before: &Model) {
    for (own, known) in model.axes.iter_mut().zip(&before.axes) {
        for term in own.iter_mut().flat_map(|own| &mut own.terms) {
            let known = known.as_ref().and_then(|known| known.term(term.effect.card().id));
            if let Some(known) = known.filter(|known| known.values.iter().all(|value| value.is_finite())) {
                term.values.clone_from(&known.values);
            }
        }
    }
}
