//! The end of a run, in words: axis by axis what was learned, then what went through, then how fast.

use super::board::Board;
use crate::{
    live::words,
    run_folder::{Run, RunFolder},
};
use gyro_model::{Axis, Model, faults::is_wrong_ratio, units, words::labels};
use ipc_types::ServiceId;
use std::fmt::Write;
use workbench::model_file;

/// The summary of a run, as text.
#[must_use]
pub fn text(run: &Run, folder: &RunFolder, board: &Board) -> String {
    let mut out = String::new();
    let source = folder.source().unwrap_or_default();
    let took = crate::clock::now_ns().saturating_sub(run.began_ns) as f64 * 1e-9;
    let _ = match source.name.as_str() {
        "" => writeln!(out, "no row came in {took:.1} s"),
        name => writeln!(out, "{name}: {took:.1} s"),
    };
    match model_file::load(&folder.model(), &source.free_names) {
        Ok(file) => parameters(&mut out, &file.model),
        Err(_) if !folder.model().exists() => out.push_str("no model: nothing was learned\n"),
        Err(error) => {
            let _ = writeln!(out, "no model: {error:#}");
        }
    }
    if let Ok(learned) = folder.learned() {
        if let Some(reason) = learned.without {
            let _ = writeln!(out, "not solved at the end: {reason}");
        }
        for axis in learned.axes {
            if let (Some(before), Some(after)) = (axis.before, axis.after) {
                let times = before / after;
                let _ = writeln!(
                    out,
                    "axis {}: drift rate over {:.1} s {} → {} ({times:.1} times less)",
                    axis.axis,
                    axis.tau,
                    rate(before),
                    rate(after)
                );
            }
        }
    }
    if let Some(source) = board.of(ServiceId::Acquisition).and_then(|h| words::text(&h.source)) {
        let _ = writeln!(out, "source: {source}");
    }
    counts(&mut out, board);
    stages(&mut out, board);
    out
}

fn parameters(out: &mut String, model: &Model) {
    let _ = writeln!(out, "model of epoch {}", model.epoch);
    for axis in Axis::ALL {
        let Some(of_axis) = &model.axes[axis.index()] else { continue };
        for term in &of_axis.terms {
            for (card, value, std_error) in term.parameters(axis) {
                let name = format!("{}.{}", term.effect.card().id, card.name);
                let unit = units::shown(card.unit, &[Some(value), Some(std_error)]);
                let shown = units::uncertain(Some(value), Some(std_error), &unit);
                let _ = writeln!(out, "axis {axis}: {name:<28} {shown}");
            }
        }
        if is_wrong_ratio(of_axis) {
            let _ = writeln!(out, "{}", labels::wrong_ratio(axis, of_axis.alpha()));
        }
    }
}

/// A rate as a person reads it.
#[must_use]
pub fn rate(value: f64) -> String {
    format!("{:.4} °/s", value.to_degrees())
}

fn counts(out: &mut String, board: &Board) {
    let _ = writeln!(out, "{:<12} {:>10} {:>10} {:>8} {:>8}", "process", "in", "out", "lost", "rejected");
    for id in ServiceId::ALL {
        if let Some(h) = board.of(id) {
            let name = id.name();
            let _ = writeln!(out, "{name:<12} {:>10} {:>10} {:>8} {:>8}", h.received, h.sent, h.lost, h.rejected);
        }
    }
}

fn stages(out: &mut String, board: &Board) {
    let stages = board.stages();
    if stages.is_empty() {
        return;
    }
    let _ = writeln!(out, "{:<28} {:>10} {:>9} {:>9} {:>9} {:>9}", "stage (µs)", "count", "p50", "p99", "p99.9", "max");
    for s in stages {
        let us = |ns: u64| ns as f64 * 1e-3;
        let _ = writeln!(
            out,
            "{:<28} {:>10} {:>9.1} {:>9.1} {:>9.1} {:>9.1}",
            s.stage.as_str(),
            s.count,
            us(s.quantile(0.5)),
            us(s.quantile(0.99)),
            us(s.quantile(0.999)),
            us(s.max_ns)
        );
    }
}
