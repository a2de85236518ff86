//! Effects added to recorded logs: real noise, real motion, known truth.
//!
//! First the ladder gives the recording the model that it needs by itself. Then each effect that the recording can show,
//! and that is not alike to one it has, is added to the recorded rows, and the ladder goes on from that model.

use crate::{
    choice::{EFFECTS, alike},
    log_file,
    outcome::Outcome,
    run::{Run, Trial},
    table::{Table, share},
};
use gyro_model::{
    Axis, Model, Record,
    diagnose::{Options, ladder},
    effects::{Need, Role, find},
    record::ReferenceKind,
    simulate::{Hidden, Injection},
};
use std::{error::Error, path::PathBuf};

/// Options.
#[derive(clap::Args)]
pub struct Arguments {
    /// Recorded logs.
    #[arg(long = "log", required = true, num_args = 1..)]
    logs: Vec<PathBuf>,
    /// Times the typical size.
    #[arg(long, default_value_t = 1.0)]
    times: f64,
}

/// A recording and what it needs by itself.
struct Recording {
    name: String,
    record: Record,
    own: Model,
}

impl Recording {
    /// Whether it has what the effect needs, and nothing like it.
    fn suits(&self, id: &str, axis: Axis) -> bool {
        let own = self.own.axes[axis.index()].as_ref().map(gyro_model::AxisModel::effect_ids).unwrap_or_default();
        let needs = find(id).map_or(&[][..], |effect| effect.card().needs);
        let rows = &self.record.rows;
        let met = |need: &Need| match need {
            Need::ThreeGyros => Axis::ALL.iter().all(|&axis| self.record.has_gyro(axis)),
            Need::Accelerometer => rows.iter().any(|row| row.accel.iter().all(|a| a.is_finite())),
            Need::Temperature => rows.iter().any(|row| row.temperature.is_finite()),
            Need::Supply => rows.iter().any(|row| row.supply.is_finite()),
            Need::AngleReference => self.record.reference(axis) == Some(ReferenceKind::Angle),
        };
        needs.iter().all(met) && !own.iter().any(|other| alike(id, other))
    }

    /// The effect at its typical size times `times`. A step comes in the middle, a rail at 70 % of the largest reading.
    fn hidden(&self, id: &str, axis: Axis, times: f64) -> Option<Hidden> {
        let mut hidden = Hidden::typical(find(id)?, axis);
        let cards = hidden.effect.parameters(axis);
        match id {
            "saturation" => {
                let largest = self.record.rows.iter().map(|row| row.gyro[axis.index()].abs()).fold(0.0, f64::max);
                hidden.values[0] = 0.7 * largest;
            }
            "mount-resonance" => hidden.values[0] /= times.sqrt(),
            _ => {
                let linear = cards.iter().take_while(|card| card.role == Role::Linear).count().max(1);
                hidden.values[..linear].iter_mut().for_each(|value| *value *= times);
            }
        }
        if id == "bias-step" {
            hidden.values[1] = 0.5 * self.record.duration();
        }
        Some(hidden)
    }

    fn spoilt(&self, hidden: &Hidden, axis: Axis) -> Record {
        let mut injection = Injection::new(axis);
        injection.add(hidden.clone());
        let rows = self.record.rows.iter().map(|row| injection.spoil(*row)).collect();
        Record { rows, free_names: self.record.free_names.clone(), means: self.record.means }
    }
}

/// Runs it and prints what each effect was called on each recording.
pub fn study(arguments: &Arguments, run: &Run) -> Result<(), Box<dyn Error>> {
    let mut recordings = Vec::new();
    for path in &arguments.logs {
        let record = log_file::read(path)?;
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let (own, ladders) = ladder(&record, &Model::base_for(&record), &record.fitted_axes(), &Options::default())?;
        for l in &ladders {
            println!("{name}, axis {}: by itself {:?}, {:?}.\n", l.axis, l.effects, l.verdict);
        }
        recordings.push(Recording { name, record, own });
    }
    let mut trials = Vec::new();
    for recording in &recordings {
        for axis in recording.record.fitted_axes() {
            for id in EFFECTS.into_iter().filter(|id| recording.suits(id, axis)) {
                if let Some(hidden) = recording.hidden(id, axis, arguments.times) {
                    trials.push(Trial {
                        name: format!("{}/{axis}/{id}", recording.name),
                        what: (recording, axis, hidden),
                    });
                }
            }
        }
    }
    let results = run.each(trials, |trial, detail| {
        let (recording, axis, hidden) = &trial.what;
        Outcome::climb(&recording.spoilt(hidden, *axis), &recording.own, *axis, detail)
    })?;
    let mut table = Table::new(&["recording, axis, effect", "size", "named"]);
    let mut right = 0;
    for (trial, outcome) in &results {
        let hidden = &trial.what.2;
        let next = outcome.added.first();
        let named = next.is_some_and(|added| added.id == hidden.effect.card().id);
        right += usize::from(named);
        let mark = if named { "" } else { " ✗" };
        table.row([trial.name.clone(), format!("{:?}", hidden.values), format!("{}{mark}", outcome.says())]);
    }
    table.print();
    println!("The next step names what was added: {}.\n", share(right, results.len()));
    Ok(())
}
