//! SI numbers in the units that gyro engineers say aloud: °/s, °, ms, %, ppm, g.

/// How a quantity of some SI unit is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Shown {
    /// Multiplies the SI value.
    pub factor: f64,
    /// What is printed behind the number, with its leading space where it wants one.
    pub unit: String,
}

/// Standard gravity, m/s².
const G: f64 = 9.806_65;

/// The unit for a quantity whose sizes to show are `sizes` (the largest decides between s and ms, %, and ppm).
#[must_use]
pub fn shown(unit: &str, sizes: &[Option<f64>]) -> Shown {
    let size = sizes.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
    let (factor, unit) = match unit {
        "1" | "–" if size == 0.0 || size > 0.4 => (1.0, String::new()),
        "1" | "–" if size < 2e-3 => (1e6, " ppm".into()),
        "1" | "–" => (100.0, " %".into()),
        "s" if size < 0.5 => (1e3, " ms".into()),
        "rad/s per m/s²" => (1f64.to_degrees() * G, " °/s per g".into()),
        "rad/s per (m/s²)²" => (1f64.to_degrees() * G * G, " °/s per g²".into()),
        "rad" => (1f64.to_degrees(), "°".into()),
        "1/K" => (100.0, " %/K".into()),
        _ if unit.starts_with("rad/") => (1f64.to_degrees(), format!(" °{}", &unit[3..])),
        _ => (1.0, format!(" {unit}")),
    };
    Shown { factor, unit }
}

/// `12.10 ± 0.12 ms`: two digits of the standard error; the value alone where there is none.
#[must_use]
pub fn uncertain(value: Option<f64>, std_error: Option<f64>, unit: &Shown) -> String {
    let Some(value) = value.filter(|v| v.is_finite()) else { return "–".into() };
    let value = value * unit.factor;
    match std_error.map(|e| e * unit.factor).filter(|e| e.is_finite() && *e > 0.0) {
        Some(error) if error.log10() < -6.0 || value.abs().max(error) >= 1e6 => {
            format!("{} ± {}{}", scientific(value), scientific(error), unit.unit)
        }
        Some(error) => {
            let digits = (1.0 - error.log10().floor()).clamp(0.0, 7.0) as usize;
            format!("{} ± {error:.digits$}{}", signed(value, digits), unit.unit)
        }
        None => format!("{}{}", number(value), unit.unit),
    }
}

/// Three significant digits.
#[must_use]
pub fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    let magnitude = value.abs().log10().floor();
    if !(-4.0..6.0).contains(&magnitude) {
        return scientific(value);
    }
    signed(value, (2.0 - magnitude).clamp(0.0, 6.0) as usize)
}

/// A value of an axis or an interval of this range: with the decimals that tell a hundredth of the range.
#[must_use]
pub fn within(value: f64, range: f64) -> String {
    let magnitude = range.abs().log10().floor();
    if !magnitude.is_finite() || !(-7.0..6.0).contains(&magnitude) {
        return number(value);
    }
    signed(value, (1.0 - magnitude).clamp(0.0, 8.0) as usize)
}

/// Two figures of a number that is not negative.
#[must_use]
pub fn two(value: f64) -> String {
    if value < 1e-9 {
        return "0".to_owned();
    }
    let decimals = (1.0 - value.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}")
}

/// Three significant digits, needless zeros dropped: for sizes that are round by themselves.
#[must_use]
pub fn round(value: f64) -> String {
    let text = number(value);
    if text.contains('.') && !text.contains('e') {
        return text.trim_end_matches('0').trim_end_matches('.').to_string();
    }
    text
}

/// A rate error in °/s, from rad/s.
#[must_use]
pub fn rate(value: Option<f64>) -> String {
    value.filter(|v| v.is_finite()).map_or_else(|| "–".into(), |v| number(v.to_degrees()))
}

/// A share in percent: `98 %`, `3.1 %`.
#[must_use]
pub fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    if percent.abs() >= 9.95 { signed(percent, 0) + " %" } else { signed(percent, 1) + " %" }
}

/// A ratio to the floor: `1.02`, `9.8`, `66`.
#[must_use]
pub fn ratio(value: f64) -> String {
    let digits = match value.abs() {
        r if r < 2.0 => 2,
        r if r < 10.0 => 1,
        _ => 0,
    };
    signed(value, digits)
}

/// A time: `20 ms`, `1.5 s`, `15 s`.
#[must_use]
pub fn time(seconds: f64) -> String {
    let (value, unit) = if seconds < 0.0995 { (seconds * 1e3, "ms") } else { (seconds, "s") };
    let digits = (1.0 - value.abs().log10().floor()).clamp(0.0, 3.0) as usize;
    let text = format!("{value:.digits$}");
    let text = if digits > 0 { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} {unit}")
}

/// A count in groups of three: `12 345`.
#[must_use]
pub fn thousands(count: u64) -> String {
    let digits = count.to_string();
    let lead = digits.len() % 3;
    let groups = digits.as_bytes()[lead..].chunks(3).map(|group| String::from_utf8_lossy(group).into_owned());
    let lead = (lead > 0).then(|| digits[..lead].to_owned());
    lead.into_iter().chain(groups).collect::<Vec<_>>().join("\u{a0}")
}

fn signed(value: f64, digits: usize) -> String {
    format!("{value:.digits$}").replace('-', "−")
}

fn scientific(value: f64) -> String {
    format!("{value:.1e}").replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_of_an_interval_have_the_digits_that_tell_them_apart() {
        let ends = [1.001_23, 1.005_67].map(|value| within(value, 0.00444));
        assert_eq!(ends, ["1.0012", "1.0057"]);
        assert_eq!([within(438.2, 24.0), within(3.0, 0.0)], ["438", "3.00"]);
    }

    fn say(value: f64, error: f64, unit: &str) -> String {
        uncertain(Some(value), Some(error), &shown(unit, &[Some(value)]))
    }

    #[test]
    fn each_unit_is_shown_as_engineers_say_it() {
        assert_eq!(say(0.0121, 0.000_12, "s"), "12.10 ± 0.12 ms");
        assert_eq!(say(1f64.to_radians(), 0.01f64.to_radians(), "rad/s"), "1.000 ± 0.010 °/s");
        assert_eq!(say(0.02, 0.001, "1"), "2.00 ± 0.10 %");
        assert_eq!(say(0.9939, 1e-5, "1"), "0.993900 ± 0.000010");
        assert_eq!(say(0.1f64.to_radians() / G, 0.01f64.to_radians() / G, "rad/s per m/s²"), "0.100 ± 0.010 °/s per g");
    }

    #[test]
    fn what_has_no_value_is_a_dash_and_never_nan() {
        assert_eq!(uncertain(None, None, &shown("s", &[])), "–");
        assert_eq!(uncertain(Some(f64::NAN), Some(1.0), &shown("s", &[])), "–");
        assert!(!uncertain(Some(1.0), Some(f64::NAN), &shown("s", &[])).contains("NaN"));
        assert_eq!(rate(Some(f64::INFINITY)), "–");
    }
}
