//! Round trips between two processes on this machine: our own hop, and what else could carry a sample.
//!
//! ```text
//! truerate bench ──▶ there ──▶ truerate bench --echo WAY
//!                ◀── back ◀──
//! ```
//!
//! Every way carries a sample there and an estimate back, as the pipeline's middle process gets and gives them.

mod bytes;
pub mod echo;
mod load;
mod place;
mod ports;

use crate::clock::now_ns;
use crate::stop::Stop;
use anyhow::bail;
use clap::ValueEnum;
use ipc_types::wait::Wait;
use place::Place;
use std::time::Duration;

pub use load::Load;

/// What carries a message from one process to another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Way {
    /// The pipeline's hop, woken by an event
    Event,
    /// The pipeline's hop, which looks without pause
    Spin,
    /// iceoryx2 alone: publish and subscribe, with its notifier and listener
    Iceoryx2,
    /// A Unix stream socket
    Socket,
    /// Two pipes
    Pipe,
}

impl Way {
    /// All of them, the one that the others are held against first.
    pub const ALL: [Self; 5] = [Self::Pipe, Self::Socket, Self::Iceoryx2, Self::Event, Self::Spin];

    /// As on the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["event", "spin", "iceoryx2", "socket", "pipe"][self as usize]
    }

    /// How the pipeline's own hop waits; `None` of the others.
    fn wait(self) -> Option<Wait> {
        match self {
            Self::Event => Some(Wait::Event),
            Self::Spin => Some(Wait::Spin),
            _ => None,
        }
    }
}

/// One process' end of a way. Messages carry a number.
trait End {
    /// Gives a message of this number to the other process.
    fn give(&mut self, number: u64) -> anyhow::Result<()>;
    /// The number of the next message; `None` where none came for a while.
    fn take(&mut self) -> anyhow::Result<Option<u64>>;
}

/// The number that ends the other process.
const END: u64 = u64::MAX;
/// How long an end waits before it looks whether it is to stop.
const NAP: Duration = Duration::from_millis(100);
/// Without an answer for that long the other process is taken to be dead, ns: longer than a busy machine keeps it waiting.
const DEAD_NS: u64 = 20_000_000_000;
/// Round trips before the first that counts, and the longest that they may take, ns.
const WARM_UP: u64 = 200;
const WARM_UP_NS: u64 = 100_000_000;

const STOPPED: &str = "asked to stop before everything was measured";

/// How long a way is measured.
#[derive(Clone, Copy, Debug)]
pub enum Length {
    /// So many round trips.
    RoundTrips(u64),
    /// So long.
    Time(Duration),
}

/// What is measured, and how.
#[derive(Clone, Debug)]
pub struct Plan {
    /// The ways.
    pub ways: Vec<Way>,
    /// What else the machine does meanwhile.
    pub loads: Vec<Load>,
    /// How long, each way under each load.
    pub length: Length,
    /// Round trips a second, Hz; one after the other where there is none.
    pub rate_hz: Option<f64>,
    /// Turns in which each way is measured: what the machine does beside meets all of them alike.
    pub turns: u64,
}

/// Round trips of one way under one load.
#[derive(Clone, Debug)]
pub struct Measured {
    /// What else the machine did.
    pub load: Load,
    /// What carried the messages.
    pub way: Way,
    /// How long each round trip took, ns, the shortest first.
    pub sorted_ns: Vec<u64>,
}

impl Measured {
    /// The time within which this share of the round trips was over, ns.
    #[must_use]
    pub fn quantile(&self, q: f64) -> u64 {
        let last = self.sorted_ns.len().saturating_sub(1);
        let at = (q * self.sorted_ns.len() as f64).ceil() as usize;
        self.sorted_ns.get(at.saturating_sub(1).min(last)).copied().unwrap_or(0)
    }
}

/// Measures; `tell` hears what is measured next.
///
/// # Errors
/// Where the machine refuses a process or its shared memory, or it was asked to stop.
pub fn measure(plan: &Plan, stop: &Stop, mut tell: impl FnMut(Load, Way)) -> anyhow::Result<Vec<Measured>> {
    let place = Place::make()?;
    let mut all = Vec::new();
    for &load in &plan.loads {
        let busy = load.begin();
        let first = all.len();
        all.extend(plan.ways.iter().map(|&way| Measured { load, way, sorted_ns: Vec::new() }));
        for turn in 0..plan.turns {
            for measured in &mut all[first..] {
                tell(load, measured.way);
                turn_of(measured, plan, turn, &place, stop)?;
            }
        }
        drop(busy);
    }
    for measured in &mut all {
        measured.sorted_ns.sort_unstable();
    }
    Ok(all)
}

/// One turn of one way: another process, a warm-up, and its share of the round trips.
fn turn_of(measured: &mut Measured, plan: &Plan, turn: u64, place: &Place, stop: &Stop) -> anyhow::Result<()> {
    let (count, longest) = match plan.length {
        Length::RoundTrips(all) => ((turn + 1) * all / plan.turns - turn * all / plan.turns, u64::MAX),
        Length::Time(all) => (u64::MAX, all.as_nanos() as u64 / plan.turns),
    };
    if count == 0 {
        return Ok(());
    }
    let (mut end, echo) = place.open(measured.way)?;
    let mut pace = Pace::of(plan.rate_hz);
    let start = now_ns();
    for number in 1..=WARM_UP {
        round_trip(end.as_mut(), number, stop)?;
        if now_ns() > start + WARM_UP_NS {
            break;
        }
    }
    let start = now_ns();
    for number in 0..count {
        if now_ns() - start > longest {
            break;
        }
        if stop.asked() {
            bail!(STOPPED);
        }
        pace.wait();
        measured.sorted_ns.push(round_trip(end.as_mut(), WARM_UP + 1 + number, stop)?);
    }
    end.give(END)?;
    drop(end);
    echo.wait()
}

fn round_trip(end: &mut dyn End, number: u64, stop: &Stop) -> anyhow::Result<u64> {
    let start = now_ns();
    end.give(number)?;
    loop {
        match end.take()? {
            Some(back) if back == number => return Ok(now_ns() - start),
            None if stop.asked() => bail!(STOPPED),
            None if now_ns() > start + DEAD_NS => bail!("the other process does not answer any more"),
            // The answer to one before, or none yet.
            Some(_) | None => {}
        }
    }
}

/// When the next round trip begins.
struct Pace {
    period_ns: Option<u64>,
    next_ns: u64,
}

impl Pace {
    fn of(rate_hz: Option<f64>) -> Self {
        Self { period_ns: rate_hz.map(|hz| (1e9 / hz) as u64), next_ns: now_ns() }
    }

    fn wait(&mut self) {
        let Some(period) = self.period_ns else { return };
        self.next_ns = (self.next_ns + period).max(now_ns());
        std::thread::sleep(Duration::from_nanos(self.next_ns.saturating_sub(now_ns())));
    }
}

#[cfg(test)]
mod tests {
    use super::{Load, Measured, Way};

    #[test]
    fn quantiles_are_those_of_the_sorted_times() {
        let of = |sorted_ns| Measured { load: Load::Quiet, way: Way::Pipe, sorted_ns };
        let hundred = of((1..=100).collect());
        assert_eq!([0.5, 0.99, 0.999, 1.0].map(|q| hundred.quantile(q)), [50, 99, 100, 100]);
        assert_eq!(of(vec![7]).quantile(0.5), 7);
        assert_eq!(of(Vec::new()).quantile(0.5), 0);
    }

    #[test]
    fn a_way_is_named_as_on_the_command_line() {
        use clap::ValueEnum;
        for way in Way::ALL {
            assert_eq!(way.to_possible_value().unwrap().get_name(), way.name());
        }
    }
}
