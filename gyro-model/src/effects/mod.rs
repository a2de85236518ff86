//! The catalogue of physical effects: one effect a file, one static list.
//!
//! An effect is a set of facts (its [`Card`]) and a few pure functions. Where it acts on the way from the true rate to
//! the reading is its [`Stage`]; each stage has a trait of its own with the functions that an effect there needs. Everything else in truerate
//! (simulator, compensation, fit, diagnosis, reports, `truerate effects`) walks [`CATALOGUE`].

pub(crate) use operators::{
    Lately, Parabola, Play, SIXTH, STEADY, derivative, low_pass, low_passed, play, quieted, quieter, second_derivative,
    sixth_differences, slowed, steadied, white_noise, within,
};

pub use memory::Memory;
pub use split::split_by;
pub use stage::{Acts, ErrorWhole, Felt, Reading, ReferenceAngle, Response, Shown, Stage, Timing};
pub use window::Window;

use crate::{
    Axis, Record, Row,
    measured::Measured,
    record::{FREE_CHANNELS, ReferenceKind},
};
use std::{borrow::Cow, fmt};

pub mod bias;
pub mod bias_drift;
pub mod bias_step;
pub mod clock_skew;
pub mod clock_step;
pub mod cross_axis;
pub mod cubic_nonlinearity;
pub mod dead_zone;
pub mod delay;
pub mod encoder_backlash;
pub mod encoder_eccentricity;
pub mod encoder_subdivision;
pub mod g_sensitivity;
pub mod g_squared_sensitivity;
pub mod lag;
pub mod lost_counts;
mod memory;
pub mod mount_resonance;
mod operators;
pub mod quadratic_nonlinearity;
pub mod rate_hysteresis;
pub mod reference_lag;
pub mod reference_smoothing;
pub mod saturation;
pub mod scale_asymmetry;
pub mod scale_factor;
mod split;
mod stage;
pub mod supply_voltage;
pub mod temperature_bias;
pub mod temperature_rate;
pub mod temperature_scale;
pub mod user;
pub mod vibration_tone;
pub mod warm_up;
mod window;
pub(crate) mod zero_for_a_while;
pub(crate) mod zero_while_moving;
pub(crate) mod zero_with_angle;

/// Every effect that truerate knows, in the order of `truerate effects`.
pub static CATALOGUE: &[&dyn Effect] = &[
    &scale_factor::SCALE_FACTOR,
    &bias::BIAS,
    &cross_axis::CROSS_AXIS,
    &quadratic_nonlinearity::QUADRATIC_NONLINEARITY,
    &cubic_nonlinearity::CUBIC_NONLINEARITY,
    &scale_asymmetry::SCALE_ASYMMETRY,
    &g_sensitivity::G_SENSITIVITY,
    &g_squared_sensitivity::G_SQUARED_SENSITIVITY,
    &temperature_bias::TEMPERATURE_BIAS,
    &temperature_scale::TEMPERATURE_SCALE,
    &temperature_rate::TEMPERATURE_RATE,
    &warm_up::WARM_UP,
    &bias_drift::BIAS_DRIFT,
    &bias_step::BIAS_STEP,
    &supply_voltage::SUPPLY_VOLTAGE,
    &lag::LAG,
    &delay::DELAY,
    &clock_skew::CLOCK_SKEW,
    &clock_step::CLOCK_STEP,
    &dead_zone::DEAD_ZONE,
    &saturation::SATURATION,
    &rate_hysteresis::RATE_HYSTERESIS,
    &mount_resonance::MOUNT_RESONANCE,
    &vibration_tone::VIBRATION_TONE,
    &encoder_eccentricity::ENCODER_ECCENTRICITY,
    &encoder_subdivision::ENCODER_SUBDIVISION,
    &encoder_backlash::ENCODER_BACKLASH,
    &lost_counts::LOST_COUNTS,
    &reference_smoothing::REFERENCE_SMOOTHING,
    &reference_lag::REFERENCE_LAG,
];

/// The effect of this id.
#[must_use]
pub fn find(id: &str) -> Option<&'static dyn Effect> {
    CATALOGUE.iter().copied().find(|e| e.card().id == id)
}

/// ` (did you mean 'X'?)` for the id of the catalogue that is nearest of those a slip away or that have the name in them, or
/// nothing where none is.
#[must_use]
pub fn meant(id: &str) -> String {
    let near = CATALOGUE.iter().map(|e| e.card().id).filter_map(|known| {
        let changes = strsim::levenshtein(id, known);
        (changes <= SLIPS.min(known.len() - 1) || !id.is_empty() && known.contains(id)).then_some((changes, known))
    });
    near.min().map_or_else(String::new, |(_, known)| format!(" (did you mean '{known}'?)"))
}

/// Letters that differ in a name that is still guessed.
const SLIPS: usize = 3;

/// Whether the catalogue says of one of two effects that it may be taken for the other.
#[must_use]
pub fn are_aliases(a: &str, b: &str) -> bool {
    let names = |a: &str, b: &str| find(a).is_some_and(|e| e.card().aliases.iter().any(|alias| alias.id == b));
    names(a, b) || names(b, a)
}

/// How a parameter enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// A coefficient: the effect is proportional to it.
    Linear,
    /// A shape (time constant, width, frequency): it means nothing while the effect is absent and has to be scanned.
    Shape,
    /// A whole number, which the scan chooses: left where it is.
    Chosen,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct ParameterCard {
    /// Name as in model files.
    pub name: &'static str,
    /// Unit as in model files.
    pub unit: &'static str,
    /// What it is, in a few words.
    pub says: &'static str,
    /// Coefficient or shape.
    pub role: Role,
    /// The value at which the effect changes nothing (shapes of effects with a coefficient: any value, the typical one).
    pub neutral: f64,
    /// The typical size on a low-cost sensor: what `simulate --hide ID` takes.
    pub typical: f64,
    /// Physical bounds; no fit leaves them.
    pub bounds: (f64, f64),
}

/// What an effect is, as far as those have to know it who search for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trait {
    /// Goes with time, or with what changes slowly in it: a bias that wanders may be taken for it.
    Slow,
    /// Begins or ends at instants, its shapes in seconds, which have to be seen from both sides.
    Onset,
    /// Multiplies the whole rate.
    Gain,
    /// Turns the sensor against the body: on an orientation all axes have their share, and one alone carries the others' errors.
    Turn,
    /// A sine of one frequency and one phase throughout the log.
    Line,
    /// A resonance of what carries the sensor. Its inverse is a notch, which takes out any line near its frequency.
    Resonance,
    /// A limit of the reading: none lies beyond it.
    Ceiling,
    /// A limit of the reading: none lies within it, but zero.
    Hole,
}

/// What a log must hold for an effect to be examined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// A gyro of another axis.
    OtherGyros,
    /// The gyro of this axis.
    Gyro(Axis),
    /// An accelerometer.
    Accelerometer,
    /// A temperature that changes.
    Temperature,
    /// A supply voltage that changes.
    Supply,
    /// A reference that is an angle.
    AngleReference,
}

impl Need {
    /// Whether a log has that for this axis, even if its value never changes.
    #[must_use]
    pub fn is_in(self, record: &Record, axis: Axis) -> bool {
        let any = |value: &dyn Fn(&Row) -> f64| record.rows.iter().any(|row| value(row).is_finite());
        match self {
            Self::OtherGyros => Axis::ALL.into_iter().any(|other| other != axis && record.has_gyro(other)),
            Self::Gyro(axis) => record.has_gyro(axis),
            Self::Accelerometer => (0..3).any(|i| any(&|row| row.accel[i])),
            Self::Temperature => any(&|row| row.temperature),
            Self::Supply => any(&|row| row.supply),
            Self::AngleReference => record.reference(axis) == Some(ReferenceKind::Angle),
        }
    }
}

impl fmt::Display for Need {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::OtherGyros => "a gyro of another axis",
            Self::Gyro(axis) => return write!(f, "the gyro of axis {axis}"),
            Self::Accelerometer => "an accelerometer",
            Self::Temperature => "a temperature that changes",
            Self::Supply => "a supply voltage that changes",
            Self::AngleReference => "a reference that is an angle",
        })
    }
}

/// An effect that can look the same on one log.
#[derive(Clone, Copy, Debug)]
pub struct Alias {
    /// Its id.
    pub id: &'static str,
    /// When the two look alike.
    pub when: &'static str,
    /// The manoeuvre that splits them.
    pub split_by: &'static str,
}

/// The facts about an effect.
#[derive(Clone, Copy, Debug)]
pub struct Card {
    /// Public id.
    pub id: &'static str,
    /// What it is, half a line.
    pub title: &'static str,
    /// What happens physically, two or three sentences for an engineer.
    pub physics: &'static str,
    /// The equation, in the symbols of the crate's head.
    pub equation: &'static str,
    /// Typical size on low-cost sensors, in words and data-sheet units.
    pub typical: &'static str,
    /// Where the equation and the size come from.
    pub source: &'static str,
    /// What the log must hold.
    pub needs: &'static [Need],
    /// What motion or condition shows it.
    pub excited_by: &'static str,
    /// What compensation can do about it.
    pub mended_by: &'static str,
    /// What to do where it comes from, on the vehicle; empty where nothing is known.
    pub at_source: &'static str,
    /// What those have to know who search for it.
    pub traits: &'static [Trait],
    /// Effects with fewer parameters that it becomes where one of its own goes to an end: what is left of it where the log does not
    /// show that parameter. A bias is in every model and is not listed.
    pub simpler: &'static [&'static str],
    /// What it can be confused with.
    pub aliases: &'static [Alias],
}

/// One instant as a regressor sees it. All finite where the effect's needs are met.
#[derive(Clone, Copy, Debug)]
pub struct Signals {
    /// Time since the log's first row, s.
    pub t: f64,
    /// Since the previous sample, s (0 at the first).
    pub dt: f64,
    /// The axis under study.
    pub axis: usize,
    /// Compensated rates of the three axes, rad/s; the others' raw where they have no model, 0 where there is no gyro.
    pub rates: [f64; 3],
    /// Derivative of this axis' compensated rate, rad/s².
    pub rate_dot: f64,
    /// Shaft angle (reference stages: the true angle; others: the best known), rad.
    pub angle: f64,
    /// Specific force, m/s².
    pub accel: [f64; 3],
    /// T − 25 °C.
    pub delta_temperature: f64,
    /// dT/dt where it is known from elsewhere (a simulator, a log as a whole); `NaN` where the effect has to estimate it
    /// from what it has seen, K/s.
    pub temperature_dot: f64,
    /// Supply less the model's origin, V.
    pub delta_supply: f64,
    /// Supply voltage, V.
    pub supply: f64,
    /// Free channels.
    pub free: [f64; FREE_CHANNELS],
}

impl Default for Signals {
    /// All zero, and dT/dt not known.
    fn default() -> Self {
        Self {
            t: 0.0,
            dt: 0.0,
            axis: 0,
            rates: [0.0; 3],
            rate_dot: 0.0,
            angle: 0.0,
            accel: [0.0; 3],
            delta_temperature: 0.0,
            temperature_dot: f64::NAN,
            delta_supply: 0.0,
            supply: 0.0,
            free: [0.0; FREE_CHANNELS],
        }
    }
}

impl Signals {
    /// ω of the axis under study.
    #[must_use]
    pub fn rate(&self) -> f64 {
        self.rates[self.axis]
    }
}

/// What a scan needs to know of a log to choose its grid of shapes.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// Time of its first row: later than 0 where it is a part of a log, s.
    pub start: f64,
    /// Length of the log, s.
    pub duration: f64,
    /// Median sample interval, s.
    pub dt: f64,
    /// Median distance of the reference's readings, s.
    pub reference_dt: f64,
    /// Smallest |reading| that is not zero, rad/s.
    pub reading_min: f64,
    /// Largest |reading|, rad/s.
    pub reading_max: f64,
    /// Largest less smallest reference angle, rad.
    pub travel: f64,
}

/// A physical effect: facts, and pure functions of the place where it acts. `p` is the parameters in the order of [`Effect::parameters`].
pub trait Effect: Send + Sync {
    /// The facts.
    fn card(&self) -> &'static Card;

    /// Where it acts, and how.
    fn acts(&self) -> Acts<'_>;

    /// Its parameters on this axis: coefficients first, then shapes.
    fn parameters(&self, axis: Axis) -> &'static [ParameterCard];

    /// The parameters `p` of axis `of` as axis `on` has them where the cause is one, each where `p` tells it: what a whole sensor has is
    /// alike on all its axes.
    fn carried_over(&self, p: &[f64], _of: Axis, _on: Axis) -> Vec<Option<f64>> {
        p.iter().map(|value| self.acts().stage().is_of_whole_sensor().then_some(*value)).collect()
    }

    /// What it does, with its numbers, as a clause with its subject: "your gyro is 10.05 ± 0.05 ms late". `p` is the parameters in the
    /// order of [`Effect::parameters`], all finite.
    fn says(&self, _axis: Axis, _p: &[Measured]) -> String {
        format!("your gyro has '{}'", self.card().id)
    }

    /// The body of a C99 function of doubles that does what compensation does, parameters by their names (those of a user's own effect
    /// with `own_` before them, since theirs may be any word); `truerate export --to c`
    /// writes it out. By stage:
    ///
    /// | stage | given | returns |
    /// | --- | --- | --- |
    /// | `Felt` | `in->rate`, `in->rates[3]`, `in->t`, …, as in [`Signals`] and in SI units; `memory[8]` | [`Felt::error_seen`] |
    /// | `Response` | `felt`, `dt`, `memory[8]` | [`Response::undo_response`] |
    /// | `Timing` | `t` | [`Timing::valid_time`] |
    /// | `Reading` | `reading` | [`Reading::lost`] |
    ///
    /// `None` where the stage leaves the gyro's reading alone, or C cannot hold the effect.
    fn in_c(&self, _axis: Axis) -> Option<Cow<'static, str>> {
        None
    }

    /// The shapes to scan on such a log: one entry a grid point, in the order of the `Shape` parameters. Empty where
    /// the effect has no shape. Finer than half the distance at which two shapes can be told apart.
    fn grid(&self, _span: &Span) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// What `p` is in the other forms of the effect, [`Role::Chosen`], that a fit tries.
    fn forms(&self, _p: &[f64], _span: &Span) -> Vec<Vec<f64>> {
        Vec::new()
    }
}

impl dyn Effect + '_ {
    /// Where it acts.
    #[must_use]
    pub fn stage(&self) -> Stage {
        self.acts().stage()
    }

    /// Whether its card has this trait.
    #[must_use]
    pub fn is(&self, wanted: Trait) -> bool {
        self.card().traits.contains(&wanted)
    }

    /// Which of its parameters are instants at which it begins or ends.
    pub fn instants(&self, axis: Axis) -> impl Iterator<Item = usize> + use<> {
        let is_instant = |card: &ParameterCard| card.role == Role::Shape && card.unit == "s";
        let cards = if self.is(Trait::Onset) { self.parameters(axis) } else { &[] };
        (0..cards.len()).filter(move |&k| is_instant(&cards[k]))
    }

    /// Whether it joins on all axes of an orientation at once: what a whole sensor has, and a sensor that is turned.
    #[must_use]
    pub fn joins_throughout(&self) -> bool {
        self.is_of_whole_sensor() || self.is(Trait::Turn)
    }

    /// Whether both act at the same place of a whole sensor or reference.
    #[must_use]
    pub fn is_like(&self, other: &dyn Effect) -> bool {
        self.joins_throughout() && other.joins_throughout() && self.stage() == other.stage()
    }

    /// Whether it is that of a whole sensor or reference, the same on all its axes.
    #[must_use]
    pub fn is_of_whole_sensor(&self) -> bool {
        self.stage().is_of_whole_sensor()
    }
}

impl fmt::Debug for dyn Effect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.card().id)
    }
}

#[cfg(test)]
mod hostile;
#[cfg(test)]
mod tests;
