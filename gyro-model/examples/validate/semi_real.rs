//! Effects added to recorded logs: real noise, real motion, known truth.
//!
//! First the ladder gives the recording the model that it needs by itself. Then each effect that the recording can show,
//! and that is not alike to one it has, is added to the recorded rows, and the ladder goes on from that model. How much
//! there is to find, where the recording has errors of its own that nothing explains, is said by the held-out excess J − 1
//! under that model: the share of it that came with the effect. With `--share` each effect is doubled until it makes up
//! that much, which leaves out those that cannot, whatever their physical size.

use crate::{
    choice::{EFFECTS, alike},
    log_file,
    outcome::Outcome,
    run::{Run, Trial},
    table::{Table, number, share},
};
use gyro_model::{
    Axis, Model, Record, Row,
    diagnose::{Options, ladder},
    effects::{Role, find},
    evidence::{
        encoder::Encoder,
        study::{Bench, Study},
    },
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
    #[arg(long, default_value_t = 1.0, conflicts_with = "share")]
    times: f64,
    /// Doubles the typical size until the effect makes up this share of the excess.
    #[arg(long)]
    share: Option<f64>,
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
        needs.iter().all(|need| need.is_in(&self.record, axis)) && !own.iter().any(|other| alike(id, other))
    }

    /// The effect at its typical size times `times`. A step comes in the middle, a rail at 70 % of the largest reading.
    fn sized(&self, id: &str, axis: Axis, times: f64) -> Option<Hidden> {
        let mut hidden = Hidden::typical(find(id)?, axis);
        let cards = hidden.effect.parameters(axis);
        match id {
            "saturation" => {
                let largest = self.record.rows.iter().map(|row| row.gyro[axis.index()].abs()).fold(0.0, f64::max);
                hidden.values[0] = 0.7 * largest;
            }
            "mount-resonance" => hidden.values[0] = (hidden.values[0] / times.sqrt()).max(cards[0].bounds.0),
            _ => {
                let linear = cards.iter().take_while(|card| card.role == Role::Linear).count().max(1);
                for (value, card) in hidden.values[..linear].iter_mut().zip(cards) {
                    *value = (*value * times).clamp(card.bounds.0, card.bounds.1);
                }
            }
        }
        if id == "bias-step" {
            hidden.values[1] = 0.5 * self.record.duration();
        }
        Some(hidden)
    }

    /// What is added: the effect at so many times its typical size, or at twice, four times … so much that it makes up this
    /// share of the excess; `None` where no size does.
    fn hidden(&self, id: &str, axis: Axis, arguments: &Arguments) -> Option<Hidden> {
        let Some(share) = arguments.share else { return self.sized(id, axis, arguments.times) };
        let sizes = (0..DOUBLINGS).map(|k| 2_f64.powi(k)).filter_map(|times| self.sized(id, axis, times));
        let enough = |hidden: &Hidden| self.added(&self.spoilt(hidden, axis), axis).is_some_and(|own| own >= share);
        { sizes }.find(enough)
    }

    /// Share of the held-out excess of the spoilt record that the recording had not: J − 1 of both under the model that the
    /// recording needs by itself, and over the recording's own floor.
    fn added(&self, spoilt: &Record, axis: Axis) -> Option<f64> {
        let bench = Bench::new(&self.record, &[axis], &self.own)?;
        let excess = |bench: &Bench, floor: &[f64]| Study::fit(bench, &self.own, None).held_out().excess(floor);
        let before = excess(&bench, &bench.weights);
        let after = excess(&Bench::new(spoilt, &[axis], &self.own)?, &bench.weights);
        (after > 1.0).then(|| (after - before) / (after - 1.0))
    }

    fn spoilt(&self, hidden: &Hidden, axis: Axis) -> Record {
        let mut injection = Injection::new(axis);
        injection.add(hidden.clone());
        // An encoder counts what its shaft does behind a play, too.
        let step = Encoder::steps(&self.record)[axis.index()];
        let counted = |angle: f64| if step > 0.0 { (angle / step).round() * step } else { angle };
        let spoilt = |row: &Row| {
            let mut spoilt = injection.spoil(*row);
            if spoilt.ref_angle[axis.index()] != row.ref_angle[axis.index()] {
                spoilt.ref_angle[axis.index()] = counted(spoilt.ref_angle[axis.index()]);
            }
            spoilt
        };
        let rows = self.record.rows.iter().map(spoilt).collect();
        Record { rows, ..self.record.clone() }
    }
}

/// Doublings of a typical size, itself among them: beyond sixteen times no low-cost sensor has it.
const DOUBLINGS: i32 = 5;

/// Share of the excess that an effect has to make up before the ladder is asked to name it.
const MATTERS: f64 = 0.1;

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
                if let Some(hidden) = recording.hidden(id, axis, arguments) {
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
        let spoilt = recording.spoilt(hidden, *axis);
        let made = recording.added(&spoilt, *axis);
        Ok((Outcome::climb(&spoilt, &recording.own, *axis, detail)?, made))
    })?;
    let mut table = Table::new(&["recording, axis, effect", "size", "share of the excess", "named"]);
    let (mut right, mut matters) = (0, (0, 0));
    for (trial, (outcome, made)) in &results {
        let hidden = &trial.what.2;
        let next = outcome.added.first();
        let id = hidden.effect.card().id;
        let named = next.is_some_and(|added| added.id == id || added.aliases.iter().any(|alias| alias == id));
        right += usize::from(named);
        if made.is_some_and(|share| share > MATTERS) {
            matters = (matters.0 + usize::from(named), matters.1 + 1);
        }
        let mark = if named { "" } else { " ✗" };
        let size: Vec<String> = hidden.values.iter().map(|v| number(Some(*v))).collect();
        let part = made.map_or_else(|| "–".to_owned(), |share| format!("{:.1} %", 100.0 * share));
        table.row([trial.name.clone(), size.join(", "), part, format!("{}{mark}", outcome.says())]);
    }
    table.print();
    println!("The next step names what was added, or it and what may as well be: {}.", share(right, results.len()));
    println!(
        "Of those that make up more than {:.0} % of the excess: {}.\n",
        100.0 * MATTERS,
        share(matters.0, matters.1)
    );
    Ok(())
}
