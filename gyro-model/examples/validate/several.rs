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
    effects::Stage,
    evidence::study::{Bench, Study},
    fit::FitError,
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
    /// Hides a rate hysteresis on drives too, whose held rates then stand anywhere in so small a play.
    #[arg(long)]
    held: bool,
}

/// Standard errors within which a parameter should lie.
const SIGMA: f64 = 3.0;

/// A log that hides two or three effects which can be told apart, on a motion of many amplitudes and frequencies. A hysteresis of
/// such a size is excited by a rate that goes on changing: a drive holds its rates after a last swing that is as small, so that
/// each stands anywhere in the play, and says nothing of what is hidden besides. Only where `held`, it is hidden there too.
pub fn draw(seed: u64, times: f64, held: bool) -> Option<Scenario> {
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
        if id == "rate-hysteresis" && matches!(motion, Motion::Drive { .. }) && !held {
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

/// Standard errors by which the least of the hidden effects stands out of a log, the simulated model fitted with it and without:
/// √(2 Δ ln L). What a limit hides is read off.
fn stands_out(simulated: &Simulated, axis: Axis) -> Option<f64> {
    let bench = Bench::new(&simulated.record, &[axis], &simulated.truth)?;
    let with = Study::fit(&bench, &simulated.truth, None);
    let all = with.identify();
    let terms = &simulated.truth.axes[axis.index()].as_ref()?.terms;
    let is_hidden = |k: &usize| !matches!(terms[*k].effect.stage(), Stage::Calibration | Stage::Reading);
    let rise = |k: usize| {
        let mut model = with.model.clone();
        model.axes[axis.index()].as_mut()?.terms.remove(k);
        let without = Study::fit(&bench, &model, Some(&with.frozen())).identify_near(&all.noise);
        Some(all.log_likelihood - without.log_likelihood)
    };
    let rises: Option<Vec<f64>> = (0..terms.len()).filter(is_hidden).map(rise).collect();
    Some((2.0 * rises?.into_iter().fold(f64::INFINITY, f64::min)).max(0.0).sqrt())
}

/// Where the table of what stands out is divided, in standard errors: what is named half of the time has about 4.5.
const DIVIDED: [f64; 4] = [3.0, 4.5, 9.0, 18.0];

/// Runs it and prints shares and failures.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), Box<dyn Error>> {
    let mut trials = Vec::new();
    for k in 0..arguments.draws {
        trials.push(Trial { name: k.to_string(), what: run.seed_of(k) });
    }
    let Arguments { times, held, .. } = *arguments;
    let results = run.each(trials, |trial, detail| {
        let Some(scenario) = draw(trial.what, times, held) else { return Ok(None) };
        if detail {
            eprintln!("{:?} on {:?}", scenario.hidden, scenario.motion);
        }
        let simulated = simulate(&scenario);
        let axis = scenario.sensor.axis;
        // A bias is that at the voltage which counts as usual: the same one in the truth and here.
        let start = Model { origin: simulated.truth.origin, ..Model::base_for(&simulated.record) };
        let outcome = Outcome::climb(&simulated.record, &start, axis, detail)?;
        let by = stands_out(&simulated, axis).ok_or(FitError::TooShort(axis))?;
        if detail {
            eprintln!("The least hidden effect stands out by {by:.1} standard errors.");
        }
        Ok(Some((scenario, simulated.truth, outcome, by)))
    })?;
    let (mut right, mut ambiguous, mut standing) = (0, 0, [(0, 0); DIVIDED.len() + 1]);
    let mut by_motion = [("multisine", (0, 0)), ("drive", (0, 0))];
    let mut within: BTreeMap<String, (usize, usize)> = BTreeMap::new();
    let (mut failures, mut far) = (Vec::new(), Vec::new());
    for (trial, result) in &results {
        let Some((scenario, truth, outcome, by)) = result else {
            return Err("detection.csv does not have every effect".into());
        };
        let axis = scenario.sensor.axis;
        let named = is_right_or_ambiguous(scenario, outcome);
        ambiguous += usize::from(named);
        let part = &mut standing[DIVIDED.partition_point(|from| from <= by)];
        *part = (part.0 + usize::from(named), part.1 + 1);
        let (_, on_motion) = &mut by_motion[usize::from(matches!(scenario.motion, Motion::Drive { .. }))];
        *on_motion = (on_motion.0 + usize::from(named), on_motion.1 + 1);
        if !is_right(scenario, outcome) {
            let hidden: Vec<&str> = scenario.hidden.iter().map(|h| h.effect.card().id).collect();
            failures.push(format!(
                "- `--only {}`, {:?}: hidden {}, the least {by:.1} σ, found {}",
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
    for (motion, (right, all)) in by_motion {
        println!("Of those on a {motion}: {}.", share(right, all));
    }
    let sum = within.values().fold((0, 0), |sum, entry| (sum.0 + entry.0, sum.1 + entry.1));
    println!("Parameters within {SIGMA} standard errors: {}.\n", share(sum.0, sum.1));
    let mut table = Table::new(&["the least effect stands out by", "right or ambiguous"]);
    for (k, (right, all)) in standing.into_iter().enumerate() {
        let from = k.checked_sub(1).map_or(0.0, |k| DIVIDED[k]);
        let to = DIVIDED.get(k).map_or_else(|| "more".to_owned(), |to| format!("{to} σ"));
        table.row([format!("{from} to {to}"), share(right, all)]);
    }
    table.print();
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
