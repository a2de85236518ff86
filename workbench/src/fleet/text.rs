//! A fleet on a terminal: what is wrong first.

use super::{ChangedRow, FaultRow, Fleet, LabelRow, MisalignedRow, PartRow, ShareRow, TypeRow, Whose, label};
use crate::report::{
    Ink, Terminal,
    units::{shown, thousands, uncertain, within},
};
use gyro_model::{pooled::fleet::OfValue, thresholds::SIGNIFICANCE, words::labels::NOTHING_TOGETHER};
use std::{collections::BTreeSet, fmt::Write as _};

/// Parts that are told; JSON and the page have them all.
const PARTS: usize = 20;
/// Logs left out that are told.
const LEFT_OUT: usize = 10;

pub(super) fn render(fleet: &Fleet, name: &str, terminal: Terminal) -> String {
    let mut out = String::new();
    let kinds: BTreeSet<&str> = fleet.types.iter().map(|row| row.kind.as_str()).collect();
    let _ = writeln!(out, "{}  {name}", terminal.paint(Ink::Strong, "Fleet"));
    let about =
        format!("{} of {} of {}", many(fleet.logs, "log"), many(fleet.part_count, "part"), many(kinds.len(), "type"));
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

/// `1 log`, `12 logs`.
pub(super) fn many(n: usize, what: &str) -> String {
    format!("{} {what}{}", thousands(n as u64), if n == 1 { "" } else { "s" })
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
        let own = part.changed.first().map_or_else(
            || value(part.value, part.std_error, &part.unit),
            |change| {
                format!(
                    "{} before {}, {} since then",
                    value(change.before, Some(change.before_error), &part.unit),
                    change.day,
                    value(change.after, Some(change.after_error), &part.unit)
                )
            },
        );
        all.push(format!(
            "Part {} is not of its type ({}): {} {own}; the others have {}. Logs: {}.",
            part.part,
            part.kind,
            label(part.axis, &part.effect, &part.name, &[]),
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
                "Part {} ({}) changed on {} ± {} days: {} by {}, from {} to {}.{}",
                part.part,
                part.kind,
                change.day,
                change.days.ceil(),
                label(part.axis, &part.effect, &part.name, &[]),
                value(change.by, Some(change.std_error), &part.unit),
                value(change.before, Some(change.before_error), &part.unit),
                value(change.after, Some(change.after_error), &part.unit),
                with(change)
            ));
        }
    }
    all.extend(fleet.faults.iter().map(of_fault));
    all.extend(fleet.labels.iter().map(of_label));
    all.extend(fleet.misaligned.iter().flat_map(of_misaligned));
    for row in fleet.types.iter().filter(|row| row.is_found()) {
        let what = if row.p_value < SIGNIFICANT {
            format!("has {} of {}", row.label(), value(row.mean, row.std_error, &row.unit))
        } else if row.p_of_spread < SIGNIFICANT {
            format!("differs from part to part in {}", row.label())
        } else if row.p_of_spread_of_logs < SIGNIFICANT {
            format!("differs from log to log in {}", row.label())
        } else {
            // One part had it, which is not in the mean and is told above.
            continue;
        };
        let matters = if row.matters { "" } else { " It is too small to matter on the median log." };
        // Of one part nothing is known of the others of its type.
        let one = row.readings.first().filter(|_| row.parts == 1);
        let whose = one.map_or_else(|| format!("Type {}", row.kind), |own| format!("Part {} ({})", own.part, row.kind));
        let of = if one.is_some() { many(row.logs, "log") } else { of_parts(row.logs, row.parts) };
        all.push(format!("{whose} {what} ({of}).{matters}"));
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
    all.extend(fleet.not_understood.iter().map(|own| {
        format!(
            "The effect {}.{}, in {}, is not understood and not judged: a newer truerate made it; update this one.",
            own.effect,
            own.name,
            many(own.logs, "log")
        )
    }));
    if fleet.logs == 0 && !fleet.left_out.is_empty() {
        all.push("No log can be used: nothing is known of effects. The reasons are below, log by log.".to_owned());
    } else if all.is_empty() {
        all.push(NOTHING_TOGETHER.to_owned());
    }
    all
}

fn of_parts(logs: usize, parts: usize) -> String {
    format!("{} of {}", many(logs, "log"), many(parts, "part"))
}

/// What changed with a part, as a sentence.
pub(super) fn with(change: &ChangedRow) -> String {
    let each = change.with.iter().map(|own| format!("{} ({} → {})", own.label, own.from, own.to));
    let list = each.collect::<Vec<_>>().join(", ");
    if list.is_empty() { list } else { format!(" With it changed: {list}.") }
}

fn of_fault(own: &FaultRow) -> String {
    let FaultRow { kind, axis, fault, part, logs, of_logs, of_parts } = own;
    match part {
        Some(part) => format!(
            "Part {part} ({kind}), axis {axis}: data fault {fault} in all of its {}, and in no other part. It is the part's.",
            many(*of_logs, "log")
        ),
        None if *of_parts == 1 => format!(
            "Type {kind}, axis {axis}: data fault {fault} in {logs} of {}. All are of one part: another part would tell \
             whether it is the type's (its driver, range or registers).",
            many(*of_logs, "log")
        ),
        None => format!(
            "Type {kind}, axis {axis}: data fault {fault} in {logs} of {} of {}. It is the type's (its driver, range or \
             registers), not a part's.",
            many(*of_logs, "log"),
            many(*of_parts, "part")
        ),
    }
}

/// A misalignment with its owner.
fn of_misaligned(own: &MisalignedRow) -> Vec<String> {
    let MisalignedRow { kind, axes: [i, k], about, of, turned, alike, .. } = own;
    let spread = |share: &ShareRow, unit: &str| {
        let each = [("part to part", share.spread), ("log to log", share.spread_of_logs)];
        let told = each.into_iter().filter_map(|(what, spread)| {
            spread.filter(|spread| *spread > 0.0).map(|spread| format!("{} from {what}", value(spread, None, unit)))
        });
        let told = told.collect::<Vec<_>>().join(", ");
        if told.is_empty() { told } else { format!("; it varies by {told}") }
    };
    let mut all = Vec::new();
    if matches!(of, Whose::Mount | Whose::Both) {
        // A mean of nothing is no finding: the spread is.
        let by = if turned.p_of_mean < SIGNIFICANT {
            format!("by {} about {about}", value(turned.mean, turned.std_error, "rad"))
        } else {
            format!("about {about}, by angles that differ, in the mean {}", value(turned.mean, turned.std_error, "rad"))
        };
        all.push(format!(
            "Type {kind}: the sensor is turned on its mount {by} (axes {i} and {k} feel each other with opposite signs, \
             as a rotation makes it{}).",
            spread(turned, "rad")
        ));
    }
    if matches!(of, Whose::Chip | Whose::Both) {
        all.push(format!(
            "Type {kind}: axes {i} and {k} feel {} of each other with one sign. No mount makes that: it is the chip's{}.",
            value(alike.mean, alike.std_error, "1"),
            spread(alike, "1")
        ));
    }
    all
}

/// Values of a label that are told, the others being named by their number: the lowest and the highest.
const TOLD: usize = 6;

fn of_label(own: &LabelRow) -> String {
    let each = |row: &OfValue| {
        format!(
            "{} with {} ({})",
            value(row.mean, Some(row.std_error), &own.unit),
            row.value,
            of_parts(row.logs, row.parts)
        )
    };
    let also = own.labels[1..].join(", ");
    let also = if also.is_empty() {
        String::new()
    } else {
        format!(" {also} part the logs in the same way: these logs do not tell which of them it is.")
    };
    let mut rows: Vec<&OfValue> = own.values.iter().collect();
    let told = if rows.len() > TOLD {
        rows.sort_by(|a, b| a.mean.total_cmp(&b.mean));
        let (first, last) = (each(rows[0]), each(rows[rows.len() - 1]));
        format!("from {first} to {last}, {} values", rows.len())
    } else {
        rows.into_iter().map(each).collect::<Vec<_>>().join(", ")
    };
    let spread = own.spread.map_or_else(String::new, |spread| format!("; spread {}", value(spread, None, &own.unit)));
    format!(
        "Type {}: {} depends on {}: {told}{spread} (p = {}).{also}",
        own.kind,
        label(own.axis, &own.effect, &own.name, &[]),
        own.labels[0],
        chance(own.p_value)
    )
}

/// The chance below which a type has an effect.
const SIGNIFICANT: f64 = SIGNIFICANCE.value;

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fleet::{UnknownRow, part_row, type_row};
    use gyro_model::{
        Axis,
        pooled::{
            Key,
            fleet::{Dated, OfPart, OfType},
            spread::{Nested, Reading},
        },
    };

    /// A type of which one part of eight had an effect, and that part.
    fn fleet() -> Fleet {
        let key = Key::new(Axis::X, "scale-asymmetry", "a");
        let readings: Vec<Reading> =
            (0..7).map(|part| Reading { part, value: 1e-6 * (part as f64 - 3.0), variance: 25e-12 }).collect();
        let kind = "M".to_owned();
        let of_type = OfType {
            kind: kind.clone(),
            key: key.clone(),
            unit: "1".to_owned(),
            nested: Nested::fit(&readings).unwrap(),
            p_value: 1.0,
            matters: true,
            readings: Vec::new(),
        };
        let changed = Dated {
            day: 9000.0,
            days: 3.0,
            by: 2e-3,
            std_error: 3e-5,
            before: (2e-6, 2e-5),
            after: (2.002e-3, 2e-5),
            p_value: 1e-9,
            with: Vec::new(),
        };
        let part = OfPart {
            kind,
            part: "3".to_owned(),
            key,
            value: 2.002e-3,
            std_error: 2e-5,
            p_value: Some(1e-9),
            outlier: true,
            logs: vec!["a".to_owned()],
            changed: Some(changed),
            course: None,
        };
        let empty = super::super::Gathered::default().fleet();
        Fleet { types: vec![type_row(&of_type)], parts: vec![part_row(&part, "1".to_owned())], ..empty }
    }

    #[test]
    fn a_type_is_not_named_for_its_one_odd_part_and_a_part_that_changed_has_two_values() {
        let said = sentences(&fleet());
        assert!(said.iter().all(|line| !line.contains("Type M")), "{said:?}");
        assert!(said[0].contains("2.00 ± 20.0 ppm before 2024-08-22, 0.2002 ± 0.0020 % since then"), "{said:?}");
        assert!(said[1].contains("from 2.00 ± 20.0 ppm to 0.2002"), "{said:?}");
    }

    #[test]
    fn an_effect_that_is_not_known_is_said() {
        let unknown = UnknownRow { effect: "wobble-of-mars".to_owned(), name: "w".to_owned(), logs: 3 };
        let said = sentences(&Fleet { types: Vec::new(), parts: Vec::new(), not_understood: vec![unknown], ..fleet() });
        assert!(said[0].starts_with("The effect wobble-of-mars.w, in 3 logs, is not understood"), "{said:?}");
    }
}
