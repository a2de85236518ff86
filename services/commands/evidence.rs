//! `truerate evidence`: what logs say, without the logs.

use crate::{
    arguments::LogsArgs,
    commands::{
        print,
        subject::{few, options_of_all, say_chosen_of_all, writable},
    },
    progress::Progress,
};
use anyhow::{Result, anyhow, bail};
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::ExitCode,
};
use workbench::{
    evidence::{Evidence, Labels, LogEvidence},
    log::Provenance,
    output,
    subject::{Subject, Taken},
};

/// What `truerate evidence` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate evidence log.csv.gz -o a.evidence --part 17 --type BMI160-250dps
      what this log says of part 17, some 20 kB
  truerate evidence new.csv.gz -o b.evidence --part 18 --type BMI160-250dps --meta day=2026-05-31
      of part 18, recorded on that day; several logs may be given
  truerate merge a.evidence b.evidence -o fleet.evidence
      puts files together

An evidence file holds the normal equations of the model and of every effect, the noise, the error's
causes and the labels of each log; readings cannot be got back from it. `truerate merge` puts files
together, `truerate fleet` reads them. Without --part a log's name is the part.")]
pub struct Args {
    #[command(flatten)]
    logs: LogsArgs,
    /// The evidence file to write, or `-` for standard output
    #[arg(short, long, value_name = "E")]
    output: PathBuf,
    /// The part that was recorded: one sensor, by a number or a name
    #[arg(long, value_name = "ID")]
    part: Option<String>,
    /// The type of the part: sensor, with its driver and range where they matter
    #[arg(long = "type", value_name = "ID")]
    kind: Option<String>,
    /// Anything else that is known of the recording (mount, vehicle, season); `day=2026-05-31` gives the day where the log has no
    /// date; may be given several times
    #[arg(long, value_name = "KEY=VALUE", value_parser = pair)]
    meta: Vec<(String, String)>,
    /// Start from this model; without it the base model
    #[arg(long, value_name = "M")]
    model: Option<PathBuf>,
}

fn pair(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.is_empty() => Ok((key.to_owned(), value.to_owned())),
        _ => Err("expected KEY=VALUE".to_owned()),
    }
}

/// Reduces each log, and writes the file.
///
/// # Errors
/// A refused log or model, the same key twice, or a file that cannot be written.
pub fn run(args: &Args) -> Result<ExitCode> {
    writable(&args.output, &args.logs.paths())?;
    let mut meta = BTreeMap::new();
    for (key, value) in &args.meta {
        if meta.insert(key.clone(), value.clone()).is_some() {
            bail!("--meta {key}: is given twice");
        }
    }
    let labels = Labels { part: args.part.clone(), kind: args.kind.clone(), meta };
    let taken = Taken {
        options: args.logs.names.options(),
        axis: None,
        at_rest: args.logs.at_rest,
        reference_is_dependent: args.logs.reference_is_dependent,
    };
    let mut all: Vec<LogEvidence> = Vec::new();
    let mut read: Vec<(String, Provenance)> = Vec::new();
    let mut left_out: BTreeMap<String, Vec<String>> = BTreeMap::new();
    {
        let progress = Progress::of_files(args.logs.logs.len());
        for (k, path) in args.logs.logs.iter().enumerate() {
            progress.says(&path.display().to_string());
            let subject = Subject::read(path, &taken)?;
            let start = subject.start(args.model.as_deref())?;
            let says = |_: &str| ();
            let own = LogEvidence::of(&subject, &start, &labels, &options_of_all(&says))?;
            if let Some(why) = own.left_out() {
                left_out.entry(why).or_default().push(subject.name.clone());
            }
            all.push(own);
            read.push((subject.name, subject.provenance));
            progress.at(k as u64 + 1);
        }
    }
    say_chosen_of_all(read.iter().map(|(name, provenance)| (name.as_str(), provenance)), &[]);
    for (why, logs) in &left_out {
        let (logs, say) =
            (few(&logs.iter().map(String::as_str).collect::<Vec<_>>()), if logs.len() == 1 { "says" } else { "say" });
        eprintln!("truerate: {logs}: kept, but {say} nothing of a fleet: {why}");
    }
    let many = all.len();
    let evidence = Evidence::new(all).map_err(|error| anyhow!("{error:#}"))?;
    if evidence.logs.len() < many {
        eprintln!("truerate: {} of the logs are the same: kept once", many - evidence.logs.len());
    }
    let text = evidence.render()?;
    output::write(&args.output, text.as_bytes())?;
    if args.output != Path::new("-") {
        print(&format!(
            "{}: {} {}, {} kB\n",
            args.output.display(),
            evidence.logs.len(),
            if evidence.logs.len() == 1 { "log" } else { "logs" },
            text.len().div_ceil(1000)
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}
