//! The diagnosis against statistics: how often it invents, how little it needs, how well it tells effects apart.
//!
//! ```text
//! cargo run -p gyro-model --example validate -- STUDY [options]
//! ```
//!
//! | study | asks |
//! | --- | --- |
//! | `false-alarms` | how often is something named where nothing is hidden, noise by noise? |
//! | `detection` | how large must an effect be, beside what an oracle needs? |
//! | `naming` | which name does an effect of five times that size get, on three motions? |
//! | `several` | are two or three effects at once all found, and are their standard errors right? |
//! | `semi-real` | is an effect found that was added to a recorded log? |
//! | `floor` | does the error end on its floor? |
//! | `rules` | which tests of admission decide anything? |
//! | `budget` | what limits a log: told right on set-ups of five kinds? |
//! | `confusion` | what is each effect and each random cause called? |
//! | `standard-errors` | are scale factor and bias as well known as is said? |
//!
//! Each prints Markdown to standard output, its last line the command that made it; progress goes to standard error.
//! `--only NAME` runs one log again and tells every step of its ladder.

mod budget;
#[allow(dead_code)] // truths are written by the generator alone
#[path = "../make_cases/choice.rs"]
mod choice;
mod confusion;
mod detection;
mod false_alarms;
mod floor;
mod log_file;
mod naming;
mod oracle;
mod outcome;
mod pairs;
mod picture;
mod probe;
mod rules;
mod run;
mod semi_real;
mod several;
mod standard_errors;
mod table;

use clap::{Parser, Subcommand};
use std::error::Error;

#[derive(Parser)]
#[command(about = "The diagnosis against statistics")]
struct Cli {
    #[command(flatten)]
    run: run::Run,
    #[command(subcommand)]
    study: Study,
}

#[derive(Subcommand)]
enum Study {
    /// Nothing is hidden: what is named all the same?
    FalseAlarms(false_alarms::Arguments),
    /// The size found half of the time, beside the size that an oracle needs.
    Detection(detection::Arguments),
    /// Which name each effect gets: the confusion matrix.
    Naming(naming::Arguments),
    /// Two or three effects at once.
    Several(several::Arguments),
    /// Effects added to recorded logs.
    SemiReal(semi_real::Arguments),
    /// Error over floor after the ladder.
    Floor(floor::Arguments),
    /// How often each test of admission, and each way to pass it, decides alone.
    Rules(rules::Arguments),
    /// What limits a log, on set-ups of five kinds.
    Budget(budget::Arguments),
    /// What each explanation of an error is called: effects and random causes, on three motions and three references.
    Confusion(confusion::Arguments),
    /// Scale factor and bias of clean logs, in their standard errors.
    StandardErrors(standard_errors::Arguments),
}

fn main() -> Result<(), Box<dyn Error>> {
    let cli = Cli::parse();
    match &cli.study {
        Study::FalseAlarms(arguments) => false_alarms::study(arguments, &cli.run)?,
        Study::Detection(arguments) => detection::study(arguments, &cli.run)?,
        Study::Naming(arguments) => naming::study(arguments, &cli.run)?,
        Study::Several(arguments) => several::study(arguments, &cli.run)?,
        Study::SemiReal(arguments) => semi_real::study(arguments, &cli.run)?,
        Study::Floor(arguments) => floor::study(arguments, &cli.run)?,
        Study::Rules(arguments) => rules::study(arguments, &cli.run)?,
        Study::Budget(arguments) => budget::study(arguments, &cli.run)?,
        Study::Confusion(arguments) => confusion::study(arguments, &cli.run)?,
        Study::StandardErrors(arguments) => standard_errors::study(arguments, &cli.run)?,
    }
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    println!("\n```console\n$ cargo run -p gyro-model --example validate -- {}\n```", arguments.join(" "));
    Ok(())
}
