//! A number with its standard error, said aloud: what effects make their sentences of.

use crate::units::{self, Shown};

/// 100 °/s in rad/s: the rate at which errors that grow with it are said.
pub const HUNDRED: f64 = 1.745_329_251_994_329_5;

/// Standard errors from nothing from which on a part of an effect is worth a word.
const SEEN: f64 = 2.0;

/// A value and its standard error, SI; the error is `NaN` where there is none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measured {
    /// The value.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
}

impl Measured {
    /// Both times a factor.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        Self { value: self.value * factor, std_error: self.std_error * factor.abs() }
    }

    /// With its sign: `−0.870 ± 0.012 °/s`.
    #[must_use]
    pub fn signed(self, unit: &str) -> String {
        let unit = if unit == "1" && self.value.abs() > LARGE_SHARE {
            percent()
        } else {
            units::shown(unit, &[Some(self.value)])
        };
        units::uncertain(Some(self.value), Some(self.std_error), &unit)
    }

    /// Without it: `0.870 ± 0.012 °/s`.
    #[must_use]
    pub fn size(self, unit: &str) -> String {
        Self { value: self.value.abs(), ..self }.signed(unit)
    }

    /// `rises`, or `falls` where it is negative.
    #[must_use]
    pub fn goes(self) -> &'static str {
        if self.value < 0.0 { "falls" } else { "rises" }
    }

    /// A number without a unit.
    #[must_use]
    pub fn plain(self) -> String {
        units::uncertain(Some(self.value), Some(self.std_error), &Shown { factor: 1.0, unit: String::new() })
    }

    /// Whether it differs from nothing by more than its own error.
    #[must_use]
    pub fn is_seen(self) -> bool {
        self.value != 0.0 && (self.std_error.is_nan() || self.value.abs() > SEEN * self.std_error)
    }
}

/// A share from which on a number without a unit would be taken for a factor.
const LARGE_SHARE: f64 = 0.4;

fn percent() -> Shown {
    Shown { factor: 100.0, unit: " %".into() }
}

/// `0.10 ± 0.01 °/s per g along x and 0.03 ± 0.01 °/s per g along z`: the parts that are seen, or all where none is.
#[must_use]
pub fn parts(p: &[Measured], names: &[String], say: impl Fn(&Measured) -> String) -> String {
    let any = p.iter().any(|m| m.is_seen());
    let seen = p.iter().zip(names).filter(|(m, _)| m.is_seen() || !any);
    let said: Vec<String> = seen.map(|(m, name)| format!("{} {name}", say(m))).collect();
    and(&said)
}

/// The amplitude of a sine and a cosine part.
#[must_use]
pub fn amplitude(p: &[Measured]) -> Measured {
    let (sin, cos) = (p[0], p[1]);
    let value = sin.value.hypot(cos.value);
    let std_error = (sin.value * sin.std_error).hypot(cos.value * cos.std_error) / value;
    Measured { value, std_error }
}

/// `a`, `a and b`, `a, b and c`.
#[must_use]
pub fn and(list: &[String]) -> String {
    match list {
        [] => String::new(),
        [one] => one.clone(),
        [before @ .., last] => format!("{} and {last}", before.join(", ")),
    }
}
