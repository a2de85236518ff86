//! CAN: frames as the programs that record them write them, and the DBC file that says what their bits mean.
//!
//! | module | noun |
//! | --- | --- |
//! | [`database`] | messages and signals of a DBC file |
//! | [`signal`] | bits of a frame, and the value that they make |
//! | [`group`] | the parts of an identifier of SAE J1939 |
//! | [`frame`] | a line of `candump` or of a Vector ASC log |

pub mod database;
pub mod frame;
pub mod group;
pub mod signal;

pub use database::{Database, DbcError, Match, Message};
pub use frame::{Frame, Line, Lines, Writer};
pub use signal::Signal;

/// Set in an identifier of 29 bits, as DBC files and Linux have it.
pub const EXTENDED: u32 = 1 << 31;
/// Bytes of the longest frame, CAN FD's.
pub const LONGEST_FRAME: usize = 64;

/// The kind of all topics of a log of such frames.
pub const KIND: &str = "CAN";
