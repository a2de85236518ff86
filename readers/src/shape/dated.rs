//! Rows whose time stands in columns of its parts, as rows with one.
//!
//! ```text
//! Year,Month,Day,Hour,Minute,Second,Millisecond,gz        time,gz
//! 2026,5,2,9,14,20,120,25.9                          →    2026-05-02T09:14:20.120000000,25.9
//!
//! hour,min,sec,gz                                         time,gz
//! 9,14,20.12,25.9                                         09:14:20.120000000,25.9
//! ```

use super::{Shape, head_of, write_row};
use crate::text::{Dialect, Field, Head, is_number};

/// The columns that hold the parts of a time.
struct Parts {
    /// Year, month and day.
    date: Option<[usize; 3]>,
    /// Hour, minute and second.
    clock: [usize; 3],
    /// What is below a second, and how many of it make one.
    below: Option<(usize, f64)>,
}

/// What the parts are called.
const YEAR: &[&str] = &["year", "yr", "yyyy"];
const MONTH: &[&str] = &["month", "mon"];
const DAY: &[&str] = &["day", "dd", "dayofmonth"];
const HOUR: &[&str] = &["hour", "hours", "hr", "hh"];
const MINUTE: &[&str] = &["minute", "minutes", "min"];
const SECOND: &[&str] = &["second", "seconds", "sec", "ss"];
const BELOW: [(&[&str], f64); 3] = [
    (&["millisecond", "milliseconds", "millis", "msec", "ms", "milli"], 1e3),
    (&["microsecond", "microseconds", "micros", "usec", "us", "micro"], 1e6),
    (&["nanosecond", "nanoseconds", "nanos", "nsec", "ns", "nano"], 1e9),
];

impl Parts {
    fn of(names: &[String]) -> Option<Self> {
        let plain = |name: &String| name.to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect::<String>();
        let names: Vec<String> = names.iter().map(plain).collect();
        let at = |called: &[&str]| names.iter().position(|name| called.contains(&name.as_str()));
        let all = |of: [&[&str]; 3]| Some([at(of[0])?, at(of[1])?, at(of[2])?]);
        let below = BELOW.iter().find_map(|(called, count)| Some((at(called)?, *count)));
        Some(Self { date: all([YEAR, MONTH, DAY]), clock: all([HOUR, MINUTE, SECOND])?, below })
    }

    fn columns(&self) -> impl Iterator<Item = usize> {
        self.date.into_iter().flatten().chain(self.clock).chain(self.below.map(|(column, _)| column))
    }

    /// The time that these fields make, as text; `None` where they are none of a clock.
    fn written(&self, dialect: Dialect, row: &[&[u8]]) -> Option<String> {
        let number = |column: usize| match dialect.value(row.get(column)?) {
            Field::Number(x) => Some(x),
            _ => None,
        };
        let whole = |column: usize, below: f64| number(column).filter(|x| x.fract() == 0.0 && (0.0..below).contains(x));
        let [hour, minute, second] = self.clock;
        let (hour, minute) = (whole(hour, 24.0)?, whole(minute, 60.0)?);
        let second = number(second).filter(|x| (0.0..60.0).contains(x))?;
        let below = match self.below {
            // The second may hold them already.
            Some((column, count)) if second.fract() == 0.0 => {
                number(column).filter(|x| (0.0..count).contains(x))? / count
            }
            _ => 0.0,
        };
        let date = match self.date {
            Some([year, month, day]) => {
                let (year, month, day) = (whole(year, 1e4)?, whole(month, 13.0)?, whole(day, 32.0)?);
                // A clock of two digits counts from 2000.
                let year = if year < 100.0 { 2000.0 + year } else { year };
                format!("{year:04.0}-{month:02.0}-{day:02.0}T")
            }
            None => String::new(),
        };
        Some(format!("{date}{hour:02.0}:{minute:02.0}:{:012.9}", second + below))
    }
}

/// Whether the columns of a table hold the parts of a time, by their names.
#[must_use]
pub fn has_parts(head: &Head) -> bool {
    head.line.is_some() && Parts::of(&head.names).is_some()
}

/// Rows with parts of a time as lines of a CSV.
pub struct Dated {
    head: Head,
    parts: Parts,
    is_headed: bool,
}

impl Dated {
    /// What lines like these are.
    pub fn of(lines: &[&[u8]]) -> Option<Self> {
        let (head, above) = head_of(lines)?;
        head.line?;
        let parts = Parts::of(&head.names)?;
        let times: Vec<String> = (lines[above..].iter())
            .filter_map(|line| parts.written(head.dialect, &head.dialect.fields(line)))
            .collect();
        let is_clock = times.len() * 10 > lines[above..].len() * 9 && times.windows(2).any(|pair| pair[0] != pair[1]);
        is_clock.then_some(Self { head, parts, is_headed: false })
    }
}

impl Shape for Dated {
    fn line(&mut self, line: &[u8], out: &mut Vec<u8>) {
        let (line, dialect) = (line.trim_ascii_end(), self.head.dialect);
        let row = dialect.fields(line);
        let is_other = |column: &usize| !self.parts.columns().any(|part| part == *column);
        let others = || (0..self.head.names.len()).filter(is_other);
        let Some(time) = self.parts.written(dialect, &row).filter(|_| row.len() <= self.head.names.len()) else {
            // The header is given with the first row.
            if self.is_headed && !line.trim_ascii().is_empty() {
                out.extend_from_slice(line);
                out.push(b'\n');
            }
            return;
        };
        if !std::mem::replace(&mut self.is_headed, true) {
            let name = |column: usize| {
                let unit = self.head.units[column].filter(|unit| !unit.symbol.is_empty());
                unit.map_or_else(
                    || self.head.names[column].clone(),
                    |unit| format!("{} [{}]", self.head.names[column], unit.symbol),
                )
            };
            write_row(out, std::iter::once("time".to_owned()).chain(others().map(name)));
        }
        let field = |column: usize| {
            let field = row.get(column).copied().unwrap_or_default();
            let text = String::from_utf8_lossy(field);
            if is_number(dialect, field) { text.replace(',', ".") } else { text.into_owned() }
        };
        write_row(out, std::iter::once(time).chain(others().map(field)));
    }

    fn end(&mut self, _: &mut Vec<u8>) {}
}

#[cfg(test)]
mod tests {
    use super::*;

    fn csv(header: &str, row: impl Fn(u32) -> String) -> Option<Vec<String>> {
        let text = header.to_owned() + "\n" + &(0..40).map(|k| row(k) + "\n").collect::<Vec<_>>().concat();
        let lines: Vec<&[u8]> = text.lines().map(str::as_bytes).collect();
        let mut rows = Dated::of(&lines)?;
        let mut out = Vec::new();
        for line in &lines {
            rows.line(line, &mut out);
        }
        Some(String::from_utf8(out).unwrap().lines().map(str::to_owned).collect())
    }

    #[test]
    fn parts_of_a_time_are_one_time() {
        let dated = csv("Year,Month,Day,Hour,Minute,Second,Millisecond,gz [deg/s]", |k| {
            format!("2026,5,2,9,14,{},{},{k}.5", 20 + k / 10, k % 10 * 100)
        });
        let dated = dated.unwrap();
        assert_eq!(dated[0], "time,gz [deg/s]");
        assert_eq!((dated[12].as_str(), dated.len()), ("2026-05-02T09:14:21.100000000,11.5", 41));
        let clock = csv("gz;hh;mm_;min;sec", |k| format!("{k},5;9;7;14;{},25", 20 + k)).unwrap();
        assert_eq!((clock[0].as_str(), clock[2].as_str()), ("time,gz,mm_", "09:14:21.250000000,1.5,7"));
    }

    #[test]
    fn a_table_with_another_time_is_none() {
        for header in ["t,min,max,gz", "second,hour,gz,angle", "day,month,year,gz"] {
            assert_eq!(csv(header, |k| format!("{k},1,2,3")), None, "{header}");
        }
        assert_eq!(csv("hour,minute,second,gz", |k| format!("{k},99,5,3")), None);
    }
}
