//! Rows for a guided recording: a live source, or a simulated hand that follows.

use crate::{
    live::{Address, Joined, Origin, Stream},
    settings::Speed,
    stop::Stop,
};
use anyhow::Result;
use gyro_model::{
    Row,
    guide::{Followed, Hand, State},
    simulate::Scenario,
};
use ipc_types::health::SourceHealth;
use std::time::{Duration, Instant};
use workbench::log::Options;

/// Where rows come from.
#[allow(clippy::large_enum_variant, reason = "there is one of it")]
pub enum From {
    /// A live source, and its reference where that comes another way.
    Live {
        /// The gyro.
        address: Address,
        /// The reference.
        reference: Option<Address>,
        /// The names of their channels.
        options: Options,
    },
    /// A simulated hand, at this speed.
    Hand(Box<Scenario>, Speed),
}

impl From {
    /// Whether rows come by standard input.
    pub(super) fn is_standard_input(&self) -> bool {
        matches!(self, Self::Live { address, .. } if address.is_standard_input())
    }
}

/// An open source.
pub(super) enum Source {
    Live { stream: Stream, reference: Option<Box<Joined>> },
    Hand { hand: Box<Hand>, speed: Speed, begun: Instant, given: u64, rate_hz: f64 },
}

/// What comes next.
#[allow(clippy::large_enum_variant, reason = "there is one of it, and a box would be an allocation a row")]
pub(super) enum Next {
    Row(Row),
    Later,
    End,
}

/// A nap of a source whose next row is not due.
const NAP: Duration = Duration::from_millis(5);

impl Source {
    /// Opens it at its first row; `None` when asked to stop before.
    pub fn open(from: &From, stop: &Stop, meanwhile: impl FnMut(&SourceHealth) -> Result<()>) -> Result<Option<Self>> {
        match from {
            From::Live { address, reference, options } => {
                let reference =
                    reference.as_ref().map(|own| Joined::open(own, options, stop)).transpose()?.map(Box::new);
                let stream = Stream::open(address, options, None, stop, meanwhile)?;
                Ok(stream.map(|stream| Self::Live { stream, reference }))
            }
            From::Hand(scenario, speed) => Ok(Some(Self::Hand {
                hand: Box::new(Hand::new(scenario)),
                speed: *speed,
                begun: Instant::now(),
                given: 0,
                rate_hz: scenario.rate_hz,
            })),
        }
    }

    /// What the source says of itself.
    pub fn origin(&self) -> Option<&Origin> {
        if let Self::Live { stream, .. } = self { Some(stream.origin()) } else { None }
    }

    /// How it is now; of a simulated hand there is nothing to say.
    pub fn health(&self) -> SourceHealth {
        if let Self::Live { stream, .. } = self { stream.health() } else { SourceHealth::default() }
    }

    /// Whether it waits for whoever takes its rows, so that nothing is lost while something is computed.
    pub fn waits(&self) -> bool {
        matches!(self, Self::Hand { speed: Speed::Max, .. })
    }

    /// The next row, where it comes within `patience`.
    pub fn next(&mut self, patience: Duration) -> Result<Next> {
        match self {
            Self::Live { stream, reference } => Ok(match stream.next(patience)? {
                None => Next::Later,
                Some(None) => Next::End,
                Some(Some(mut arrival)) => {
                    if let Some(reference) = reference {
                        reference.join(&mut arrival.row)?;
                    }
                    Next::Row(arrival.row)
                }
            }),
            Self::Hand { hand, speed, begun, given, rate_hz } => {
                if let Speed::Times(times) = speed
                    && *given as f64 > begun.elapsed().as_secs_f64() * *times * *rate_hz
                {
                    std::thread::sleep(NAP.min(patience));
                    return Ok(Next::Later);
                }
                *given += 1;
                Ok(Next::Row(hand.step().row))
            }
        }
    }

    /// A simulated hand reads what is shown.
    pub fn hears(&mut self, state: &State) {
        let Self::Hand { hand, .. } = self else { return };
        hand.hear(state.order);
        if let Followed::Not { correction, .. } = state.hand {
            hand.mend(correction);
        }
    }
}
