//! How often the checks of a log find a fault where there is none.
//!
//! ```text
//! cargo run --release -p gyro-model --example false_faults -- [--count 300] [--seed 1] [LOG …]
//! ```
//!
//! Simulated logs have another sensor, motion, rate and kind of reference each, and hide no effect or some, which are physics and
//! no fault; LOGs are recorded ones, in the columns of the interface. Printed are the faults of each log that has any, and
//! a table: how many logs have which fault, of how many.

#[allow(dead_code)] // truths are written by the generator alone
#[path = "make_cases/choice.rs"]
mod choice;
#[path = "validate/log_file.rs"]
mod log_file;

use choice::Case;
use clap::Parser;
use gyro_model::{
    Record,
    fault::FaultKind,
    faults,
    simulate::{Reference, Scenario, simulate},
};
use std::{collections::BTreeMap, error::Error, path::PathBuf};

#[derive(Parser)]
#[command(about = "Faults found where there are none")]
struct Arguments {
    /// Simulated logs.
    #[arg(long, default_value_t = 300)]
    count: u64,
    /// Of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Recorded logs.
    logs: Vec<PathBuf>,
}

/// How many logs have which fault, by the kind of log.
#[derive(Default)]
struct Tally {
    logs: BTreeMap<String, u64>,
    found: BTreeMap<(String, FaultKind), u64>,
}

impl Tally {
    fn add(&mut self, kind: &str, name: &str, record: &mut Record) {
        *self.logs.entry(kind.to_owned()).or_default() += 1;
        let report = faults::check(record, &[]);
        for fault in &report.faults {
            println!("{name}: {} ({}): {}", fault.kind, fault.count, fault.says);
        }
        let mut names: Vec<FaultKind> = report.faults.into_iter().map(|fault| fault.kind).collect();
        names.sort();
        names.dedup();
        for fault in names {
            *self.found.entry((kind.to_owned(), fault)).or_default() += 1;
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments = Arguments::parse();
    let mut tally = Tally::default();
    for k in 0..arguments.count {
        let seed = choice::seed_of(arguments.seed, k);
        let (kind, scenario) = scenario(Case::random(seed).scenario, k);
        let ids: Vec<&str> = scenario.hidden.iter().map(|hidden| hidden.effect.card().id).collect();
        let name = format!("{kind} {seed} {} Hz {:?} [{}]", scenario.rate_hz, scenario.motion, ids.join(", "));
        tally.add(kind, &name, &mut simulate(&scenario).record);
    }
    for path in &arguments.logs {
        tally.add("recorded", &path.display().to_string(), &mut log_file::read(path)?);
    }
    println!("\n| logs | of | fault | logs that have it |\n| --- | --- | --- | --- |");
    for (kind, logs) in &tally.logs {
        let of_kind: Vec<_> = tally.found.iter().filter(|((of, _), _)| of == kind).collect();
        if of_kind.is_empty() {
            println!("| {kind} | {logs} | none | 0 |");
        }
        for ((_, fault), found) in of_kind {
            println!("| {kind} | {logs} | {fault} | {found} |");
        }
    }
    Ok(())
}

/// An encoder's log as it is chosen, one against a rate, one against an orientation, in turn.
fn scenario(mut scenario: Scenario, k: u64) -> (&'static str, Scenario) {
    let (kind, reference, noise) = match k % 4 {
        0 => ("rate", Reference::Rate, 1e-3),
        1 => ("orientation", Reference::Quaternion, 5e-4),
        _ => return ("encoder", scenario),
    };
    let of_encoder = |id: &str| id.starts_with("encoder");
    scenario.hidden.retain(|hidden| !of_encoder(hidden.effect.card().id));
    scenario.sensor.reference = reference;
    scenario.sensor.reference_noise = noise;
    (kind, scenario)
}
