//! Rows without a time, below a text that says how far apart they lie, as rows that have one.
//!
//! ```text
//! Delta_X  0.01  0.01                          time [s],gyro,angle
//! X_Value  gyro  angle                    →    0,1.5,3
//!          1.5   3                             0.01,1.6,3.1
//!
//! X,CH1,CH2,Start,Increment                    time [s],CH1 [V],CH2 [V]
//! Sequence,Volt,Volt,-30,0.01             →    0,1.65,0
//! 0,1.65,0,                                    0.01,1.66,0.1
//! ```

use super::{Shape, head_of};
use crate::{
    json::write_text,
    meaning::{self, counts_rows, of_text},
    text::{Head, form, is_number},
    unit,
};
use std::io::Write;

/// Rows that are enough.
const FEWEST: usize = 8;
/// More fields are no rows of a sensor.
const WIDEST: usize = 200;

/// Rows without a time as lines of a CSV.
pub struct Stepped {
    head: Head,
    /// Rows a second, and rows so far.
    rate: f64,
    count: u64,
    /// Fields of a row that are given: the first may be the row's number or empty.
    first: usize,
    fields: usize,
    is_headed: bool,
}

impl Stepped {
    /// What lines like these are.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let (mut head, above) = head_of(lines)?;
        if head.dialect.stamped || head.dialect.labelled || head.names.len() > WIDEST {
            return None;
        }
        let rows: Vec<Vec<&[u8]>> = lines[above..].iter().map(|line| head.dialect.fields(line)).collect();
        let fields = rows.first()?.len();
        head.keys.extend(lines[..above].iter().filter_map(|line| key(line)));
        if let Some((names, step)) = lines[..above].windows(2).find_map(|pair| of_scope(&head, pair[0], pair[1])) {
            (head.names, head.line) = (names, Some(1));
            head.keys.push(("increment".to_owned(), step));
        }
        head.line?;
        let rate = meaning::stated_rate(&head)?;
        let text = |row: &[&[u8]], column: usize| row.get(column).map_or(Vec::new(), |field| field.to_vec());
        head.samples = rows.iter().map(|row| (0..fields).map(|column| text(row, column)).collect()).collect();
        let first = usize::from(rows.iter().all(|row| row[0].is_empty()) || head.names[0] == ROW);
        // Whatever keeps growing may be the time.
        let grows = |column: usize| {
            let number = |row: &Vec<Vec<u8>>| std::str::from_utf8(&row[column]).ok()?.parse::<f64>().ok();
            let values: Vec<Option<f64>> = head.samples.iter().map(number).collect();
            let steps: Vec<Option<f64>> = values.windows(2).map(|pair| Some(pair[1]? - pair[0]?)).collect();
            // A clock ticks evenly; a rate that grows for a while does not.
            let first = steps.first().copied().flatten().unwrap_or_default();
            let is_growing =
                first > 0.0 && steps.iter().all(|step| step.is_some_and(|step| (0.2..5.0).contains(&(step / first))));
            let is_written = head.samples.iter().all(|row| form(&row[column]).is_some());
            is_written || is_growing || counts_rows(&head, column)
        };
        let is_timed = (first..fields).any(grows)
            || of_text(&head, &|_| false).chosen.iter().any(|pick| {
                let column = head.names.iter().position(|name| *name == pick.channel);
                (pick.name == "t" || pick.name.starts_with("t_")) && column.is_some_and(|column| column >= first)
            });
        let is_row =
            |row: &&Vec<&[u8]>| row.len() == fields && row[first..].iter().any(|field| is_number(head.dialect, field));
        let are_rows = rows.len() >= FEWEST && rows.iter().filter(is_row).count() * 10 > rows.len() * 9;
        (!is_timed && are_rows).then_some(Self { head, rate, count: 0, first, fields, is_headed: false })
    }
}

impl Shape for Stepped {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let (line, dialect) = (line.trim_ascii_end(), self.head.dialect);
        let row = dialect.fields(line);
        let begins = self.first == 0 || row[0].is_empty() || is_number(dialect, row[0]);
        let is_row = row.len() == self.fields
            && begins
            && row[self.first..].iter().all(|field| field.is_empty() || is_number(dialect, field))
            && row[self.first..].iter().any(|field| !field.is_empty());
        if !is_row {
            // The header is given with the first row.
            if self.is_headed && !line.trim_ascii().is_empty() {
                out.extend_from_slice(line);
                out.push(b'\n');
            }
            return;
        }
        if !std::mem::replace(&mut self.is_headed, true) {
            out.extend_from_slice(b"time [s]");
            for k in self.first..self.fields {
                let name = self.head.names.get(k).map_or_else(|| format!("column_{}", k + 1), Clone::clone);
                let unit = self.head.units.get(k).copied().flatten().filter(|_| unit::split(&name).1.is_none());
                out.push(b',');
                write_text(out, &unit.map_or_else(|| name.clone(), |unit| format!("{name} [{}]", unit.symbol)));
            }
            out.push(b'\n');
        }
        // Into memory nothing fails.
        let _ = write!(out, "{:.9}", self.count as f64 / self.rate);
        self.count += 1;
        for field in &row[self.first..] {
            out.push(b',');
            write_text(out, &String::from_utf8_lossy(field).replace(',', "."));
        }
        out.push(b'\n');
    }

    fn end(&mut self, _: &mut Vec<u8>) {}
}

/// What an oscilloscope calls the number of a row.
const ROW: &str = "X";

/// A line as a key and its first number: `Delta_X  0.01  0.01`.
fn key(line: &[u8]) -> Option<(String, String)> {
    let text = std::str::from_utf8(line).ok()?;
    let mut parts = text.split(['\t', ',', ';', '=', ':']).map(|part| part.trim().trim_matches('"'));
    let key = parts.next()?.trim_start_matches(['#', '%', '/', ' ']);
    let value = parts.find(|part| part.starts_with(|c: char| c.is_ascii_digit() || c == '.'))?;
    Some((key.to_owned(), value.to_owned()))
}

/// The names of an oscilloscope's columns and the step, which stand in two lines above the rows, the names of both among the first.
fn of_scope(head: &Head, names: &[u8], values: &[u8]) -> Option<(Vec<String>, String)> {
    let field = |field: &[u8]| String::from_utf8_lossy(field).into_owned();
    let names: Vec<String> = head.dialect.fields(names).into_iter().map(field).collect();
    let values: Vec<String> = head.dialect.fields(values).into_iter().map(field).collect();
    let place = names.iter().position(|name| name.eq_ignore_ascii_case("increment"))?;
    let step = values.get(place).filter(|value| value.parse::<f64>().is_ok())?.clone();
    let unit = |k: usize| values.get(k).and_then(|value| unit::parse(value)).filter(|unit| !unit.symbol.is_empty());
    let named =
        |(k, name): (usize, &String)| unit(k).map_or_else(|| name.clone(), |unit| format!("{name} [{}]", unit.symbol));
    Some((names.iter().enumerate().map(named).collect(), step))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn csv(above: &str, row: impl Fn(i32) -> String) -> Option<String> {
        let text = above.to_owned() + &(0..40).map(row).collect::<String>();
        let lines: Vec<&[u8]> = text.lines().map(str::as_bytes).collect();
        let mut rows = Stepped::of(&lines)?;
        let mut out = Vec::new();
        for line in &lines {
            rows.line(line, &mut out);
        }
        Some(String::from_utf8(out).unwrap())
    }

    /// What a sensor reads.
    fn reading(k: i32) -> i32 {
        k * k % 7 - 3
    }

    #[test]
    fn rows_have_the_time_that_the_step_above_them_makes() {
        let lvm = "X0\t0.0\t0.0\nDelta_X\t0.02\t0.02\n***End_of_Header***\nX_Value\tgyro\tangle\tComment\n";
        let csv_of_lvm = csv(lvm, |k| format!("\t{}.5\t{}\n", reading(k), reading(k + 1))).unwrap();
        assert!(csv_of_lvm.starts_with("time [s],gyro,angle\n0.000000000,-3.5,-2\n0.020000000,"), "{csv_of_lvm}");
        let scope = "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-3,0.02\n";
        let csv_of_scope = csv(scope, |k| format!("{k},{}.5,{},\n", reading(k), reading(k + 1))).unwrap();
        assert!(csv_of_scope.starts_with("time [s],CH1 [V],CH2 [V]"), "{csv_of_scope}");
        let rated =
            csv("# sample rate: 50 Hz\ngz;angle\n", |k| format!("{}.5;{}\n", reading(k), reading(k + 1))).unwrap();
        assert!(rated.starts_with("time [s],gz,angle\n0.000000000,-3.5,-2\n0.020000000,"), "{rated}");
    }

    #[test]
    fn a_table_with_a_time_or_a_counter_keeps_it() {
        for (above, first) in
            [("# sample rate: 50 Hz\nt,gz\n", 0.02), ("# sample rate: 50 Hz\nn,gz\n", 1.0), ("# dt=0.02\na,gz\n", 20.0)]
        {
            assert_eq!(csv(above, |k| format!("{},{}\n", f64::from(k) * first, reading(k))), None, "{above}");
        }
        assert_eq!(csv("a,gz\n", |k| format!("{},{}\n", reading(k), reading(k + 1))), None);
    }
}
