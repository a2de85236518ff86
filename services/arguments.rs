//! The flags that several commands share.

use clap::ValueEnum;
use gyro_model::Axis;
use std::path::{Path, PathBuf};
use workbench::{log::Options, report::Format};

/// Which log, and how to read it.
#[derive(clap::Args, Debug, Clone)]
pub struct LogArgs {
    /// The log: CSV or other text, ULog, MCAP, Parquet, …, plain, .gz or .zst, the folder of a ROS 2 bag, or `-` for standard input
    #[arg(value_name = "LOG")]
    pub log: PathBuf,
    #[command(flatten)]
    pub(crate) names: NameArgs,
    /// Use the reference although it was computed from this very gyro
    #[arg(long)]
    pub reference_is_dependent: bool,
    /// An axis without a reference did not turn, because the sensor was at rest or on a turntable of another axis: it is judged against zero rate
    #[arg(long)]
    pub at_rest: bool,
}

/// Which logs, and how to read them.
#[derive(clap::Args, Debug, Clone)]
pub struct LogsArgs {
    /// The log: CSV or other text, ULog, MCAP, …, plain, .gz or .zst, the folder of a ROS 2 bag, or `-` for standard input;
    /// several are logs of one sensor: one model for all, each with its own zero and reference
    #[arg(value_name = "LOG", required = true, num_args = 1..)]
    pub logs: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) names: NameArgs,
    /// Use the reference although it was computed from this very gyro
    #[arg(long)]
    pub reference_is_dependent: bool,
    /// An axis without a reference did not turn, because the sensor was at rest or on a turntable of another axis: it is judged against zero rate
    #[arg(long)]
    pub at_rest: bool,
}

impl LogsArgs {
    /// The first log, with how it is read.
    #[must_use]
    pub fn first(&self) -> LogArgs {
        LogArgs {
            log: self.logs.first().cloned().unwrap_or_default(),
            names: self.names.clone(),
            reference_is_dependent: self.reference_is_dependent,
            at_rest: self.at_rest,
        }
    }

    /// Whether there is more than one.
    #[must_use]
    pub fn are_several(&self) -> bool {
        self.logs.len() > 1
    }

    /// All of them, as files.
    #[must_use]
    pub fn paths(&self) -> Vec<&Path> {
        self.logs.iter().map(PathBuf::as_path).collect()
    }
}

/// Which channels of a log are meant.
#[derive(clap::Args, Debug, Clone, Default)]
pub struct NameArgs {
    /// A TOML file that renames foreign headers: lines such as `"IMU gz (deg/s)" = "gyro_z_dps"`
    #[arg(long, value_name = "F")]
    pub columns: Option<PathBuf>,
    /// Take this channel under this name: `gyro_z=imu.gz`, `gyro_z_dps=0.1*raw_z+2`, `ref_q=/mocap.pose.orientation`; may
    /// be given several times (`truerate channels LOG` lists the channels)
    #[arg(long, value_name = "NAME=CHANNEL")]
    pub map: Vec<String>,
    /// Take the reference from this second file, joined in time; it may have a clock of its own. Live: from this address
    #[arg(long, value_name = "FILE")]
    pub reference: Option<PathBuf>,
    /// A DBC file, which says what the frames of a CAN log (candump, Vector ASC) mean: each signal becomes a channel
    /// MESSAGE.SIGNAL, in the unit that the file gives it
    #[arg(long, value_name = "FILE.dbc")]
    pub dbc: Option<PathBuf>,
}

impl NameArgs {
    /// How a log is to be read.
    #[must_use]
    pub fn options(&self) -> Options {
        Options {
            columns: self.columns.clone(),
            map: self.map.clone(),
            reference: self.reference.clone(),
            dbc: self.dbc.clone(),
            ..Options::default()
        }
    }

    /// The flags as they were given.
    #[must_use]
    pub fn flags(&self) -> Vec<String> {
        let path = |flag: &str, path: &PathBuf| [flag.to_owned(), path.display().to_string()];
        let mut flags: Vec<String> = self.columns.iter().flat_map(|columns| path("--columns", columns)).collect();
        flags.extend(self.map.iter().flat_map(|map| ["--map".to_owned(), map.clone()]));
        flags.extend(self.reference.iter().flat_map(|file| path("--reference", file)));
        flags.extend(self.dbc.iter().flat_map(|file| path("--dbc", file)));
        flags
    }
}

/// How much is said of each suspect.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Explain {
    /// A sentence
    Plain,
    /// Each test, with its number and its threshold
    Full,
}

/// What a fit starts from, and on which axis.
#[derive(clap::Args, Debug, Clone)]
pub struct StartArgs {
    /// The model to start from; without it the base model
    #[arg(long, value_name = "M")]
    pub model: Option<PathBuf>,
    /// Start from a type, as `truerate fleet F --export` writes it (FILE:TYPE where it holds several): a new part then needs
    /// seconds; a value that differs from the type's is reported, and not pulled to it
    #[arg(long, value_name = "type.toml", conflicts_with = "model")]
    pub prior: Option<PathBuf>,
    /// Only this axis
    #[arg(long, value_name = "x|y|z")]
    pub axis: Option<Axis>,
}

/// How a search is run.
#[derive(clap::Args, Debug, Clone)]
pub struct SearchArgs {
    /// Say of each suspect why it was named, or was not; `--explain full`: each test, with its number and its threshold
    #[arg(long, value_enum, value_name = "full", num_args = 0..=1, require_equals = true, default_missing_value = "plain")]
    pub explain: Option<Explain>,
    /// Stop the search after so many seconds and give the best so far, marked as unfinished; Ctrl-C does the same
    #[arg(long, value_name = "SECONDS")]
    pub budget: Option<f64>,
}

/// How a result is printed.
#[derive(clap::Args, Debug, Clone)]
pub struct ReportArgs {
    /// What is printed to standard output
    #[arg(long, value_enum, default_value_t)]
    pub format: Format,
    /// Also write the report to this file; its ending (.txt, .json, .html) says in which form
    #[arg(long, value_name = "F")]
    pub report: Option<PathBuf>,
    /// Show the report in a browser: the file of `--report`, if that is HTML, or a temporary one
    #[arg(long)]
    pub open: bool,
}

/// The axes that `--axis` picks: that one, or all of the given.
#[must_use]
pub fn picked(axis: Option<Axis>, all: &[Axis]) -> Vec<Axis> {
    axis.map_or_else(|| all.to_vec(), |axis| vec![axis])
}
