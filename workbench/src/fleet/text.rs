//! A fleet on a terminal: what is wrong first.

use super::{Fleet, PartRow, TypeRow, label};
use crate::report::{
    Ink, Terminal,
    units::{shown, thousands, uncertain, within},
};
use std::{collections::BTreeSet, fmt::Write as _};

/// Parts that are told; JSON and the page have them all.
const PARTS: usize = 20;
/// Logs left out that are told.
const LEFT_OUT: usize = 10;

pub(super) fn render(fleet: &Fleet, name: &str, terminal: Terminal) -> String {
    let mut out = String::new();
    let kinds: BTreeSet<&str> = fleet.types.iter().map(|row| row.kind.as_str()).collect();
    let _ = writeln!(out, "{}  {name}", terminal.paint(Ink::Strong, "Fleet"));
    let about = format!(
        "{} logs of {} parts of {} {}",
        thousands(fleet.logs as u64),
        thousands(fleet.part_count as u64),
        kinds.len(),
        if kinds.len() == 1 { "type" } else { "types" }
    );
    let _ = writeln!(out, "{}", terminal.paint(Ink::Quiet, &about));
    for line in sentences(fleet) {
        let _ = write!(out, "\n{}", wrapped(&line, terminal.width));
    }
    for kind in kinds {
        let _ = writeln!(out, "\n\n{}", terminal.paint(Ink::Strong, &format!("type {kind}")));
        let rows: Vec<[String; 6]> = fleet.types.iter().filter(|row| row.kind == kind).map(columns).collect();
        let head = ["", "mean", "between parts", "next part (95 %)", "p", "matters"].map(str::to_owned);
        let wide: Vec<usize> =
            (0..6).map(|k| rows.iter().chain([&head]).map(|row| row[k].chars().count()).max().unwrap_or(0)).collect();
        for (number, row) in std::iter::once(&head).chain(&rows).enumerate() {
            let cells: Vec<String> = row.iter().zip(&wide).map(|(cell, wide)| format!("{cell:wide$}")).collect();
            let line = format!("  {}", cells.join("  "));
            let ink = if number == 0 { Ink::Quiet } else { Ink::Plain };
            let _ = writeln!(out, "{}", terminal.paint(ink, line.trim_end()));
        }
        out.pop();
    }
    out.push('\n');
    if !fleet.left_out.is_empty() {
        let _ = writeln!(out, "\n{}", terminal.paint(Ink::Strong, "left out"));
        for own in fleet.left_out.iter().take(LEFT_OUT) {
            let _ = writeln!(out, "  {}: {}", own.log, own.why);
        }
        if fleet.left_out.len() > LEFT_OUT {
            let _ = writeln!(out, "  and {} more", fleet.left_out.len() - LEFT_OUT);
        }
    }
    out
}

/// One row of a type.
pub(super) fn columns(row: &TypeRow) -> [String; 6] {
    let next = row.next.map_or_else(
        || "–".to_owned(),
        |(low, high)| {
            let unit = shown(&row.unit, &[Some(low), Some(high)]);
            let digits = |value: f64| within(value * unit.factor, (high - low) * unit.factor);
            format!("{} to {} {}", digits(low), digits(high), unit.unit).trim_end().to_owned()
        },
    );
    [
        row.label(),
        value(row.mean, row.std_error, &row.unit),
        row.spread.map_or_else(|| "–".to_owned(), |spread| value(spread, None, &row.unit)),
        next,
        if row.is_found() { chance(row.p_value) } else { "–".to_owned() },
        if row.matters { "yes" } else { "no" }.to_owned(),
    ]
}

/// A number with its error in a unit that suits it.
pub(crate) fn value(value: f64, std_error: Option<f64>, unit: &str) -> String {
    if unit == "1" && value.abs() < SMALL_SHARE {
        let digits = |x: f64| crate::report::units::number(1e6 * x);
        return match std_error {
            Some(error) => format!("{} ± {} ppm", digits(value), digits(error)),
            None => format!("{} ppm", digits(value)),
        };
    }
    uncertain(Some(value), std_error, &shown(unit, &[Some(value)])).trim_end().to_owned()
}

/// A share below which it is said in ppm.
const SMALL_SHARE: f64 = 2e-3;

pub(super) fn chance(p: f64) -> String {
    if p < 1e-4 { format!("{p:.0e}") } else { format!("{p:.4}") }
}

/// What a reader has to know first: outliers, changes, what a type has, what is ambiguous.
pub(super) fn sentences(fleet: &Fleet) -> Vec<String> {
    let mut all = Vec::new();
    let outliers: Vec<&PartRow> = fleet.parts.iter().filter(|part| part.outlier).collect();
    for part in outliers.iter().take(PARTS) {
        all.push(format!(
            "Part {} is not of its type ({}): {} {}; the others have {}. Logs: {}.",
            part.part,
            part.kind,
            label(part.axis, &part.effect, &part.name, &[]),
            value(part.value, part.std_error, &part.unit),
            others(fleet, part),
            listed(&part.logs)
        ));
    }
    if outliers.len() > PARTS {
        all.push(format!("{} more parts are not of their type.", outliers.len() - PARTS));
    }
    for part in fleet.parts.iter().filter(|part| !part.changed.is_empty()).take(PARTS) {
        for change in &part.changed {
            all.push(format!(
                "Part {} ({}) changed on {} ± {} days: {} by {}.",
                part.part,
                part.kind,
                change.day,
                change.days.ceil(),
                label(part.axis, &part.effect, &part.name, &[]),
                value(change.by, Some(change.std_error), &part.unit)
            ));
        }
    }
    for row in fleet.types.iter().filter(|row| row.is_found()) {
        let what = if row.p_value < SIGNIFICANT {
            format!("has {} of {}", row.label(), value(row.mean, row.std_error, &row.unit))
        } else if row.parts > 1 {
            format!("differs from part to part in {}", row.label())
        } else {
            format!("differs from log to log in {}", row.label())
        };
        let matters = if row.matters { "" } else { " It is too small to matter on the median log." };
        let logs = if row.logs == 1 { "log" } else { "logs" };
        all.push(format!("Type {} {what} ({} {logs} of {} parts).{matters}", row.kind, row.logs, row.parts));
    }
    for own in &fleet.ambiguous {
        all.push(format!(
            "Type {}, axis {}: {} may also be {}. To tell them apart: {}.",
            own.kind,
            own.axis,
            own.effect,
            own.aliases.join(" or "),
            own.separate_by.trim_end_matches('.')
        ));
    }
    if all.is_empty() {
        all.push("Nothing is missing that these logs show together, and no part is other than its type.".to_owned());
    }
    all
}

/// The chance below which a type has an effect.
const SIGNIFICANT: f64 = 2e-3;

fn others(fleet: &Fleet, part: &PartRow) -> String {
    let row = fleet.types.iter().find(|row| {
        row.kind == part.kind && row.axis == part.axis && row.effect == part.effect && row.name == part.name
    });
    row.map_or_else(
        || "other values".to_owned(),
        |row| {
            format!(
                "{} with a spread of {}",
                value(row.mean, None, &row.unit),
                value(row.spread.unwrap_or(0.0), None, &row.unit)
            )
        },
    )
}

fn listed(logs: &[String]) -> String {
    match logs {
        [first, .., last] if logs.len() > 4 => format!("{first} … {last} ({})", logs.len()),
        all => all.join(", "),
    }
}

fn wrapped(text: &str, width: usize) -> String {
    let mut out = String::new();
    let mut length = 0;
    for word in text.split(' ') {
        let own = word.chars().count();
        if length > 0 && length + 1 + own > width {
            out.push_str("\n  ");
            length = 2;
        } else if length > 0 {
            out.push(' ');
            length += 1;
        }
        out.push_str(word);
        length += own;
    }
    out
}
