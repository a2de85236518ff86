//! Nothing is hidden: what is named all the same?

use crate::{
    outcome::Outcome,
    run::{Run, Trial},
    table::{Table, share, wilson_upper},
};
use clap::ValueEnum;
use gyro_model::{
    fit::FitError,
    simulate::{Motion, Reference, Scenario, SensorSpec, simulate},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs of each kind.
    #[arg(long, default_value_t = 200)]
    logs: u64,
    /// The noise.
    #[arg(long, default_value = "all")]
    kind: Choice,
    /// Length, s.
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Rows a second.
    #[arg(long, default_value_t = 100.0)]
    rate: f64,
}

/// One noise, or each.
#[derive(Clone, Copy, ValueEnum)]
enum Choice {
    All,
    White,
    Ar,
    Flicker,
    RateNoise,
    Quantised,
    OneSine,
}

/// What is random, beside white gyro noise of 0.0024–0.008 °/s/√Hz, which every log has.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    /// Nothing more.
    White,
    /// AR(1), 0.99 from row to row, of 0.005–0.1 °/s.
    Ar,
    /// 1/f, bias instability 5–30 °/h (the flat part of the Allan deviation).
    Flicker,
    /// White noise that grows by 0.1–1 % of the rate.
    RateNoise,
    /// An encoder of 1024–4096 counts, turned slowly.
    Quantised,
    /// The paper's motion, ±150° at 0.25 Hz.
    OneSine,
}

impl Kind {
    /// Each.
    pub const ALL: [Self; 6] = [Self::White, Self::Ar, Self::Flicker, Self::RateNoise, Self::Quantised, Self::OneSine];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        ["white", "ar", "flicker", "rate-noise", "quantised", "one-sine"][self as usize]
    }

    /// The log of this seed; its motion goes by `k`: sine, multisine, drive.
    pub fn scenario(self, seed: u64, k: u64, seconds: f64, rate_hz: f64) -> Scenario {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let mut sensor = SensorSpec { bias_random_walk: 0.0, ..SensorSpec::random(seed) };
        let mut between = |low: f64, high: f64| random.random_range(low.ln()..high.ln()).exp();
        let mut motion = match k % 3 {
            0 => Motion::Sine { amplitude: between(1.2, 2.8), frequency: between(0.2, 0.5) },
            1 => Motion::Multisine { travel: between(3.5, 9.0) },
            _ => Motion::Drive { rate: between(0.6, 1.8), hold: between(1.2, 4.0) },
        };
        match self {
            Self::White => {}
            Self::Ar => sensor.correlated = between(0.005, 0.1).to_radians(),
            Self::Flicker => sensor.flicker = between(5.0, 30.0).to_radians() / 3600.0,
            Self::RateNoise => sensor.rate_noise = between(1e-3, 1e-2),
            Self::Quantised => {
                sensor.reference = Reference::Encoder([1024, 2048, 4096][(k / 3 % 3) as usize]);
                motion = match k % 3 {
                    0 => Motion::Sine { amplitude: between(0.1, 1.0), frequency: between(0.05, 0.25) },
                    1 => Motion::Multisine { travel: between(0.3, 2.0) },
                    _ => Motion::Drive { rate: between(0.03, 0.3), hold: between(1.2, 4.0) },
                };
            }
            Self::OneSine => motion = Motion::default(),
        }
        Scenario { motion, seconds, rate_hz, seed, hidden: Vec::new(), sensor }
    }
}

/// Runs it and prints the table.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), FitError> {
    let kinds: Vec<Kind> = match arguments.kind {
        Choice::All => Kind::ALL.to_vec(),
        one => vec![Kind::ALL[one as usize - 1]],
    };
    let each = |&kind: &Kind| {
        (0..arguments.logs).map(move |k| {
            let scenario = kind.scenario(run.seed_of(k), k, arguments.seconds, arguments.rate);
            Trial { name: format!("{}/{k}", kind.name()), what: (kind, scenario) }
        })
    };
    let outcomes = run.each(kinds.iter().flat_map(each).collect(), |trial, detail| {
        let scenario = &trial.what.1;
        Outcome::of(&simulate(scenario).record, scenario.sensor.axis, detail)
    })?;
    let mut table = Table::new(&["noise", "logs", "alarms", "95 % upper bound", "what they say"]);
    let mut list = Vec::new();
    for kind in kinds {
        let own: Vec<_> = outcomes.iter().filter(|(trial, _)| trial.what.0 == kind).collect();
        let alarms: Vec<_> = own.iter().filter(|(_, outcome)| outcome.is_alarm()).collect();
        let mut names = BTreeMap::new();
        for (trial, outcome) in &alarms {
            *names.entry(outcome.says()).or_insert(0) += 1;
            list.push(format!("- `--only {}`, {:?}: {}", trial.name, trial.what.1.motion, outcome.says()));
        }
        let names: Vec<String> = names.iter().map(|(name, count)| format!("{name} × {count}")).collect();
        let bound = format!("{:.1} %", 100.0 * wilson_upper(alarms.len(), own.len().max(1)));
        table.row([
            kind.name().to_owned(),
            own.len().to_string(),
            share(alarms.len(), own.len()),
            bound,
            names.join(", "),
        ]);
    }
    table.print();
    for line in list {
        println!("{line}");
    }
    Ok(())
}
