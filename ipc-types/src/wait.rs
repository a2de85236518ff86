//! How a reader waits for the next message.

use std::{fmt, str::FromStr, time::Duration};

/// How a reader waits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wait {
    /// Sleeps until the writer wakes it: some 20–80 µs a hop, no load while idle.
    #[default]
    Event,
    /// Looks without pause: about 1 µs a hop, for a whole core.
    Spin,
    /// Looks for that long, then sleeps.
    Hybrid(Duration),
}

/// A word that is no way of waiting.
#[derive(Clone, Debug, thiserror::Error)]
#[error("unknown way to wait '{0}': use event, spin or hybrid(MICROSECONDS)")]
pub struct UnknownWait(String);

impl FromStr for Wait {
    type Err = UnknownWait;

    fn from_str(text: &str) -> Result<Self, UnknownWait> {
        match text {
            "event" => Ok(Self::Event),
            "spin" => Ok(Self::Spin),
            _ => text
                .strip_prefix("hybrid(")
                .and_then(|rest| rest.strip_suffix(')'))
                .and_then(|us| us.parse().ok())
                .map(|us| Self::Hybrid(Duration::from_micros(us)))
                .ok_or_else(|| UnknownWait(text.to_owned())),
        }
    }
}

impl fmt::Display for Wait {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Event => f.write_str("event"),
            Self::Spin => f.write_str("spin"),
            Self::Hybrid(d) => write!(f, "hybrid({})", d.as_micros()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Wait;

    #[test]
    fn a_way_to_wait_reads_back_as_written() {
        for text in ["event", "spin", "hybrid(50)"] {
            assert_eq!(text.parse::<Wait>().unwrap().to_string(), text);
        }
        assert!("hybrid".parse::<Wait>().is_err());
    }
}
