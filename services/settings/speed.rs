//! How fast a source is played.

use anyhow::bail;
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};
use std::str::FromStr;

/// See the head.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Speed {
    /// That many times real time.
    Times(f64),
    /// Unpaced, and without loss.
    Max,
}

/// Times real time.
const LEAST: f64 = 1e-3;
const MOST: f64 = 1e6;

impl FromStr for Speed {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        if text == "max" {
            return Ok(Self::Max);
        }
        match text.parse::<f64>() {
            Ok(x) if (LEAST..=MOST).contains(&x) => Ok(Self::Times(x)),
            _ => bail!(
                "'{text}' is not a speed: 1 is real time, 10 ten times that (from {LEAST} to {MOST:e}), `max` unpaced"
            ),
        }
    }
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum SpeedText {
    Number(f64),
    Word(String),
}

impl Serialize for Speed {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Times(x) => SpeedText::Number(*x),
            Self::Max => SpeedText::Word("max".to_owned()),
        }
        .serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Speed {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = match SpeedText::deserialize(deserializer)? {
            SpeedText::Number(x) => x.to_string(),
            SpeedText::Word(word) => word,
        };
        text.parse().map_err(|e: anyhow::Error| D::Error::custom(e))
    }
}
