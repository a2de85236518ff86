//! What the offline commands have in common: a log is read while the terminal shows progress; where the result goes.

use crate::{
    arguments::{Explain, LogArgs, LogsArgs, ReportArgs, SearchArgs, StartArgs},
    browser,
    deadline::Deadline,
    progress::Progress,
};
use anyhow::{Context as _, Result, anyhow, bail};
use gyro_model::{
    Axis, Model, diagnose,
    diagnosis::{DataFault, Diagnosis},
    evidence::study::Bench,
};
use std::{
    io::Write as _,
    path::{Path, PathBuf},
};
use workbench::{
    log,
    model_file::{self, ModelFile},
    output::{self, Output, print},
    prior::{self, Begun, Prior},
    report::{self, Explained, Format, Terminal},
    several::{self, Several, Unfit},
    subject::{Start, Subject, Taken},
    words::typed,
};

/// Reads a log for fitting.
///
/// # Errors
/// A refused log, or an axis without gyro or reference.
pub fn read(args: &LogArgs, axis: Option<Axis>) -> Result<Subject> {
    let taken = Taken {
        options: args.names.options(),
        axis,
        at_rest: args.at_rest,
        reference_is_dependent: args.reference_is_dependent,
    };
    let subject = {
        let _spinner = Progress::spinner("reading the log");
        Subject::read(&args.log, &taken)?
    };
    say_chosen(args, &subject.provenance);
    Ok(subject)
}

/// The model of this file, or the base model fitted to the log.
///
/// # Errors
/// As [`Subject::start`].
pub fn start(subject: &Subject, model: Option<&Path>) -> Result<Start> {
    let _spinner = Progress::spinner("fitting");
    subject.start(model)
}

/// Refits a model on the axes that are meant, and gives the log as it was laid out for it.
///
/// # Errors
/// A log that cannot be fitted.
pub fn fit(subject: &Subject, model: &Model) -> Result<(Model, Option<Bench>)> {
    let _spinner = Progress::spinner("fitting");
    subject.fit_and_keep(model)
}

/// Holds the model to start from against the log.
///
/// # Errors
/// A log that cannot be judged.
pub fn judge(subject: &Subject, start: &Start) -> Result<Diagnosis> {
    let spinner = Progress::spinner("comparing");
    let progress = |what: &str| spinner.says(what);
    subject.judge(start, &options(subject, &progress))
}

/// Holds a model against the log; `own_log` where it was fitted on this very one.
///
/// # Errors
/// A log that cannot be judged.
pub fn compare(subject: &Subject, model: &Model, own_log: bool, laid: Option<&Bench>) -> Result<Diagnosis> {
    let spinner = Progress::spinner("comparing");
    let progress = |what: &str| spinner.says(what);
    subject.compare(model, &subject.axes, &diagnose::Options { own_log, laid, ..options(subject, &progress) })
}

/// Writes the model that a command made, and says on standard error where it takes the place of another.
///
/// # Errors
/// The file cannot be written.
pub fn keep(path: &Path, file: &ModelFile) -> Result<()> {
    let replaces = path != Path::new("-") && path.is_file();
    model_file::save(path, file)?;
    if replaces {
        eprintln!("{}: replaced an existing file", path.display());
    }
    Ok(())
}

/// How a diagnosis of this log is run.
#[must_use]
pub fn options<'a>(subject: &'a Subject, progress: &'a (dyn Fn(&str) + Sync)) -> diagnose::Options<'a> {
    diagnose::Options { faults: &subject.faults, ..options_of_all(progress) }
}

/// What a report has to know of how the command was called.
#[must_use]
pub fn context(
    subject: &Subject,
    command: report::Command,
    args: &LogArgs,
    axis: Option<Axis>,
    model: Option<&Path>,
    output: Option<&Path>,
) -> report::Context {
    let shown = |path: Option<&Path>| path.map(|p| p.display().to_string());
    let mut flags = Vec::new();
    flags.extend(args.names.flags());
    if args.reference_is_dependent {
        flags.push("--reference-is-dependent".to_owned());
    }
    if let Some(axis) = axis {
        flags.extend(["--axis".to_owned(), axis.to_string()]);
    }
    report::Context {
        model: shown(model),
        output: shown(output),
        flags,
        maps: log::remedy(&args.log, &args.names.options(), &subject.record, &subject.faults),
        about: subject.about(model),
        terminal: Terminal::detect(),
        ..report::Context::new(command, subject.name.clone())
    }
}

/// How much is told of each suspect.
#[must_use]
pub fn explained(search: &SearchArgs) -> Explained {
    if search.explain == Some(Explain::Full) { Explained::Tests } else { Explained::Sentence }
}

/// Reads several logs of one sensor.
///
/// # Errors
/// As [`Several::read`].
pub fn read_all(args: &LogsArgs, axis: Option<Axis>) -> Result<Several> {
    if args.logs.iter().filter(|log| *log == Path::new("-")).count() > 0 {
        bail!("standard input is one log: give several logs as files");
    }
    if args.names.reference.is_some() {
        bail!("--reference is the second file of one log: give several logs with the reference in them");
    }
    let taken = taken(args, axis);
    let several = {
        let spinner = Progress::spinner("reading the logs");
        Several::read(&args.logs, &taken, |path| spinner.says(&path.display().to_string()))?
    };
    let provenances = several.subjects.iter().map(|subject| (subject.name.as_str(), &subject.provenance));
    say_chosen_of_all(provenances, &several.unfit);
    Ok(several)
}

/// Reads the logs of two sensors.
///
/// # Errors
/// As [`read`], of either; they are not two.
pub fn read_each(args: &LogsArgs, axis: Option<Axis>) -> Result<[Subject; 2]> {
    let taken = taken(args, axis);
    let (subjects, unfit) = {
        let spinner = Progress::spinner("reading the logs");
        several::read_each(&args.logs, &taken, |path| spinner.says(&path.display().to_string()))?
    };
    say_chosen_of_all(subjects.iter().map(|own| (own.name.as_str(), &own.provenance)), &unfit);
    subjects.try_into().map_err(|_| anyhow!("two logs are needed, one of each sensor"))
}

fn taken(args: &LogsArgs, axis: Option<Axis>) -> Taken {
    Taken {
        options: args.names.options(),
        axis,
        at_rest: args.at_rest,
        reference_is_dependent: args.reference_is_dependent,
    }
}

/// What a search starts from: a type, the model of a file, or the base model; and what is said of the type.
///
/// # Errors
/// As [`begin`] and [`start`].
pub fn begun(subject: &Subject, args: &StartArgs) -> Result<(Start, Vec<(Axis, String)>)> {
    match &args.prior {
        Some(path) => begin(subject, path).map(|begun| (begun.start, begun.says)),
        None => Ok((start(subject, args.model.as_deref())?, Vec::new())),
    }
}

/// Runs a search. The terminal shows what is looked at; it ends when its time is over.
///
/// # Errors
/// Those of `work`, and a time that is none.
pub fn search<T>(
    what: &str,
    args: &SearchArgs,
    faults: &[DataFault],
    work: impl FnOnce(&Progress, &diagnose::Options) -> Result<T>,
) -> Result<T> {
    let spinner = Progress::spinner(what);
    let progress = |what: &str| spinner.says(what);
    let deadline = Deadline::after(args.budget)?;
    let is_over = || deadline.is_over();
    let explain = args.explain.is_some();
    work(&spinner, &diagnose::Options { explain, stop: &is_over, faults, ..options_of_all(&progress) })
}

/// A model of a type, fitted to the log of a new part.
///
/// # Errors
/// As [`Prior::load`] and [`Prior::begin`].
pub fn begin(subject: &Subject, path: &Path) -> Result<Begun> {
    let prior = Prior::load(path)?;
    let _spinner = Progress::spinner("fitting");
    prior.begin(subject).map_err(|error| prior::again(error, path))
}

/// How a diagnosis of several logs is run.
#[must_use]
pub fn options_of_all(progress: &(dyn Fn(&str) + Sync)) -> diagnose::Options<'_> {
    diagnose::Options { progress, failed: &|error| eprintln!("truerate: {error}"), ..diagnose::Options::default() }
}

/// What a report over several logs has to know of how the command was called.
#[must_use]
pub fn context_of_all(
    several: &Several,
    command: report::Command,
    args: &LogsArgs,
    axis: Option<Axis>,
    model: Option<&Path>,
    output: Option<&Path>,
) -> report::Context {
    let first = args.first();
    let own = context(&several.subjects[0], command, &first, axis, model, output);
    report::Context {
        log: first.log.display().to_string(),
        more: args.logs[1..].iter().map(|log| log.display().to_string()).collect(),
        about: several.about(model),
        maps: None,
        ..own
    }
}

/// Says on standard error which channels of several logs were taken without being named, once for all that have the same, and which maps
/// were not taken.
pub fn say_chosen_of_all<'a>(logs: impl Iterator<Item = (&'a str, &'a log::Provenance)>, unfit: &[Unfit]) {
    let mut said: Vec<(String, Vec<&str>)> = Vec::new();
    for (name, provenance) in logs.filter(|(_, provenance)| !provenance.chosen.is_empty()) {
        let unsure = provenance.unsure.as_ref().map_or(String::new(), |says| format!("\n{says}"));
        let says = format!("read as {}{unsure}", typed(&provenance.chosen));
        match said.iter_mut().find(|(other, _)| *other == says) {
            Some((_, names)) => names.push(name),
            None => said.push((says, vec![name])),
        }
    }
    for (says, names) in said {
        eprintln!("{}: {says}", few(&names));
    }
    let mut unfit = unfit.to_vec();
    unfit.sort_by(|a, b| a.map.cmp(&b.map));
    for own in unfit.chunk_by(|a, b| a.map == b.map) {
        let names: Vec<&str> = own.iter().map(|one| one.log.as_str()).collect();
        eprintln!("{}", own[0].says(&few(&names)));
    }
}

/// `a.csv, b.csv and 8 more`
#[must_use]
pub fn few(names: &[&str]) -> String {
    const SHOWN: usize = 3;
    match names {
        [all @ .., last] if !all.is_empty() && names.len() <= SHOWN => format!("{} and {last}", all.join(", ")),
        [_, ..] if names.len() > SHOWN => {
            format!("{} and {} more", names[..SHOWN - 1].join(", "), names.len() - SHOWN + 1)
        }
        _ => names.join(""),
    }
}

/// Says on standard error which channels were taken without being named.
pub fn say_chosen(args: &LogArgs, provenance: &log::Provenance) {
    if !provenance.chosen.is_empty() {
        let unsure = provenance.unsure.as_ref().map_or(String::new(), |says| format!("\n{says}"));
        eprintln!("{}: read as {}{unsure}", args.log.display(), typed(&provenance.chosen));
    }
}

impl ReportArgs {
    /// Checks that the report can be written, before any long work.
    ///
    /// # Errors
    /// An ending that says no form, a place that cannot be written to, or one of the files to `keep`.
    pub fn check(&self, keep: &[&Path]) -> Result<()> {
        if let Some(path) = &self.report {
            form(path)?;
            writable(path, keep)?;
        }
        Ok(())
    }

    /// The same, and that what the command makes can be written, which takes the place of neither log nor report.
    ///
    /// # Errors
    /// As [`Self::check`], of either file.
    pub fn check_with(&self, log: &Path, product: Option<&Path>) -> Result<()> {
        self.check_with_all(&[log], product)
    }

    /// The same of several logs.
    ///
    /// # Errors
    /// As [`Self::check`], of either file.
    pub fn check_with_all(&self, logs: &[&Path], product: Option<&Path>) -> Result<()> {
        let keep: Vec<&Path> = logs.iter().copied().chain(product).collect();
        self.check(&keep)?;
        product.map_or(Ok(()), |path| writable(path, logs))
    }

    /// Prints a result, and writes and shows its report, each in the context of its place.
    ///
    /// # Errors
    /// As [`ReportArgs::emit`].
    pub fn give(
        &self,
        product: Option<&Path>,
        context: report::Context,
        render: impl Fn(Format, &report::Context) -> String,
    ) -> Result<()> {
        let context = report::Context { opened: self.open, ..context };
        self.emit(product, |format, file| render(format, &if file { context.for_file() } else { context.clone() }))
    }

    /// Prints a result, and writes the report file. `render` makes it, told whether it is for a file. Nothing is printed
    /// where `product`, what the command makes, went to standard output.
    ///
    /// # Errors
    /// Standard output or the report cannot be written.
    pub fn emit(&self, product: Option<&Path>, render: impl Fn(Format, bool) -> String) -> Result<()> {
        if let Some(path) = &self.report {
            output::write(path, render(form(path)?, true).as_bytes())?;
        }
        if product != Some(Path::new("-")) {
            print(&render(self.format, false))?;
        }
        if self.open {
            self.show(&render)?;
        }
        Ok(())
    }

    /// Shows the page in a browser, and says where it is.
    fn show(&self, render: &impl Fn(Format, bool) -> String) -> Result<()> {
        let own = self.report.clone().filter(|path| matches!(form(path), Ok(Format::Html)));
        let page = match own {
            Some(path) => path,
            None => temporary(render(Format::Html, true).as_bytes()).context("the report for the browser")?,
        };
        if browser::show(&page) {
            eprintln!("in the browser: {}", page.display());
        } else {
            eprintln!(
                "no browser was found here: open {} in one, or copy it to a machine that has one (BROWSER names another program)",
                page.display()
            );
        }
        Ok(())
    }
}

/// A page in the folder for temporary files. It stays: a browser reads it when it likes.
fn temporary(page: &[u8]) -> std::io::Result<PathBuf> {
    let mut file = tempfile::Builder::new().prefix("truerate-").suffix(".html").tempfile()?;
    file.write_all(page)?;
    Ok(file.into_temp_path().keep()?)
}

/// The form that a report file's ending asks for.
fn form(path: &Path) -> Result<Format> {
    match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
        Some("txt" | "text" | "md") => Ok(Format::Text),
        Some("json") => Ok(Format::Json),
        Some("html" | "htm") => Ok(Format::Html),
        _ => bail!("{}: a report's ending says its form: use .txt, .json or .html", path.display()),
    }
}

/// Checks that a file can be written here, without touching what stands there, and that it is none of those to keep.
///
/// # Errors
/// The folder is missing or read-only, the name is a folder's, or one of those.
pub fn writable(path: &Path, kept: &[&Path]) -> Result<()> {
    let same = |other: &&&Path| match (path.canonicalize(), other.canonicalize()) {
        (Ok(own), Ok(other)) => own == other && own.is_file(),
        _ => path == **other && path != Path::new("-"),
    };
    if let Some(other) = kept.iter().find(same) {
        bail!("{}: would be written over {}, which is needed: choose another name", path.display(), other.display());
    }
    Output::create(path).map(drop)
}
