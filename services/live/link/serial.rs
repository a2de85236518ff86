//! A serial line: raw bytes, 8 bits, no parity, no flow control.

use super::{Got, Link, has_come, of_stream};
use rustix::{
    fs::{Mode, OFlags},
    io::Errno,
    termios::{ControlModes, OptionalActions, SpecialCodeIndex, tcgetattr, tcsetattr},
};
use std::{
    fs::File,
    io::{self, Read},
    path::Path,
    time::Duration,
};

/// The slowest and the fastest line.
const SPEEDS: std::ops::RangeInclusive<u32> = 300..=12_000_000;

/// Whether a line can have this speed, bits a second.
#[must_use]
pub fn is_speed(baud: u32) -> bool {
    SPEEDS.contains(&baud)
}

/// An open line.
pub struct Serial(File);

impl Serial {
    /// Opens the device and sets the line.
    ///
    /// # Errors
    /// Where it is not there, may not be used, is no terminal, or does not know the speed.
    pub fn open(path: &Path, baud: u32) -> io::Result<Self> {
        // A line without carrier must not keep us, nor become our controlling terminal.
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::NONBLOCK | OFlags::CLOEXEC;
        let line = rustix::fs::open(path, flags, Mode::empty())?;
        let mut settings = tcgetattr(&line).map_err(|error| match error {
            Errno::NOTTY => io::Error::new(io::ErrorKind::InvalidInput, "it is not a serial line"),
            error => error.into(),
        })?;
        settings.make_raw();
        settings.control_modes |= ControlModes::CREAD | ControlModes::CLOCAL | ControlModes::CS8;
        settings.control_modes &= !(ControlModes::PARENB | ControlModes::CSTOPB | ControlModes::CRTSCTS);
        settings.special_codes[SpecialCodeIndex::VMIN] = 1;
        settings.special_codes[SpecialCodeIndex::VTIME] = 0;
        settings.set_speed(baud)?;
        // What came before, at another speed perhaps, is dropped.
        tcsetattr(&line, OptionalActions::Flush, &settings)?;
        Ok(Self(File::from(line)))
    }
}

impl Link for Serial {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Got> {
        if has_come(&self.0, patience)? { of_stream(self.0.read(buffer)) } else { Ok(Got::Nothing) }
    }
}

/// Where the kernel lists ports of adapters and boards; those of a mainboard are always listed, whether or not anything is there.
const LISTED: [(&str, &[&str]); 2] =
    [("/dev/serial/by-id", &[""]), ("/dev", &["ttyUSB", "ttyACM", "ttyAMA", "ttyTHS", "cu.usb"])];

/// The ports that are there.
fn ports(lists: &[(&str, &[&str])]) -> Vec<String> {
    let mut ports = Vec::new();
    for (folder, begins) in lists {
        let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let is_port = |name: &str| begins.iter().any(|begin| name.starts_with(begin));
        let names = entries.filter_map(|entry| entry.file_name().into_string().ok()).filter(|name| is_port(name));
        let mut names: Vec<String> = names.map(|name| format!("{folder}/{name}")).collect();
        names.sort();
        ports.extend(names);
    }
    ports
}

/// Why a line could not be opened, and what there is.
#[must_use]
pub fn says(path: &Path, error: &io::Error) -> String {
    says_of(path, error, &ports(&LISTED))
}

fn says_of(path: &Path, error: &io::Error, ports: &[String]) -> String {
    match error.kind() {
        io::ErrorKind::NotFound if ports.is_empty() => {
            format!("{error}; no serial port is there: is the board plugged in, with a cable that carries data?")
        }
        io::ErrorKind::NotFound => format!("{error}; ports that are there: {}", ports.join(", ")),
        io::ErrorKind::PermissionDenied => {
            format!(
                "{error}: {} belongs to a group; `sudo usermod -aG dialout $USER`, then log in again",
                path.display()
            )
        }
        _ => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_port_that_is_not_there_is_answered_with_those_that_are() {
        let folder = tempfile::tempdir().unwrap();
        for name in ["ttyUSB1", "ttyUSB0", "ttyS0", "tty7"] {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        let here = folder.path().to_str().unwrap();
        let found = ports(&[("/no/such/folder", &[""]), (here, &["ttyUSB"])]);
        assert_eq!(found, [format!("{here}/ttyUSB0"), format!("{here}/ttyUSB1")]);
        let absent = io::Error::from(io::ErrorKind::NotFound);
        let path = Path::new("/dev/ttyUSB7");
        assert!(
            says_of(path, &absent, &found).ends_with(&format!("ports that are there: {here}/ttyUSB0, {here}/ttyUSB1"))
        );
        assert!(says_of(path, &absent, &[]).contains("plugged in"));
        assert!(says_of(path, &io::Error::from(io::ErrorKind::PermissionDenied), &[]).contains("dialout"));
    }
}
