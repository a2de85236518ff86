//! Which name each effect gets, on three motions, at five times the size that is named half of the time.

use crate::{
    choice::EFFECTS,
    detection::times_found,
    outcome::Outcome,
    pairs::partners,
    picture::{self, Matrix},
    probe::{Probe, scenario},
    run::{Run, Trial},
    table::share,
};
use gyro_model::simulate::{Motion, Scenario, simulate};
use std::{error::Error, path::PathBuf};

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs of each effect and motion.
    #[arg(long, default_value_t = 20)]
    seeds: u64,
    /// Times the size that is named half of the time.
    #[arg(long, default_value_t = 5.0)]
    times: f64,
    /// Draws the confusion matrix to a file.
    #[arg(long)]
    svg: Option<PathBuf>,
}

/// What a log's effect was called.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Called {
    /// One effect, nothing like it.
    One(String),
    /// The right name in a group that this log cannot tell apart.
    AmbiguousWithIt,
    /// Nothing was added.
    Nothing,
    /// More than one was added.
    Several,
}

impl Called {
    /// Of a log in which `id` is hidden.
    pub fn of(id: &str, outcome: &Outcome) -> Self {
        match outcome.added.as_slice() {
            [] => Self::Nothing,
            [one] if one.aliases.is_empty() => Self::One(one.id.clone()),
            [_] if outcome.names(id) => Self::AmbiguousWithIt,
            [one] => Self::One(one.id.clone()),
            _ => Self::Several,
        }
    }

    /// Right where no pair applies: the name and no other. Where one does, `ambiguous` with both is right too.
    pub fn is_right(&self, id: &str, motion: Motion) -> bool {
        match self {
            Self::One(named) => named == id,
            Self::AmbiguousWithIt => !partners(id, motion).is_empty(),
            Self::Nothing | Self::Several => false,
        }
    }

    fn column(&self) -> usize {
        let others = EFFECTS.len();
        match self {
            Self::One(id) => EFFECTS.iter().position(|e| e == id).unwrap_or(others + 2),
            Self::AmbiguousWithIt => others,
            Self::Nothing => others + 1,
            Self::Several => others + 2,
        }
    }
}

/// A multisine, a drive, and the paper's sine where it shows the effect (else a brisker drive).
pub const MOTIONS: [(&str, Motion); 3] = [
    ("multisine", Motion::Multisine { travel: 8.0 }),
    ("drive", Motion::Drive { rate: 1.2, hold: 2.0 }),
    ("sine", Motion::Sine { amplitude: 2.618, frequency: 0.25 }),
];

/// The log of an effect, a motion and a seed.
pub fn hidden_log(id: &str, motion: Motion, seed: u64, times: f64) -> Option<Scenario> {
    let probe = Probe::new(id, scenario(id, motion, seed));
    Some(probe.hide(times_found(&probe, times)?))
}

/// Runs it, prints the shares and draws the matrix.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), Box<dyn Error>> {
    let mut trials = Vec::new();
    for id in EFFECTS {
        for (name, motion) in MOTIONS {
            for k in 0..arguments.seeds {
                trials.push(Trial { name: format!("{id}/{name}/{k}"), what: (id, motion, run.seed_of(k)) });
            }
        }
    }
    let times = arguments.times;
    let results = run.each(trials, |trial, detail| {
        let (id, motion, seed) = trial.what;
        let Some(scenario) = hidden_log(id, motion, seed, times) else { return Ok(None) };
        if detail {
            eprintln!("{:?} on {:?}", scenario.hidden, scenario.motion);
        }
        let outcome = Outcome::of(&simulate(&scenario).record, scenario.sensor.axis, detail)?;
        Ok(Some((scenario, Called::of(id, &outcome), outcome.says())))
    })?;
    let mut columns: Vec<&str> = EFFECTS.to_vec();
    columns.extend(["ambiguous with it", "nothing", "several"]);
    let mut matrix = Matrix::new(&EFFECTS, &columns);
    let [mut plain, mut paired] = [(0, 0); 2];
    let mut wrong = Vec::new();
    for (trial, result) in &results {
        let Some((scenario, called, says)) = result else {
            return Err(format!("detection.csv has no {}", trial.what.0).into());
        };
        let id = trial.what.0;
        matrix.add(EFFECTS.iter().position(|e| *e == id).unwrap_or_default(), called.column());
        let right = called.is_right(id, scenario.motion);
        let group = if partners(id, scenario.motion).is_empty() { &mut plain } else { &mut paired };
        group.0 += usize::from(right);
        group.1 += 1;
        if !right {
            wrong.push(format!("- `--only {}`, {:?}: {says}", trial.name, scenario.hidden[0].values));
        }
    }
    println!("Right where no pair of aliases applies: {}.", share(plain.0, plain.1));
    println!("Right, or ambiguous with the right name, where one does: {}.\n", share(paired.0, paired.1));
    matrix.print();
    for line in wrong {
        println!("{line}");
    }
    if let Some(path) = &arguments.svg {
        picture::draw(&matrix, path)?;
    }
    Ok(())
}
