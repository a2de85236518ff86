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
            Errno::NOTTY => io::Error::new(io::ErrorKind::InvalidInput, "it is no serial line"),
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
