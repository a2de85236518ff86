//! Units as people write them.

/// What a unit measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Time.
    Time,
    /// Rate of turn.
    Rate,
    /// Angle.
    Angle,
    /// Specific force.
    Acceleration,
    /// Temperature.
    Temperature,
    /// Voltage.
    Voltage,
    /// Anything else that is known to be a unit.
    Other,
}

/// A unit: a number in it times `factor` is one in the unit that `suffix` names (none: SI).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// What it measures.
    pub quantity: Quantity,
    /// As it stands in the names of a log: `_dps`, `_us`, nothing for SI.
    pub suffix: &'static str,
    /// To the suffix' unit.
    pub factor: f64,
    /// As it is shown.
    pub symbol: &'static str,
}

impl Unit {
    const fn new(quantity: Quantity, symbol: &'static str, suffix: &'static str) -> Self {
        Self { quantity, suffix, factor: 1.0, symbol }
    }

    /// So many of it.
    #[must_use]
    pub fn times(self, count: f64) -> Self {
        Self { factor: self.factor * count, ..self }
    }

    const fn scaled(quantity: Quantity, symbol: &'static str, suffix: &'static str, factor: f64) -> Self {
        Self { quantity, suffix, factor, symbol }
    }
}

/// Standard gravity, m/s² (exact by definition).
pub const STANDARD_GRAVITY: f64 = 9.806_65;
/// rad/s
pub const RADIANS_PER_SECOND: Unit = Unit::new(Quantity::Rate, "rad/s", "");
/// °/s
pub const DEGREES_PER_SECOND: Unit = Unit::new(Quantity::Rate, "deg/s", "_dps");
/// °
pub const DEGREES: Unit = Unit::new(Quantity::Angle, "deg", "_deg");
/// s
pub const SECONDS: Unit = Unit::new(Quantity::Time, "s", "");
/// ms
pub const MILLISECONDS: Unit = Unit::new(Quantity::Time, "ms", "_ms");
/// µs
pub const MICROSECONDS: Unit = Unit::new(Quantity::Time, "us", "_us");
/// ns
pub const NANOSECONDS: Unit = Unit::new(Quantity::Time, "ns", "_ns");
/// min
pub const MINUTES: Unit = Unit::scaled(Quantity::Time, "min", "", 60.0);
/// h
pub const HOURS: Unit = Unit::scaled(Quantity::Time, "h", "", 3600.0);
/// days
pub const DAYS: Unit = Unit::scaled(Quantity::Time, "days", "", 86_400.0);
/// m/s²
pub const METRES_PER_SECOND_SQUARED: Unit = Unit::new(Quantity::Acceleration, "m/s^2", "");
/// °C
pub const DEGREES_CELSIUS: Unit = Unit::new(Quantity::Temperature, "degC", "");

/// What stands in a name's brackets or under it. Blanks and the signs of products and powers do not count.
const SPELLINGS: &[(&[&str], Unit)] = &[
    (
        &["rad/s", "rads", "rad/sec", "rads-1", "r/s", "rps", "radps", "radians/s", "radian/s", "rad/second"],
        RADIANS_PER_SECOND,
    ),
    (
        &[
            "deg/s",
            "°/s",
            "dps",
            "deg/sec",
            "degs-1",
            "degs",
            "degps",
            "degree/s",
            "degrees/s",
            "degrees/second",
            "º/s",
            "deg/second",
            "°s-1",
        ],
        DEGREES_PER_SECOND,
    ),
    (&["mdps", "mdeg/s"], Unit::scaled(Quantity::Rate, "mdeg/s", "_dps", 1e-3)),
    (&["mrad/s", "mrad/sec", "mrads-1"], Unit::scaled(Quantity::Rate, "mrad/s", "", 1e-3)),
    (&["cdeg/s", "cdps"], Unit::scaled(Quantity::Rate, "cdeg/s", "_dps", 1e-2)),
    (&["deg/min", "°/min"], Unit::scaled(Quantity::Rate, "deg/min", "_dps", 1.0 / 60.0)),
    (&["deg/h", "°/h", "deg/hr", "dph"], Unit::scaled(Quantity::Rate, "deg/h", "_dps", 1.0 / 3600.0)),
    (&["rpm", "rev/min", "1/min"], Unit::scaled(Quantity::Rate, "rpm", "_dps", 6.0)),
    (&["rad", "radian", "radians"], Unit::new(Quantity::Angle, "rad", "")),
    (&["deg", "°", "degree", "degrees", "º"], DEGREES),
    (&["mrad"], Unit::scaled(Quantity::Angle, "mrad", "", 1e-3)),
    (&["mdeg", "m°"], Unit::scaled(Quantity::Angle, "mdeg", "_deg", 1e-3)),
    (&["cdeg", "centidegrees"], Unit::scaled(Quantity::Angle, "cdeg", "_deg", 1e-2)),
    (&["arcmin"], Unit::scaled(Quantity::Angle, "arcmin", "_deg", 1.0 / 60.0)),
    (&["arcsec"], Unit::scaled(Quantity::Angle, "arcsec", "_deg", 1.0 / 3600.0)),
    (&["rev", "turn", "turns", "revolutions"], Unit::scaled(Quantity::Angle, "turns", "_deg", 360.0)),
    (&["m/s2", "m/s/s", "ms-2", "mps2", "m/sec2", "m/s²"], METRES_PER_SECOND_SQUARED),
    (&["g", "g's", "gs", "gee"], Unit::new(Quantity::Acceleration, "g", "_g")),
    (&["mg"], Unit::new(Quantity::Acceleration, "mg", "_mg")),
    (&["°c", "degc", "c", "celsius", "℃", "ºc", "degreescelsius", "degreesc"], DEGREES_CELSIUS),
    (&["k", "kelvin"], Unit::new(Quantity::Temperature, "K", "_k")),
    (&["°f", "degf", "fahrenheit"], Unit::new(Quantity::Temperature, "degF", "_f")),
    (&["v", "volt", "volts"], Unit::new(Quantity::Voltage, "V", "")),
    (&["mv", "millivolt"], Unit::new(Quantity::Voltage, "mV", "_mv")),
    (&["s", "sec", "secs", "second", "seconds"], SECONDS),
    (&["ms", "msec", "millis", "milliseconds", "millisecond"], MILLISECONDS),
    (&["us", "µs", "μs", "usec", "micros", "microseconds", "microsecond"], MICROSECONDS),
    (&["ns", "nsec", "nanos", "nanoseconds", "nanosecond"], NANOSECONDS),
    (&["min", "mins", "minute", "minutes"], MINUTES),
    (&["h", "hr", "hrs", "hour", "hours"], HOURS),
    (&["m"], Unit::new(Quantity::Other, "m", "")),
    (&["mm"], Unit::new(Quantity::Other, "mm", "")),
    (&["cm"], Unit::new(Quantity::Other, "cm", "")),
    (&["km"], Unit::new(Quantity::Other, "km", "")),
    (&["m/s"], Unit::new(Quantity::Other, "m/s", "")),
    (&["km/h", "kph"], Unit::new(Quantity::Other, "km/h", "")),
    (&["ut", "µt", "μt", "t", "mt", "gauss", "mgauss", "ga"], Unit::new(Quantity::Other, "magnetic field", "")),
    (
        &[
            "%", "hz", "pa", "hpa", "kpa", "mbar", "lux", "lx", "a", "ma", "n", "nm", "-", "1", "count", "counts",
            "lsb", "raw",
        ],
        Unit::new(Quantity::Other, "", ""),
    ),
];

/// The unit that this spelling means.
#[must_use]
pub fn parse(text: &str) -> Option<Unit> {
    let plain: String = text
        .trim()
        .chars()
        .filter(|c| !matches!(c, ' ' | '^' | '*' | '·' | '⋅' | '.' | '{' | '}' | '(' | ')'))
        .flat_map(char::to_lowercase)
        .map(|c| match c {
            '⁻' | '−' => '-',
            '¹' => '1',
            other => other,
        })
        .collect();
    SPELLINGS.iter().find(|(spellings, _)| spellings.contains(&plain.as_str())).map(|(_, unit)| *unit)
}

/// A name without the unit that stands in brackets at its end, and that unit: `Gyro Z [deg/s]`, `time (us)`.
#[must_use]
pub fn split(name: &str) -> (&str, Option<Unit>) {
    let name = name.trim();
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some(inside) = name.strip_suffix(close).and_then(|rest| rest.rfind(open).map(|at| (at, &rest[at + 1..])))
        {
            let (at, text) = inside;
            if text.trim().is_empty() {
                return (name[..at].trim(), None);
            }
            // An index is no unit.
            if let Some(unit) = parse(text).filter(|_| !text.bytes().all(|b| b.is_ascii_digit() || b == b'-')) {
                return (name[..at].trim(), Some(unit));
            }
        }
    }
    (name, None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_of_one_unit_are_one_unit() {
        for text in ["deg/s", "°/s", " Deg / s ", "dps", "deg s^-1", "deg·s⁻¹"] {
            assert_eq!(parse(text).map(|u| (u.quantity, u.suffix)), Some((Quantity::Rate, "_dps")), "{text}");
        }
        for text in ["m/s^2", "m s^-2", "m/s²", "m/s/s", "m/(s^2)"] {
            assert_eq!(parse(text).map(|u| u.quantity), Some(Quantity::Acceleration), "{text}");
        }
        assert_eq!(parse("parsec"), None);
    }

    #[test]
    fn a_unit_in_brackets_is_split_off_and_an_index_is_not() {
        assert_eq!(split("Gyro Z [deg/s]"), ("Gyro Z", Some(DEGREES_PER_SECOND)));
        assert_eq!(split("time (us)"), ("time", Some(MICROSECONDS)));
        assert_eq!(split("w_RS_S_x [rad s^-1]"), ("w_RS_S_x", Some(RADIANS_PER_SECOND)));
        assert_eq!(split("q_RS_w []"), ("q_RS_w", None));
        assert_eq!(split("gyroADC[0]"), ("gyroADC[0]", None));
        assert_eq!(split("motor[1]"), ("motor[1]", None));
        assert_eq!(split("Position (x)"), ("Position (x)", None));
    }
}
