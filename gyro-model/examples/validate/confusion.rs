//! What each explanation of an error is called: effects of the catalogue and random causes, each hidden alone at its typical size and
//! at a third of it, on three motions and three kinds of reference; or the commonest in pairs.

use crate::{
    outcome::Outcome,
    run::{Run, Trial},
    table::{Table, share},
};
use gyro_model::{
    Axis, Record,
    diagnosis::{ErrorPoint, LimitedBy, Verdict},
    effects::{CATALOGUE, Need, Stage, are_aliases},
    fit::FitError,
    simulate::{Hidden, Motion, RandomCauses, Reference, Scenario, SensorSpec, SetUp, Simulator},
};
use itertools::Itertools;
use std::collections::BTreeMap;

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs of each explanation, size, motion and reference.
    #[arg(long, default_value_t = 1)]
    seeds: u64,
    /// Length of a log, s.
    #[arg(long, default_value_t = 90.0)]
    seconds: f64,
    /// References: some of encoder, rate, orientation.
    #[arg(long, value_delimiter = ',', default_value = "encoder,rate,orientation")]
    references: Vec<String>,
    /// Motions: some of multisine, drive, rate-table.
    #[arg(long, value_delimiter = ',', default_value = "multisine,drive,rate-table")]
    motions: Vec<String>,
    /// Sizes, over the typical one.
    #[arg(long, value_delimiter = ',', default_value = "1,0.3333")]
    sizes: Vec<f64>,
    /// Hides each pair of the commonest explanations in place of each one alone.
    #[arg(long)]
    pairs: bool,
}

/// The commonest explanations, effects and random causes.
const COMMONEST: [&str; 10] = [
    "delay",
    "cross-axis",
    "scale-asymmetry",
    "cubic-nonlinearity",
    "temperature-bias",
    "bias-step",
    "vibration-tone",
    "encoder-eccentricity",
    "reversal-steps",
    "random-scale",
];

const MOTIONS: [(&str, Motion); 3] = [
    ("multisine", Motion::Multisine { travel: 8.0 }),
    ("drive", Motion::Drive { rate: 1.2, hold: 2.0 }),
    ("rate-table", Motion::RateTable { rate: 2.0, hold: 4.0 }),
];

/// One log: what is hidden, and in what.
#[derive(Clone)]
struct Log {
    /// Ids; none where nothing is hidden.
    hidden: Vec<&'static str>,
    size: f64,
    motion: Motion,
    reference: &'static str,
    seed: u64,
}

/// What a log's explanation was called.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Called {
    /// By its own name and no other; of a pair both.
    Right,
    /// Ambiguous with it, or by an alias of the catalogue.
    Alike,
    /// One of a pair by its own name or an alias, and nothing else.
    Half,
    /// Nothing was named, and what is hidden makes the error hardly larger: this log cannot show it.
    Hidden,
    /// Nothing was named: adequate or cannot-tell.
    Nothing,
    /// Nothing was named, and the error has no known cause.
    Unexplained,
    /// Something that is not there.
    Wrong,
}

/// How a name that was given stands to one that is hidden.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Named {
    Own,
    Alike,
    Not,
}

/// The size of a random cause that is typical; `None` for effects.
fn typical_random(id: &str) -> Option<f64> {
    RandomCauses::TYPICAL.iter().find(|(_, own, _)| *own == id).map(|(_, _, typical)| *typical)
}

impl Log {
    fn record(&self, seconds: f64) -> Option<(Record, Axis)> {
        let mut sensor = SensorSpec::random(self.seed);
        let axis = sensor.axis;
        sensor.reference = match self.reference {
            "rate" => Reference::Rate,
            "orientation" => Reference::Quaternion,
            _ => SensorSpec::on(axis).reference,
        };
        sensor.reference_every = 1;
        let mut set_up = SetUp::default();
        let mut hidden = Vec::new();
        for id in &self.hidden {
            if let Some(typical) = typical_random(id) {
                set_up.random.take(&format!("{id}:size={}", self.size * typical))?.ok()?;
                continue;
            }
            let effect = gyro_model::effects::find(id)?;
            if effect.stage() == Stage::Reference && self.reference != "encoder" {
                return None;
            }
            hidden.push(Hidden::typical(effect, axis).scaled(self.size, axis));
        }
        let scenario = Scenario { motion: self.motion, seed: self.seed, rate_hz: 100.0, seconds, sensor, hidden };
        let samples: Vec<_> = Simulator::new(&scenario).take((seconds * 100.0) as usize).collect();
        Some((Record { rows: set_up.applied(&samples, axis, 100.0, self.seed), ..Record::default() }, axis))
    }

    fn called(&self, outcome: &Outcome) -> Called {
        let name = |cause: &LimitedBy| cause.words().replace(' ', "-");
        let mut open = self.hidden.clone();
        let mut take = |named: &dyn Fn(&str) -> Named| {
            let best = open.iter().position(|id| named(id) == Named::Own);
            let best = best.or_else(|| open.iter().position(|id| named(id) == Named::Alike))?;
            Some(named(open.swap_remove(best)))
        };
        let mut each: Vec<Option<Named>> = outcome
            .added
            .iter()
            .map(|added| {
                take(&|id| {
                    let may_be = added.aliases.iter().any(|alias| alias == id) || are_aliases(&added.id, id);
                    if added.id == id && added.aliases.is_empty() {
                        Named::Own
                    } else if added.id == id || may_be {
                        Named::Alike
                    } else {
                        Named::Not
                    }
                })
            })
            .collect();
        each.extend(outcome.ladder.random.iter().map(|found| {
            take(&|id| {
                if name(&found.cause) == id && found.aliases.is_empty() {
                    Named::Own
                } else if name(&found.cause) == id || found.aliases.iter().any(|alias| name(alias) == id) {
                    Named::Alike
                } else {
                    Named::Not
                }
            })
        }));
        let nothing = each.is_empty();
        let doubted = |id: &str| {
            if nothing && outcome.doubts().is_some_and(|own| own == id || are_aliases(own, id)) {
                Named::Alike
            } else {
                Named::Not
            }
        };
        each.extend(take(&doubted).map(Some));
        if each.contains(&None) {
            return Called::Wrong;
        }
        match (each.len(), open.len()) {
            (0, _) if outcome.ladder.verdict == Verdict::Unexplained => Called::Unexplained,
            (0, _) => Called::Nothing,
            (_, 1..) => Called::Half,
            _ if each.contains(&Some(Named::Alike)) => Called::Alike,
            _ => Called::Right,
        }
    }
}

const NOTHING: &str = "nothing";
/// A hidden cause that makes the error over no averaging time larger than this, over that of the same log without it, is hidden too well.
const SEEN: f64 = 1.05;

/// The same where something hidden was not named and the log cannot show it.
fn seen(called: Called, log: &Log, outcome: &Outcome, seconds: f64) -> Result<Called, FitError> {
    if called != Called::Nothing || log.hidden.is_empty() {
        return Ok(called);
    }
    let clean = Log { hidden: Vec::new(), ..log.clone() };
    let Some((record, axis)) = clean.record(seconds) else { return Ok(called) };
    let clean = Outcome::of(&record, axis, false)?;
    let larger = |(with, without): (&ErrorPoint, &ErrorPoint)| match (with.error, without.error) {
        (Some(with), Some(without)) => with > SEEN * without,
        _ => false,
    };
    let shows = outcome.error_curve().iter().zip(clean.error_curve()).any(larger);
    Ok(if shows { called } else { Called::Hidden })
}

/// What is hidden, log by log: nothing and each explanation alone, or each pair of the commonest.
fn hidden(pairs: bool) -> Vec<Vec<&'static str>> {
    if pairs {
        return COMMONEST.into_iter().tuple_combinations().map(|(a, b)| vec![a, b]).collect();
    }
    let is_seen = |needs: &[Need]| needs.iter().all(|need| !matches!(need, Need::Gyro(_)));
    let effects = CATALOGUE.iter().map(|effect| (effect.stage(), effect.card()));
    let effects = effects.filter(|(stage, card)| *stage != Stage::Calibration && is_seen(card.needs));
    let random = RandomCauses::TYPICAL.iter().map(|(_, id, _)| *id);
    std::iter::once(Vec::new()).chain(effects.map(|(_, card)| card.id).chain(random).map(|id| vec![id])).collect()
}

/// Runs it and prints a row for each explanation.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), FitError> {
    let all = hidden(arguments.pairs);
    let name_of = |hidden: &[&str]| if hidden.is_empty() { NOTHING.to_owned() } else { hidden.join("+") };
    let wanted = |list: &[String], name: &str| list.iter().any(|own| own == name);
    let mut trials = Vec::new();
    for hidden in &all {
        for &size in if hidden.is_empty() { &[1.0][..] } else { &arguments.sizes[..] } {
            for (motion_name, motion) in MOTIONS.into_iter().filter(|(name, _)| wanted(&arguments.motions, name)) {
                for reference in
                    ["encoder", "rate", "orientation"].into_iter().filter(|r| wanted(&arguments.references, r))
                {
                    for k in 0..arguments.seeds {
                        let name = format!("{}/{size:.2}/{motion_name}/{reference}/{k}", name_of(hidden));
                        let (hidden, seed) = (hidden.clone(), run.seed_of(k));
                        trials.push(Trial { name, what: Log { hidden, size, motion, reference, seed } });
                    }
                }
            }
        }
    }
    let results = run.each(trials, |trial, detail| {
        let Some((record, axis)) = trial.what.record(arguments.seconds) else { return Ok(None) };
        let outcome = Outcome::of(&record, axis, detail)?;
        let random: Vec<&str> = outcome.ladder.random.iter().map(|found| found.cause.words()).collect();
        let says = [outcome.says(), random.join(", ")].into_iter().filter(|text| !text.is_empty()).collect::<Vec<_>>();
        if detail {
            for found in &outcome.ladder.random {
                eprintln!(
                    "{} ± {} {}: {}",
                    found.size.unwrap_or(0.0),
                    found.std_error.unwrap_or(0.0),
                    found.unit,
                    found.says
                );
            }
            eprintln!("{} ({:?})", outcome.ladder.says, outcome.ladder.limited_by);
        }
        let called = seen(trial.what.called(&outcome), &trial.what, &outcome, arguments.seconds)?;
        Ok(Some((called, says.join("; "))))
    })?;
    let mut table = Table::new(&[
        "hidden",
        "logs",
        "its own name",
        "or alike",
        "one of two",
        "too small to show",
        "nothing named",
        "unexplained",
        "wrong name",
        "which",
    ]);
    let mut totals = [0; 8];
    for hidden in all {
        let own = results.iter().filter(|(trial, _)| trial.what.hidden == hidden);
        let own: Vec<_> = own.filter_map(|(_, result)| result.as_ref()).collect();
        if own.is_empty() {
            continue;
        }
        let count = |called: Called| own.iter().filter(|(own, _)| *own == called).count();
        let counts = [
            Called::Right,
            Called::Alike,
            Called::Half,
            Called::Hidden,
            Called::Nothing,
            Called::Unexplained,
            Called::Wrong,
        ]
        .map(count);
        let mut wrong: BTreeMap<&str, usize> = BTreeMap::new();
        for (called, says) in &own {
            if *called == Called::Wrong {
                *wrong.entry(says.as_str()).or_default() += 1;
            }
        }
        let wrong: Vec<String> = wrong.into_iter().map(|(says, n)| format!("{says} ({n})")).collect();
        totals.iter_mut().zip(std::iter::once(own.len()).chain(counts)).for_each(|(total, n)| *total += n);
        let counts = std::iter::once(own.len()).chain(counts).map(|n| n.to_string());
        table.row(std::iter::once(name_of(&hidden)).chain(counts).chain([wrong.join("; ")]));
    }
    let all = totals[0];
    let shares = totals[1..].iter().map(|n| share(*n, all));
    table.row(["all".to_owned(), all.to_string()].into_iter().chain(shares).chain([String::new()]));
    table.print();
    Ok(())
}
