//! The running model in human units, and what changed in it.

use super::scene::{Mark, ParametersAt};
use gyro_model::{Axis, effects};
use ipc_types::{Parameters, parameters::AxisParameters};
use serde::Serialize;
use workbench::report::units;

/// The running model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ModelView {
    /// Of the parameters.
    pub epoch: u64,
    /// Whether learning rests.
    pub paused: bool,
    /// Samples that it was fitted on.
    pub samples: u64,
    /// The axes that are modelled.
    pub axes: Vec<AxisView>,
}

/// One axis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisView {
    /// `x`, `y`, `z`.
    pub axis: &'static str,
    /// In the order of adding.
    pub effects: Vec<String>,
    /// Every parameter.
    pub parameters: Vec<Shown>,
}

/// A parameter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Shown {
    /// `z bias delta`: the same in the history.
    pub key: String,
    /// Effect id.
    pub effect: String,
    /// Name as in model files.
    pub name: String,
    /// What it is.
    pub says: String,
    /// Value ± standard error with its unit.
    pub shown: String,
    /// Typical size in the same unit.
    pub typical: String,
    /// Unit of the history.
    pub unit: String,
}

/// One parameter as it came.
struct Raw<'a> {
    effect: &'a str,
    name: String,
    says: &'static str,
    value: f64,
    std_error: f64,
    typical: Option<f64>,
    unit: &'static str,
}

fn raw(axis: Axis, parameters: &AxisParameters) -> Vec<Raw<'_>> {
    let terms = parameters.terms.iter().take(parameters.count as usize);
    let mut all = Vec::new();
    for term in terms {
        let id = term.effect.as_str();
        let cards = effects::find(id).map_or(&[][..], |e| e.parameters(axis));
        for i in 0..(term.count as usize).min(term.values.len()) {
            let card = cards.get(i);
            all.push(Raw {
                effect: id,
                name: card.map_or_else(|| format!("p{}", i + 1), |c| c.name.to_string()),
                says: card.map_or("", |c| c.says),
                value: term.values[i],
                std_error: term.std_errors[i],
                typical: card.map(|c| c.typical),
                unit: card.map_or("", |c| c.unit),
            });
        }
    }
    all
}

fn present(parameters: &Parameters) -> impl Iterator<Item = (Axis, &AxisParameters)> {
    Axis::ALL.into_iter().zip(&parameters.axes).filter(|(_, a)| a.present == 1)
}

/// The unit in which a parameter's history is drawn: chosen by its typical size, so that it never changes on the way.
fn steady(raw: &Raw) -> units::Shown {
    if raw.name == "alpha" { units::shown("1", &[Some(1.0)]) } else { units::shown(raw.unit, &[raw.typical]) }
}

/// The model as it is shown.
#[must_use]
pub fn view(parameters: &Parameters) -> ModelView {
    let axes = present(parameters)
        .map(|(axis, p)| AxisView {
            axis: axis.letter(),
            effects: p.terms.iter().take(p.count as usize).map(|t| t.effect.as_str().to_string()).collect(),
            parameters: raw(axis, p)
                .iter()
                .map(|r| {
                    let unit = steady(r);
                    Shown {
                        key: format!("{axis} {} {}", r.effect, r.name),
                        effect: r.effect.into(),
                        name: r.name.clone(),
                        says: r.says.into(),
                        shown: units::uncertain(Some(r.value), Some(r.std_error), &unit),
                        typical: r
                            .typical
                            .filter(|t| *t != 0.0)
                            .map_or_else(String::new, |t| units::round(t * unit.factor) + &unit.unit),
                        unit: unit.unit.trim().into(),
                    }
                })
                .collect(),
        })
        .collect();
    ModelView { epoch: parameters.epoch, paused: parameters.paused == 1, samples: parameters.samples, axes }
}

/// The values alone, for the history.
#[must_use]
pub fn values(parameters: &Parameters, t: f64) -> ParametersAt {
    let mut values = Vec::new();
    for (axis, p) in present(parameters) {
        for r in raw(axis, p).iter().filter(|r| r.value.is_finite()) {
            let unit = steady(r);
            let error = Some(r.std_error * unit.factor).filter(|e| e.is_finite());
            values.push((format!("{axis} {} {}", r.effect, r.name), r.value * unit.factor, error));
        }
    }
    ParametersAt { t, values }
}

/// Effects that came and went between two sets of parameters.
#[must_use]
pub fn changes(before: &Parameters, after: &Parameters, t: f64) -> Vec<Mark> {
    let ids = |p: &AxisParameters| -> Vec<String> {
        p.terms.iter().take(p.count as usize).map(|t| t.effect.as_str().to_string()).collect()
    };
    let mut marks = Vec::new();
    for (axis, (a, b)) in Axis::ALL.into_iter().zip(before.axes.iter().zip(&after.axes)) {
        if a.present != 1 || b.present != 1 {
            continue;
        }
        let (old, new) = (ids(a), ids(b));
        let came = new.iter().filter(|id| !old.contains(id)).map(|id| format!("+ {id} ({axis})"));
        let went = old.iter().filter(|id| !new.contains(id)).map(|id| format!("− {id} ({axis})"));
        marks.extend(came.chain(went).map(|says| Mark { t, epoch: after.epoch, says }));
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;
    use ipc_types::{Text, parameters::Term};

    fn parameters(effects: &[(&str, f64)]) -> Parameters {
        let mut parameters = Parameters { epoch: 3, ..Parameters::default() };
        let axis = &mut parameters.axes[2];
        (axis.present, axis.count) = (1, effects.len() as u32);
        for (slot, (id, value)) in axis.terms.iter_mut().zip(effects) {
            *slot = Term { effect: Text::new(id), count: 1, ..Term::default() };
            slot.values[0] = *value;
            slot.std_errors[0] = 0.01 * value;
        }
        parameters
    }

    #[test]
    fn an_effect_that_came_is_a_mark() {
        let base = parameters(&[("scale-factor", 1.0), ("bias", 0.01)]);
        let more = parameters(&[("scale-factor", 1.0), ("bias", 0.01), ("delay", 0.012)]);
        let says: Vec<String> = changes(&base, &more, 1.0).into_iter().map(|m| m.says).collect();
        assert_eq!(says, ["+ delay (z)"]);
        let says: Vec<String> = changes(&more, &base, 1.0).into_iter().map(|m| m.says).collect();
        assert_eq!(says, ["− delay (z)"]);
        assert!(changes(&base, &base, 1.0).is_empty());
    }

    #[test]
    fn parameters_are_shown_in_human_units_with_the_history_in_the_same() {
        let p = parameters(&[("delay", 0.012)]);
        let shown = view(&p);
        assert_eq!(shown.axes[0].parameters[0].shown, "12.00 ± 0.12 ms");
        let history = values(&p, 2.0);
        assert_eq!(history.values[0].0, shown.axes[0].parameters[0].key);
        assert!((history.values[0].1 - 12.0).abs() < 1e-9);
    }

    #[test]
    fn an_effect_that_this_program_does_not_know_is_shown_by_its_numbers() {
        assert_eq!(view(&parameters(&[("my-own", 0.5)])).axes[0].parameters[0].name, "p1");
    }
}
