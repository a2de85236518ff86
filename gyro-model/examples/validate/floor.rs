//! Where the error ends: over its floor, and over the band of 99 %.

use crate::{
    choice::Case,
    outcome::Outcome,
    run::{Run, Trial},
    table::{Table, share},
};
use gyro_model::{effects::Stage, fit::FitError, simulate::simulate};

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs.
    #[arg(long, default_value_t = 50)]
    logs: u64,
}

/// Times the floor that an error may have at averaging times up to a hundredth of the log.
const OVER: f64 = 1.1;

/// One log after its ladder.
struct End {
    says: String,
    hidden: String,
    is_right: bool,
    /// Points above the band: τ, error/floor_99.
    above: Vec<(f64, f64)>,
    /// Largest error/floor at short averaging times.
    short: f64,
}

/// Runs it and prints the shares.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), FitError> {
    let trials = (0..arguments.logs).map(|k| Trial { name: k.to_string(), what: run.seed_of(k) }).collect();
    let ends = run.each(trials, |trial, detail| {
        let scenario = Case::random(trial.what).scenario;
        let record = simulate(&scenario).record;
        let outcome = Outcome::of(&record, scenario.sensor.axis, detail)?;
        let hidden: Vec<&str> = scenario.hidden.iter().map(|h| h.effect.card().id).collect();
        let curve = outcome.ladder.steps.last().map(|step| step.error_curve.clone()).unwrap_or_default();
        let ratio = |a: Option<f64>, b: Option<f64>| a.zip(b).map_or(f64::NAN, |(a, b)| a / b);
        let above = curve.iter().map(|p| (p.tau_s, ratio(p.error, p.floor_99))).filter(|p| p.1 > 1.0).collect();
        let short = curve.iter().filter(|p| p.tau_s <= record.duration() / 100.0);
        if detail {
            for p in &curve {
                eprintln!(
                    "  {:8.3} s: {:.3} of the floor, {:.3} of its band",
                    p.tau_s,
                    ratio(p.error, p.floor),
                    ratio(p.error, p.floor_99)
                );
            }
        }
        let limited = scenario.hidden.iter().any(|h| h.effect.stage() == Stage::Reading);
        let end = End {
            says: outcome.says(),
            is_right: outcome.added.len() == hidden.len()
                && hidden.iter().all(|id| outcome.added.iter().any(|a| a.id == *id)),
            hidden: hidden.join(" + "),
            above,
            short: short.map(|p| ratio(p.error, p.floor)).fold(0.0, f64::max),
        };
        Ok((limited, end))
    })?;
    let mut table = Table::new(&["logs", "below floor_99 everywhere", "within 1.1 of the floor up to T/100", "both"]);
    let mut add = |name: &str, ends: &[&End]| {
        let count = |test: &dyn Fn(&End) -> bool| share(ends.iter().filter(|end| test(end)).count(), ends.len());
        table.row([
            format!("{name}: {}", ends.len()),
            count(&|end| end.above.is_empty()),
            count(&|end| end.short <= OVER),
            count(&|end| end.above.is_empty() && end.short <= OVER),
        ]);
    };
    let mended = ends.iter().filter(|(_, (limited, _))| !limited).map(|(_, (_, end))| end);
    add("all", &ends.iter().map(|(_, (_, end))| end).collect::<Vec<_>>());
    add("without dead zones and saturations", &mended.clone().collect::<Vec<_>>());
    add("of those, named right", &mended.filter(|end| end.is_right).collect::<Vec<_>>());
    table.print();
    for (trial, (_, end)) in ends.iter().filter(|(_, (_, end))| !end.above.is_empty() || end.short > OVER) {
        let above: Vec<String> = end.above.iter().map(|(tau, over)| format!("{over:.2} at {tau:.3} s")).collect();
        println!(
            "- `--only {}`: hidden {}, found {}; short τ {:.2} of the floor; of the band: {}",
            trial.name,
            if end.hidden.is_empty() { "nothing" } else { &end.hidden },
            end.says,
            end.short,
            if above.is_empty() { "–".to_owned() } else { above.join(", ") },
        );
    }
    Ok(())
}
