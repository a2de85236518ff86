//! Whether what is said of a parameter's error is so: the base model, fitted to logs in which nothing is hidden.

use crate::{
    naming::MOTIONS,
    run::{Run, Trial},
    table::{Table, share},
};
use gyro_model::{
    Model,
    fit::{FitError, fit},
    simulate::{Scenario, SensorSpec, simulate},
};

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs, each of another sensor.
    #[arg(long, default_value_t = 1200)]
    logs: u64,
}

/// Runs it and prints by how many of its standard errors each parameter was off.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), FitError> {
    let trial = |k: u64| {
        let (name, motion) = MOTIONS[(k % MOTIONS.len() as u64) as usize];
        Trial { name: format!("{name}/{k}"), what: (motion, run.seed_of(k)) }
    };
    let trials = (0..arguments.logs).map(trial).collect();
    let each = run.each(trials, |trial, _| {
        let (motion, seed) = trial.what;
        let sensor = SensorSpec::random(seed);
        let seconds = 60.0 + 10.0 * (seed / 8 % 5) as f64;
        let scenario = Scenario { motion, seconds, seed, sensor, ..Scenario::default() };
        let record = simulate(&scenario).record;
        let axis = scenario.sensor.axis;
        let model = fit(&record, &Model::base_for(&record), &[axis])?;
        let off = |id: &str, truth: f64| {
            let term = model.axes[axis.index()].as_ref().and_then(|model| model.term(id));
            term.map_or(f64::NAN, |term| (term.values[0] - truth) / term.std_errors[0])
        };
        Ok([off("scale-factor", scenario.sensor.alpha), off("bias", scenario.sensor.delta)])
    })?;
    let mut table = Table::new(&["parameter", "motion", "error, RMS, in standard errors", "beyond 2", "beyond 3"]);
    for (k, parameter) in ["scale-factor.alpha", "bias.delta"].into_iter().enumerate() {
        for (motion, _) in MOTIONS {
            let own = each.iter().filter(|(trial, _)| trial.name.starts_with(motion));
            let errors: Vec<f64> = own.map(|(_, off)| off[k]).collect();
            let rms = (errors.iter().map(|off| off * off).sum::<f64>() / errors.len() as f64).sqrt();
            let beyond = |most: f64| share(errors.iter().filter(|off| off.abs() > most).count(), errors.len());
            table.row([parameter.to_owned(), motion.to_owned(), format!("{rms:.2}"), beyond(2.0), beyond(3.0)]);
        }
    }
    table.print();
    Ok(())
}
