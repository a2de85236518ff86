//! Why a log is refused: what, where, what to do, in one line.

use super::{
    lacking::Advice,
    packing::Packing,
    unit::{self, Channel},
};
use crate::{
    toml_error::{TomlError, quoted},
    words::{self, Task, call, given, with},
};
use gyro_model::words::{Argument, Voice, shell_word};
use log_readers::format::{Format, Unreadable};
use std::{
    fmt, io,
    ops::{Deref, RangeInclusive},
    path::Path,
};

/// A refused log.
#[derive(Debug)]
pub struct LogError(Box<Refused>);

/// What is wrong with which log, and where.
#[derive(Debug)]
pub struct Refused {
    /// The log's path, or `standard input`.
    pub log: String,
    /// Line of the (unpacked) text, from 1.
    pub line: Option<u64>,
    /// Column, from 1, and its name.
    pub column: Option<(usize, String)>,
    /// What is wrong.
    pub problem: Problem,
    /// What would make a log of it.
    pub advice: Option<Advice>,
}

/// What is wrong with a log, and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// It cannot be opened.
    #[error("cannot be opened ({0}): check the path and who may read it")]
    Open(io::Error),
    /// It is a folder.
    #[error("is a folder without a recording in it: name a file{}", .0.as_ref().map_or(String::new(), |file| format!(", such as `{}`", shell_word(file))))]
    Folder(Option<String>),
    /// Reading failed half-way.
    #[error("cannot be read ({0}): check the disk, or copy the file again")]
    Read(io::Error),
    /// The packed file ends early or is damaged.
    #[error("truncated or corrupt gzip ({0}): copy the file again, or save what is whole with `gzip -dc`")]
    Gzip(io::Error),
    /// A file packed with zstd ends early or is damaged.
    #[error("truncated or corrupt zstd ({0}): copy the file again, or save what is whole with `zstd -dc`")]
    Zstd(io::Error),
    /// An archive of several files.
    #[error("is an archive of {count} files ({names}): {}", of_archive(such))]
    Archive {
        /// How many.
        count: usize,
        /// Their names.
        names: String,
        /// The path of one that may be meant.
        such: String,
    },
    /// An archive that cannot be read.
    #[error("is an archive that cannot be read ({0}): copy the file again, or unpack it")]
    Zip(io::Error),
    /// A database whose last messages lie beside it.
    #[error(
        "has messages beside it that are not written into it yet ({}): close the recorder, or write them in with \
         `sqlite3 FILE 'PRAGMA wal_checkpoint(TRUNCATE)'`",
        quoted(.0)
    )]
    Unwritten(String),
    /// A recording of which a file is missing.
    #[error("lists {} that is not there: copy the whole folder, or name the files that there are one by one", quoted(.0))]
    Incomplete(String),
    /// The list of a recording's files cannot be understood.
    #[error(
        "has a metadata.yaml that cannot be read ({0}): make it again with `ros2 bag reindex`, or name a file of the folder"
    )]
    Metadata(String),
    /// Named .gz, but not packed.
    #[error("is named .gz but is not gzip: copy the file again, or name it .csv if it is plain text")]
    NotGzip,
    /// No byte in it.
    #[error("is empty: a header row and data rows are needed, such as t,gyro_z,ref_angle_z")]
    Empty,
    /// A whole document of JSON where a stream has a record a line.
    #[error(
        "is one JSON document in one line\na stream is read line by line, a record in each, such as {{\"t\":0.01,\"gyro_z\":0.1}}; as a file \
         the document is read as it is\n{command}",
        command = call(Task::Run, "--source FILE.json").trim_matches('`')
    )]
    Document,
    /// The first row holds numbers.
    #[error(
        "no header: the first row holds numbers, {columns} of them ({row}); put the column names above it, such as t,gyro_z,ref_angle_z, \
         or name the columns by their numbers {}",
        with(Argument::Map(&["NAME=NUMBER".into()]))
    )]
    NoHeader {
        /// Columns in it.
        columns: usize,
        /// The row.
        row: String,
    },
    /// Commas between the fields and in the numbers.
    #[error(
        "{found} fields where the header has {wanted}: the numbers have decimal commas, and commas separate them too; write the \
         file with decimal points, or with semicolons between the fields"
    )]
    DecimalCommas {
        /// In the first row.
        found: usize,
        /// In the header.
        wanted: usize,
    },
    /// No column of this kind.
    #[error(
        "no column `{wanted}`: the header has {}; name yours {}{}{}{}",
        known.has,
        with(Argument::Map(&[format!("{}=CHANNEL", wanted.split([',', ' ']).next().unwrap_or(wanted))])),
        clause("taken without a flag: ", &known.chosen),
        clause("likely: ", &known.likely),
        clause("perhaps meant: ", &known.near)
    )]
    Missing {
        /// What is wanted.
        wanted: &'static str,
        /// What there is.
        known: Box<Known>,
    },
    /// No axis can be fitted.
    #[error(
        "no axis has both a gyro and a reference: add ref_angle_{axis}, ref_rate_{axis} or ref_qw … ref_qz, name yours {}, or \
         take it from a second file {}{}{}{}{}",
        with(Argument::Map(&[format!("ref_angle_{axis}=CHANNEL")])),
        with(Argument::Reference("FILE")),
        clause("", &known.has),
        clause("taken without a flag: ", &known.chosen),
        clause("likely, if something else than this gyro measured it: ", &known.likely),
        clause("perhaps meant: ", &known.near)
    )]
    NoReference {
        /// An axis that has a gyro.
        axis: &'static str,
        /// What there is.
        known: Box<Known>,
    },
    /// Raw words of a gyro of which nobody says how many are one °/s, and no reference either.
    #[error(
        "{columns} are whole numbers: raw words of the sensor, and nothing says how many of them are one °/s. Say it {}, STEPS \
         from the data sheet (131 for ±250 °/s of an MPU)",
        with(Argument::Map(&["gyro_z_dps=CHANNEL/STEPS".into()]))
    )]
    Words {
        /// The gyro's columns.
        columns: String,
    },
    /// A counter of rows where a time should be.
    #[error(
        "`{channel}` counts rows and is not a time: divide it by the rate, {}",
        rate.map_or_else(
            || format!("{} (rows a second)", with(Argument::Map(&[format!("t={channel}/RATE")]))),
            |rate| format!(
                "{} ({rate} Hz, as the text above the header says)",
                with(Argument::Map(&[format!("t={channel}/{rate}")]))
            )
        )
    )]
    CountsRows {
        /// The counter.
        channel: String,
        /// Rows a second, where the text says it.
        rate: Option<f64>,
    },
    /// A `--map` of a second file, and there is none.
    #[error(
        "{}: `ref:` is for a second file: name it {}, or leave `ref:` out",
        given("map", &quoted(.0)),
        with(Argument::Reference("FILE"))
    )]
    NoSecondFile(String),
    /// A `--map` without its two sides.
    #[error(
        "{}: is not NAME=[a*]CHANNEL[/b][+c], such as gyro_z_dps=imu.gz or gyro_z_dps=gz/131",
        given("map", &quoted(.0))
    )]
    MapFlag(String),
    /// A `--map` of an orientation by angles that are not three.
    #[error("{}: needs three angles, such as ref_rpy_deg=roll,pitch,yaw", given("map", &quoted(.0)))]
    MapOfAngles(String),
    /// A `--map` of a rotation matrix that is not nine channels.
    #[error("{}: needs the nine numbers of a matrix row by row, such as ref_r=r00,r01,r02,r10,… or ref_r=r", given("map", &quoted(.0)))]
    MapOfMatrix(String),
    /// The reference's clock is another, and the motion does not tell which.
    #[error(
        "log and reference have different clocks, and their motion does not show the offset (correlation {0:.2}, at least 0.5 is needed): \
         record both with one clock, or begin and end with a few quick turns"
    )]
    NotAligned(f64),
    /// A second file without a reference in it.
    #[error(
        "holds no reference that is clear: it has {has}; name it {}{}",
        with(Argument::Map(&["ref_q=CHANNEL".into()])),
        clause("likely: ", likely)
    )]
    NoReferenceIn {
        /// What is there.
        has: String,
        /// What may be meant, as flags.
        likely: String,
    },
    /// A `--map` of the time of messages.
    #[error("{}: messages have a time of their own: leave it out", given("map", &quoted(.0)))]
    TimeOfMessages(String),
    /// A `--map` of the difference of two channels, which messages of one time are needed for.
    #[error("{}: two channels of messages have times of their own, and no difference: give a table", given("map", &quoted(.0)))]
    DifferenceOfMessages(String),
    /// A format that is not read.
    #[error("is {what}: {remedy}")]
    Unread {
        /// What it is.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// Another format, of which nothing can be read.
    #[error("is a {format} that cannot be read ({cause})")]
    Unreadable {
        /// The format.
        format: &'static str,
        /// Why.
        cause: Unreadable,
    },
    /// Frames, and nothing that says what they mean.
    #[error(
        "is a {0}: what its frames mean is defined in a DBC file, give it {dbc} ({channels} lists the identifiers that came)",
        dbc = with(Argument::Dbc("FILE.dbc")),
        channels = call(Task::Channels, "FILE")
    )]
    NoDbc(&'static str),
    /// A DBC file of other frames.
    #[error(
        "the DBC file names none of the frames in the log, which are those of {0}: give the one of this bus ({channels} lists the \
         identifiers that came)",
        channels = call(Task::Channels, "FILE")
    )]
    OtherFrames(String),
    /// A DBC file that is none.
    #[error("{}: {says}", given("dbc", file))]
    Dbc {
        /// Which.
        file: String,
        /// Why.
        says: String,
    },
    /// A `--map` of a channel that the log has not got.
    #[error(
        "{}: there is no such channel{}; it has {}",
        given("map", &quoted(flag)),
        clause("likely: ", &likely.join(", ")),
        listed(channels)
    )]
    NoChannel {
        /// The flag.
        flag: String,
        /// Channels that may be meant.
        likely: Vec<String>,
        /// Those that there are.
        channels: Vec<String>,
    },
    /// The time does not change, for want of digits.
    #[error(
        "the time is written with too few digits: it changes by {step} s at the least, and {rows} of {all} rows repeat the one before; \
         write it with more decimals (`%.6f` instead of `%g`)"
    )]
    FewDigits {
        /// The last digit's worth, s.
        step: f64,
        /// Rows that repeat the time before.
        rows: u64,
        /// All.
        all: u64,
    },
    /// One quantity, two columns.
    #[error("named twice ({first} and {second}): leave one out, or rename it {}", with(Argument::Columns))]
    Twice {
        /// The earlier header.
        first: String,
        /// The later header.
        second: String,
    },
    /// A unit that does not fit.
    #[error(
        "the suffix _{suffix} is not a unit of {quantity}: use {fitting}, or rename the column {}",
        with(Argument::Columns)
    )]
    Unit {
        /// The suffix.
        suffix: &'static str,
        /// The quantity.
        quantity: &'static str,
        /// Names that would do.
        fitting: String,
    },
    /// Part of a quaternion.
    #[error("is missing: a reference orientation needs all of ref_qw, ref_qx, ref_qy, ref_qz")]
    PartOfQuaternion,
    /// Part of a rotation matrix.
    #[error("is missing: a rotation matrix needs all nine of ref_r00, ref_r01, … ref_r22")]
    PartOfMatrix,
    /// Text where a number should be.
    #[error("{} is not a number: fix it, or leave the field empty where there is no value", quoted(.0))]
    Text(String),
    /// A row of another length.
    #[error("{found} fields where the header has {wanted}: fix or delete the row{}", whole_rows(*wanted, *commas))]
    Length {
        /// In this row.
        found: usize,
        /// In the header.
        wanted: usize,
        /// Whether commas stand between the fields, and decimal points in the numbers.
        commas: bool,
    },
    /// A line without end.
    #[error("longer than {0} bytes: this is not a row of a log (a missing line break or quotation mark?)")]
    LongLine(usize),
    /// A time that nanoseconds cannot hold.
    #[error(
        "time {} lies more than 292 years from the first row: fix it, or name its unit (`t_ms`, `t_us` or `t_ns`)",
        quoted(.0)
    )]
    TimeRange(String),
    /// Too few rows.
    #[error("only {found} usable rows, at least {wanted} are needed: record a longer log{why}")]
    TooFew {
        /// Usable rows.
        found: usize,
        /// Needed.
        wanted: usize,
        /// What made others unusable.
        why: String,
    },
    /// Many rows of one time.
    #[error(
        "the time of {rows} of {all} rows repeats that of the row before: they were stamped as they arrived, or by a clock that is too \
         coarse; write the sensor's own clock, or a finer one (µs), or count the readings where none is lost"
    )]
    RepeatedTimes {
        /// Rows that repeat the time before.
        rows: u64,
        /// All.
        all: u64,
    },
    /// Too much is faulty.
    #[error("{faulty} of {rows} rows are faulty, more than 10 % ({worst}): fix the recording")]
    TooFaulty {
        /// Faulty rows.
        faulty: u64,
        /// All rows.
        rows: u64,
        /// The most frequent fault.
        worst: String,
    },
    /// Two recordings in one.
    #[error(
        "the time starts again at line {line}: these are two recordings, put each into a file of its own, or let the time of the \
         second go on where the first ends"
    )]
    StartsAgain {
        /// Where the second begins.
        line: u64,
    },
    /// The column map cannot be read.
    #[error("column map {file} cannot be read ({cause}): check the path")]
    MapFile {
        /// The map.
        file: String,
        /// Why.
        cause: io::Error,
    },
    /// The column map is wrong.
    #[error("column map {0}")]
    Map(TomlError),
}

/// What is known of a log that lacks something.
#[derive(Clone, Debug, Default)]
pub struct Known {
    /// What it has.
    pub has: String,
    /// What was taken of it, as flags.
    pub chosen: String,
    /// What may be meant, as flags.
    pub likely: String,
    /// Names that are nearly ours.
    pub near: String,
}

/// How the rows that came whole are kept of a dump that was garbled on its way.
fn whole_rows(fields: usize, commas: bool) -> String {
    if !commas {
        return String::new();
    }
    format!(
        "; where many are garbled, `awk -F, 'NR == 1 || (NF == {fields} && !/[^-+0-9.eEna,\\r]/)' FILE > whole.csv` keeps the whole ones"
    )
}

/// How a file of an archive is named.
fn of_archive(such: &str) -> String {
    match words::voice() {
        Voice::Page => {
            let name = Path::new(such).file_name().unwrap_or_default().to_string_lossy();
            format!("unpack it, and drop {}", quoted(&name))
        }
        Voice::Log | Voice::Stream | Voice::Library => format!("name one of them, such as `{}`", shell_word(such)),
    }
}

/// The first few names of columns or channels.
pub(super) fn listed(headers: &[String]) -> String {
    first_of(headers, "columns")
}

/// The first few of many names, and how many there are of these.
pub(super) fn first_of(names: &[String], these: &str) -> String {
    let mut shown: Vec<String> = names.iter().take(12).map(|name| quoted(name)).collect();
    if names.len() > 12 {
        shown.push(format!("… {} {these} in all", names.len()));
    }
    shown.join(", ")
}

/// A clause of a message, where there is something to say.
fn clause(begins: &str, text: &str) -> String {
    if text.is_empty() { String::new() } else { format!("; {begins}{text}") }
}

/// The Python call that reads this file as a log.
fn function(advice: &Advice) -> String {
    let maps = (!advice.flags.is_empty()).then_some(Argument::Map(&advice.flags));
    let rest = if advice.at_rest {
        Some(Argument::AtRest)
    } else {
        (advice.needs_file || maps.is_none()).then_some(Argument::Reference("REFERENCE.csv"))
    };
    let arguments = maps.into_iter().chain(rest).map(|argument| format!(", {}", argument.typed(Voice::Library)));
    format!("truerate.read(source{})", arguments.collect::<String>())
}

/// The command that was given, with further flags; or a look at what the file holds.
fn again(log: &str, advice: &Advice) -> String {
    if advice.flags.is_empty() && !advice.needs_file && !advice.at_rest {
        return format!("truerate channels {}", shell_word(log));
    }
    let whole = free_name(log);
    let given = |word: &String| shell_word(if word == log && !advice.left_out.is_empty() { &whole } else { word });
    let words: Vec<String> = still_given(words::command(), advice).into_iter().map(given).collect();
    let file = if advice.needs_file { " --reference REFERENCE.csv" } else { "" };
    let rest = if advice.at_rest && words.iter().all(|word| word != "--at-rest") { " --at-rest" } else { "" };
    let flags = if advice.flags.is_empty() {
        String::new()
    } else {
        format!(" {}", Argument::Map(&advice.flags).typed(Voice::Log))
    };
    let command = format!("truerate {}{flags}{file}{rest}", words.join(" "));
    if advice.left_out.is_empty() {
        return command;
    }
    let deleted = |lines: &RangeInclusive<u64>| match (lines.start(), lines.end()) {
        (from, to) if from == to => format!("{from}d"),
        (from, &u64::MAX) => format!("{from},$d"),
        (from, to) => format!("{from},{to}d"),
    };
    let lines: Vec<String> = advice.left_out.iter().map(deleted).collect();
    format!("sed '{}' {} > {} && {command}", lines.join(";"), shell_word(log), shell_word(&whole))
}

/// The words of a command without those in whose place the advice comes: maps of the same channels, and `--at-rest` where a reference is
/// wanted.
fn still_given<'a>(words: &'a [String], advice: &Advice) -> Vec<&'a String> {
    let channel = |flag: &str| unit::channel(flag.split('=').next().unwrap_or_default());
    let advised: Vec<Channel> = advice.flags.iter().filter_map(|flag| channel(flag)).collect();
    let is_advised = |flag: &str| channel(flag).is_some_and(|channel| advised.contains(&channel));
    let mut kept = Vec::new();
    let mut words = words.iter().peekable();
    while let Some(word) = words.next() {
        if word == "--map" && words.peek().is_some_and(|next| is_advised(next)) {
            words.next();
        } else if !(word.strip_prefix("--map=").is_some_and(is_advised) || word == "--at-rest" && advice.needs_file) {
            kept.push(word);
        }
    }
    kept
}

/// The name of a file that is not there yet, for what is left of this one.
fn free_name(log: &str) -> String {
    let file = Path::new(log).file_name().unwrap_or_default().to_string_lossy();
    let names = std::iter::once(format!("whole-{file}")).chain((2..u32::MAX).map(|k| format!("whole-{k}-{file}")));
    names.into_iter().find(|name| !Path::new(name).exists()).unwrap_or_default()
}

impl Problem {
    /// What was found, without what to do.
    #[must_use]
    pub fn found(&self) -> String {
        match self {
            Self::NoHeader { row, .. } => format!("no header above the rows ({row})"),
            Self::Missing { wanted, known } => format!("no column `{wanted}`: the header has {}", known.has),
            Self::NoReference { .. } => "no axis has both a gyro and a reference".to_owned(),
            Self::NoReferenceIn { has, .. } => format!("holds no reference that is clear: it has {has}"),
            Self::Length { found, wanted, .. } => format!("{found} fields where the header has {wanted}"),
            Self::Text(field) => format!("{} is not a number", quoted(field)),
            Self::StartsAgain { line } => format!("the time starts again at line {line}: these are two recordings"),
            Self::Words { columns } => format!("{columns} are raw words of the sensor without a unit"),
            other => other.to_string(),
        }
    }

    /// What a failed read means.
    pub(super) fn reading(error: io::Error, packing: Packing) -> Self {
        match packing {
            Packing::Plain => Self::Read(error),
            Packing::Gzip => Self::Gzip(error),
            Packing::Zstd => Self::Zstd(error),
        }
    }

    /// Nothing of a file of this format can be read.
    pub(super) fn unreadable(format: &dyn Format, cause: Unreadable, packing: Packing) -> Self {
        match cause {
            Unreadable::Read(error) => Self::reading(error, packing),
            cause => Self::Unreadable { format: format.name(), cause },
        }
    }
}

impl LogError {
    /// A problem of this log, at a line (from 1) and a column (number from 1, and name) where they are known.
    #[must_use]
    pub fn new(log: &str, line: Option<u64>, column: Option<(usize, String)>, problem: Problem) -> Self {
        Self(Box::new(Refused { log: log.to_owned(), line, column, problem, advice: None }))
    }

    /// The same with what to do about it; hints that were not tried are left out.
    #[must_use]
    pub(super) fn advised(mut self, advice: Option<Advice>, is_text: bool) -> Self {
        if let (true, Problem::Missing { known, .. } | Problem::NoReference { known, .. }) =
            (is_text, &mut self.0.problem)
        {
            known.likely.clear();
        }
        self.0.advice = advice.or(self.0.advice.take());
        self
    }
}

impl Deref for LogError {
    type Target = Refused;

    fn deref(&self) -> &Refused {
        &self.0
    }
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.log)?;
        if let Some(line) = self.line {
            write!(f, " line {line}")?;
        }
        if let Some((number, name)) = &self.column {
            write!(f, " column {number} ({name})")?;
        }
        match &self.advice {
            None => write!(f, ": {}", self.problem),
            Some(advice) => {
                write!(f, ": {}\n{}", self.problem.found(), advice.why)?;
                match words::voice() {
                    Voice::Library => write!(f, "\n{}", function(advice)),
                    Voice::Log | Voice::Stream => write!(f, "\n{}", again(&self.log, advice)),
                    // The page shows the flags of the advice as a button.
                    Voice::Page => Ok(()),
                }
            }
        }
    }
}

impl std::error::Error for LogError {}
