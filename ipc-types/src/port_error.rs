//! Why a port cannot be opened or used.

use crate::domain::DomainError;
use std::fmt::Debug;

/// What iceoryx2 refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PortError {
    /// The place is wrong.
    #[error(transparent)]
    Domain(#[from] DomainError),
    /// Anything else.
    #[error("{what} of topic '{topic}': {cause}")]
    Refused {
        /// What was tried.
        what: &'static str,
        /// On which topic.
        topic: &'static str,
        /// In iceoryx2's words.
        cause: String,
    },
    /// No answer in time.
    #[error("no answer from topic '{topic}' within {seconds} s: is the pipeline running? ('truerate status' tells)")]
    Silent {
        /// The topic asked.
        topic: &'static str,
        /// How long was waited in all.
        seconds: f64,
    },
}

/// What iceoryx2 refused, with what was tried on which topic.
pub(crate) fn refused<E: Debug>(what: &'static str, topic: &'static str) -> impl Fn(E) -> PortError {
    move |cause| PortError::Refused { what, topic, cause: format!("{cause:?}") }
}
