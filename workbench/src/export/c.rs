//! A C99 header with a function that compensates a reading as [`gyro_model::compensation`] does, step for step.
//!
//! What the effects do comes from [`gyro_model::effects::Effect::in_c`]; the order in which they act stands in `runtime.h`. One thing is
//! not held: axes with different delays couple at their own times there, here at the same reading.

use super::{Exported, comments, single::single};
use crate::model_file::ModelFile;
use gyro_model::{
    Axis, AxisModel, Term,
    compensation::of_the_mount,
    effects::{Stage, user},
};
use std::fmt::Write;

/// What holds for every model: types, memory, and the step. `@…@` stands where the model's own parts go.
const RUNTIME: &str = include_str!("runtime.h");

/// One effect on one axis on its way into C.
struct Placed<'a> {
    axis: Axis,
    term: &'a Term,
    /// Its function's name.
    name: String,
    /// Where its memory is.
    slot: usize,
    body: String,
}

pub fn header(file: &ModelFile, heading: &str, channels: &[String]) -> Exported {
    let mut placed = Vec::new();
    let mut notes = Vec::new();
    let mut warnings = Vec::new();
    let axes = |axis: Axis| file.model.axes[axis.index()].as_ref().map(|model| (axis, model));
    for (axis, model) in Axis::ALL.into_iter().filter_map(axes) {
        notes.push(line_of(axis, model));
        for (k, term) in model.terms.iter().enumerate() {
            let id = term.effect.card().id;
            match (term.effect.in_c(axis), term.effect.stage()) {
                (_, Stage::Calibration) => {}
                (_, Stage::Reference | Stage::Shown) => {
                    notes.push(format!(
                        "Axis {axis}: '{id}' is an error of the reference: there is nothing to undo in the gyro."
                    ));
                }
                (None, _) => {
                    warnings.push(format!("axis {axis}: C cannot hold '{id}': left out"));
                    notes.push(format!("NOT HELD: '{id}' of axis {axis}. The rate is without it."));
                }
                (Some(body), _) => {
                    let clean = id.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
                    let name = format!("truerate_{axis}{k}_{clean}");
                    placed.push(Placed { axis, term, name, slot: placed.len(), body: body.into_owned() });
                }
            }
        }
    }
    let columns: Vec<String> = channels.iter().enumerate().map(|(k, name)| format!("channel[{k}] = {name}")).collect();
    if placed.iter().any(|p| p.body.contains("in->channel")) {
        notes.push(format!("Columns of the log: {}.", columns.join(", ")));
    }
    limits(&placed, &mut notes, &mut warnings);
    let text = assemble(file, heading, &notes, &placed);
    Exported { text, warnings }
}

/// What stands in the header of how exact it is, in double precision …
const EXACT: &str =
    " * Doubles throughout. The same to the last bit as truerate where the model needs only + - * /; compile with
 * -ffp-contract=off for that (the default of -std=c99), and never with -ffast-math: NAN means that there is no value.";
/// … and in single precision.
const NEARLY: &str = " * Floats throughout, but for what turns times into times. A rate is within a few parts in ten million of the range of
 * what truerate makes of it. Never compile with -ffast-math: NAN means that there is no value.";

/// The same header in single precision.
pub fn in_floats(exported: &Exported) -> Exported {
    let text = single(&exported.text.replace(EXACT, NEARLY));
    Exported { text, warnings: exported.warnings.clone() }
}

/// The axis in one line of the comment: what it has, and how noisy it is.
fn line_of(axis: Axis, model: &AxisModel) -> String {
    format!(
        "Axis {axis}: {}; gyro noise {:.3e} (rad/s)/sqrt(Hz).",
        model.effect_ids().join(", "),
        model.noise.angle_random_walk
    )
}

/// What is held, but not everywhere.
fn limits(placed: &[Placed], notes: &mut Vec<String>, warnings: &mut Vec<String>) {
    for p in placed {
        let (id, axis) = (p.term.effect.card().id, p.axis);
        if p.body.contains("in->t ") || p.body.contains("in->t;") || p.body.contains("in->t)") {
            let says = format!(
                "'{id}' of axis {axis} depends on the time since the first row of the log that it was fitted on (t_ns): right on that log, and \
                 elsewhere only if t_ns counts from the same event, power-on say"
            );
            notes.push(format!("{says}."));
            warnings.push(says);
        }
        if p.body.contains("in->angle") {
            notes.push(format!("'{id}' of axis {axis} depends on the shaft angle, which you give."));
        }
    }
    let shifts = |axis: Axis| -> Vec<(&str, &[f64])> {
        let timing = placed.iter().filter(move |p| p.axis == axis && p.term.effect.stage() == Stage::Timing);
        timing.map(|p| (p.term.effect.card().id, p.term.values.as_slice())).collect()
    };
    let differ = Axis::ALL.iter().any(|&axis| shifts(axis) != shifts(Axis::X));
    let couples = placed.iter().any(|p| {
        let others = p
            .body
            .match_indices("in->rates[")
            .any(|(at, _)| !p.body[at + 10..].starts_with(&p.axis.index().to_string()));
        p.term.effect.stage() == Stage::Felt && others
    });
    if differ && couples {
        let says = "the axes are late by different times and feel one another: here they are coupled at the same reading, in truerate at \
                    the same instant";
        notes.push(format!("NOT HELD: {says}."));
        warnings.push(says.to_owned());
    }
}

fn assemble(file: &ModelFile, heading: &str, notes: &[String], placed: &[Placed]) -> String {
    let uses = |word: &str| placed.iter().any(|p| p.body.contains(word));
    let mut inputs = String::new();
    let mut hold = String::new();
    if uses("in->accel") {
        inputs.push_str(
            "    double accel[3];    /* specific force, m/s^2; NAN where there is none: the last one counts */\n",
        );
        hold.push_str(
            "    for (int i = 0; i < 3; ++i) {\n        truerate_hold(&state->accel[i], in->accel[i]);\n    }\n",
        );
    }
    if uses("in->delta_temperature") {
        inputs.push_str("    double temperature; /* of the gyro, degrees Celsius; NAN where there is none */\n");
        hold.push_str("    truerate_hold(&state->temperature, in->temperature);\n");
    }
    if uses("in->delta_supply") || uses("in->supply") {
        inputs.push_str("    double supply;      /* V; NAN where there is none */\n");
        hold.push_str("    truerate_hold(&state->supply, in->supply);\n    if (!isfinite(state->supply_origin)) {\n        state->supply_origin = state->supply;\n    }\n");
    }
    if uses("in->angle") {
        inputs.push_str("    double angle[3];    /* best known shaft angles, rad */\n");
        hold.push_str("    for (int i = 0; i < 3; ++i) {\n        state->angle[i] = in->angle[i];\n    }\n");
    }
    if uses("in->channel") {
        inputs.push_str(
            "    double channel[8];  /* the log's own columns, in the order above; NAN where there is none */\n",
        );
        hold.push_str(
            "    for (int i = 0; i < 8; ++i) {\n        truerate_hold(&state->channel[i], in->channel[i]);\n    }\n",
        );
    }
    let model = |axis: Axis| file.model.axes[axis.index()].clone().unwrap_or_default();
    let alphas = Axis::ALL.map(|axis| format!("{:?}", model(axis).alpha())).join(", ");
    let deltas = Axis::ALL.map(|axis| format!("{:?}", model(axis).delta())).join(", ");
    let origin = file.model.origin.supply.map_or("NAN".to_owned(), |v| format!("{v:?}"));
    let at = |stage: Stage| move |p: &&Placed| p.term.effect.stage() == stage;
    let sensor = |p: &&Placed| p.term.effect.stage() == Stage::Response && !of_the_mount(p.term.effect);
    let mount = |p: &&Placed| p.term.effect.stage() == Stage::Response && of_the_mount(p.term.effect);
    let undo = |p: &Placed| format!("rate = truerate_finite({}(rate, dt, state->memory[{}]), rate);", p.name, p.slot);
    let felt = |p: &Placed| format!("sum += truerate_felt({}, in, state->memory[{}], commit);", p.name, p.slot);
    let forget = |p: &Placed| format!("memset(state->memory[{0}], 0, sizeof state->memory[{0}]);", p.slot);
    let parts = [
        ("@HEADING@", heading.to_owned()),
        ("@NOTES@", comments(" *", notes.iter().flat_map(|note| wrapped(note)))),
        ("@MEMORIES@", placed.len().max(1).to_string()),
        ("@INPUTS@", inputs),
        ("@EFFECTS@", placed.iter().map(function).collect()),
        ("@ALPHA@", alphas),
        ("@DELTA@", deltas),
        ("@SUPPLY_ORIGIN@", origin),
        ("@HOLD@", hold),
        ("@VALID@", cases(placed, at(Stage::Timing), |p| format!("t = {}(t);", p.name))),
        ("@LOST@", cases(placed, at(Stage::Reading), |p| format!("lost = lost || {}(reading);", p.name))),
        ("@SENSOR@", cases(placed, sensor, undo)),
        ("@MOUNT@", cases(placed, mount, undo)),
        ("@FORGET@", cases(placed, at(Stage::Response), forget)),
        ("@REACH@", cases(placed, at(Stage::Response), reach)),
        ("@FELT@", cases(placed, at(Stage::Felt), felt)),
    ];
    parts.iter().fold(RUNTIME.to_owned(), |text, (place, part)| text.replace(place, part))
}

fn reach(p: &Placed) -> String {
    format!("reach = (reach < 0.0 ? 0.0 : reach) + {:?};", p.term.effect.reach(&p.term.values))
}

/// The effect as a C function.
fn function(p: &Placed) -> String {
    let card = p.term.effect.card();
    let takes = match p.term.effect.stage() {
        Stage::Timing => "double t",
        Stage::Reading => "double reading",
        Stage::Response => "double felt, double dt, double *memory",
        _ => "const truerate_signals *in, double *memory",
    };
    let returns = if p.term.effect.stage() == Stage::Reading { "int" } else { "double" };
    let mut text = format!(
        "/* {}: {} */\nstatic inline {returns} {}({takes})\n{{\n",
        card.id,
        card.equation.replace("*/", "* /"),
        p.name
    );
    if takes.ends_with("*memory") {
        text.push_str("    (void)memory;\n");
    }
    let own = if user::definition(p.term.effect).is_some() { "own_" } else { "" };
    for (parameter, value, std_error) in p.term.parameters(p.axis) {
        let error = if std_error.is_finite() { format!("+- {std_error:.1e} ") } else { String::new() };
        let unit = if parameter.unit == "1" { "" } else { parameter.unit };
        let comment = format!("{error}{unit}").trim().replace("*/", "* /");
        let comment = if comment.is_empty() { comment } else { format!(" /* {comment} */") };
        let _ = writeln!(text, "    const double {own}{} = {value:?};{comment}", parameter.name);
        if !p.body.contains(parameter.name) {
            let _ = writeln!(text, "    (void){own}{};", parameter.name);
        }
    }
    if takes.starts_with("const truerate_signals") && !p.body.contains("in->") {
        text.push_str("    (void)in;\n");
    }
    for line in p.body.lines() {
        let _ = writeln!(text, "    {line}");
    }
    text + "}\n\n"
}

/// `case 2: …; break;` for the axes that have such an effect.
fn cases(placed: &[Placed], which: impl Fn(&&Placed) -> bool, statement: impl Fn(&Placed) -> String) -> String {
    let mut text = String::new();
    for axis in Axis::ALL {
        let mut of_axis = placed.iter().filter(|p| p.axis == axis).filter(&which).peekable();
        if of_axis.peek().is_some() {
            let _ = writeln!(text, "    case {}:", axis.index());
            for p in of_axis {
                let _ = writeln!(text, "        {}", statement(p));
            }
            text.push_str("        break;\n");
        }
    }
    text
}

/// A note in lines of a comment.
fn wrapped(note: &str) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in note.replace("*/", "* /").split_whitespace() {
        let line = lines.last_mut().filter(|line| line.is_empty() || line.chars().count() + word.chars().count() < 96);
        match line {
            Some(line) if line.is_empty() => line.push_str(word),
            Some(line) => *line = format!("{line} {word}"),
            None => lines.push(format!("  {word}")),
        }
    }
    lines
}
