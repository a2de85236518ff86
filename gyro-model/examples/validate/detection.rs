//! How large an effect must be to be named, beside what an oracle needs.

use crate::{
    choice::EFFECTS,
    oracle,
    outcome::Outcome,
    probe::{Probe, richest, scenario},
    run::{Run, Trial},
    table::{Table, median, number},
};
use gyro_model::{fit::FitError, simulate::simulate};
use std::{error::Error, path::PathBuf};

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs of each effect.
    #[arg(long, default_value_t = 20)]
    seeds: u64,
    /// Writes the table to a file, too: `examples/validate/detection.csv` is where the other studies read it.
    #[arg(long)]
    csv: Option<PathBuf>,
}

/// Sizes that are tried: so many steps of an eighth of an octave from a third of the oracle's size on.
const STEPS: u32 = 92;
/// The first of them, in steps: 1.4 of the oracle's.
const FIRST: u32 = 16;
/// From a size that is not named to the next, in steps.
const GALLOP: u32 = 16;
/// What takes the oracle's place for a dead zone (rad/s) or a saturation (share).
const LIMIT: f64 = 0.01;

/// One log's threshold.
#[derive(Clone, Copy)]
struct Threshold {
    oracle: Option<f64>,
    unit: &'static str,
    /// Infinite where not even the largest was named.
    found: f64,
}

/// Runs it and prints the table.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), Box<dyn Error>> {
    let each = |&id: &&'static str| {
        (0..arguments.seeds).map(move |k| Trial { name: format!("{id}/{k}"), what: (id, run.seed_of(k)) })
    };
    let thresholds = run.each(EFFECTS.iter().flat_map(each).collect(), |trial, detail| {
        let (id, seed) = trial.what;
        threshold(&Probe::new(id, scenario(id, richest(id), seed)), detail)
    })?;
    let mut table = Table::new(&["effect", "unit of size", "oracle, 3 σ", "named half of the time", "ratio"]);
    let mut csv = arguments.csv.as_ref().map(csv::Writer::from_path).transpose()?;
    if let Some(csv) = &mut csv {
        csv.write_record(["effect", "oracle", "found", "ratio"])?;
    }
    for id in EFFECTS {
        let own: Vec<Threshold> = thresholds.iter().filter(|(t, _)| t.what.0 == id).map(|(_, t)| *t).collect();
        let Some(first) = own.first() else { continue };
        let oracle = median(own.iter().filter_map(|t| t.oracle).collect());
        let found = median(own.iter().map(|t| t.found).collect());
        let ratio = median(own.iter().filter_map(|t| t.oracle.map(|oracle| t.found / oracle)).collect());
        table.row([id.to_owned(), first.unit.to_owned(), number(oracle), number(found), number(ratio)]);
        if let Some(csv) = &mut csv {
            let cell = |value: Option<f64>| value.map(|v| format!("{v:.4e}")).unwrap_or_default();
            csv.write_record([id.to_owned(), cell(oracle), cell(found), cell(ratio)])?;
        }
    }
    table.print();
    println!("Sizes and ratios are medians over the logs; – is where no oracle of three sigma makes sense.\n");
    Ok(())
}

/// The size between the largest that is not named and the smallest that is, by halving.
fn threshold(probe: &Probe, detail: bool) -> Result<Threshold, FitError> {
    let oracle = oracle::size(probe);
    let unit = oracle.unwrap_or(LIMIT);
    let (mut low, mut high) = (0, STEPS);
    let mut tried = FIRST;
    while low < high {
        let size = multiple(tried) * unit;
        if detail {
            eprintln!("{:.2} × {unit:.3e}: {:?}", multiple(tried), probe.at(size));
        }
        let record = simulate(&probe.hide(size)).record;
        if Outcome::of(&record, probe.scenario.sensor.axis, detail)?.names(probe.id()) {
            high = tried;
        } else {
            low = tried + 1;
        }
        tried = if high == STEPS { (tried + GALLOP).min(STEPS - 1) } else { u32::midpoint(low, high) };
    }
    let found = if high == STEPS { f64::INFINITY } else { multiple(high) / 2_f64.powf(0.0625) };
    Ok(Threshold { oracle, unit: probe.unit(), found: found * unit })
}

/// A size that is tried, in sizes of the oracle.
fn multiple(step: u32) -> f64 {
    2_f64.powf(0.125 * (f64::from(step) - 12.0))
}

/// What `detection.csv` holds of an effect.
#[derive(serde::Deserialize)]
struct Entry {
    effect: String,
    found: f64,
    ratio: Option<f64>,
}

/// So many times the size that is named half of the time on such a log; `None` where `detection.csv` does not have it.
pub fn times_found(probe: &Probe, times: f64) -> Option<f64> {
    let mut reader = csv::Reader::from_reader(include_bytes!("detection.csv").as_slice());
    let entry = reader.deserialize().filter_map(Result::ok).find(|entry: &Entry| entry.effect == probe.id())?;
    // Not named at any size is taken for the largest that was tried.
    let by_oracle = oracle::size(probe).zip(entry.ratio).map(|(size, ratio)| size * ratio.min(multiple(STEPS)));
    Some(times * by_oracle.unwrap_or(entry.found.min(multiple(STEPS) * LIMIT)))
}
