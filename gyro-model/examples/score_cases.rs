//! Scores the ladder on the diagnosis benchmark's cases without writing them to files.
//!
//! ```text
//! cargo run -p gyro-model --example score_cases -- [--count 36] [--seed 1] [--only K]
//! ```
//!
//! An effect that was hidden and stands in the final model counts in full, one that stands among the printed aliases of
//! what was added instead counts half, anything else in the model is invented.

#[path = "make_cases/choice.rs"]
mod choice;

use choice::Case;
use clap::Parser;
use gyro_model::{
    Axis, Model, Record,
    diagnose::{Options, diagnose, ladder},
    diagnosis::AxisResult,
    simulate::simulate,
    words::Voice,
};
use std::{error::Error, time::Instant};

#[derive(Parser)]
#[command(about = "Scores the ladder on the cases that make_cases writes")]
struct Arguments {
    /// Cases.
    #[arg(long, default_value_t = 36)]
    count: u64,
    /// Of everything random.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only this case, told in detail.
    #[arg(long)]
    only: Option<u64>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let Arguments { count, seed, only } = Arguments::parse();
    let (mut wanted, mut named, mut halves, mut invented, mut clean) = (0, 0, 0, 0, (0, 0));
    for k in (0..count).filter(|k| only.is_none_or(|only| only == *k)) {
        let case = Case::random(choice::seed_of(seed, k));
        let axis = case.scenario.sensor.axis;
        let simulated = simulate(&case.scenario);
        let began = Instant::now();
        let start = Model::base_for(&simulated.record);
        let (_, ladders) = ladder(&simulated.record, &start, &[axis], &Options::default())?;
        let hidden: Vec<&str> = case.scenario.hidden.iter().map(|h| h.effect.card().id).collect();
        let score = Score::of(&hidden, &ladders[0]);
        if only.is_some() {
            tell(&simulated.record, axis, &ladders[0])?;
        }
        wanted += hidden.len();
        named += score.named;
        halves += score.halves;
        invented += score.invented.len();
        clean.0 += usize::from(hidden.is_empty() && score.invented.is_empty());
        clean.1 += usize::from(hidden.is_empty());
        let mark = if score.named == hidden.len() && score.invented.is_empty() { ' ' } else { '*' };
        println!("{mark}{k:3} {}", case.truth());
        println!("     {:?} {:?}  {:.1} s", ladders[0].verdict, score.found, began.elapsed().as_secs_f64());
    }
    println!(
        "named {named} + {halves} halves of {wanted}, invented {invented}, clean logs left alone {} of {}",
        clean.0, clean.1
    );
    Ok(())
}

/// The diagnosis of the base model, and the ladder's steps.
fn tell(record: &Record, axis: Axis, ladder: &AxisResult) -> Result<(), Box<dyn Error>> {
    let start = Model::base_for(record);
    for diagnosis in
        diagnose(record, &start, &[axis], &Options { progress: &|line| eprintln!("{line}"), ..Options::default() })?
    {
        println!("{:?}: {}", diagnosis.verdict, diagnosis.in_words(Voice::Log));
        for s in &diagnosis.suspects {
            let values: Vec<_> = s.parameters.iter().map(|p| (p.name.as_str(), p.value)).collect();
            println!("  {} fall {:?} p {:?} aliases {:?} {values:?}", s.effect, s.error_fall, s.p_value, s.aliases);
        }
    }
    for step in &ladder.steps {
        println!(
            "  step +{:?} -{:?} {:?} error/floor {:?}",
            step.added, step.removed, step.aliases, step.error_over_floor
        );
    }
    println!("{:?}: {}", ladder.verdict, ladder.in_words(Voice::Log));
    Ok(())
}

struct Score {
    found: Vec<String>,
    named: usize,
    halves: usize,
    invented: Vec<String>,
}

impl Score {
    fn of(hidden: &[&str], ladder: &AxisResult) -> Self {
        let found: Vec<String> =
            ladder.effects.iter().filter(|e| !["scale-factor", "bias"].contains(&e.as_str())).cloned().collect();
        let (right, wrong): (Vec<_>, Vec<_>) = found.iter().cloned().partition(|e| hidden.contains(&e.as_str()));
        let mut left: Vec<&str> = hidden.iter().copied().filter(|h| !right.iter().any(|r| r == h)).collect();
        let mut invented = wrong;
        invented.retain(|effect| {
            let step = ladder.steps.iter().find(|step| step.added.as_ref() == Some(effect));
            let twin = left.iter().position(|h| step.is_some_and(|step| step.aliases.iter().any(|a| a == h)));
            twin.map(|twin| left.remove(twin)).is_none()
        });
        let halves = hidden.len() - right.len() - left.len();
        Self { found, named: right.len(), halves, invented }
    }
}
