//! Where the rate goes: `unix:/run/rate`, `udp:127.0.0.1:5601`, `-`, `shm`; `?format=csv` or `binary` where both are possible.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};
use std::{fmt, io::ErrorKind, net::ToSocketAddrs, path::PathBuf, str::FromStr};

/// A place that the rate is given to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    text: String,
    /// How it goes there.
    pub way: Way,
    /// As lines of text in place of binary rows.
    pub as_text: bool,
}

/// How rows go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Way {
    /// To whoever connects to this socket.
    Unix(PathBuf),
    /// In packets to this address.
    Udp(String),
    /// To standard output.
    StandardOutput,
    /// Into this file, or the instance's own.
    Shared(Option<PathBuf>),
}

/// Why a text is no target.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// Nothing like it.
    #[error("unknown place for the rate '{0}': use unix:PATH, udp:HOST:PORT, - (standard output) or shm")]
    Unknown(String),
    /// Not of the form `HOST:PORT`.
    #[error("{0}: a host and a port are needed, such as udp:127.0.0.1:5601")]
    HostPort(String),
    /// No such host.
    #[error("{0}: this host is not found: {1}")]
    Host(String, String),
    /// Too long for a socket.
    #[error("{0}: a socket's path has room for 107 bytes")]
    Long(String),
    /// Another form.
    #[error("{0}: the form is format=csv or format=binary; shared memory has its own")]
    Form(String),
}

/// Longest path of a Unix socket, bytes.
const LONGEST_PATH: usize = 107;

impl FromStr for Target {
    type Err = TargetError;

    fn from_str(text: &str) -> Result<Self, TargetError> {
        let (place, form) = text.split_once('?').unwrap_or((text, ""));
        let way = match place.split_once(':').unwrap_or((place, "")) {
            ("-", "") => Way::StandardOutput,
            ("shm", "") => Way::Shared(None),
            ("shm", path) => Way::Shared(Some(path.into())),
            ("unix", path) if !path.is_empty() => Way::Unix(path.into()),
            ("udp", place) => match place.to_socket_addrs() {
                Ok(_) => Way::Udp(place.to_owned()),
                Err(error) if error.kind() == ErrorKind::InvalidInput => {
                    return Err(TargetError::HostPort(text.to_owned()));
                }
                Err(error) => return Err(TargetError::Host(text.to_owned(), error.to_string())),
            },
            _ => return Err(TargetError::Unknown(text.to_owned())),
        };
        if matches!(&way, Way::Unix(path) if path.as_os_str().len() > LONGEST_PATH) {
            return Err(TargetError::Long(text.to_owned()));
        }
        let as_text = match (form, &way) {
            ("", _) => way == Way::StandardOutput,
            ("format=csv", Way::Unix(_) | Way::Udp(_) | Way::StandardOutput) => true,
            ("format=binary", Way::Unix(_) | Way::Udp(_) | Way::StandardOutput) => false,
            _ => return Err(TargetError::Form(text.to_owned())),
        };
        Ok(Self { text: text.to_owned(), way, as_text })
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Serialize for Target {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Target {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::{Target, Way};

    #[test]
    fn a_target_says_how_rows_go_and_in_which_form() {
        let target = |text: &str| text.parse::<Target>().map(|t| (t.way, t.as_text));
        assert_eq!(target("-"), Ok((Way::StandardOutput, true)));
        assert_eq!(target("-?format=binary"), Ok((Way::StandardOutput, false)));
        assert_eq!(target("unix:/run/rate"), Ok((Way::Unix("/run/rate".into()), false)));
        assert_eq!(target("udp:127.0.0.1:5601?format=csv"), Ok((Way::Udp("127.0.0.1:5601".into()), true)));
        assert_eq!(target("shm"), Ok((Way::Shared(None), false)));
        for wrong in ["", "file", "unix:", "udp:5601", "shm?format=csv", "-?format=xml", "-:x"] {
            assert!(target(wrong).is_err(), "{wrong}");
        }
        assert!(target(&format!("unix:/{}", "x".repeat(120))).is_err());
    }
}
