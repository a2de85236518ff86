//! How each process waits for its next message.

use ipc_types::{ServiceId, wait::Wait};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// How each process waits.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Waits {
    /// kalman.
    #[serde(with = "as_text")]
    pub kalman: Wait,
    /// compensator.
    #[serde(with = "as_text")]
    pub compensator: Wait,
    /// recorder.
    #[serde(with = "as_text")]
    pub recorder: Wait,
    /// sender.
    #[serde(with = "as_text")]
    pub sender: Wait,
}

impl Waits {
    /// Of this process; `None` where it waits for no stream.
    #[must_use]
    pub fn of(&self, service: ServiceId) -> Option<Wait> {
        match service {
            ServiceId::Kalman => Some(self.kalman),
            ServiceId::Compensator => Some(self.compensator),
            ServiceId::Recorder => Some(self.recorder),
            ServiceId::Sender => Some(self.sender),
            ServiceId::Acquisition | ServiceId::Dashboard => None,
        }
    }
}

mod as_text {
    use super::{Deserialize, Deserializer, Serializer, Wait};
    use serde::de::Error as _;

    pub fn serialize<S: Serializer>(wait: &Wait, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(wait)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Wait, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}
