//! ROS 2 topics in: a line of CSV for every reading of the gyro, with what the reference said since the one before.

use crate::{
    keys,
    session::{self, Reach},
    wall_ns,
};
use anyhow::{Context, Result, anyhow, bail};
use log_readers::{
    format::{Note, Sink, Topic},
    formats::ros::{Connections, Wire, definition},
};
use std::{
    cell::RefCell,
    collections::BTreeSet,
    fmt::Write as _,
    io::{self, Write as _},
    net::UdpSocket,
    rc::Rc,
    sync::mpsc::{self, RecvTimeoutError, Sender},
    time::Duration,
};
use zenoh::{Session, Wait, pubsub::Subscriber, sample::Sample};

/// What `truerate-ros2 listen` takes.
#[derive(clap::Args, Debug, Clone)]
pub struct Args {
    #[command(flatten)]
    reach: Reach,
    /// The gyro: sensor_msgs/msg/Imu. Its orientation is not taken: it was computed from this gyro
    #[arg(long, value_name = "TOPIC")]
    imu: String,
    /// The reference: a pose or transform of motion capture or vision, odometry that no gyro goes into, the joint of an encoder, or
    /// another IMU
    #[arg(long, value_name = "TOPIC")]
    reference: Option<String>,
    /// The joint of a JointState; the only one, where nothing is said
    #[arg(long, value_name = "NAME")]
    joint: Option<String>,
    /// The gyro's axis that the joint turns about
    #[arg(long, value_name = "x|y|z", default_value = "z")]
    axis: char,
    /// Send each line as a packet to `udp:HOST:PORT`, in place of standard output
    #[arg(long, value_name = "udp:ADDR")]
    to: Option<String>,
}

/// Where a message came from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum From {
    Imu,
    Reference,
}

struct Arrival {
    from: From,
    key: String,
    bytes: Vec<u8>,
    came_ns: u64,
}

const GYRO: [&str; 6] = [
    "angular_velocity.x",
    "angular_velocity.y",
    "angular_velocity.z",
    "linear_acceleration.x",
    "linear_acceleration.y",
    "linear_acceleration.z",
];
const GYRO_COLUMNS: &str = "t,gyro_x,gyro_y,gyro_z,accel_x,accel_y,accel_z";
/// Without a message for so long it is said what is waited for.
const SILENCE: Duration = Duration::from_secs(2);

/// Listens until nobody reads any more.
pub fn run(args: &Args) -> Result<()> {
    if !"xyz".contains(args.axis) {
        bail!("--axis {}: x, y or z", args.axis);
    }
    if args.reference.as_ref() == Some(&args.imu) {
        bail!("{}: a gyro cannot be its own reference", args.imu);
    }
    let mut out = Out::open(args.to.as_deref())?;
    let (sender, arrivals) = mpsc::channel();
    let session = session::open(&args.reach)?;
    let _imu = subscribe(&session, args.reach.domain, &args.imu, From::Imu, sender.clone())?;
    let _reference = match &args.reference {
        Some(topic) => Some(subscribe(&session, args.reach.domain, topic, From::Reference, sender)?),
        None => None,
    };
    let (mut of_imu, mut of_reference) = (Last::default(), Last::default());
    let (mut imu, mut reference) = (Decoder::new(&mut of_imu), Decoder::new(&mut of_reference));
    let mut columns: Option<Columns> = args.reference.is_none().then(Columns::default);
    let mut newest: Option<Vec<f64>> = None;
    let (mut heard, mut begun) = (BTreeSet::new(), false);
    loop {
        let arrival = match arrivals.recv_timeout(SILENCE) {
            Ok(arrival) => arrival,
            Err(RecvTimeoutError::Timeout) => {
                let silent = |from: From, topic: &str| (!heard.contains(&from)).then(|| topic.to_owned());
                let of_reference = args.reference.as_deref().and_then(|topic| silent(From::Reference, topic));
                let waited: Vec<String> = silent(From::Imu, &args.imu).into_iter().chain(of_reference).collect();
                if !waited.is_empty() {
                    eprintln!("truerate-ros2: no message yet of {}", waited.join(" and "));
                }
                continue;
            }
            Err(RecvTimeoutError::Disconnected) => return Ok(()),
        };
        heard.insert(arrival.from);
        match arrival.from {
            From::Reference => {
                let Some(message) = reference.decode(&arrival)? else { continue };
                let own = match &columns {
                    Some(own) => own,
                    None => columns.insert(Columns::of(&message, args)?),
                };
                newest = Some(own.values(&message));
            }
            From::Imu => {
                let (Some(message), Some(columns)) = (imu.decode(&arrival)?, &columns) else { continue };
                if !std::mem::replace(&mut begun, true) && !out.begin(&format!("{GYRO_COLUMNS}{}", columns.header))? {
                    return Ok(());
                }
                let mut line = format!("{}.{:09}", message.time_ns / 1_000_000_000, message.time_ns % 1_000_000_000);
                let gyro = GYRO.map(|name| message.value(name).unwrap_or(f64::NAN));
                let told = newest.take().unwrap_or_else(|| vec![f64::NAN; columns.fields.len()]);
                for value in gyro.into_iter().chain(told) {
                    line.push(',');
                    if value.is_finite() {
                        let _ = write!(line, "{value}");
                    }
                }
                line.push('\n');
                if !out.give(&line)? {
                    return Ok(());
                }
            }
        }
    }
}

fn subscribe(session: &Session, domain: u32, topic: &str, from: From, to: Sender<Arrival>) -> Result<Subscriber<()>> {
    let take = move |sample: Sample| {
        let arrival = Arrival {
            from,
            key: sample.key_expr().to_string(),
            bytes: sample.payload().to_bytes().into_owned(),
            came_ns: wall_ns().unwrap_or(0),
        };
        // Nobody takes it once we end.
        let _ = to.send(arrival);
    };
    let key = keys::any_kind(domain, topic);
    session.declare_subscriber(key).callback(take).wait().map_err(|error| anyhow!("{topic}: {error}"))
}

/// A message's numbers by their names.
#[derive(Clone, Debug)]
struct Message {
    kind: String,
    fields: Rc<Vec<String>>,
    values: Vec<f64>,
    time_ns: i64,
}

impl Message {
    fn value(&self, name: &str) -> Option<f64> {
        let place = self.fields.iter().position(|field| field == name)?;
        self.values.get(place).copied()
    }
}

/// Takes the last message that was decoded.
#[derive(Default)]
struct Last {
    /// Kind and fields of each part of a topic.
    parts: Vec<(String, Rc<Vec<String>>)>,
    message: Rc<RefCell<Option<Message>>>,
}

impl Sink for Last {
    fn topic(&mut self, topic: &Topic) -> bool {
        let fields = topic.fields.iter().map(|field| field.name.clone()).collect();
        self.parts.push((topic.kind.clone(), Rc::new(fields)));
        true
    }

    fn message(&mut self, part: usize, time_ns: i64, values: &[f64]) {
        let (kind, fields) = self.parts[part].clone();
        *self.message.borrow_mut() = Some(Message { kind, fields, values: values.to_vec(), time_ns });
    }

    fn note(&mut self, note: Note) {
        eprintln!("truerate-ros2: {note}");
    }
}

/// Decodes the messages of one topic.
struct Decoder<'a> {
    connections: Connections<'a>,
    last: Rc<RefCell<Option<Message>>>,
    /// Kinds that have come, each a connection.
    kinds: Vec<String>,
    told: bool,
}

impl<'a> Decoder<'a> {
    fn new(last: &'a mut Last) -> Self {
        let message = last.message.clone();
        Self { connections: Connections::new(last), last: message, kinds: Vec::new(), told: false }
    }

    /// The message; `None` for one that is damaged.
    fn decode(&mut self, arrival: &Arrival) -> Result<Option<Message>> {
        let kind = keys::kind_in(&arrival.key).with_context(|| format!("{}: not a topic of ROS 2", arrival.key))?;
        let known = self.kinds.iter().position(|own| *own == kind);
        let connection = known.unwrap_or(self.kinds.len()) as u32;
        if known.is_none() {
            let definition = definition(&kind).with_context(|| {
                format!("messages of the kind {kind} are not known: take Imu, PoseStamped, TransformStamped, Odometry or JointState")
            })?;
            self.connections.connect(connection, "", &kind, Wire::Cdr, &definition);
            self.kinds.push(kind);
        }
        self.connections.message(connection, arrival.came_ns as i64, &arrival.bytes);
        let message = self.last.borrow_mut().take();
        if message.is_none() && !std::mem::replace(&mut self.told, true) {
            eprintln!("truerate-ros2: {}: a damaged message is left out; further ones are not reported", arrival.key);
        }
        Ok(message)
    }
}

/// What a reference's messages have to say, as columns of a log.
#[derive(Default)]
struct Columns {
    header: String,
    fields: Vec<String>,
}

impl Columns {
    fn of(message: &Message, args: &Args) -> Result<Self> {
        let ending = |end: &str| message.fields.iter().find(|field| field.ends_with(end)).cloned();
        let all = |names: [&str; 4], of: &str| {
            let found = names.map(|name| ending(&format!("{of}.{name}")));
            found.into_iter().collect::<Option<Vec<String>>>()
        };
        // An IMU's orientation was computed from its gyro: its rate is the measurement.
        if message.kind != "sensor_msgs/Imu" {
            for of in ["orientation", "rotation", "quaternion"] {
                if let Some(fields) = all(["w", "x", "y", "z"], of) {
                    return Ok(Self { header: ",ref_qw,ref_qx,ref_qy,ref_qz".into(), fields });
                }
            }
        }
        for of in ["angular_velocity", "angular"] {
            let found = ["x", "y", "z"].map(|name| ending(&format!("{of}.{name}")));
            if let Some(fields) = found.into_iter().collect::<Option<Vec<String>>>() {
                return Ok(Self { header: ",ref_rate_x,ref_rate_y,ref_rate_z".into(), fields });
            }
        }
        let positions: Vec<&String> = message.fields.iter().filter(|field| field.contains("position")).collect();
        let is_joint = |field: &&&String| args.joint.as_ref().is_none_or(|joint| field.contains(joint.as_str()));
        let chosen: Vec<&&String> = positions.iter().filter(is_joint).collect();
        match chosen.as_slice() {
            [field] => Ok(Self { header: format!(",ref_angle_{}", args.axis), fields: vec![(**field).clone()] }),
            [] => {
                bail!("messages of the kind {} hold no orientation, rate or joint: {:?}", message.kind, message.fields)
            }
            _ => bail!("there are several joints, say which by --joint: {positions:?}"),
        }
    }

    fn values(&self, message: &Message) -> Vec<f64> {
        self.fields.iter().map(|field| message.value(field).unwrap_or(f64::NAN)).collect()
    }
}

/// Where the lines go.
enum Out {
    Standard(io::BufWriter<io::Stdout>),
    Packets(UdpSocket, String),
}

impl Out {
    fn open(to: Option<&str>) -> Result<Self> {
        let Some(to) = to else { return Ok(Self::Standard(io::BufWriter::new(io::stdout()))) };
        let address = to.strip_prefix("udp:").with_context(|| format!("--to {to}: say udp:HOST:PORT"))?;
        let socket = UdpSocket::bind("0.0.0.0:0").and_then(|socket| socket.connect(address).map(|()| socket));
        Ok(Self::Packets(socket.with_context(|| to.to_owned())?, address.to_owned()))
    }

    /// Says what the columns are; whether somebody still reads.
    fn begin(&mut self, header: &str) -> Result<bool> {
        match self {
            Self::Standard(_) => self.give(&format!("{header}\n")),
            Self::Packets(_, address) => {
                eprintln!("truerate-ros2: truerate run --source 'udp:{address}?header={header}'");
                Ok(true)
            }
        }
    }

    fn give(&mut self, line: &str) -> Result<bool> {
        match self {
            Self::Standard(out) => match out.write_all(line.as_bytes()).and_then(|()| out.flush()) {
                Ok(()) => Ok(true),
                Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(false),
                Err(error) => Err(error).context("standard output"),
            },
            // That nobody listens yet is no error.
            Self::Packets(socket, _) => {
                let _ = socket.send(line.as_bytes());
                Ok(true)
            }
        }
    }
}
