//! How well effects are to be known, as it is typed: `1%` for all, `delay=0.0002` for one.

use anyhow::{Result, bail};
use gyro_model::guide::Precision;

/// Of the size that is typical of low-cost sensors: a typical effect is then known at fifty times its standard error.
const USUAL: f64 = 0.02;

/// A precision for all effects, and others for some.
#[derive(Clone, Debug, PartialEq)]
pub struct Precisions {
    all: Precision,
    own: Vec<(String, Precision)>,
}

impl Precisions {
    /// Reads what was typed; later ones win.
    ///
    /// # Errors
    /// What is no precision.
    pub fn parse(texts: &[String]) -> Result<Self> {
        let mut precisions = Self { all: Precision::OfTypical(USUAL), own: Vec::new() };
        for text in texts {
            match text.split_once('=') {
                Some((id, size)) => precisions.own.insert(0, (id.trim().to_owned(), size_of(size, text)?)),
                None if text.trim_end().ends_with('%') => precisions.all = size_of(text, text)?,
                None => {
                    bail!("--to {text}: say a share of the typical size, 1%, or the effect that it is of, delay={text}")
                }
            }
        }
        Ok(precisions)
    }

    /// That of an effect.
    #[must_use]
    pub fn of(&self, id: &str) -> Precision {
        self.own.iter().find(|(own, _)| own == id).map_or(self.all, |(_, precision)| *precision)
    }

    /// The effects that have one of their own.
    pub fn effects(&self) -> impl Iterator<Item = &str> {
        self.own.iter().map(|(id, _)| id.as_str())
    }
}

fn size_of(size: &str, text: &str) -> Result<Precision> {
    let size = size.trim().trim_start_matches('±').trim();
    let (number, share) = size.strip_suffix('%').map_or((size, false), |number| (number.trim(), true));
    match number.parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => {
            Ok(if share { Precision::OfTypical(0.01 * value) } else { Precision::Absolute(value) })
        }
        _ => bail!(
            "--to {text}: a number above zero is needed, with % for a share of the typical size, in SI units without"
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_sizes_are_told_apart() {
        let parse = |texts: &[&str]| Precisions::parse(&texts.iter().map(|t| (*t).to_owned()).collect::<Vec<_>>());
        let own = parse(&["1%", "delay=±0.0002", "bias=0.5 %"]).unwrap();
        assert_eq!(own.of("scale-factor"), Precision::OfTypical(0.01));
        assert_eq!(own.of("delay"), Precision::Absolute(0.0002));
        assert_eq!(own.of("bias"), Precision::OfTypical(0.005));
        for (text, says) in
            [("0.1", "delay=0.1"), ("delay=", "above zero"), ("-1%", "above zero"), ("x=nan", "above zero")]
        {
            let error = parse(&[text]).unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
    }
}
