//! What each explanation of an error is called: effects of the catalogue and random causes, each hidden alone at its typical size and
//! at a third of it, on three motions and three kinds of reference.

use crate::{
    outcome::Outcome,
    run::{Run, Trial},
    table::{Table, share},
};
use gyro_model::{
    Axis, Record,
    diagnosis::{ErrorPoint, Verdict},
    effects::{CATALOGUE, Need, Stage, are_aliases},
    fit::FitError,
    simulate::{Hidden, Motion, RandomCauses, Reference, Scenario, SensorSpec, SetUp, Simulator},
};
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
}

const MOTIONS: [(&str, Motion); 3] = [
    ("multisine", Motion::Multisine { travel: 8.0 }),
    ("drive", Motion::Drive { rate: 1.2, hold: 2.0 }),
    ("rate-table", Motion::RateTable { rate: 2.0, hold: 4.0 }),
];

/// One log: what is hidden, and in what.
#[derive(Clone)]
struct Log {
    /// `nothing`, or an id.
    id: &'static str,
    size: f64,
    motion: Motion,
    reference: &'static str,
    seed: u64,
}

/// What a log's explanation was called.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Called {
    /// By its own name and no other.
    Right,
    /// Ambiguous with it, or by an alias of the catalogue.
    Alike,
    /// Nothing was named, and what is hidden makes the error hardly larger: this log cannot show it.
    Hidden,
    /// Nothing was named: adequate or cannot-tell.
    Nothing,
    /// Nothing was named, and the error has no known cause.
    Unexplained,
    /// Something that is not there.
    Wrong,
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
        let is_random = RandomCauses::TYPICAL.iter().find(|(_, id, _)| *id == self.id);
        if let Some((_, id, typical)) = is_random {
            set_up.random.take(&format!("{id}:size={}", self.size * typical))?.ok()?;
        } else if self.id != NOTHING {
            let effect = gyro_model::effects::find(self.id)?;
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
        let random: Vec<String> =
            outcome.ladder.random.iter().map(|found| found.cause.words().replace(' ', "-")).collect();
        let is_random = RandomCauses::TYPICAL.iter().any(|(_, id, _)| *id == self.id);
        let ids: Vec<&str> = outcome.added.iter().map(|added| added.id.as_str()).collect();
        let is_named = if is_random { random.iter().any(|id| id == self.id) } else { ids.contains(&self.id) };
        let others =
            ids.iter().filter(|id| **id != self.id).count() + random.iter().filter(|id| *id != self.id).count();
        match (is_named, others) {
            (true, 0) if outcome.added.iter().all(|added| added.aliases.is_empty()) => Called::Right,
            (true, 0) => Called::Alike,
            (false, 0) if outcome.ladder.verdict == Verdict::Unexplained => Called::Unexplained,
            (false, 0) if outcome.doubts().is_some_and(|id| id == self.id || are_aliases(id, self.id)) => Called::Alike,
            (false, 0) => Called::Nothing,
            (false, 1) if outcome.names(self.id) || ids.first().is_some_and(|id| are_aliases(id, self.id)) => {
                Called::Alike
            }
            _ => Called::Wrong,
        }
    }
}

const NOTHING: &str = "nothing";
/// A hidden cause that makes the error over no averaging time larger than this, over that of the same log without it, is hidden too well.
const SEEN: f64 = 1.05;

/// The same where nothing was named and the log cannot show what is hidden.
fn seen(called: Called, log: &Log, outcome: &Outcome, seconds: f64) -> Result<Called, FitError> {
    let clean = Log { id: NOTHING, ..log.clone() };
    let Some((record, axis)) = clean.record(seconds).filter(|_| called == Called::Nothing && log.id != NOTHING) else {
        return Ok(called);
    };
    let clean = Outcome::of(&record, axis, false)?;
    let larger = |(with, without): (&ErrorPoint, &ErrorPoint)| match (with.error, without.error) {
        (Some(with), Some(without)) => with > SEEN * without,
        _ => false,
    };
    let shows = outcome.error_curve().iter().zip(clean.error_curve()).any(larger);
    Ok(if shows { called } else { Called::Hidden })
}

/// Runs it and prints a row for each explanation.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), FitError> {
    let limits = |needs: &[Need]| needs.iter().all(|need| !matches!(need, Need::Gyro(_)));
    let effects = CATALOGUE.iter().filter(|effect| effect.stage() != Stage::Calibration && limits(effect.card().needs));
    let random = RandomCauses::TYPICAL.iter().map(|(_, id, _)| *id);
    let ids: Vec<&'static str> =
        std::iter::once(NOTHING).chain(effects.map(|effect| effect.card().id)).chain(random).collect();
    let wanted = |list: &[String], name: &str| list.iter().any(|own| own == name);
    let mut trials = Vec::new();
    for &id in &ids {
        for &size in if id == NOTHING { &[1.0][..] } else { &arguments.sizes[..] } {
            for (motion_name, motion) in MOTIONS.into_iter().filter(|(name, _)| wanted(&arguments.motions, name)) {
                for reference in
                    ["encoder", "rate", "orientation"].into_iter().filter(|r| wanted(&arguments.references, r))
                {
                    for k in 0..arguments.seeds {
                        let name = format!("{id}/{size:.2}/{motion_name}/{reference}/{k}");
                        trials.push(Trial { name, what: Log { id, size, motion, reference, seed: run.seed_of(k) } });
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
        "too small to show",
        "nothing named",
        "unexplained",
        "wrong name",
        "which",
    ]);
    let mut totals = [0; 7];
    for id in ids {
        let own: Vec<_> =
            results.iter().filter(|(trial, _)| trial.what.id == id).filter_map(|(_, result)| result.as_ref()).collect();
        if own.is_empty() {
            continue;
        }
        let count = |called: Called| own.iter().filter(|(own, _)| *own == called).count();
        let counts =
            [Called::Right, Called::Alike, Called::Hidden, Called::Nothing, Called::Unexplained, Called::Wrong]
                .map(count);
        let mut wrong: BTreeMap<&str, usize> = BTreeMap::new();
        for (called, says) in &own {
            if *called == Called::Wrong {
                *wrong.entry(says.as_str()).or_default() += 1;
            }
        }
        let wrong: Vec<String> = wrong.into_iter().map(|(says, n)| format!("{says} ({n})")).collect();
        totals.iter_mut().zip(std::iter::once(own.len()).chain(counts)).for_each(|(total, n)| *total += n);
        let [right, alike, hidden, nothing, unexplained, bad] = counts.map(|n| n.to_string());
        table.row([
            id.to_owned(),
            own.len().to_string(),
            right,
            alike,
            hidden,
            nothing,
            unexplained,
            bad,
            wrong.join("; "),
        ]);
    }
    let [all, right, alike, hidden, nothing, unexplained, wrong] = totals;
    let share = |n: usize| share(n, all);
    table.row([
        "all".to_owned(),
        all.to_string(),
        share(right),
        share(alike),
        share(hidden),
        share(nothing),
        share(unexplained),
        share(wrong),
        String::new(),
    ]);
    table.print();
    Ok(())
}
