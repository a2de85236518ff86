//! Delimited text as one topic without a name.

use crate::{
    format::{Converted, Field, Format, Note, Sink, Topic, Unreadable},
    meaning::{self, Pick},
    text::{self, Form, HeadError, Table, TextRow, TimeField},
    unit,
};
use std::io::Read;

/// Reads a table that was stored in another way.
pub(super) fn read(mut table: Converted, sink: &mut dyn Sink) -> Result<(), Unreadable> {
    Text.read(&mut table.text, sink)?;
    table.notes.into_iter().for_each(|note| sink.note(note));
    Ok(())
}

/// Delimited text.
pub struct Text;

impl Format for Text {
    fn name(&self) -> &'static str {
        "delimited text"
    }

    /// Text has no zero bytes and hardly a control character.
    fn recognises(&self, start: &[u8]) -> bool {
        start.iter().all(|&b| b >= b' ' || matches!(b, b'\t' | b'\n' | b'\r' | 0x0c))
    }

    fn read(&self, mut bytes: &mut dyn Read, sink: &mut dyn Sink) -> Result<(), Unreadable> {
        let mut table = Table::open(&mut bytes, &|_| false)?;
        let (head, dialect) = (table.head().clone(), table.dialect());
        let fields = head.names.iter().zip(&head.units);
        let fields = fields.map(|(name, unit)| Field { name: name.clone(), unit: unit.or(unit::split(name).1) });
        let wanted = sink.topic(&Topic { name: String::new(), kind: String::new(), fields: fields.collect() });
        let time = time_column(&head);
        let mut values = Vec::new();
        while let Some(row) = table.next_row().map_err(HeadError::Line)? {
            if !wanted {
                continue;
            }
            values.clear();
            values.extend(row.fields().map(|field| match dialect.value(field) {
                text::Field::Number(x) => x,
                _ => f64::NAN,
            }));
            values.resize(head.names.len(), f64::NAN);
            // Without a time nothing has a rate.
            let time_ns = time.map_or(Some(0), |(column, form)| read_time(row, column, form, dialect.point));
            if let Some(time_ns) = time_ns {
                sink.message(0, time_ns, &values);
            }
        }
        for (kind, count, line) in table.skipped().iter() {
            sink.note(Note::Skipped { kind, count, line });
        }
        Ok(())
    }
}

/// The column of the time, and how it is written.
pub(super) fn time_column(head: &text::Head) -> Option<(usize, Form)> {
    let is_time = |pick: &&Pick| pick.name == "t" || pick.name.starts_with("t_");
    let proposal = meaning::of_text(head, &|_| false);
    let pick = proposal.chosen.iter().find(is_time)?;
    let column = head.names.iter().position(|name| *name == pick.channel)?;
    let sample = head.samples.first().and_then(|row| row.get(column)).map_or(&b""[..], Vec::as_slice);
    let exponent = match pick.name.as_str() {
        "t_ns" => 0,
        "t_us" => 3,
        "t_ms" => 6,
        _ => 9,
    };
    let number = if head.is_clock_in_digits(column) { Form::Digits } else { Form::Number(exponent) };
    Some((column, text::form(sample).unwrap_or(number)))
}

pub(super) fn read_time(row: TextRow, column: usize, form: Form, point: text::Point) -> Option<i64> {
    let field = row.field(column)?;
    let ns = match form {
        Form::Number(exponent) => match text::time(field, point, exponent) {
            TimeField::Nanoseconds(ns) => ns,
            _ => return None,
        },
        Form::Clock => text::clock(field)?,
        Form::Digits => text::digits(field)?,
        _ => text::date_time(field)?,
    };
    i64::try_from(ns).ok()
}
