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

/// Sizes that are tried, in sizes of the oracle.
const MULTIPLES: [f64; 11] = [0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0, 5.6, 8.0, 11.2];
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
    let (mut low, mut high) = (0, MULTIPLES.len());
    let mut tried = 4;
    while low < high {
        let size = MULTIPLES[tried] * unit;
        if detail {
            eprintln!("{} × {unit:.3e}: {:?}", MULTIPLES[tried], probe.at(size));
        }
        let record = simulate(&probe.hide(size)).record;
        if Outcome::of(&record, probe.scenario.sensor.axis, detail)?.names(probe.id()) {
            high = tried;
        } else {
            low = tried + 1;
        }
        tried = usize::midpoint(low, high);
    }
    let found = match high {
        0 => MULTIPLES[0],
        _ if high == MULTIPLES.len() => f64::INFINITY,
        _ => (MULTIPLES[high - 1] * MULTIPLES[high]).sqrt(),
    };
    Ok(Threshold { oracle, unit: probe.unit(), found: found * unit })
}

/// What `detection.csv` holds of an effect.
#[derive(serde::Deserialize)]
struct Entry {
    effect: String,
    found: Option<f64>,
    ratio: Option<f64>,
}

/// So many times the size that is named half of the time on such a log.
pub fn times_found(probe: &Probe, times: f64) -> Result<f64, csv::Error> {
    let mut reader = csv::Reader::from_reader(include_bytes!("detection.csv").as_slice());
    for entry in reader.deserialize() {
        let entry: Entry = entry?;
        if entry.effect == probe.id() {
            // Not found at all is the largest that was tried.
            let ratio = entry.ratio.map(|ratio| ratio.min(MULTIPLES[MULTIPLES.len() - 1]));
            let by_oracle = ratio.zip(oracle::size(probe)).map(|(ratio, size)| ratio * size);
            return Ok(by_oracle.or(entry.found).map_or(probe.drawn(), |found| times * found));
        }
    }
    Ok(probe.drawn())
}
