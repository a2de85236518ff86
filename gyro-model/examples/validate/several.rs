//! Two or three effects at once, each at five times the size that is named half of the time.

use crate::{
    choice::{EFFECTS, alike, is_excited},
    detection::times_found,
    outcome::{Added, Outcome},
    pairs::partners,
    probe::{Probe, scenario},
    run::{Run, Trial},
    table::{Table, share},
};
use gyro_model::{
    Axis, Model,
    diagnose::verdict::SILENT,
    evidence::study::{Bench, Study},
    simulate::{Motion, Scenario, Simulated, simulate},
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::{collections::BTreeMap, error::Error};

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs.
    #[arg(long, default_value_t = 200)]
    draws: u64,
    /// Times the size that is named half of the time.
    #[arg(long, default_value_t = 5.0)]
    times: f64,
}

/// Standard errors within which a parameter should lie.
const SIGMA: f64 = 3.0;

/// A log that hides two or three effects which can be told apart, on a motion of many amplitudes and frequencies.
pub fn draw(seed: u64, times: f64) -> Option<Scenario> {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let motion = if random.random_bool(0.5) {
        Motion::Multisine { travel: random.random_range(4.5..9.0) }
    } else {
        Motion::Drive { rate: random.random_range(0.8..1.8), hold: random.random_range(1.2..3.0) }
    };
    let mut several = scenario("", motion, seed);
    let count = random.random_range(2..=3);
    while several.hidden.len() < count {
        let id = EFFECTS[random.random_range(0..EFFECTS.len())];
        if several.hidden.iter().any(|hidden| alike(id, hidden.effect.card().id)) || !is_excited(id, &several) {
            continue;
        }
        let probe = Probe::new(id, Scenario { hidden: Vec::new(), ..several.clone() });
        several.hidden.push(probe.at(times_found(&probe, times)?));
    }
    Some(several)
}

/// Whether all were found, by their own names, and nothing else.
pub fn is_right(scenario: &Scenario, outcome: &Outcome) -> bool {
    let hidden = |id: &str| scenario.hidden.iter().any(|h| h.effect.card().id == id);
    outcome.added.len() == scenario.hidden.len() && outcome.added.iter().all(|added| hidden(&added.id))
}

/// The same where a partner in a pair of aliases counts, if it was said that it may as well be the right one.
fn is_right_or_ambiguous(scenario: &Scenario, outcome: &Outcome) -> bool {
    let found = |id: &str| {
        let partners = partners(id, scenario.motion);
        let as_well =
            |added: &Added| partners.contains(&added.id.as_str()) && added.aliases.iter().any(|alias| alias == id);
        outcome.added.iter().any(|added| added.id == id || as_well(added))
    };
    outcome.added.len() == scenario.hidden.len() && scenario.hidden.iter().all(|h| found(h.effect.card().id))
}

/// Whether the very model that was simulated leaves enough of the log for a verdict: inside a play or a dead zone, or beyond the
/// range, a reading does not tell the rate.
fn tells_the_rate(simulated: &Simulated, axis: Axis) -> bool {
    let bench = Bench::new(&simulated.record, &[axis], &simulated.truth);
    bench.is_some_and(|bench| Study::held(&bench, &simulated.truth).evaluation.silent() <= SILENT)
}

/// Runs it and prints shares and failures.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), Box<dyn Error>> {
    let mut trials = Vec::new();
    for k in 0..arguments.draws {
        trials.push(Trial { name: k.to_string(), what: run.seed_of(k) });
    }
    let times = arguments.times;
    let results = run.each(trials, |trial, detail| {
        let Some(scenario) = draw(trial.what, times) else { return Ok(None) };
        if detail {
            eprintln!("{:?} on {:?}", scenario.hidden, scenario.motion);
        }
        let simulated = simulate(&scenario);
        let axis = scenario.sensor.axis;
        // A bias is that at the voltage which counts as usual: the same one in the truth and here.
        let start = Model { origin: simulated.truth.origin, ..Model::base_for(&simulated.record) };
        let outcome = Outcome::climb(&simulated.record, &start, axis, detail)?;
        let tells = tells_the_rate(&simulated, axis);
        Ok(Some((scenario, simulated.truth, outcome, tells)))
    })?;
    let (mut right, mut ambiguous, mut told) = (0, 0, (0, 0));
    let mut within: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let (mut failures, mut far) = (Vec::new(), Vec::new());
    for (trial, result) in &results {
        let Some((scenario, truth, outcome, tells)) = result else {
            return Err("detection.csv does not have every effect".into());
        };
        let axis = scenario.sensor.axis;
        let named = is_right_or_ambiguous(scenario, outcome);
        ambiguous += usize::from(named);
        if *tells {
            told = (told.0 + usize::from(named), told.1 + 1);
        }
        if !is_right(scenario, outcome) {
            let hidden: Vec<&str> = scenario.hidden.iter().map(|h| h.effect.card().id).collect();
            failures.push(format!(
                "- `--only {}`, {:?}: hidden {}, found {}",
                trial.name,
                scenario.motion,
                hidden.join(" + "),
                outcome.says()
            ));
            continue;
        }
        right += 1;
        for found in &outcome.ladder.parameters {
            let term = truth.axes[axis.index()].as_ref().and_then(|model| model.term(&found.effect));
            let hidden = term.and_then(|t| t.parameters(axis).find(|(card, ..)| card.name == found.name));
            let (Some((_, hidden, _)), Some(value), Some(std_error)) = (hidden, found.value, found.std_error) else {
                continue;
            };
            let sigmas = (value - hidden) / std_error;
            let name = format!("{}.{}", found.effect, found.name);
            if sigmas.abs() > SIGMA {
                far.push(format!("- `--only {}`: {name} {value:.4e} for {hidden:.4e}, {sigmas:+.1} σ", trial.name));
            }
            let entry = within.entry(name).or_default();
            entry.0 += usize::from(sigmas.abs() <= SIGMA);
            entry.1 += 1;
        }
    }
    println!("All found by their own names and none invented: {}.", share(right, results.len()));
    println!("Or ambiguous with the right name, where a pair of aliases applies: {}.", share(ambiguous, results.len()));
    println!("Of the logs that tell the rate for long enough, the hidden effects known: {}.", share(told.0, told.1));
    let sum = within.values().fold((0, 0), |sum, entry| (sum.0 + entry.0, sum.1 + entry.1));
    println!("Parameters within {SIGMA} standard errors: {}.\n", share(sum.0, sum.1));
    let mut table = Table::new(&["parameter", "within 3 standard errors"]);
    for (name, (near, all)) in within {
        table.row([name, share(near, all)]);
    }
    table.print();
    for line in failures.iter().chain(&far) {
        println!("{line}");
    }
    Ok(())
}
