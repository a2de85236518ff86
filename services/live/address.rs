//! Where a live source is: `serial:/dev/ttyUSB0?baud=115200&format=csv`, `udp:0.0.0.0:5600`, `tcp:host:port`,
//! `mavlink:udp:0.0.0.0:14550`, `iio:device0`, `can:can0?dbc=car.dbc`.

use super::{
    kind::Kind,
    link::{Link, can, iio, pipe::Pipe, serial, tcp, udp},
};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error as _};
use std::{
    fmt, io,
    path::{Path, PathBuf},
    str::FromStr,
    time::Duration,
};

/// A live source's address, understood.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    text: String,
    /// How bytes come.
    pub way: Way,
    /// What they are.
    pub format: Kind,
    /// The columns, where the source does not say them: a header row.
    pub header: Option<String>,
    /// Whether its rows hold a reference alone, without a gyro.
    pub is_reference: bool,
    /// How long a link may be silent before it is opened anew; none said: without end.
    pub silence: Option<Duration>,
    /// The DBC file that says what frames of a CAN bus mean.
    pub dbc: Option<PathBuf>,
}

/// How bytes come.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Way {
    /// A terminal device and its speed.
    Serial(PathBuf, u32),
    /// Packets to this address of ours.
    Udp(String),
    /// A server.
    Tcp(String),
    /// A sensor of Linux' industrial I/O.
    Iio(iio::Place),
    /// A CAN interface.
    Can(String),
    /// Standard input or a named pipe.
    Pipe(PathBuf),
}

/// Why a text is no address.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum AddressError {
    /// An option that there is not.
    #[error("unknown option '{option}' of {address}: {known}")]
    Option {
        /// As it stands there.
        option: String,
        /// The whole.
        address: String,
        /// What there is.
        known: &'static str,
    },
    /// Neither an address nor a file.
    #[error("{0}: there is no such file, and no address begins so: {known}", known = SCHEMES.map(|scheme| format!("{scheme}:…")).join(", "))]
    Scheme(String),
    /// Not of the form `HOST:PORT`.
    #[error("{address}: a host and a port are needed, such as {example}")]
    HostPort {
        /// The whole.
        address: String,
        /// One that is.
        example: &'static str,
    },
    /// No device.
    #[error("{0}: the device is missing, such as serial:/dev/ttyUSB0")]
    Device(String),
    /// No sensor.
    #[error("{0}: the sensor is missing, such as iio:device0, or its name")]
    Sensor(String),
    /// No interface.
    #[error("{0}: the interface is missing, such as can:can0?dbc=car.dbc")]
    Interface(String),
    /// Frames whose meaning nobody says.
    #[error("{0}: what the frames mean is defined in a DBC file: add dbc=FILE.dbc after `?`, or give it with --dbc")]
    Dbc(String),
    /// MAVLink over something else.
    #[error("{0}: MAVLink comes by udp, tcp or serial, such as mavlink:udp:0.0.0.0:14550")]
    Mavlink(String),
}

const KNOWN: &str = "baud=115200 (serial), format=csv, frames or candump, dbc=FILE.dbc (candump, can), header=t,gyro_z,… (csv), silence=SECONDS, rate=HZ and root=PATH (iio)";
/// The words that an address begins with.
const SCHEMES: [&str; 6] = ["serial", "udp", "tcp", "mavlink", "iio", "can"];
const BAUD: u32 = 115_200;
/// Readings a second of a sensor without a buffer, and at most.
const RATE_HZ: u32 = 100;
const FASTEST_HZ: u32 = 10_000;

impl Address {
    /// Whether a text is meant as an address, be it a right one or not.
    #[must_use]
    pub fn is_meant(text: &str) -> bool {
        text.split_once(':').is_some_and(|(scheme, _)| SCHEMES.contains(&scheme))
    }

    /// Whether a text looks like an address of a kind that there is not, and is no file.
    #[must_use]
    pub fn is_misspelt(text: &str) -> bool {
        let is_word = |scheme: &str| !scheme.is_empty() && scheme.bytes().all(|b| b.is_ascii_alphanumeric());
        text.split_once(':').is_some_and(|(scheme, _)| is_word(scheme)) && !Path::new(text).exists()
    }

    /// An address whose frames of a CAN bus are told by this DBC file, where frames come by it and it names none itself.
    ///
    /// # Errors
    /// A text that is no address.
    pub fn of_frames(text: &str, dbc: &Path) -> Result<Self, AddressError> {
        match text.parse() {
            Err(AddressError::Dbc(_)) => {
                let mark = if text.contains('?') { '&' } else { '?' };
                format!("{text}{mark}dbc={}", dbc.display()).parse()
            }
            parsed => parsed,
        }
    }

    /// Of standard input (`-`) or a pipe: CSV, or the lines of `candump` where a DBC file says what they mean.
    #[must_use]
    pub fn of_pipe(path: PathBuf, dbc: Option<PathBuf>) -> Self {
        let text =
            if Pipe::is_standard_input(&path) { "standard input".to_owned() } else { path.display().to_string() };
        let format = if dbc.is_some() { Kind::Candump } else { Kind::Csv };
        Self { text, way: Way::Pipe(path), format, header: None, is_reference: false, silence: None, dbc }
    }

    /// Whether rows come by standard input.
    #[must_use]
    pub fn is_standard_input(&self) -> bool {
        matches!(&self.way, Way::Pipe(path) if Pipe::is_standard_input(path))
    }

    /// The same, of rows that hold a reference alone.
    #[must_use]
    pub fn of_reference(self) -> Self {
        Self { is_reference: true, ..self }
    }

    /// The same with a DBC file that is found from this folder.
    #[must_use]
    pub fn from_folder(mut self, folder: &Path) -> Self {
        if let Some(dbc) = self.dbc.as_mut().filter(|dbc| dbc.is_relative()) {
            let whole = folder.join(&dbc);
            self.text = self.text.replacen(&format!("dbc={}", dbc.display()), &format!("dbc={}", whole.display()), 1);
            *dbc = whole;
        }
        self
    }

    /// Opens the way to it.
    ///
    /// # Errors
    /// Where nothing is there, or it may not be used.
    pub fn open(&self) -> io::Result<Box<dyn Link>> {
        Ok(match &self.way {
            Way::Serial(path, baud) => Box::new(serial::Serial::open(path, *baud)?),
            Way::Udp(place) => Box::new(udp::Udp::open(place)?),
            Way::Tcp(place) => Box::new(tcp::Tcp::open(place)?),
            Way::Iio(place) => Box::new(iio::Iio::open(place)?),
            Way::Can(name) => Box::new(can::Can::open(name)?),
            Way::Pipe(path) => Box::new(Pipe::open(path)?),
        })
    }

    /// Why it could not be opened, and what there is in its place.
    #[must_use]
    pub fn why(&self, error: &io::Error) -> String {
        match &self.way {
            Way::Serial(path, _) => serial::says(path, error),
            _ => error.to_string(),
        }
    }

    /// Whether it has an end, and what was read cannot come again.
    #[must_use]
    pub fn is_pipe(&self) -> bool {
        matches!(self.way, Way::Pipe(_))
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let (place, options) = text.split_once('?').unwrap_or((text, ""));
        let mavlink = place.strip_prefix("mavlink:");
        let (scheme, place) = mavlink.unwrap_or(place).split_once(':').unwrap_or(("", ""));
        let mut address = Self {
            text: text.to_owned(),
            way: Way::Udp(place.to_owned()),
            format: match (mavlink, scheme) {
                (Some(_), _) => Kind::Mavlink,
                (_, "can") => Kind::Candump,
                _ => Kind::Csv,
            },
            header: None,
            is_reference: false,
            silence: None,
            dbc: None,
        };
        let mut baud = BAUD;
        let mut sensor = iio::Place { device: place.to_owned(), root: "/".into(), rate_hz: RATE_HZ };
        for option in options.split('&').filter(|option| !option.is_empty()) {
            let unknown = || AddressError::Option { option: option.to_owned(), address: text.to_owned(), known: KNOWN };
            let (name, value) = option.split_once('=').ok_or_else(unknown)?;
            match name {
                "baud" if scheme == "serial" => {
                    baud = value.parse().ok().filter(|&baud| serial::is_speed(baud)).ok_or_else(unknown)?;
                }
                "rate" if scheme == "iio" => {
                    let rate = value.parse().ok().filter(|rate| (1..=FASTEST_HZ).contains(rate));
                    sensor.rate_hz = rate.ok_or_else(unknown)?;
                }
                "root" if scheme == "iio" => sensor.root = value.into(),
                "dbc" if mavlink.is_none() && scheme != "iio" && !value.is_empty() => address.dbc = Some(value.into()),
                "format" if mavlink.is_none() && !matches!(scheme, "iio" | "can") => {
                    address.format = value.parse().map_err(|()| unknown())?;
                }
                "header" if address.format == Kind::Csv && scheme != "iio" => address.header = Some(value.to_owned()),
                "silence" => {
                    let seconds = value.parse().ok().filter(|&s: &f64| s > 0.0 && s <= 1e6).ok_or_else(unknown)?;
                    address.silence = Some(Duration::from_secs_f64(seconds));
                }
                _ => return Err(unknown()),
            }
        }
        if address.dbc.is_none() != (address.format != Kind::Candump) {
            let option = || AddressError::Option { option: "dbc".to_owned(), address: text.to_owned(), known: KNOWN };
            return Err(if address.dbc.is_none() { AddressError::Dbc(text.to_owned()) } else { option() });
        }
        let host_port = |example| {
            let good =
                place.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
            if good { Ok(()) } else { Err(AddressError::HostPort { address: text.to_owned(), example }) }
        };
        address.way = match scheme {
            "serial" if place.is_empty() => return Err(AddressError::Device(text.to_owned())),
            "serial" => Way::Serial(place.into(), baud),
            "udp" => host_port(udp::EXAMPLE).map(|()| Way::Udp(place.to_owned()))?,
            "tcp" => host_port(tcp::EXAMPLE).map(|()| Way::Tcp(place.to_owned()))?,
            "can" | "iio" if mavlink.is_some() => return Err(AddressError::Mavlink(text.to_owned())),
            "can" if place.is_empty() => return Err(AddressError::Interface(text.to_owned())),
            "can" => Way::Can(place.to_owned()),
            "iio" if place.is_empty() => return Err(AddressError::Sensor(text.to_owned())),
            "iio" => {
                address.header = Some(iio::HEADER.to_owned());
                Way::Iio(sensor)
            }
            _ => return Err(AddressError::Mavlink(text.to_owned())),
        };
        Ok(address)
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

impl Serialize for Address {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Address {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(D::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::{Address, Kind, Way};
    use std::time::Duration;

    #[test]
    fn an_address_says_how_bytes_come_and_what_they_are() {
        let serial: Address = "serial:/dev/ttyACM0?baud=921600&format=frames&silence=2".parse().unwrap();
        assert_eq!(serial.way, Way::Serial("/dev/ttyACM0".into(), 921_600));
        assert_eq!((serial.format, serial.silence), (Kind::Frames, Some(Duration::from_secs(2))));
        let udp: Address = "udp:[::]:5600?header=t_us,gyro_z_dps".parse().unwrap();
        assert_eq!((udp.way, udp.header.as_deref()), (Way::Udp("[::]:5600".into()), Some("t_us,gyro_z_dps")));
        let can = "can:can0?dbc=car.dbc".parse::<Address>().unwrap().from_folder("/etc".as_ref());
        assert_eq!((can.format, can.to_string()), (Kind::Candump, "can:can0?dbc=/etc/car.dbc".to_owned()));
        assert_eq!((can.to_string().parse(), can.way.clone()), (Ok(can), Way::Can("can0".to_owned())));
        let mavlink: Address = "mavlink:serial:/dev/ttyS1".parse().unwrap();
        assert_eq!((mavlink.way, mavlink.format), (Way::Serial("/dev/ttyS1".into(), 115_200), Kind::Mavlink));
    }

    #[test]
    fn a_dbc_file_beside_the_address_is_that_of_frames_which_come_without_one() {
        let beside = |text: &str| Address::of_frames(text, "car.dbc".as_ref()).unwrap().to_string();
        assert_eq!(beside("can:can0"), "can:can0?dbc=car.dbc");
        assert_eq!(beside("udp:[::]:1?format=candump"), "udp:[::]:1?format=candump&dbc=car.dbc");
        assert_eq!(beside("can:can0?dbc=own.dbc"), "can:can0?dbc=own.dbc");
        assert_eq!(beside("serial:/dev/x"), "serial:/dev/x");
        assert!(Address::of_frames("can:", "car.dbc".as_ref()).is_err());
    }

    #[test]
    fn what_is_wrong_in_an_address_is_named() {
        for (text, says) in [
            ("serial:", "the device is missing"),
            ("serial:/dev/x?baud=12", "'baud=12'"),
            ("serial:/dev/x?bad=1", "'bad=1'"),
            ("udp:5600", "a host and a port"),
            ("tcp:host:99999", "a host and a port"),
            ("udp:0.0.0.0:1?baud=9600", "'baud=9600'"),
            ("udp:0.0.0.0:1?format=xml", "'format=xml'"),
            ("can:?dbc=a.dbc", "the interface is missing"),
            ("can:can0", "add dbc=FILE.dbc"),
            ("can:can0?dbc=a.dbc&format=csv", "'format=csv'"),
            ("udp:0.0.0.0:1?format=candump", "add dbc=FILE.dbc"),
            ("udp:0.0.0.0:1?dbc=a.dbc", "'dbc'"),
            ("mavlink:can:can0", "MAVLink comes by"),
            ("iio:", "the sensor is missing"),
            ("iio:device0?rate=0", "'rate=0'"),
            ("mavlink:iio:device0", "MAVLink comes by"),
            ("mavlink:/dev/x", "MAVLink comes by"),
            ("mavlink:udp:0.0.0.0:1?format=csv", "'format=csv'"),
        ] {
            assert!(Address::is_meant(text));
            let error = text.parse::<Address>().unwrap_err().to_string();
            assert!(error.contains(says), "{text}: {error}");
        }
        assert!(!Address::is_meant("log.csv") && !Address::is_meant("/dev/ttyUSB0"));
    }
}
