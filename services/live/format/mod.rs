//! What bytes are: rows in them, and what is none. One format a file, all alike.

pub mod candump;
mod cutter;
pub mod frames;
pub mod lines;
pub mod mavlink;

use super::{Content, Fault, address::Address, kind::Kind};
use gyro_model::Row;
use workbench::log::{Advice, Maps, Options, Problem};

/// What is found in bytes.
#[derive(Debug)]
#[allow(clippy::large_enum_variant, reason = "a box would be an allocation a row")]
pub enum Found {
    /// A row, and its time on the source's own clock, ns.
    Row(Row, i128),
    /// What is no good, and the words for it.
    Fault(Fault, String),
    /// So many rows are missing by the source's own count.
    Missed(u64),
    /// The source may have begun again: a clock that goes back now is no mistake.
    Begins,
}

/// Finds rows in bytes.
pub trait Format: Send {
    /// Takes bytes in the order in which they came.
    fn take(&mut self, bytes: &[u8], found: &mut dyn FnMut(Found));

    /// What has begun does not go on: the link was lost, or its packet is over.
    fn cut(&mut self, found: &mut dyn FnMut(Found));

    /// Nothing more will ever come.
    fn end(&mut self, found: &mut dyn FnMut(Found)) {
        self.cut(found);
    }

    /// What the rows hold, as soon as it is known; it does not change after that.
    fn content(&self) -> Option<&Content>;

    /// Why there is no row in all that came, where it has to be said.
    fn refusal(&self) -> Option<String> {
        None
    }

    /// What would make rows of what has come.
    fn advice(&self) -> Option<Advice> {
        None
    }

    /// Whether what comes are frames of a CAN bus, whose meaning nobody says.
    fn needs_dbc(&self) -> bool {
        false
    }

    /// What is not sure of the units that were found.
    fn unsure(&self) -> Option<&str> {
        None
    }

    /// What has come so far and is not understood, with an example.
    fn not_understood(&self) -> Option<String> {
        None
    }
}

/// The names of a source's channels; of a reference alone those that are meant for it.
fn maps(options: &Options, is_reference: bool) -> Result<Maps, Problem> {
    if is_reference { Maps::of_reference(options)?.and_columns(options) } else { Maps::load(options) }
}

/// The format of an address.
///
/// # Errors
/// A map, or a header in the address, that is none.
pub fn of(address: &Address, options: &Options) -> anyhow::Result<Box<dyn Format>> {
    Ok(match address.format {
        Kind::Csv => Box::new(lines::Lines::new(address.header.as_deref(), options, address.is_reference)?),
        Kind::Candump => {
            let options = Options { dbc: address.dbc.clone(), ..options.clone() };
            Box::new(candump::Candump::new(maps(&options, address.is_reference)?)?)
        }
        Kind::Frames => Box::new(frames::Frames::default()),
        Kind::Mavlink => Box::new(mavlink::Mavlink::default()),
    })
}
