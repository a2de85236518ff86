//! `truerate apply`: a compensated log, from the very filter that runs live.

use crate::{
    arguments::{LogArgs, picked},
    commands::{
        print,
        subject::{say_chosen, writable},
    },
    progress::Progress,
};
use anyhow::{Context, Result, bail};
use gyro_model::{Axis, Model, Record, effects::Need, estimator, estimator::Estimator};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};
use workbench::estimates::{EstimateWriter, Unmeasured};
use workbench::{
    log::{self, Options, Provenance},
    model_file::{self, ModelFile},
    report::view,
};

/// What `truerate apply` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate apply log.csv.gz --model model.toml -o compensated.csv
  truerate apply - --model model.toml < log.csv > compensated.csv

Columns, one row for each row of the log:
  t                when the row's rates are valid, s on the clock of the gyro's stamps: a model with
                   a delay d makes it the row's time less d; where d is negative the reference is
                   late, and it stays the row's time
  rate_x …         compensated rate, rad/s, not filtered; empty in a row without a gyro's reading
  rate_filtered_x  filtered rate, rad/s, and rate_std_x its standard deviation
  angle_x          integral of rate_x alone, rad, from the first reference on
  angle_fused_x    filtered angle, rad, with the reference where there is one
No reference is needed. The rows are those of `truerate run --speed max --model M --freeze --record
F`.")]
pub struct Args {
    #[command(flatten)]
    log: LogArgs,
    /// The model to compensate with
    #[arg(long, value_name = "M")]
    model: PathBuf,
    /// Only this axis
    #[arg(long, value_name = "x|y|z")]
    axis: Option<Axis>,
    /// The file to write: CSV, packed where it ends in .gz, or `-` for standard output
    #[arg(short, long, value_name = "OUT.csv", default_value = "-")]
    output: PathBuf,
}

/// Compensates and filters the whole log.
///
/// # Errors
/// A refused log or model, a model without an axis of the log, or a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    writable(&args.output, &[&args.log.log, &args.model])?;
    let options = Options { as_streamed: true, ..args.log.names.options() };
    let to_a_file = args.output != Path::new("-");
    let (record, faults, provenance, applied) = if to_a_file {
        // Beside the search for faults: the file is put in its place once that has ended, too.
        let (record, faults, provenance, applied) =
            log::read_beside(&args.log.log, &options, |record, provenance| Applied::of(args, record, provenance))?;
        (record, faults, provenance, applied?)
    } else {
        let (record, faults, provenance) = log::read(&args.log.log, &options)?;
        let applied = Applied::of(args, &record, &provenance)?;
        (record, faults, provenance, applied)
    };
    let Applied { file, axes, writer, unmeasured } = applied;
    writer.finish()?;
    let log = args.log.log.display();
    for fault in &faults {
        eprintln!("{log}: data fault {}", view::fault(fault));
    }
    for says in unmeasured.says() {
        eprintln!("{log}: {says}");
    }
    let model = &file.model;
    if to_a_file {
        let range = file.provenance.as_ref().and_then(|p| p.temperature).zip(provenance.temperature);
        let warning = range.map_or_else(String::new, |(fitted, here)| beyond(model, fitted, here));
        print(&(summary(args, &record, &axes) + &warning))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Estimates that are written, and the model that made them.
struct Applied {
    file: ModelFile,
    axes: Vec<Axis>,
    writer: EstimateWriter,
    unmeasured: Unmeasured,
}

impl Applied {
    fn of(args: &Args, record: &Record, provenance: &Provenance) -> Result<Self> {
        say_chosen(&args.log, provenance);
        let file = model_file::load(&args.model, &record.free_names)?;
        let model = &file.model;
        let both: Vec<Axis> =
            Axis::ALL.into_iter().filter(|&a| record.has_gyro(a) && model.axes[a.index()].is_some()).collect();
        let axes: Vec<Axis> = picked(args.axis, &both);
        if axes.is_empty() || axes.iter().any(|a| !both.contains(a)) {
            bail!(
                "{} with model {}: {}: fit the model on a log of this sensor",
                args.log.log.display(),
                args.model.display(),
                none_in_common(record, model, args.axis)
            );
        }
        file.check_channels(record, &axes).with_context(|| args.log.log.display().to_string())?;
        let mut writer = EstimateWriter::create(&args.output, &axes, provenance.start_ns)?;
        let mut estimator = Estimator::new(estimator::Options::default());
        estimator.set_model(model);
        let progress = Progress::of(record.len() as u64, "compensating");
        let mut unmeasured = Unmeasured::default();
        for (k, row) in record.rows.iter().enumerate() {
            let estimate = estimator.step(row);
            unmeasured.take(row.t_ns, &estimate, &axes);
            writer.row(estimate.valid_t_ns, &estimate)?;
            if k % 4096 == 0 {
                progress.at(k as u64);
            }
        }
        drop(progress);
        Ok(Self { file, axes, writer, unmeasured })
    }
}

/// A warning where a model that goes by the temperature is used far outside of that of the log which it was fitted on.
fn beyond(model: &Model, fitted: (f64, f64), here: (f64, f64)) -> String {
    let mut terms = model.axes.iter().flatten().flat_map(|own| &own.terms);
    let far = (fitted.0 - here.0).max(here.1 - fitted.1) > fitted.1 - fitted.0;
    if !far || !terms.any(|term| term.effect.card().needs.contains(&Need::Temperature)) {
        return String::new();
    }
    format!(
        "warning: the model depends on the temperature and was fitted at {:.1} to {:.1} °C; here it is {:.1} to {:.1} °C: fit it on a \
         log of these temperatures, and check that both are in °C\n",
        fitted.0, fitted.1, here.0, here.1
    )
}

fn none_in_common(record: &Record, model: &Model, axis: Option<Axis>) -> String {
    let list = |has: &dyn Fn(Axis) -> bool| {
        let letters: Vec<&str> = Axis::ALL.into_iter().filter(|&a| has(a)).map(Axis::letter).collect();
        if letters.is_empty() { "no axis".to_owned() } else { letters.join(", ") }
    };
    let wanted = axis.map_or_else(String::new, |a| format!("axis {a} is asked for, "));
    format!(
        "{wanted}the log has gyro {}, the model {}",
        list(&|a| record.has_gyro(a)),
        list(&|a| model.axes[a.index()].is_some())
    )
}

fn summary(args: &Args, record: &Record, axes: &[Axis]) -> String {
    let letters: Vec<&str> = axes.iter().map(|a| a.letter()).collect();
    format!(
        "{}: {} rows of axis {}, compensated with {}\n",
        args.output.display(),
        record.len(),
        letters.join(", "),
        args.model.display()
    )
}
