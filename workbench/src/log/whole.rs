//! A whole log in memory, with what is checked over all of it.

use super::{
    FAULTY_SHARE, FEWEST_ROWS, LogError, Options, Provenance, Reader, dependent, error::Problem, header::Column, jump,
    reader::no_reference, unit::Channel, words,
};
use gyro_model::{
    Record, Row,
    diagnosis::DataFault,
    faults::{
        self,
        held::{Held, LOOKED_AT},
    },
    parallel,
};
use std::path::Path;

/// Reads a log (`-`: standard input): its rows, what is faulty in them, and where they come from.
///
/// # Errors
/// See [`Problem`]: unreadable, no usable header, text for a number, too few rows, more than a tenth of them faulty.
pub fn read(path: &Path, options: &Options) -> Result<(Record, Vec<DataFault>, Provenance), LogError> {
    read_beside(path, options, |_, _| ()).map(|(record, faults, provenance, ())| (record, faults, provenance))
}

/// The same with `work` on the rows. Where they are taken as a stream gives them it goes on beside the search for faults, which changes none.
///
/// # Errors
/// As [`read`]; what `work` gave is lost then.
pub fn read_beside<T>(
    path: &Path,
    options: &Options,
    work: impl FnOnce(&Record, &Provenance) -> T,
) -> Result<(Record, Vec<DataFault>, Provenance, T), LogError> {
    let mut reader = Reader::open(path, options)?;
    let mut record = Record { rows: Vec::new(), free_names: reader.layout().free_names.clone(), ..Record::default() };
    let mut marked = Vec::new();
    while let Some(row) = reader.next_row()? {
        record.rows.push(row);
        // A message without a gyro's reading has lost none.
        marked.push(reader.row_was_marked() || reader.row_is_of_reference(&row));
    }
    let refuse = |problem| LogError::new(reader.log(), None, None, problem);
    if let Some(problem) = counts_rows(&reader, &record) {
        return Err(refuse(problem));
    }
    let mut found = reader.faults();
    let (origin, left_out) =
        if options.as_streamed { (0, 0) } else { jump::cut(&mut record.rows, &mut marked, &mut found) };
    let (report, streamed) = if options.as_streamed {
        let mut checked = record.clone();
        let mut held = Held::of(&record.rows[..record.len().min(LOOKED_AT)]);
        record.rows.iter_mut().for_each(|row| held.take(row));
        let provenance = provenance(path, &reader, &record);
        let (report, done) = parallel::both(|| faults::check(&mut checked, &marked), || work(&record, &provenance));
        (report, Ok(done))
    } else {
        (faults::check(&mut record, &marked), Err(work))
    };
    found.extend(report.faults);
    if let Some(by) = &reader.layout().dependent {
        found.push(dependent::fault(by, &reader.layout().seconds, record.len() as u64));
    }
    let faulty = reader.rows_faulty() + left_out + report.rows_marked;
    let costs_rows = |f: &&DataFault| f.kind.costs_rows();
    let worst = || found.iter().filter(costs_rows).max_by_key(|f| f.count).map_or_else(String::new, |f| f.says.clone());
    if faulty as f64 > FAULTY_SHARE * reader.rows_read() as f64 {
        if let Some(problem) = reader.few_digits() {
            return Err(refuse(problem));
        }
        if let Some(line) = reader.starts_again() {
            return Err(refuse(Problem::StartsAgain { line }));
        }
        if let Some(problem) = reader.repeated_times() {
            return Err(refuse(problem));
        }
        return Err(refuse(Problem::TooFaulty { faulty, rows: reader.rows_read(), worst: worst() }));
    }
    let gyros = reader.layout().gyros();
    let has_gyro = |row: &&Row| gyros.iter().any(|a| row.gyro[a.index()].is_finite());
    let usable = record.rows.iter().filter(has_gyro).count();
    if usable < FEWEST_ROWS {
        let why = if reader.rows_read() > usable as u64 {
            format!(" ({} rows in all, some without a gyro reading)", reader.rows_read())
        } else {
            String::new()
        };
        return Err(refuse(Problem::TooFew { found: usable, wanted: FEWEST_ROWS, why }));
    }
    if !options.needs_reference
        && !options.as_streamed
        && let Some(columns) = words::of(&record, reader.layout())
    {
        return Err(refuse(Problem::Words { columns }));
    }
    if options.needs_reference && record.fitted_axes().is_empty() {
        return Err(refuse(no_reference(reader.layout())));
    }
    let mut provenance = provenance(path, &reader, &record);
    provenance.start_ns += i128::from(origin);
    let done = streamed.unwrap_or_else(|work| work(&record, &provenance));
    Ok((record, found, provenance, done))
}

/// A time that counts rows, where its name or the text above the header shows that it is none.
fn counts_rows(reader: &Reader, record: &Record) -> Option<Problem> {
    const COUNTERS: [&str; 10] =
        ["count", "counter", "index", "idx", "sample", "packet", "packetcounter", "seq", "id", "n"];
    let layout = reader.layout();
    let name: String = layout.time_channel.chars().filter(char::is_ascii_alphanumeric).collect();
    let is_named_so = COUNTERS.contains(&name.to_ascii_lowercase().as_str());
    let ones = record.rows.windows(2).filter(|pair| pair[1].t_ns - pair[0].t_ns == 1_000_000_000).count();
    let says = layout.stated_rate.is_some_and(|rate| rate != 1.0) || is_named_so;
    (says && record.len() > 2 && 100 * ones >= 99 * (record.len() - 1))
        .then(|| Problem::CountsRows { channel: layout.time_channel.clone(), rate: layout.stated_rate })
}

/// When the log begins, ns since 1970. A sheet counts its days from 1899-12-30, MATLAB from the year 0.
fn since_1970(reader: &Reader) -> i128 {
    const DAY: f64 = 86_400.0;
    const NS: i128 = 86_400_000_000_000;
    let start = reader.start_ns().unwrap_or_default();
    let is_of_days = |column: &Column| column.channel == Channel::Time && column.conversion.scale == DAY;
    if !reader.layout().columns.iter().any(is_of_days) {
        return start;
    }
    match start / NS {
        30_000..80_000 => start - 25_569 * NS,
        690_000..800_000 => start - 719_529 * NS,
        _ => start,
    }
}

fn provenance(path: &Path, reader: &Reader, record: &Record) -> Provenance {
    let finite = |value: fn(&Row) -> f64| record.rows.iter().map(value).filter(|x| x.is_finite());
    let temperature = finite(|r| r.temperature)
        .fold(None, |range: Option<(f64, f64)>, x| Some(range.map_or((x, x), |(low, high)| (low.min(x), high.max(x)))));
    let mut supply: Vec<f64> = finite(|r| r.supply).collect();
    let middle = supply.len() / 2;
    let supply = (!supply.is_empty()).then(|| *supply.select_nth_unstable_by(middle, f64::total_cmp).1);
    Provenance {
        log: path.file_name().map_or_else(|| "-".to_owned(), |name| name.to_string_lossy().into_owned()),
        sha256: reader.sha256(),
        samples: record.len() as u64,
        temperature,
        supply,
        start_ns: since_1970(reader),
        chosen: reader.layout().chosen.clone(),
        unsure: reader.layout().unsure.clone(),
        said: reader.layout().said.clone(),
    }
}
