//! What several logs of one sensor share: the effects, and the model with them; and scale factors that they do not share.

use super::{Looked, Several};
use crate::subject::Start;
use anyhow::Result;
use gyro_model::{
    Axis, Model, Term, diagnose,
    effects::{Role, find},
    pooled::{
        Key,
        joint::Joint,
        search::{self, Member, Repeated, Whose},
    },
};

/// What several logs share.
pub(super) struct Found {
    pub repeated: Vec<Repeated>,
    /// The model with it.
    pub joint: Joint,
}

impl Several {
    /// The effects that the logs share, and the model with them; on the axes `apart` each log has a scale factor of its own.
    pub(super) fn shared(
        &self,
        start: &Start,
        looked: &[Looked],
        apart: &[Axis],
        options: &diagnose::Options,
    ) -> Result<Found> {
        let members: Vec<Member> = looked.iter().map(|own| Member::of(&own.pieces)).collect();
        let known = |r: &Repeated| {
            let own = start.file.model.axes[r.axis.index()].as_ref();
            own.is_none_or(|own| own.term(&r.effect).is_none())
        };
        let mut repeated: Vec<Repeated> = search::together(&members, apart).into_iter().filter(known).collect();
        for own in &mut repeated {
            if let Some(aliases) = aliases_of_all(own, looked) {
                own.aliases = aliases;
            }
        }
        let fit = |repeated: &[Repeated]| {
            self.fit_beside(&with(&start.file.model, repeated), looked, repeated, apart, options.progress)
        };
        let mut joint = fit(&repeated)?;
        // Far from where the logs were linearised an effect may leave nothing of the others to be known, or lead the fit astray: one of a size of
        // its own in each log goes first, then the last one. One that the fit cannot tell from nothing goes, too.
        loop {
            let gone = if is_known(&joint, looked) {
                repeated.iter().position(|r| is_unseen(r, &joint.model))
            } else {
                repeated.iter().rposition(Repeated::differs).or(repeated.len().checked_sub(1))
            };
            let Some(gone) = gone else { break };
            repeated.remove(gone);
            joint = fit(&repeated)?;
        }
        Ok(Found { repeated, joint })
    }

    /// The axes on which logs differ in their scale factors, whatever `joint` added, with what each log says.
    pub(super) fn of_other_scale(
        &self,
        joint: &Joint,
        scale: impl Fn(usize, &Key) -> Option<(f64, f64)>,
    ) -> Vec<OtherScale> {
        let differs = |axis: &Axis| {
            let key = scale_of(*axis);
            let each: Vec<Option<(f64, f64)>> = (0..joint.each.len()).map(|k| scale(k, &key)).collect();
            let of_joint = joint.differs.get(&key).copied().unwrap_or(1.0);
            let p_differs = of_joint.max(search::p_differs(&each));
            (p_differs < OTHER_SCALE).then_some(OtherScale { key, each, p_differs })
        };
        self.axes.iter().filter_map(differs).collect()
    }
}

/// Whether no coefficient of an effect that all logs have in one size is farther from nothing than [`search::SHOWN`] standard errors.
fn is_unseen(found: &Repeated, model: &Model) -> bool {
    let term = model.axes[found.axis.index()].as_ref().and_then(|own| own.term(&found.effect));
    let sizes = |term: &Term| {
        let cards = term.effect.parameters(found.axis).iter().zip(term.values.iter().zip(&term.std_errors));
        let linear = cards.filter(|(card, _)| card.neutral.is_finite() && card.role == Role::Linear);
        linear.map(|(card, (value, error))| ((value - card.neutral) / error).abs()).collect::<Vec<f64>>()
    };
    found.whose == Whose::Sensor
        && !found.differs()
        && term.map(sizes).is_some_and(|sizes| !sizes.is_empty() && sizes.iter().all(|size| *size < search::SHOWN))
}

/// Scale factors of an axis that are not the same in the logs.
pub(super) struct OtherScale {
    pub key: Key,
    /// Log by log: value and standard error, where it has the axis.
    pub each: Vec<Option<(f64, f64)>>,
    /// Chance that logs with one value differ as much.
    pub p_differs: f64,
}

pub(super) fn axes_of(other: &[OtherScale]) -> Vec<Axis> {
    other.iter().map(|own| own.key.axis).collect()
}

impl Looked {
    /// A parameter of its model, with its standard error.
    pub(super) fn told(&self, key: &Key) -> Option<(f64, f64)> {
        let term =
            self.point.axes[key.axis.index()].as_ref().filter(|_| self.axes.contains(&key.axis))?.term(&key.effect)?;
        let place = term.effect.parameters(key.axis).iter().position(|card| card.name == key.name)?;
        Some((term.values[place], *term.std_errors.get(place)?)).filter(|(_, error)| error.is_finite())
    }
}

/// The key of an axis' scale factor.
pub(super) fn scale_of(axis: Axis) -> Key {
    Key::new(axis, "scale-factor", "alpha")
}

/// Chance below which logs differ in their scale factors: each has its own.
const OTHER_SCALE: f64 = 1e-6;

/// Whether a joint fit knows what the logs alone know of the axes that each has, in numbers that are some.
fn is_known(joint: &Joint, looked: &[Looked]) -> bool {
    let knows = |model: &Model, axis: Axis, id: &str, place: usize| {
        let term = model.axes[axis.index()].as_ref().and_then(|own| own.term(id));
        term.and_then(|term| term.std_errors.get(place)).is_some_and(|error| error.is_finite())
    };
    let is_sound = |(model, axes): (&Model, &[Axis])| {
        axes.iter().filter_map(|axis| Some((*axis, model.axes[axis.index()].as_ref()?))).all(|(axis, own)| {
            own.terms.iter().all(|term| {
                let id = term.effect.card().id;
                let alone = |place: usize| looked.iter().any(|own| knows(&own.point, axis, id, place));
                term.values.iter().all(|value| !value.is_nan())
                    && term
                        .std_errors
                        .iter()
                        .enumerate()
                        .all(|(k, error)| error.is_finite() && *error != 0.0 || !alone(k))
            })
        })
    };
    let each = joint.each.iter().zip(looked).map(|(own, looked)| (&own.model, &looked.axes[..]));
    std::iter::once((&joint.model, &Axis::ALL[..])).chain(each).all(is_sound)
}

/// What every log that names an effect cannot tell it from; `None` where none names it.
fn aliases_of_all(found: &Repeated, looked: &[Looked]) -> Option<Vec<String>> {
    let named = looked
        .iter()
        .flat_map(|own| &own.diagnosis.axes)
        .filter(|axis| axis.axis == found.axis && axis.finding.names());
    let own = named.filter_map(|axis| axis.suspects.iter().find(|suspect| suspect.effect == found.effect));
    own.map(|suspect| suspect.aliases.clone()).reduce(|mut all, other| {
        all.retain(|id| other.contains(id));
        all
    })
}

/// A model with the sensor's effects that were found, at the values that the equations say.
fn with(model: &Model, repeated: &[Repeated]) -> Model {
    let mut model = model.clone();
    for found in repeated.iter().filter(|found| found.whose == Whose::Sensor) {
        let Some(effect) = find(&found.effect) else { continue };
        let Some(own) = &mut model.axes[found.axis.index()] else { continue };
        if own.term(&found.effect).is_some() {
            continue;
        }
        let mut term = Term::neutral(effect, found.axis);
        for (k, card) in effect.parameters(found.axis).iter().enumerate() {
            if let Some((_, value, _)) = found.parameters.iter().find(|(key, ..)| key.name == card.name) {
                term.values[k] = value.clamp(card.bounds.0, card.bounds.1);
            }
        }
        // Shapes of a column that was taken at one.
        let linear =
            effect.parameters(found.axis).len() - found.parameters.first().map_or(0, |(key, ..)| key.shape.len());
        if let Some((key, ..)) = found.parameters.first() {
            for (value, shape) in term.values[linear..].iter_mut().zip(&key.shape) {
                *value = *shape;
            }
        }
        own.terms.push(term);
    }
    model
}
