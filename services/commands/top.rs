//! `truerate top`: what runs, and every stage's latency, live in the terminal.

/// What `truerate top` takes.
#[derive(clap::Args, Debug, Clone)]
pub struct Args {
    /// The pipeline that is meant
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}
