//! Which physical effect is missing.

pub mod candidates;
pub mod limits;
pub mod refit;
pub mod tone;
