//! `truerate control`: changes the model of a running pipeline.

use clap::Subcommand;
use gyro_model::Axis;
use std::path::PathBuf;

/// What `truerate control` takes.
#[derive(clap::Args, Debug, Clone)]
#[command(after_long_help = "\
Examples:
  truerate control add g-sensitivity --axis z
  truerate control undo
  truerate control save model.toml
  truerate control hide delay:d=0.012")]
pub struct Args {
    /// What to change
    #[command(subcommand)]
    pub request: Request,
    /// The pipeline that is meant
    #[arg(long, value_name = "NAME", default_value = "default", global = true)]
    pub instance: String,
}

/// A change to a running pipeline.
#[derive(Subcommand, Debug, Clone)]
pub enum Request {
    /// Add an effect to the model of one axis
    Add {
        /// Effect id
        effect: String,
        /// The axis
        #[arg(long, value_name = "x|y|z")]
        axis: Axis,
        /// A model file with the `[effect.NAME]` section of a user's own effect
        #[arg(long, value_name = "F")]
        file: Option<PathBuf>,
    },
    /// Take an effect out of the model of one axis
    Remove {
        /// Effect id
        effect: String,
        /// The axis
        #[arg(long, value_name = "x|y|z")]
        axis: Axis,
    },
    /// Return to the model before the last change
    Undo,
    /// Stop learning
    Pause,
    /// Go on learning
    Resume,
    /// Forget what was learned from the samples so far
    Forget,
    /// Save the model to a file
    Save {
        /// The model file to write
        #[arg(value_name = "F")]
        file: PathBuf,
    },
    /// Switch an effect on in the simulated or replayed source
    Hide {
        /// The effect, at its typical size or with these values
        #[arg(value_name = "ID[:NAME=VALUE,…]")]
        effect: String,
    },
}
