//! Which tests of admission decide anything: how often each alone refuses a suspect, and each of its ways alone lets one in.
//!
//! A test, or a way to pass one, that never decides alone changes no verdict of these logs by being taken out.

use crate::{
    choice::Case,
    false_alarms::Kind,
    run::{Run, Trial},
    table::Table,
};
use gyro_model::{
    Axis, Model,
    diagnose::{Options, ladder},
    diagnosis::{Explained, Relation, TestCondition, TestName, TestOutcome},
    fit::FitError,
    simulate::{Scenario, simulate},
};
use std::{collections::BTreeMap, sync::Mutex};

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs with random effects, and half as many without any.
    #[arg(long, default_value_t = 60)]
    logs: u64,
}

/// A way, in words; empty for its test.
type Key = (TestName, String);

/// How often something was asked, and decided alone.
#[derive(Clone, Copy, Default)]
struct Count {
    asked: usize,
    alone: usize,
}

/// Runs it and prints the table.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), FitError> {
    let with =
        (0..arguments.logs).map(|k| Trial { name: format!("hidden/{k}"), what: Case::random(run.seed_of(k)).scenario });
    let without = (0..arguments.logs / 2).map(|k| {
        let kind = Kind::ALL[(k % Kind::ALL.len() as u64) as usize];
        let scenario: Scenario = kind.scenario(run.seed_of(k), k / Kind::ALL.len() as u64, 60.0, 100.0);
        Trial { name: format!("{}/{k}", kind.name()), what: scenario }
    });
    let rounds = run.each(with.chain(without).collect(), |trial, _| {
        let (scenario, seen) = (&trial.what, Mutex::new(Vec::new()));
        let looked = |_: Axis, explained: &[Explained]| {
            if let Ok(mut seen) = seen.lock() {
                seen.extend(explained.iter().filter(|suspect| !suspect.tests.is_empty()).cloned());
            }
        };
        let record = simulate(scenario).record;
        let options = Options { explain: true, looked: &looked, ..Options::default() };
        ladder(&record, &Model::base_for(&record), &[scenario.sensor.axis], &options)?;
        Ok(seen.into_inner().unwrap_or_default())
    })?;
    let mut counts: BTreeMap<Key, Count> = BTreeMap::new();
    let mut order: Vec<Key> = Vec::new();
    for suspect in rounds.iter().flat_map(|(_, explained)| explained) {
        for (k, test) in suspect.tests.iter().enumerate().filter(|(_, test)| test.applies) {
            let others = suspect.tests.iter().enumerate().all(|(j, other)| j == k || other.passed);
            let mut count = |key: Key, decides: bool| {
                if !counts.contains_key(&key) {
                    order.push(key.clone());
                }
                let count = counts.entry(key).or_default();
                count.asked += 1;
                count.alone += usize::from(decides);
            };
            count((test.test, String::new()), others && !test.passed);
            let passing = passing(test);
            for (j, way) in test.ways.iter().enumerate() {
                count((test.test, words(way)), others && passing == [j]);
            }
        }
    }
    let mut table = Table::new(&["test", "way", "asked", "decides alone"]);
    order.sort_by_key(|(test, _)| suspect_order(&rounds, *test));
    for key in order {
        let Count { asked, alone } = counts[&key];
        let (test, way) = key;
        let way = if way.is_empty() { "(refuses)".to_owned() } else { way };
        table.row([test.to_string(), way, asked.to_string(), alone.to_string()]);
    }
    table.print();
    println!("{} refits on {} logs.", rounds.iter().map(|(_, e)| e.len()).sum::<usize>(), rounds.len());
    Ok(())
}

/// The ways by which a test is passed.
fn passing(test: &TestOutcome) -> Vec<usize> {
    let holds = |way: &[TestCondition]| way.iter().all(|condition| condition.holds);
    (0..test.ways.len()).filter(|&k| holds(&test.ways[k])).collect()
}

fn words(way: &[TestCondition]) -> String {
    let one = |condition: &TestCondition| match condition.threshold {
        Some(threshold) => format!("{} {} {threshold}", condition.measure, condition.relation),
        None if condition.relation == Relation::Is => condition.measure.clone(),
        None => format!("not {}", condition.measure),
    };
    way.iter().map(one).collect::<Vec<_>>().join("; ")
}

/// Where a test stands among those of a suspect.
fn suspect_order(rounds: &[(Trial<Scenario>, Vec<Explained>)], test: TestName) -> usize {
    let mut tests = rounds.iter().flat_map(|(_, explained)| explained).map(|suspect| &suspect.tests);
    tests.find_map(|tests| tests.iter().position(|other| other.test == test)).unwrap_or(usize::MAX)
}
