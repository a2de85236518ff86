//! Many logs, one answer: what each log says, added up.
//!
//! Each log is reduced to its normal equations at a stated model, over *all* columns: the model's parameters and every effect of the
//! catalogue at fixed shapes. Those of several logs add up. What belongs to one log alone (its bias, its reference) is taken out log by
//! log by a Schur complement, never by comparing estimates that were made without the other columns: such estimates name the alias.
//!
//! ```text
//! log ─▶ Piece (A, b over all columns) ─▶ Equations without the log's own ─▶ Σ ─▶ Search: which effect, of whom
//!                                                     └─▶ an estimate a log ─▶ Nested: mean, spread, next part
//! ```
//!
//! | module | noun |
//! | --- | --- |
//! | [`mod@column`] | what a column is the coefficient of |
//! | [`piece`] | one log reduced to its normal equations |
//! | [`equations`] | normal equations by name: taken together, reduced, solved |
//! | [`spread`] | mean and spreads of estimates: REML over parts and logs |
//! | [`labels`] | whether an effect goes by a label of the logs: a driver's version, a lot, a mount |
//! | [`mount`] | whose a misalignment is: the mount's or the chip's |
//! | [`joint`] | one model fitted to several logs |
//! | [`curves`] | their errors as one curve |
//! | `forward` | which columns join, one after the other |
//! | [`search`] | which effects several logs of one sensor show together, and what repeats |
//! | [`prior`] | a new part that starts from its type |
//! | [`course`] | a part in time: control charts |
//! | [`fleet`] | types of sensors, their parts, and what changed in time |

pub mod column;
pub mod course;
pub mod curves;
pub mod equations;
pub mod fleet;
mod forward;
pub mod joint;
pub mod labels;
pub mod mount;
pub mod piece;
pub mod prior;
pub mod search;
pub mod spread;

pub use column::{Column, Key};
pub use equations::Equations;
pub use piece::{Piece, pieces};
