//! Two sensors side by side: which is better, by what, and over which time.
//!
//! ```text
//! r(τ) = E₁(τ) / E₂(τ)        band of r (95 %): r · exp(± 1.96 s),   s² = s₁² + s₂²
//! sᵢ = max( (2 Tᵢ/τ)^−½ , ln(F₉₉/F)/2.33 )        scatter of ln E: independent increments in the log; noise alone put through the same
//! ```

use crate::{
    Axis,
    diagnosis::{AxisResult, ErrorPoint},
    units,
};
use serde::Serialize;

/// One of the two.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Which {
    /// The one that was named first.
    First,
    /// The other.
    Second,
}

/// One sensor on one axis: its log's name and length, and what its model leaves.
#[derive(Clone, Copy, Debug)]
pub struct Side<'a> {
    /// What it is called.
    pub name: &'a str,
    /// With its scale factor and bias, or a model of its own.
    pub axis: &'a AxisResult,
    /// Length of its log, s.
    pub seconds: f64,
    /// Rows in it.
    pub samples: u64,
}

/// A size of both.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quantity {
    /// `zero`, `scale error`, `white noise`, `walk of the zero`.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// Of the first and of the second.
    pub values: [Option<f64>; 2],
    /// Their standard errors, where they are known.
    pub std_errors: [Option<f64>; 2],
    /// Whose is smaller; `null` where that is not sure.
    pub better: Option<Which>,
}

/// The errors of both over one averaging time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct AtTime {
    /// The averaging time, s.
    pub tau_s: f64,
    /// Of the first and of the second, rad/s.
    pub errors: [f64; 2],
    /// The first over the second.
    pub ratio: f64,
    /// Lower end of its band (95 %).
    pub low: f64,
    /// Upper end.
    pub high: f64,
    /// Whose is smaller; `null` where the band holds 1.
    pub better: Option<Which>,
}

/// One axis of both.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Sides {
    /// The axis.
    pub axis: Axis,
    /// Which is better over every time that is decided; `null` where none is, or where they disagree.
    pub better: Option<Which>,
    /// That in a sentence or two.
    pub says: String,
    /// Size by size.
    pub quantities: Vec<Quantity>,
    /// At 0.1, 1 and 10 s, as far as both logs are long enough.
    pub errors: Vec<AtTime>,
}

/// The averaging times that are told, s.
pub const TOLD: [f64; 3] = [0.1, 1.0, 10.0];
/// Standard deviations of a band of 95 %.
const BAND: f64 = 1.96;
/// Standard deviation up to which the upper end of a band of 99 % reaches.
const UPPER: f64 = 2.33;
/// Standard errors of both together from which on two sizes differ: one pair in four hundred by chance.
const DIFFER: f64 = 3.0;
/// How well a noise density is known at best: its identification takes it for white.
const WHITE: f64 = 0.01;

impl Sides {
    /// Of one axis of both.
    #[must_use]
    pub fn of(first: &Side, second: &Side) -> Self {
        let errors: Vec<AtTime> = TOLD.iter().filter_map(|tau| at(first, second, *tau)).collect();
        let quantities = quantities(first, second);
        let better = only(errors.iter().filter_map(|own| own.better));
        let says = says([first.name, second.name], &errors, &quantities);
        Self { axis: first.axis.axis, better, says, quantities, errors }
    }
}

/// The one that all of them are, where there is one.
fn only(all: impl Iterator<Item = Which>) -> Option<Which> {
    let all: Vec<Which> = all.collect();
    all.first().copied().filter(|one| all.iter().all(|other| other == one))
}

fn at(first: &Side, second: &Side, tau: f64) -> Option<AtTime> {
    let (one, two) = (error_at(&first.axis.error_curve, tau)?, error_at(&second.axis.error_curve, tau)?);
    let scatter = |side: &Side, point: &ErrorPoint| {
        let increments = (2.0 * side.seconds / tau).max(1.0);
        let band = point.floor_99.zip(point.floor).map_or(0.0, |(top, floor)| (top / floor).ln() / UPPER);
        increments.powf(-0.5).max(if band.is_finite() { band } else { 0.0 })
    };
    let errors = [one.error?, two.error?];
    let ratio = errors[0] / errors[1];
    let wide = (BAND * scatter(first, &one).hypot(scatter(second, &two))).exp();
    let (low, high) = (ratio / wide, ratio * wide);
    let better = match () {
        () if low > 1.0 => Some(Which::Second),
        () if high < 1.0 => Some(Which::First),
        () => None,
    };
    ratio.is_finite().then_some(AtTime { tau_s: tau, errors, ratio, low, high, better })
}

/// The curve at a time between its points, straight in its logarithms.
fn error_at(curve: &[ErrorPoint], tau: f64) -> Option<ErrorPoint> {
    let known: Vec<&ErrorPoint> = curve.iter().filter(|p| p.error.is_some_and(|e| e > 0.0)).collect();
    let right = known.iter().position(|p| p.tau_s >= tau * (1.0 - 1e-9))?;
    let b = known[right];
    let Some(a) = right.checked_sub(1).map(|k| known[k]) else {
        // Nothing lies before the first point.
        return (b.tau_s <= tau * (1.0 + 1e-9)).then_some(*b);
    };
    let share = (tau / a.tau_s).ln() / (b.tau_s / a.tau_s).ln();
    let between = |of: fn(&ErrorPoint) -> Option<f64>| {
        of(a).zip(of(b)).filter(|(a, b)| *a > 0.0 && *b > 0.0).map(|(a, b)| a * (b / a).powf(share))
    };
    Some(ErrorPoint {
        tau_s: tau,
        error: between(|p| p.error),
        floor: between(|p| p.floor),
        floor_99: between(|p| p.floor_99),
    })
}

/// A size and its standard error, where they are known.
type Known = Option<(f64, Option<f64>)>;

fn quantities(first: &Side, second: &Side) -> Vec<Quantity> {
    let sides = [first, second];
    let parameter = |side: &Side, effect: &str| {
        let own = side.axis.parameters.iter().find(|p| p.effect == effect)?;
        Some((own.value?, own.std_error))
    };
    let alpha = |side: &Side| parameter(side, "scale-factor").unwrap_or((1.0, None));
    let zero = |side: &Side| {
        let (delta, error) = parameter(side, "bias")?;
        Some((-delta / alpha(side).0, error.map(|error| error / alpha(side).0.abs())))
    };
    let scale = |side: &Side| {
        let (alpha, error) = parameter(side, "scale-factor")?;
        Some((1.0 / alpha - 1.0, error.map(|error| error / (alpha * alpha))))
    };
    let white = |side: &Side| {
        let density = side.axis.noise.angle_random_walk.filter(|n| *n > 0.0)?;
        let share = (2.0 * side.samples as f64).max(1.0).powf(-0.5).max(WHITE);
        Some((density, Some(density * share)))
    };
    let walk = |side: &Side| Some((side.axis.noise.bias_random_walk?, None));
    // What is missing from a model stands in its noise, too.
    let is_noise = sides.iter().all(|side| side.axis.within_floor == Some(true));
    let of = |name, unit, size: &dyn Fn(&Side) -> Known| {
        let both = sides.map(size);
        Quantity {
            name,
            unit,
            values: both.map(|own| own.map(|(value, _)| value)),
            std_errors: both.map(|own| own.and_then(|(_, error)| error)),
            better: smaller(both).filter(|_| is_noise || !matches!(name, "white noise" | "walk of the zero")),
        }
    };
    let all = [
        of("zero", "rad/s", &zero),
        of("scale error", "1", &scale),
        of("white noise", "rad/√s", &white),
        of("walk of the zero", "rad/s/√s", &walk),
    ];
    all.into_iter().filter(|own| own.values.iter().any(Option::is_some)).collect()
}

/// Whose size is smaller, where both are known well enough.
fn smaller(both: [Known; 2]) -> Option<Which> {
    let [Some((a, Some(da))), Some((b, Some(db)))] = both else { return None };
    let apart = a.abs() - b.abs();
    (apart.abs() > DIFFER * da.hypot(db)).then_some(if apart > 0.0 { Which::Second } else { Which::First })
}

fn says(names: [&str; 2], errors: &[AtTime], quantities: &[Quantity]) -> String {
    let name = |which: Which| names[usize::from(which == Which::Second)];
    let decided: Vec<(&AtTime, Which)> = errors.iter().filter_map(|own| Some((own, own.better?))).collect();
    let mut answer = match (only(decided.iter().map(|(_, which)| *which)), errors.first()) {
        (_, None) => "The logs have no averaging time in common at which both errors are known".to_owned(),
        (Some(which), _) => {
            let times: Vec<String> = decided.iter().map(|(own, _)| times(own)).collect();
            format!("{} is better: its error is {}", name(which), times.join(", "))
        }
        (None, _) if decided.is_empty() => {
            let told: Vec<String> = errors.iter().map(undecided).collect();
            format!("No difference is seen between {} and {}: the error is {}", names[0], names[1], told.join(", "))
        }
        (None, _) => {
            let told: Vec<String> = decided
                .iter()
                .map(|(own, which)| format!("{} is better over {}", name(*which), of_time(own)))
                .collect();
            told.join(", ")
        }
    };
    let open: Vec<String> =
        errors.iter().filter(|own| own.better.is_none()).map(|own| units::time(own.tau_s)).collect();
    if !decided.is_empty() && !open.is_empty() {
        answer = format!("{}. Over {} no difference is seen", answer, open.join(" and "));
    }
    let by = |which: Which| {
        let own: Vec<&str> = quantities.iter().filter(|own| own.better == Some(which)).map(|own| own.name).collect();
        (!own.is_empty()).then(|| format!("{} has the smaller {}", name(which), own.join(" and ")))
    };
    let by: Vec<String> = [Which::First, Which::Second].into_iter().filter_map(by).collect();
    if !by.is_empty() {
        answer = format!("{}. {}", answer, by.join("; "));
    }
    answer + "."
}

/// `3.1 times smaller over 1 s (0.021 against 0.065 °/s; 95 %: 2.4 to 4.0)`.
fn times(own: &AtTime) -> String {
    let (ratio, low, high) = folded(own);
    let [a, b] = if own.ratio > 1.0 { [own.errors[1], own.errors[0]] } else { own.errors };
    format!(
        "{} times smaller over {} ({} against {} °/s; 95 %: {} to {})",
        units::ratio(ratio),
        units::time(own.tau_s),
        units::rate(Some(a)),
        units::rate(Some(b)),
        units::ratio(low),
        units::ratio(high)
    )
}

/// `0.1 s (1.5 times; 95 %: 1.2 to 1.9)`.
fn of_time(own: &AtTime) -> String {
    let (ratio, low, high) = folded(own);
    format!(
        "{} ({} times; 95 %: {} to {})",
        units::time(own.tau_s),
        units::ratio(ratio),
        units::ratio(low),
        units::ratio(high)
    )
}

/// The ratio of the larger error to the smaller one, with its band.
fn folded(own: &AtTime) -> (f64, f64, f64) {
    if own.ratio > 1.0 { (own.ratio, own.low, own.high) } else { (1.0 / own.ratio, 1.0 / own.high, 1.0 / own.low) }
}

/// `0.021 and 0.023 °/s over 1 s`.
fn undecided(own: &AtTime) -> String {
    let [a, b] = own.errors.map(|error| units::rate(Some(error)));
    format!("{a} and {b} °/s over {}", units::time(own.tau_s))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        diagnosis::{NoiseValue, ParameterValue, Verdict},
        finding::Finding,
    };

    fn axis(errors: [f64; 4], delta: f64, alpha: f64, white: f64) -> AxisResult {
        let point = |(tau_s, error): (f64, f64)| {
            let error = error.to_radians();
            ErrorPoint { tau_s, error: Some(error), floor: Some(error), floor_99: Some(1.05 * error) }
        };
        let parameter = |effect: &str, name: &str, value: f64, std_error: f64| ParameterValue {
            effect: effect.into(),
            name: name.into(),
            value: Some(value),
            std_error: Some(std_error),
            unit: "1".into(),
            typical: None,
        };
        AxisResult {
            error_curve: [0.05, 0.5, 5.0, 50.0].into_iter().zip(errors).map(point).collect(),
            parameters: vec![parameter("scale-factor", "alpha", alpha, 1e-4), parameter("bias", "delta", delta, 1e-4)],
            within_floor: Some(true),
            noise: NoiseValue { angle_random_walk: Some(white), bias_random_walk: Some(1e-6), ..NoiseValue::default() },
            ..AxisResult::new(Axis::Z, Finding::Bare { verdict: Verdict::Adequate })
        }
    }

    fn side<'a>(name: &'a str, axis: &'a AxisResult, seconds: f64) -> Side<'a> {
        Side { name, axis, seconds, samples: 100 * seconds as u64 }
    }

    #[test]
    fn the_better_of_two_is_said_with_its_ratio_and_its_band() {
        let (a, b) =
            (axis([0.6, 0.3, 0.15, 0.075], 0.02, 1.01, 6e-4), axis([0.2, 0.1, 0.05, 0.025], 0.001, 1.002, 2e-4));
        let found = Sides::of(&side("a.csv", &a, 1000.0), &side("b.csv", &b, 1000.0));
        assert_eq!((found.better, found.errors.len()), (Some(Which::Second), 3));
        assert!(found.errors.iter().all(|own| (own.ratio - 3.0).abs() < 1e-9 && own.low > 2.0 && own.high < 4.5));
        // Fewer increments are known less well.
        assert!(found.errors.windows(2).all(|w| w[1].high - w[1].low >= w[0].high - w[0].low), "{:?}", found.errors);
        assert!(
            found.says.starts_with("b.csv is better: its error is 3.0 times smaller over 0.1 s ("),
            "{}",
            found.says
        );
        assert!(found.says.contains("b.csv has the smaller zero and scale error and white noise."), "{}", found.says);
        // A straight line between two points, in logarithms.
        let at = error_at(&a.error_curve, 1.0).unwrap().error.unwrap().to_degrees();
        assert!((at - 0.3 * 0.5_f64.powf(2_f64.log10())).abs() < 1e-9, "{at}");
    }

    #[test]
    fn what_is_not_sure_is_not_said_and_short_and_long_times_may_disagree() {
        let (a, b) = (axis([0.2, 0.2, 0.2, 0.2], 0.01, 1.0, 2e-4), axis([0.21, 0.2, 0.19, 0.2], 0.01, 1.0, 2e-4));
        let found = Sides::of(&side("a", &a, 60.0), &side("b", &b, 60.0));
        assert!(
            found.better.is_none() && found.says.starts_with("No difference is seen between a and b"),
            "{}",
            found.says
        );
        assert!(found.quantities.iter().all(|own| own.better.is_none()));
        let (a, b) = (axis([0.1, 0.2, 0.4, 0.8], 0.01, 1.0, 2e-4), axis([0.8, 0.4, 0.2, 0.1], 0.01, 1.0, 2e-4));
        let found = Sides::of(&side("a", &a, 3000.0), &side("b", &b, 3000.0));
        assert!(found.better.is_none(), "{found:?}");
        assert!(
            found.says.starts_with("a is better over 0.1 s (") && found.says.contains("b is better over 10 s"),
            "{}",
            found.says
        );
        // Where an effect is missing, it stands in the noise.
        let (mut late, other) = (axis([2.0; 4], 0.01, 1.0, 9e-4), axis([0.2; 4], 0.01, 1.0, 2e-4));
        late.within_floor = Some(false);
        let found = Sides::of(&side("a", &late, 60.0), &side("b", &other, 60.0));
        assert!(found.quantities.iter().all(|own| own.name != "white noise" || own.better.is_none()), "{found:?}");
        // A log that ends before says nothing of that time.
        let mut short = b.clone();
        short.error_curve.truncate(2);
        let found = Sides::of(&side("a", &a, 60.0), &side("b", &short, 5.0));
        assert_eq!(found.errors.iter().map(|own| own.tau_s).collect::<Vec<_>>(), [0.1]);
    }
}
