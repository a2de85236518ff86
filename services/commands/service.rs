//! `truerate service NAME`: one process of the pipeline; what `truerate run` and the unit files start.

/// What `truerate service` takes.
#[derive(clap::Args, Debug, Clone)]
pub struct Args {
    /// Which process
    #[arg(value_name = "NAME")]
    pub name: String,
    /// The pipeline that it belongs to
    #[arg(long, value_name = "NAME", default_value = "default")]
    pub instance: String,
}
