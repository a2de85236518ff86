//! What is done to a pipeline, drawn by a seed, and what is expected of it.

use rand::{RngExt, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use std::{f64::consts::TAU, time::Duration};

/// A motion known at every instant.
#[derive(Clone, Copy, Debug)]
pub struct Swing {
    pub start_ns: u64,
}

impl Swing {
    const AMPLITUDE: f64 = 0.5;
    /// So slow that what a busy machine is late by makes no error.
    const FREQUENCY: f64 = 0.02;

    /// rad/s.
    pub fn rate(self, at_ns: u64) -> f64 {
        Self::AMPLITUDE * (TAU * Self::FREQUENCY * self.seconds(at_ns)).sin()
    }

    /// rad.
    pub fn angle(self, at_ns: u64) -> f64 {
        let angular = TAU * Self::FREQUENCY;
        Self::AMPLITUDE / angular * (1.0 - (angular * self.seconds(at_ns)).cos())
    }

    fn seconds(self, at_ns: u64) -> f64 {
        at_ns.saturating_sub(self.start_ns) as f64 * 1e-9
    }
}

/// A process of the pipeline that keeps its lock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Victim {
    Acquisition,
    Kalman,
    Compensator,
}

pub const VICTIMS: [Victim; 3] = [Victim::Acquisition, Victim::Kalman, Victim::Compensator];

impl Victim {
    pub fn name(self) -> &'static str {
        match self {
            Self::Acquisition => "acquisition",
            Self::Kalman => "kalman",
            Self::Compensator => "compensator",
        }
    }
}

/// One fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Fault {
    /// Killed at any time.
    Kill(Victim),
    /// Killed, both at once.
    KillTwo(Victim, Victim),
    /// Killed, and its next life so soon after its beginning.
    KillAtStart(Victim, Duration),
    /// Killed as an update of the parameters arrives.
    KillInUpdate(Victim),
    /// Stopped until it is replaced.
    Hang(Victim),
    /// Stopped for less than a hang takes.
    Hiccup(Victim, Duration),
    /// The supervisor is killed, and another one begun.
    Supervisor,
}

impl Fault {
    pub fn draw(random: &mut ChaCha8Rng) -> Self {
        let mut victims = VICTIMS;
        let first = *victims.choose(random).unwrap();
        victims.rotate_left(random.random_range(0..3));
        let second = *victims.iter().find(|victim| **victim != first).unwrap();
        match random.random_range(0..10) {
            0..=2 => Self::Kill(first),
            3 => Self::KillTwo(first, second),
            4 => Self::KillAtStart(first, Duration::from_micros(random.random_range(0..15_000))),
            5 => Self::KillInUpdate(*[Victim::Kalman, Victim::Compensator].choose(random).unwrap()),
            6 | 7 => Self::Hang(first),
            8 => Self::Hiccup(first, Duration::from_millis(random.random_range(20..150))),
            _ => Self::Supervisor,
        }
    }

    /// Those that do not outlive it.
    pub fn dead(&self) -> Vec<Victim> {
        match *self {
            Self::Kill(victim) | Self::KillAtStart(victim, _) | Self::KillInUpdate(victim) | Self::Hang(victim) => {
                vec![victim]
            }
            Self::KillTwo(first, second) => vec![first, second],
            Self::Hiccup(..) | Self::Supervisor => Vec::new(),
        }
    }

    /// Those that it touches.
    pub fn touched(&self) -> Vec<Victim> {
        match *self {
            Self::Hiccup(victim, _) => vec![victim],
            _ => self.dead(),
        }
    }

    /// Whether samples reach the rate without pause.
    pub fn spares_the_rate(&self) -> bool {
        self.touched().iter().all(|victim| *victim == Victim::Compensator)
    }

    /// Its row in the table of results.
    pub fn kind(&self) -> String {
        match self {
            Self::Kill(victim) => format!("{} killed", victim.name()),
            Self::KillTwo(..) => "two killed at once".into(),
            Self::KillAtStart(..) => "killed, and again at its start".into(),
            Self::KillInUpdate(victim) => format!("{} killed in an update", victim.name()),
            Self::Hang(victim) => format!("{} hangs", victim.name()),
            Self::Hiccup(..) => "stopped for 20 to 150 ms".into(),
            Self::Supervisor => "supervisor killed".into(),
        }
    }
}
