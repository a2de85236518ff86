//! A sensor of Linux' industrial I/O: its buffer through `/dev/iio:deviceN`, or where it has none its values in sysfs,
//! read again and again. What is read goes on as lines below [`HEADER`].

use super::{
    Got, Link, has_come,
    scan::{Element, Scan},
};
use crate::clock::now_ns;
use std::{
    fmt::Write as _,
    fs::{self, File, OpenOptions},
    io::{self, Read},
    os::unix::fs::OpenOptionsExt,
    path::{Path, PathBuf},
    thread::sleep,
    time::{Duration, Instant},
};

/// The columns of the lines; what a sensor does not have is left empty.
pub const HEADER: &str = "t_ns,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z,temp";
/// As in sysfs, in the order of the lines.
const CHANNELS: [&str; 7] = ["anglvel_x", "anglvel_y", "anglvel_z", "accel_x", "accel_y", "accel_z", "temp"];
/// The time's channel.
const TIMESTAMP: &str = "timestamp";
/// IIO gives temperatures in thousandths of a degree.
const MILLI: f64 = 1e-3;
/// A line is never longer, bytes.
const LINE: usize = 256;

/// Where a sensor is, and how it is read where it has no buffer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// `deviceN`, or the sensor's name.
    pub device: String,
    /// What lies above `sys` and `dev`.
    pub root: PathBuf,
    /// Readings a second without a buffer, Hz.
    pub rate_hz: u32,
}

/// An open sensor.
pub struct Iio {
    readings: Readings,
    lines: String,
}

enum Readings {
    /// Scans from the buffer.
    Buffered { file: File, scan: Scan, bytes: Vec<u8>, folder: PathBuf },
    /// Files of single values, with what makes a value of each, and when they are read next.
    Polled { files: Vec<Option<(PathBuf, f64, f64)>>, due: Instant, period: Duration },
}

impl Iio {
    /// Finds the sensor, and switches its buffer on where it has one.
    ///
    /// # Errors
    /// Where there is no such sensor, it has no gyro, or it may not be used.
    pub fn open(place: &Place) -> io::Result<Self> {
        let (folder, number) = find(place)?;
        let node = place.root.join("dev").join(&number);
        let readings = if folder.join("scan_elements").is_dir() && node.exists() {
            let scan = switch_on(&folder)?;
            // Without a writer a read must not keep us.
            let file = OpenOptions::new().read(true).custom_flags(NONBLOCK).open(node)?;
            Readings::Buffered { file, scan, bytes: Vec::new(), folder: folder.clone() }
        } else {
            let values = CHANNELS.map(|channel| {
                let raw = folder.join(format!("in_{channel}_raw"));
                let (scale, offset) = scale_and_offset(&folder, channel);
                raw.exists().then_some((raw, scale, offset))
            });
            let period = Duration::from_secs(1) / place.rate_hz;
            Readings::Polled { files: values.into(), due: Instant::now(), period }
        };
        let has_gyro = match &readings {
            Readings::Buffered { scan, .. } => (0..3).any(|k| scan.has(k)),
            Readings::Polled { files, .. } => files[..3].iter().any(Option::is_some),
        };
        if !has_gyro {
            let says = format!("{} has no gyro (in_anglvel_x, …)", folder.display());
            return Err(io::Error::new(io::ErrorKind::InvalidData, says));
        }
        Ok(Self { readings, lines: String::new() })
    }
}

const NONBLOCK: i32 = rustix::fs::OFlags::NONBLOCK.bits().cast_signed();

/// The sensor's folder in sysfs, and its number, `iio:deviceN`.
fn find(place: &Place) -> io::Result<(PathBuf, String)> {
    let all = place.root.join("sys/bus/iio/devices");
    let number = format!("iio:{}", place.device);
    if all.join(&number).is_dir() {
        return Ok((all.join(&number), number));
    }
    for entry in fs::read_dir(&all).map_err(|error| no_devices(&all, &error))?.flatten() {
        let name = fs::read_to_string(entry.path().join("name")).unwrap_or_default();
        if name.trim() == place.device {
            return Ok((entry.path(), entry.file_name().to_string_lossy().into_owned()));
        }
    }
    Err(io::Error::new(io::ErrorKind::NotFound, format!("{}: no sensor '{}' there", all.display(), place.device)))
}

fn no_devices(folder: &Path, error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("{}: {error}: this machine has no sensor of industrial I/O", folder.display()))
}

/// A channel's own factor and offset, or those of its kind.
fn scale_and_offset(folder: &Path, channel: &str) -> (f64, f64) {
    let kind = channel.split('_').next().unwrap_or(channel);
    let number = |what: &str| {
        [channel, kind]
            .iter()
            .find_map(|name| fs::read_to_string(folder.join(format!("in_{name}_{what}"))).ok()?.trim().parse().ok())
    };
    let unit = if kind == "temp" { MILLI } else { 1.0 };
    (number("scale").unwrap_or(1.0) * unit, number("offset").unwrap_or(0.0))
}

/// Switches on what we read of the buffer, row by row, and says how a scan is laid out.
fn switch_on(folder: &Path) -> io::Result<Scan> {
    let elements = folder.join("scan_elements");
    // A buffer that is on cannot be changed.
    fs::write(folder.join("buffer/enable"), "0")?;
    let mut found = Vec::new();
    for entry in fs::read_dir(&elements)?.flatten() {
        let file = entry.file_name().to_string_lossy().into_owned();
        let Some(channel) = file.strip_prefix("in_").and_then(|file| file.strip_suffix("_en")) else { continue };
        let place = CHANNELS.iter().position(|known| *known == channel);
        if place.is_some() || channel == TIMESTAMP {
            fs::write(entry.path(), "1")?;
        } else if fs::read_to_string(entry.path())?.trim() != "1" {
            continue;
        }
        let text = |what: &str| fs::read_to_string(elements.join(format!("in_{channel}_{what}")));
        let (scale, offset) = scale_and_offset(folder, channel);
        let wrong =
            || io::Error::new(io::ErrorKind::InvalidData, format!("in_{channel}_type or _index cannot be read"));
        let index: u32 = text("index")?.trim().parse().map_err(|_| wrong())?;
        let element = Element::new(text("type")?.trim(), scale, offset).ok_or_else(wrong)?;
        found.push((index, place, channel == TIMESTAMP, element));
    }
    // Each row as soon as it is there; older kernels have no watermark.
    let _ = fs::write(folder.join("buffer/watermark"), "1");
    fs::write(folder.join("buffer/enable"), "1")?;
    found.sort_by_key(|element| element.0);
    Ok(Scan::new(found.into_iter().map(|(_, place, is_time, element)| (place, is_time, element))))
}

impl Link for Iio {
    fn read(&mut self, buffer: &mut [u8], patience: Duration) -> io::Result<Got> {
        self.lines.clear();
        match &mut self.readings {
            Readings::Buffered { file, scan, bytes, .. } => {
                if !has_come(file, patience)? {
                    return Ok(Got::Nothing);
                }
                let before = bytes.len();
                let most = (buffer.len() / LINE).max(1) * scan.length();
                bytes.resize(before.max(most), 0);
                match file.read(&mut bytes[before..]) {
                    Ok(0) => return Ok(Got::End),
                    Ok(n) => bytes.truncate(before + n),
                    Err(e) => {
                        bytes.truncate(before);
                        let later = matches!(e.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::Interrupted);
                        return if later { Ok(Got::Nothing) } else { Err(e) };
                    }
                }
                let whole = bytes.len() / scan.length() * scan.length();
                for one in bytes[..whole].chunks(scan.length()) {
                    let (time, values) = scan.values(one);
                    line(&mut self.lines, time, &values);
                }
                bytes.drain(..whole);
            }
            Readings::Polled { files, due, period } => {
                let rest = due.saturating_duration_since(Instant::now());
                sleep(rest.min(patience));
                if rest > patience {
                    return Ok(Got::Nothing);
                }
                // Late readings are not made up for.
                *due = (*due + *period).max(Instant::now());
                let mut values = [f64::NAN; CHANNELS.len()];
                let time = now_ns();
                for (value, file) in values.iter_mut().zip(files) {
                    if let Some((path, scale, offset)) = file {
                        let raw = fs::read_to_string(path)?;
                        *value = raw.trim().parse().map_or(f64::NAN, |raw: f64| (raw + *offset) * *scale);
                    }
                }
                line(&mut self.lines, Some(time.cast_signed()), &values);
            }
        }
        buffer[..self.lines.len()].copy_from_slice(self.lines.as_bytes());
        Ok(if self.lines.is_empty() { Got::Nothing } else { Got::Bytes(self.lines.len()) })
    }
}

/// Appends a line; a scan without a time has ours.
fn line(lines: &mut String, time: Option<i64>, values: &[f64; CHANNELS.len()]) {
    let _ = write!(lines, "{}", time.unwrap_or_else(|| now_ns().cast_signed()));
    for value in values {
        let _ = if value.is_finite() { write!(lines, ",{value:e}") } else { write!(lines, ",") };
    }
    lines.push('\n');
}

impl Drop for Iio {
    fn drop(&mut self) {
        if let Readings::Buffered { folder, .. } = &self.readings {
            let _ = fs::write(folder.join("buffer/enable"), "0");
        }
    }
}
