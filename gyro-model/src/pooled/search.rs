//! Which effects several logs of one sensor show together, and what of it repeats.
//!
//! What repeats is the sensor's; what does not is the set-up's. The equations of the logs are summed, each log's own parameters being
//! taken out first, and effects join one after the other: that which raises the likelihood most, where noise alone would rarely do as
//! much for any of the columns, and where each log is better off with the value that the others have of it.

use super::{
    Column, Equations, Key, Piece,
    forward::{Answer, Joined, select},
};
use crate::Axis;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::collections::{BTreeMap, BTreeSet};

/// One log of a pool: its equations and how far its columns' scores of noise alone vary.
#[derive(Clone, Debug)]
pub struct Member {
    equations: Equations,
    /// Of each parameter of the equations, whether it stands in the model besides.
    stands: Vec<bool>,
    columns: BTreeMap<Key, (Column, f64, f64)>,
    axes: Vec<Axis>,
}

impl Member {
    /// Of a log's pieces.
    #[must_use]
    pub fn of(pieces: &[Piece]) -> Self {
        let each: Vec<Equations> = pieces.iter().map(Equations::of).collect();
        let columns = pieces.iter().flat_map(|piece| {
            let told = piece.columns.iter().enumerate();
            told.map(|(k, column)| (column.key.clone(), (column.clone(), piece.inflation[k], piece.shows[k])))
        });
        let axes = pieces.iter().flat_map(|piece| piece.axes.clone()).collect();
        let mut own = Self { equations: Equations::sum(&each), stands: Vec::new(), columns: columns.collect(), axes };
        own.stands = own.equations.keys.iter().map(|key| is_base(key) || own.has(key)).collect();
        own
    }

    /// The axes that it tells of.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The columns.
    pub fn columns(&self) -> impl Iterator<Item = &Column> {
        self.columns.values().map(|(column, ..)| column)
    }

    /// How much J grows by with the square of a coefficient.
    #[must_use]
    pub fn shows(&self, key: &Key) -> Option<f64> {
        self.columns.get(key).map(|(_, _, shows)| *shows)
    }

    /// Its equations with these parameters; what is its own, or stands in its model besides, is taken out.
    #[must_use]
    pub fn with(&self, wanted: &BTreeSet<Key>) -> Equations {
        // Of so few, each is compared sooner than their order is followed.
        let is_wanted = |key: &Key| wanted.iter().any(|own| own == key);
        self.equations.with(|k, key| self.stands[k] || is_wanted(key)).without(|key| !is_wanted(key))
    }

    /// Whether the model at which it was linearised has a parameter: the log alone named its effect.
    #[must_use]
    pub fn has(&self, key: &Key) -> bool {
        self.columns.get(key).is_some_and(|(column, ..)| column.at != 0.0)
    }

    /// What it says of one parameter, these others being free beside it: value, and variance with inflation.
    #[must_use]
    pub fn told(&self, key: &Key, beside: &BTreeSet<Key>) -> Option<(f64, f64)> {
        let wanted: BTreeSet<Key> = beside.iter().chain([key]).cloned().collect();
        let told = self.with(&wanted).told(key)?;
        let inflation = self.columns.get(key).map_or(1.0, |(_, inflation, _)| *inflation);
        Some((told.value, told.variance * inflation))
    }

    /// What it says of two parameters together, these others being free beside them: values, and variances and covariance (aa, ab, bb) with
    /// the larger inflation.
    #[must_use]
    pub fn told_both(&self, keys: &[Key; 2], beside: &BTreeSet<Key>) -> Option<([f64; 2], [f64; 3])> {
        let wanted: BTreeSet<Key> = beside.iter().chain(keys).cloned().collect();
        let both = self.with(&wanted).without(|key| !keys.contains(key));
        let place = |key: &Key| both.keys.iter().position(|own| own == key);
        let (a, b) = (place(&keys[0])?, place(&keys[1])?);
        let (values, covariance) = both.solve();
        let inflation = |key: &Key| self.columns.get(key).map_or(1.0, |(_, inflation, _)| *inflation);
        let most = inflation(&keys[0]).max(inflation(&keys[1]));
        let known = [(a, a), (a, b), (b, b)].map(|(i, j)| most * covariance[(i, j)]);
        known.iter().all(|entry| entry.is_finite()).then_some(([values[a], values[b]], known))
    }
}

/// The base model's own parameters, which stand in every model.
fn is_base(key: &Key) -> bool {
    matches!(key.effect.as_str(), "scale-factor" | "bias")
}

/// Whose an effect is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Whose {
    /// It repeats: the sensor's.
    Sensor,
    /// It does not: that of the set-up of some logs.
    SetUp,
}

/// One effect over several logs.
#[derive(Clone, Debug)]
pub struct Repeated {
    /// The axis.
    pub axis: Axis,
    /// The effect's id.
    pub effect: String,
    /// Its parameters over all logs: key, value, standard error.
    pub parameters: Vec<(Key, f64, f64)>,
    /// Gain in ln L of one value for all logs.
    pub gain: f64,
    /// Chance of that from noise alone, for any column.
    pub p_value: f64,
    /// Log by log, the principal parameter: value and standard error, where the log tells it.
    pub each: Vec<Option<(f64, f64)>>,
    /// Chance that logs with one value differ as much.
    pub p_differs: f64,
    /// Whose it is.
    pub whose: Whose,
    /// Effects that all logs together cannot tell from it.
    pub aliases: Vec<String>,
}

/// Standard errors from nothing from which on a log shows an effect.
pub const SHOWN: f64 = 3.0;
/// Chance below which logs differ that should have one value.
pub const DIFFERS: f64 = 1e-3;

/// The effects that these logs of one sensor show together, the clearest first. On the axes `apart` each log has a scale factor of its own.
#[must_use]
pub fn together(members: &[Member], apart: &[Axis]) -> Vec<Repeated> {
    let axes: BTreeSet<Axis> = members.iter().flat_map(|member| member.axes.clone()).collect();
    let shared = |axis: Axis| if apart.contains(&axis) { BTreeSet::new() } else { base(axis) };
    axes.into_iter().flat_map(|axis| on_axis(members, axis, shared(axis))).collect()
}

/// The groups of columns that join together: an effect's coefficients at one shape.
#[must_use]
pub fn candidates<'m>(members: impl IntoIterator<Item = &'m Member>, axis: Axis) -> Vec<Vec<Key>> {
    let mut groups: BTreeMap<(String, Vec<u64>), BTreeSet<Key>> = BTreeMap::new();
    let is_asked = |c: &&Column| c.key.axis == axis && !c.own && !is_base(&c.key) && c.key.is_size();
    for column in members.into_iter().flat_map(Member::columns).filter(is_asked) {
        let shape = column.key.shape.iter().map(|x| x.to_bits()).collect();
        groups.entry((column.key.effect.clone(), shape)).or_default().insert(column.key.clone());
    }
    groups.into_values().map(|keys| keys.into_iter().collect()).collect()
}

/// The base model's parameters of an axis that logs share.
#[must_use]
pub fn base(axis: Axis) -> BTreeSet<Key> {
    BTreeSet::from([Key::new(axis, "scale-factor", "alpha")])
}

fn on_axis(members: &[Member], axis: Axis, shared: BTreeSet<Key>) -> Vec<Repeated> {
    let left = candidates(members, axis);
    let price = left.len() as f64;
    let is_named = |key: &Key| members.iter().any(|member| member.has(key));
    let ask = |keys: &[Key], chosen: &BTreeSet<Key>| answer(members, keys, chosen, price);
    let (chosen, found) = select(left, shared, is_named, ask);
    let told = found.into_iter();
    told.filter_map(|Joined { keys, aliases }| repeated(members, axis, &keys, &chosen, price, aliases)).collect()
}

/// What a group of columns gains beside the chosen ones, one value for all logs.
fn answer(members: &[Member], keys: &[Key], chosen: &BTreeSet<Key>, price: f64) -> Option<Answer> {
    let rest: BTreeSet<Key> = chosen.iter().filter(|key| !keys.contains(key)).cloned().collect();
    let wanted: BTreeSet<Key> = rest.iter().chain(keys).cloned().collect();
    // The chosen ones have one value for all logs, too: they are taken out of the sum.
    let each: Vec<Equations> = members.iter().map(|member| member.with(&wanted)).collect();
    // Where the logs differ in one of them, each has its own.
    let differing: BTreeSet<Key> = rest.iter().filter(|key| differs(members, key, &rest)).cloned().collect();
    let each: Vec<Equations> = each.iter().map(|e| e.without(|key| differing.contains(key))).collect();
    let all = Equations::sum(&each).without(|key| rest.contains(key));
    let own = all.with(|_, key| keys.contains(key));
    let knows = own.keys.iter().all(|key| {
        let raw: f64 = each.iter().filter_map(|e| e.keys.iter().position(|k| k == key).map(|p| e.matrix[(p, p)])).sum();
        let left = own.keys.iter().position(|k| k == key).map_or(0.0, |p| own.matrix[(p, p)]);
        left > 1e-6 * raw && raw > 0.0
    });
    if !knows || own.keys.is_empty() {
        return None;
    }
    let (values, _) = own.solve();
    let raw: f64 = 0.5 * values.iter().zip(&own.right).map(|(v, b)| v * b).sum::<f64>();
    let inflation = inflation(members, keys);
    let gain = raw / inflation;
    let law = ChiSquared::new(keys.len() as f64).ok()?;
    let p_value = (law.sf((2.0 * gain).max(0.0)) * price).min(1.0);
    // Log by log, what is not asked about being free.
    let alone: Vec<Equations> = each.iter().map(|e| e.without(|key| rest.contains(key))).collect();
    let gain_of = |e: &Equations, values: &BTreeMap<Key, f64>| -> f64 {
        let value = |key: &Key| values.get(key).copied().unwrap_or(0.0);
        let linear: f64 = e.keys.iter().zip(&e.right).map(|(key, b)| value(key) * b).sum();
        let n = e.keys.len();
        let square: f64 =
            (0..n).map(|i| (0..n).map(|j| value(&e.keys[i]) * e.matrix[(i, j)] * value(&e.keys[j])).sum::<f64>()).sum();
        (linear - 0.5 * square) / inflation
    };
    let named = |e: &Equations| -> BTreeMap<Key, f64> { e.keys.iter().cloned().zip(e.solve().0).collect() };
    let whole = named(&Equations::sum(&alone));
    let each = alone.iter().map(|e| gain_of(e, &whole)).enumerate().collect();
    let held_out = if alone.len() < 2 {
        gain
    } else {
        (0..alone.len())
            .map(|k| {
                let others = alone.iter().enumerate().filter(|(other, _)| *other != k).map(|(_, e)| e);
                gain_of(&alone[k], &named(&Equations::sum(others)))
            })
            .sum()
    };
    Some(Answer { gain, p_value, each, held_out })
}

/// The columns' inflation, each log as often as it counts: its largest.
fn inflation(members: &[Member], keys: &[Key]) -> f64 {
    let mean = |key: &Key| {
        let (sum, weight) = members
            .iter()
            .filter_map(|member| {
                let (_, inflation, _) = member.columns.get(key)?;
                let place = member.equations.keys.iter().position(|own| own == key)?;
                Some((*inflation, member.equations.matrix[(place, place)]))
            })
            .fold((0.0, 0.0), |(sum, all), (inflation, weight)| (sum + inflation * weight, all + weight));
        if weight > 0.0 { sum / weight } else { 1.0 }
    };
    keys.iter().map(mean).fold(1.0, f64::max)
}

fn repeated(
    members: &[Member],
    axis: Axis,
    keys: &[Key],
    chosen: &BTreeSet<Key>,
    price: f64,
    aliases: Vec<String>,
) -> Option<Repeated> {
    let rest: BTreeSet<Key> = chosen.iter().filter(|key| !keys.contains(key)).cloned().collect();
    let Answer { gain, p_value, .. } = answer(members, keys, &rest, price)?;
    let wanted: BTreeSet<Key> = chosen.clone();
    let all = Equations::sum(&members.iter().map(|member| member.with(&wanted)).collect::<Vec<_>>());
    let inflation = inflation(members, keys);
    let parameters: Vec<(Key, f64, f64)> = keys
        .iter()
        .filter_map(|key| all.told(key).map(|told| (key.clone(), told.value, (told.variance * inflation).sqrt())))
        .collect();
    let principal = principal(&parameters)?;
    let each: Vec<Option<(f64, f64)>> = members
        .iter()
        .map(|member| {
            member.told(&principal, &rest_of(keys, &rest, &principal)).map(|(value, variance)| (value, variance.sqrt()))
        })
        .collect();
    let p_differs = p_differs(&each);
    let whose = if p_differs < DIFFERS && !is_the_sensors(&each) { Whose::SetUp } else { Whose::Sensor };
    Some(Repeated { axis, effect: keys[0].effect.clone(), parameters, gain, p_value, each, p_differs, whose, aliases })
}

fn rest_of(keys: &[Key], rest: &BTreeSet<Key>, but: &Key) -> BTreeSet<Key> {
    rest.iter().chain(keys.iter().filter(|key| *key != but)).cloned().collect()
}

/// Whether logs differ in a parameter of an effect, the others being free.
fn differs(members: &[Member], key: &Key, beside: &BTreeSet<Key>) -> bool {
    let of = |member: &Member| member.told(key, beside).map(|(value, variance)| (value, variance.sqrt()));
    !is_base(key) && p_differs(&members.iter().map(of).collect::<Vec<_>>()) < DIFFERS
}

/// The parameter that is farthest from nothing.
fn principal(parameters: &[(Key, f64, f64)]) -> Option<Key> {
    let size = |own: &&(Key, f64, f64)| (own.1 / own.2).abs();
    parameters.iter().max_by(|a, b| size(a).total_cmp(&size(b))).map(|(key, ..)| key.clone())
}

/// Chance that readings of one value differ as much (Cochran 1954).
#[must_use]
pub fn p_differs(each: &[Option<(f64, f64)>]) -> f64 {
    let known: Vec<(f64, f64)> =
        each.iter().flatten().copied().filter(|(v, s)| v.is_finite() && s.is_finite()).collect();
    if known.len() < 2 {
        return 1.0;
    }
    let weight: f64 = known.iter().map(|(_, s)| s.powi(-2)).sum();
    let mean = known.iter().map(|(v, s)| v / (s * s)).sum::<f64>() / weight;
    let q: f64 = known.iter().map(|(v, s)| ((v - mean) / s).powi(2)).sum();
    ChiSquared::new(known.len() as f64 - 1.0).map_or(1.0, |law| law.sf(q))
}

/// Whether readings that differ are still all of one sign and far from nothing: the sensor has it, in another size each time.
fn is_the_sensors(each: &[Option<(f64, f64)>]) -> bool {
    let clear: Vec<f64> = each.iter().flatten().filter(|(v, s)| v.abs() > SHOWN * s).map(|(v, _)| *v).collect();
    let could: usize = each.iter().flatten().filter(|(_, s)| clear.iter().any(|v| v.abs() > SHOWN * s)).count();
    clear.len() == could && clear.len() > 1 && clear.iter().all(|v| v.signum() == clear[0].signum())
}

impl Repeated {
    /// Whether it is the sensor's, in another size in each log.
    #[must_use]
    pub fn differs(&self) -> bool {
        self.whose == Whose::Sensor && self.p_differs < DIFFERS
    }

    /// The logs that show it, and those that could.
    #[must_use]
    pub fn shown_in(&self) -> (Vec<usize>, Vec<usize>) {
        let size = self.parameters.iter().map(|(_, value, error)| (value.abs(), value / error));
        let size = size.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or(0.0, |(size, _)| size);
        let of = |is: &dyn Fn(f64, f64) -> bool| -> Vec<usize> {
            (0..self.each.len()).filter(|&k| self.each[k].is_some_and(|(value, error)| is(value, error))).collect()
        };
        let shown = of(&|value, error| value.abs() > SHOWN * error);
        let could = of(&|value, error| value.abs() > SHOWN * error || size > SHOWN * error);
        (shown, could)
    }
}
