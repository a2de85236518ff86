//! Between the messages (bytes) and the mathematics (models, rows, estimates): neither knows the other.

use anyhow::{Context, bail};
use gyro_model::{
    Axis, AxisModel, Model, Noise, Row, Term,
    diagnosis::ErrorPoint,
    effects::{
        self, Effect,
        user::{self, Definition, ParameterDefinition},
    },
    estimator::{self, flags},
    model::Origin,
};
use ipc_types::{
    AxisEstimate, Estimate, MARK_DATA, Parameters, Sample, Text, diagnosis,
    parameters::{self, DEFINITIONS, TERMS, VALUES},
};
use serde::{Deserialize, Serialize};

/// A row as a sample, still without its stamps.
#[must_use]
pub fn sample_of(row: &Row, run: u64, sequence: u64) -> Sample {
    Sample {
        run,
        sequence,
        time_ns: row.t_ns,
        gyro: row.gyro,
        ref_angle: row.ref_angle,
        ref_rate: row.ref_rate,
        ref_quaternion: row.ref_quaternion,
        accel: row.accel,
        temperature: row.temperature,
        supply: row.supply,
        free: row.free,
        ..Sample::EMPTY
    }
}

/// The row in a sample.
#[must_use]
pub fn row_of(sample: &Sample) -> Row {
    Row {
        t_ns: sample.time_ns,
        gyro: sample.gyro,
        ref_angle: sample.ref_angle,
        ref_rate: sample.ref_rate,
        ref_quaternion: sample.ref_quaternion,
        accel: sample.accel,
        temperature: sample.temperature,
        supply: sample.supply,
        free: sample.free,
    }
}

/// An estimate as a message, still without kalman's last stamp.
#[must_use]
pub fn message_of(estimate: &estimator::Estimate, sample: &Sample, took_ns: u64) -> Estimate {
    Estimate {
        run: sample.run,
        sequence: sample.sequence,
        mark: MARK_DATA,
        flags: 0,
        epoch: estimate.epoch,
        time_ns: sample.time_ns,
        valid_ns: estimate.valid_t_ns,
        reference_ns: estimate.reference_t_ns,
        axes: estimate.axes.map(|a| AxisEstimate {
            present: u32::from(a.present),
            flags: a.flags,
            rate: a.rate,
            rate_filtered: a.rate_filtered,
            rate_std: a.rate_std,
            lag: a.lag,
            angle: a.angle,
            angle_fused: a.angle_fused,
            bias: a.bias,
            innovation: a.innovation,
            innovation_std: a.innovation_std,
            nis: a.nis,
            reference_innovation: a.reference_innovation,
            reference_innovation_std: a.reference_innovation_std,
        }),
        valid_clock_ns: 0,
        arrived_ns: sample.arrived_ns,
        acquisition_gave_ns: sample.acquisition_gave_ns,
        kalman_took_ns: took_ns,
        kalman_gave_ns: 0,
    }
}

/// The estimate in a message.
#[must_use]
pub fn estimate_of(message: &Estimate) -> estimator::Estimate {
    estimator::Estimate {
        valid_t_ns: message.valid_ns,
        reference_t_ns: message.reference_ns,
        epoch: message.epoch,
        axes: message.axes.map(|a| estimator::AxisEstimate {
            present: a.present != 0,
            rate: a.rate,
            rate_filtered: a.rate_filtered,
            rate_std: a.rate_std,
            lag: a.lag,
            angle: a.angle,
            angle_fused: a.angle_fused,
            bias: a.bias,
            innovation: a.innovation,
            innovation_std: a.innovation_std,
            nis: a.nis,
            reference_innovation: a.reference_innovation,
            reference_innovation_std: a.reference_innovation_std,
            flags: a.flags,
        }),
    }
}

/// Whether the row of this estimate was refused (not newer than the one before).
#[must_use]
pub fn is_rejected(estimate: &estimator::Estimate) -> bool {
    estimate.axes.iter().any(|a| a.flags & flags::ROW_REJECTED != 0)
}

/// A model as a message, still without run, stamps and counts.
///
/// # Errors
/// Where it has more than a message can hold.
pub fn parameters_of(model: &Model) -> anyhow::Result<Parameters> {
    let mut message = Parameters { epoch: model.epoch, ..Parameters::default() };
    message.supply = model.origin.supply.unwrap_or(f64::NAN);
    let mut own: Vec<Definition> = Vec::new();
    for term in model.axes.iter().flatten().flat_map(|axis| &axis.terms) {
        own.extend(user::definition(term.effect).filter(|d| !own.contains(d)));
    }
    if own.len() > DEFINITIONS {
        bail!("{} effects of your own: a running pipeline has room for {DEFINITIONS}", own.len());
    }
    for (slot, definition) in message.definitions.iter_mut().zip(&own) {
        let text = serde_json::to_string(&OwnEffect::from(definition))?;
        *slot = Text::whole(&text)
            .with_context(|| format!("{}: too long an expression for a running pipeline", definition.id))?;
    }
    for axis in Axis::ALL {
        let Some(model) = &model.axes[axis.index()] else { continue };
        let slot = &mut message.axes[axis.index()];
        if model.terms.len() > TERMS {
            bail!("{} effects on axis {axis}: a running pipeline has room for {TERMS}", model.terms.len());
        }
        slot.present = 1;
        slot.count = model.terms.len() as u32;
        slot.angle_random_walk = model.noise.angle_random_walk;
        slot.bias_random_walk = model.noise.bias_random_walk;
        slot.encoder = model.noise.encoder;
        slot.unexplained = model.noise.unexplained;
        for (entry, term) in slot.terms.iter_mut().zip(&model.terms) {
            let id = term.effect.card().id;
            if term.values.len() > VALUES {
                bail!("{id} has {} parameters: a running pipeline has room for {VALUES}", term.values.len());
            }
            entry.effect = Text::whole(id).with_context(|| format!("{id}: too long a name"))?;
            entry.count = term.values.len() as u64;
            entry.values[..term.values.len()].copy_from_slice(&term.values);
            entry.std_errors[..term.std_errors.len().min(VALUES)]
                .copy_from_slice(&term.std_errors[..term.std_errors.len().min(VALUES)]);
        }
    }
    Ok(message)
}

/// The error curve in a message.
#[must_use]
pub fn curve_of(points: &[diagnosis::ErrorPoint]) -> Vec<ErrorPoint> {
    let finite = |v: f64| Some(v).filter(|v| v.is_finite());
    let point = |p: &diagnosis::ErrorPoint| ErrorPoint {
        tau_s: p.tau,
        error: finite(p.error),
        floor: finite(p.floor),
        floor_99: finite(p.floor_99),
    };
    points.iter().filter(|p| p.tau > 0.0).map(point).collect()
}

/// The model in a message. A user's own effects are defined here, over these free channels.
///
/// # Errors
/// An effect that is not known here, or another number of parameters than it has.
pub fn model_of(message: &Parameters, free_names: &[String]) -> anyhow::Result<Model> {
    let mut own = Vec::new();
    for text in message.definitions.iter().filter(|text| !text.as_str().is_empty()) {
        let definition = Definition::from(serde_json::from_str::<OwnEffect>(text.as_str())?);
        own.push(user::define(&definition, free_names)?);
    }
    let mut model = Model { epoch: message.epoch, ..Model::default() };
    model.origin = Origin { supply: message.supply.is_finite().then_some(message.supply) };
    for axis in Axis::ALL {
        let slot = &message.axes[axis.index()];
        if slot.present == 0 {
            continue;
        }
        let terms: anyhow::Result<Vec<Term>> =
            slot.terms.iter().take(slot.count as usize).map(|entry| term_of(entry, axis, &own)).collect();
        let noise = Noise {
            angle_random_walk: slot.angle_random_walk,
            bias_random_walk: slot.bias_random_walk,
            encoder: slot.encoder,
            unexplained: slot.unexplained,
        };
        model.axes[axis.index()] = Some(AxisModel { terms: terms?, noise });
    }
    Ok(model)
}

fn term_of(entry: &parameters::Term, axis: Axis, own: &[&'static dyn Effect]) -> anyhow::Result<Term> {
    let id = entry.effect.as_str();
    let effect = own.iter().copied().find(|effect| effect.card().id == id).or_else(|| effects::find(id));
    let effect = effect.with_context(|| format!("effect '{id}' is not known here"))?;
    let count = entry.count as usize;
    if count != effect.parameters(axis).len() || count > VALUES {
        bail!("effect '{id}' comes with {count} parameters on axis {axis}, and has {}", effect.parameters(axis).len());
    }
    Ok(Term { effect, values: entry.values[..count].to_vec(), std_errors: entry.std_errors[..count].to_vec() })
}

/// A user's own effect as it crosses.
#[derive(Serialize, Deserialize)]
struct OwnEffect {
    id: String,
    regressor: String,
    parameters: Vec<(String, String, f64)>,
}

impl From<&Definition> for OwnEffect {
    fn from(definition: &Definition) -> Self {
        let parameters = definition.parameters.iter().map(|p| (p.name.clone(), p.unit.clone(), p.typical)).collect();
        Self { id: definition.id.clone(), regressor: definition.regressor.clone(), parameters }
    }
}

impl From<OwnEffect> for Definition {
    fn from(own: OwnEffect) -> Self {
        let parameters = own
            .parameters
            .into_iter()
            .map(|(name, unit, typical)| ParameterDefinition { name, unit, typical })
            .collect();
        Self { id: own.id, regressor: own.regressor, parameters }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_crosses_unchanged() {
        let mut row = Row { t_ns: 5, gyro: [1.0, 2.0, 3.0], supply: 3.3, ..Row::EMPTY };
        row.accel = [0.1, 0.2, 0.3];
        let back = row_of(&sample_of(&row, 1, 2));
        assert_eq!((back.t_ns, back.gyro, back.accel, back.supply), (row.t_ns, row.gyro, row.accel, row.supply));
        assert!(back.temperature.is_nan() && back.ref_angle[0].is_nan());
    }

    #[test]
    fn a_model_with_every_effect_crosses_unchanged() {
        let mut model = Model { epoch: 9, origin: Origin { supply: Some(3.3) }, ..Model::default() };
        for axis in Axis::ALL {
            let terms = effects::CATALOGUE
                .iter()
                .take(TERMS)
                .enumerate()
                .map(|(i, &effect)| {
                    let mut term = Term::neutral(effect, axis);
                    term.values.iter_mut().for_each(|v| *v += 0.1 * i as f64);
                    term
                })
                .collect();
            model.axes[axis.index()] = Some(AxisModel {
                terms,
                noise: Noise { angle_random_walk: 1e-4, bias_random_walk: 1e-6, encoder: 1e-3, unexplained: 0.02 },
            });
        }
        let back = model_of(&parameters_of(&model).unwrap(), &[]).unwrap();
        assert_eq!((back.epoch, back.origin), (9, model.origin));
        for (a, b) in back.axes.iter().flatten().zip(model.axes.iter().flatten()) {
            assert_eq!((a.effect_ids(), a.noise), (b.effect_ids(), b.noise));
            for (x, y) in a.terms.iter().zip(&b.terms) {
                assert_eq!(x.values, y.values);
            }
        }
    }

    #[test]
    fn an_effect_of_ones_own_crosses_with_its_definition() {
        let definition = Definition {
            id: "cable-twist".into(),
            regressor: "k * sin(angle) * load".into(),
            parameters: vec![ParameterDefinition { name: "k".into(), unit: "rad/s/N".into(), typical: 1e-4 }],
        };
        let names = ["load".to_owned()];
        let mut term = Term::neutral(user::define(&definition, &names).unwrap(), Axis::Z);
        term.values[0] = 3e-4;
        let mut model = Model::default();
        model.axes[2] = Some(AxisModel { terms: vec![term], noise: Noise::default() });
        let message = parameters_of(&model).unwrap();
        let back = model_of(&message, &names).unwrap();
        assert_eq!(back.axes[2].as_ref().unwrap().term("cable-twist").unwrap().values, [3e-4]);
        assert!(model_of(&message, &[]).is_err(), "the channel is not there");
    }

    #[test]
    fn an_unknown_effect_is_named() {
        let mut message = Parameters::default();
        message.axes[0].present = 1;
        message.axes[0].count = 1;
        message.axes[0].terms[0].effect = Text::new("nonsense");
        assert!(model_of(&message, &[]).unwrap_err().to_string().contains("nonsense"));
    }
}
