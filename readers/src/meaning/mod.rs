//! What channels hold, by their names and units, and a map to the names of our logs.

mod pick;
mod text;
mod topics;
mod words;

pub use pick::{Dependent, Pick, Proposal, Second};
pub use text::{counts_rows, defined, epoch_unit, of_names, of_text, stated_rate, time_unit};
pub use topics::of_topics;
pub use words::{Meaning, What, Who, understand, unit_said};

/// The letters of the axes, in order.
pub const AXES: [&str; 3] = ["x", "y", "z"];
/// The letters of an orientation's parts, in order.
pub const PARTS: [&str; 4] = ["w", "x", "y", "z"];
