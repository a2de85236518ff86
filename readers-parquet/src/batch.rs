//! Some rows of one column.

use crate::{cell::Cell, columns::Column};
use parquet::{
    column::reader::{ColumnReader, ColumnReaderImpl},
    data_type::DataType,
    errors::Result,
};

/// Some rows of one column: the texts of their fields, one after the other.
#[derive(Default)]
pub struct Batch {
    text: Vec<u8>,
    /// Where each field ends; as many a row as the column is wide.
    ends: Vec<usize>,
}

impl Batch {
    /// The next rows of a column, at most so many, each of so many fields.
    ///
    /// # Errors
    /// The file is damaged.
    pub fn read(from: &mut ColumnReader, column: &Column, width: usize, rows: usize) -> Result<Self> {
        let mut batch = Self::default();
        each(from, column, rows, &mut |cells| batch.take(cells, column, width))?;
        Ok(batch)
    }

    /// Rows in it.
    pub fn rows(&self, width: usize) -> usize {
        self.ends.len().checked_div(width).unwrap_or_default()
    }

    /// The text of a field.
    pub fn field(&self, number: usize) -> &[u8] {
        let from = number.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.text[from..self.ends[number]]
    }

    fn take(&mut self, (cell, begins): (Option<&dyn Cell>, bool), column: &Column, width: usize) {
        if begins {
            self.fill(width);
        } else if self.ends.len().is_multiple_of(width) && !self.ends.is_empty() {
            // Longer than the list that was longest.
            return;
        }
        if let Some(cell) = cell {
            cell.write(column.kind, &mut self.text);
        }
        self.ends.push(self.text.len());
    }

    /// Ends a row whose list is shorter than others.
    pub fn fill(&mut self, width: usize) {
        while !self.ends.len().is_multiple_of(width) {
            self.ends.push(self.text.len());
        }
    }
}

/// The items of the longest list in the next rows.
///
/// # Errors
/// The file is damaged.
pub fn longest(from: &mut ColumnReader, column: &Column, rows: usize) -> Result<(usize, usize)> {
    let (mut longest, mut now, mut read) = (0, 0, 0);
    each(from, column, rows, &mut |(_, begins)| {
        (now, read) = if begins { (1, read + 1) } else { (now + 1, read) };
        longest = longest.max(now);
    })?;
    Ok((longest, read))
}

type Take<'a> = &'a mut dyn FnMut((Option<&dyn Cell>, bool));

/// Gives every field of the next rows, and whether a row begins with it.
fn each(from: &mut ColumnReader, column: &Column, rows: usize, take: Take) -> Result<()> {
    match from {
        ColumnReader::BoolColumnReader(of) => typed(of, column, rows, take),
        ColumnReader::Int32ColumnReader(of) => typed(of, column, rows, take),
        ColumnReader::Int64ColumnReader(of) => typed(of, column, rows, take),
        ColumnReader::Int96ColumnReader(of) => typed(of, column, rows, take),
        ColumnReader::FloatColumnReader(of) => typed(of, column, rows, take),
        ColumnReader::DoubleColumnReader(of) => typed(of, column, rows, take),
        ColumnReader::ByteArrayColumnReader(of) => typed(of, column, rows, take),
        ColumnReader::FixedLenByteArrayColumnReader(of) => typed(of, column, rows, take),
    }
}

fn typed<T: DataType>(from: &mut ColumnReaderImpl<T>, column: &Column, rows: usize, take: Take) -> Result<()>
where
    T::T: Cell,
{
    let (mut definition, mut repetition, mut values) = (Vec::new(), Vec::new(), Vec::new());
    from.read_records(rows, Some(&mut definition), Some(&mut repetition), &mut values)?;
    // Where every value is there, there are no levels.
    let count = if definition.is_empty() { values.len() } else { definition.len() };
    let mut values = values.iter();
    for k in 0..count {
        let is_there = definition.get(k).is_none_or(|level| *level == column.deepest);
        let cell = if is_there { values.next().map(|value| value as &dyn Cell) } else { None };
        take((cell, repetition.get(k).is_none_or(|level| *level == 0)));
    }
    Ok(())
}
