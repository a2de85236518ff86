//! MAVLink 1 and 2: the inertial sensor's messages become rows, an orientation that others measured joins the next row.
//!
//! The autopilot's own attitude is made from the very gyro that is to be judged: it is no reference.

use super::{Format, Found, frames::check};
use crate::live::{Content, Fault};
use crc::{CRC_16_MCRF4XX, Crc};
use gyro_model::{Axis, Row};
use nalgebra::{Quaternion, UnitQuaternion};

const CHECKSUM: Crc<u16> = Crc::<u16>::new(&CRC_16_MCRF4XX);
/// The bytes that a message begins with.
const MAGICS: [u8; 2] = [0xfe, 0xfd];
const SIGNED: u8 = 1;
const SIGNATURE: usize = 13;
/// The longest payload, bytes.
const LONGEST: usize = 255;
/// milli-g in m/s².
const MILLI_G: f64 = 9.806_65e-3;

/// Messages that are understood: number, and the byte that its definition adds to the checksum.
const KNOWN: [(u32, u8); 8] = [
    (RAW_IMU, 144),
    (SCALED_IMU, 170),
    (SCALED_IMU2, 76),
    (SCALED_IMU3, 46),
    (HIGHRES_IMU, 93),
    (VISION_POSITION_ESTIMATE, 158),
    (ODOMETRY, 91),
    (WHEEL_DISTANCE, 113),
];
const SCALED_IMU: u32 = 26;
const RAW_IMU: u32 = 27;
const VISION_POSITION_ESTIMATE: u32 = 102;
const HIGHRES_IMU: u32 = 105;
const SCALED_IMU2: u32 = 116;
const SCALED_IMU3: u32 = 129;
const ODOMETRY: u32 = 331;
const WHEEL_DISTANCE: u32 = 9000;

/// Kinds of odometry that a gyro of the autopilot has no part in: unknown, vision, vision with a gyro of its own, motion
/// capture, lidar.
const FOREIGN_ESTIMATORS: [u8; 5] = [0, 2, 3, 6, 7];
/// Wheels whose distance is a free channel.
const WHEELS: usize = 2;

/// Finds rows in MAVLink.
#[derive(Default)]
pub struct Mavlink {
    bytes: Vec<u8>,
    /// Whether a message ended where the bytes begin.
    synchronous: bool,
    /// Who sends, and which message: one sensor of one vehicle.
    sensor: Option<(u8, u8, u32)>,
    number: Option<u8>,
    orientation: Option<[f64; 4]>,
    wheels: Option<[f64; WHEELS]>,
    content: Option<Content>,
}

/// A message as it stands in the bytes.
struct Message {
    length: usize,
    number: u8,
    sender: (u8, u8),
    id: u32,
    payload: [u8; LONGEST],
    /// Whether its checksum fits; none said where its definition is not known.
    fits: Option<bool>,
}

impl Message {
    /// The message at the beginning of these bytes; `None` while it is not whole.
    fn at(bytes: &[u8]) -> Option<Self> {
        let (&magic, &length) = (bytes.first()?, bytes.get(1)?);
        let newer = magic == MAGICS[1];
        let head = if newer { 10 } else { 6 };
        let header = bytes.get(..head)?;
        let signature = if newer && header[2] & SIGNED != 0 { SIGNATURE } else { 0 };
        let end = head + usize::from(length);
        let sum = u16::from_le_bytes(bytes.get(end..end + 2)?.try_into().ok()?);
        bytes.get(..end + 2 + signature)?;
        let (number, sender, id) = if newer {
            (header[4], (header[5], header[6]), u32::from_le_bytes([header[7], header[8], header[9], 0]))
        } else {
            (header[2], (header[3], header[4]), header[5].into())
        };
        // Zeros at a payload's end are not sent.
        let mut payload = [0; LONGEST];
        payload[..usize::from(length)].copy_from_slice(&bytes[head..end]);
        let fits = KNOWN.iter().find(|known| known.0 == id).map(|known| {
            let mut digest = CHECKSUM.digest();
            digest.update(&bytes[1..end]);
            digest.update(&[known.1]);
            digest.finalize() == sum
        });
        Some(Self { length: end + 2 + signature, number, sender, id, payload, fits })
    }

    fn float(&self, at: usize) -> f64 {
        self.payload[at..].first_chunk().map_or(f64::NAN, |b| f32::from_le_bytes(*b).into())
    }

    fn double(&self, at: usize) -> f64 {
        self.payload[at..].first_chunk().map_or(f64::NAN, |b| f64::from_le_bytes(*b))
    }

    fn short(&self, at: usize) -> f64 {
        self.payload[at..].first_chunk().map_or(f64::NAN, |b| i16::from_le_bytes(*b).into())
    }

    fn micros(&self) -> i128 {
        self.payload.first_chunk().map_or(0, |b| i128::from(u64::from_le_bytes(*b)) * 1000)
    }

    fn millis(&self) -> i128 {
        self.payload.first_chunk().map_or(0, |b| i128::from(u32::from_le_bytes(*b)) * 1_000_000)
    }
}

impl Mavlink {
    /// Finds the messages in what has come; `whole`: nothing more comes.
    fn find(&mut self, whole: bool, found: &mut dyn FnMut(Found)) {
        let bytes = std::mem::take(&mut self.bytes);
        let mut at = 0;
        while at < bytes.len() {
            let rest = &bytes[at..];
            let message = if MAGICS.contains(&rest[0]) {
                match Message::at(rest) {
                    None if !whole => break,
                    message => message,
                }
            } else {
                None
            };
            match message {
                Some(message) if message.fits == Some(true) => {
                    at += message.length;
                    self.synchronous = true;
                    self.take_message(&message, found);
                }
                // Its length is believed only where it stands in its place.
                Some(message) if message.fits.is_none() && self.synchronous => at += message.length,
                _ => {
                    if std::mem::take(&mut self.synchronous) {
                        let says = format!("{} bytes that are not a message", rest.len());
                        found(Found::Fault(Fault::Garbled, says));
                    }
                    at += 1;
                }
            }
        }
        self.bytes = bytes;
        self.bytes.drain(..at);
    }

    fn take_message(&mut self, message: &Message, found: &mut dyn FnMut(Found)) {
        match message.id {
            VISION_POSITION_ESTIMATE => {
                let [roll, pitch, yaw] = [20, 24, 28].map(|at| message.float(at));
                let q = UnitQuaternion::from_euler_angles(roll, pitch, yaw);
                self.orientation = Some([q.w, q.i, q.j, q.k]);
            }
            // The kind of estimator is an extension: where it is not sent it is unknown.
            ODOMETRY if FOREIGN_ESTIMATORS.contains(&message.payload[231]) => {
                let [w, x, y, z] = [20, 24, 28, 32].map(|at| message.float(at));
                let q = Quaternion::new(w, x, y, z);
                self.orientation = (q.norm() > 0.5).then_some([w, x, y, z]);
            }
            WHEEL_DISTANCE => self.wheels = Some(std::array::from_fn(|k| message.double(8 + 8 * k))),
            ODOMETRY => {}
            _ => self.take_reading(message, found),
        }
    }

    fn take_reading(&mut self, message: &Message, found: &mut dyn FnMut(Found)) {
        let who = (message.sender.0, message.sender.1, message.id);
        match self.sensor {
            Some(sensor) if sensor == who => {}
            // The finest of a vehicle's messages is taken in place of what came first.
            Some((a, b, id)) if (a, b) == message.sender && message.id == HIGHRES_IMU && id != HIGHRES_IMU => {
                self.sensor = Some(who);
                found(Found::Begins);
            }
            Some(_) => return,
            None => self.sensor = Some(who),
        }
        self.number = Some(message.number);
        let (mut row, time) = reading(message);
        row.ref_quaternion = self.orientation.take().unwrap_or([f64::NAN; 4]);
        row.free[..WHEELS].copy_from_slice(&self.wheels.unwrap_or([f64::NAN; WHEELS]));
        if check(&mut row) {
            found(Found::Fault(Fault::Value, format!("message {} of kind {}", message.number, message.id)));
        }
        self.content.get_or_insert_with(|| Content {
            gyros: Axis::ALL.to_vec(),
            referenced: Vec::new(),
            free_names: (1..=WHEELS).map(|k| format!("wheel_{k}")).collect(),
        });
        found(Found::Row(row, time));
    }
}

/// What a sensor's message says, and its time, ns.
fn reading(message: &Message) -> (Row, i128) {
    let mut row = Row::EMPTY;
    if message.id == HIGHRES_IMU {
        // Which of the values are new: three bits each of acceleration and rate.
        let fields = u16::from_le_bytes([message.payload[60], message.payload[61]]);
        let value = |bit: u32, at| if fields >> bit & 1 == 1 { message.float(at) } else { f64::NAN };
        row.accel = [value(0, 8), value(1, 12), value(2, 16)];
        row.gyro = [value(3, 20), value(4, 24), value(5, 28)];
        row.temperature = value(12, 56);
        return (row, message.micros());
    }
    let (time, at) = if message.id == RAW_IMU { (message.micros(), 8) } else { (message.millis(), 4) };
    row.accel = [0, 2, 4].map(|k| message.short(at + k) * MILLI_G);
    row.gyro = [6, 8, 10].map(|k| message.short(at + k) * 1e-3);
    // 0.01 °C; 0 stands for none.
    let temperature = message.short(if message.id == RAW_IMU { 27 } else { 22 });
    row.temperature = if temperature == 0.0 { f64::NAN } else { 0.01 * temperature };
    (row, time)
}

impl Format for Mavlink {
    fn take(&mut self, bytes: &[u8], found: &mut dyn FnMut(Found)) {
        self.bytes.extend_from_slice(bytes);
        self.find(false, found);
    }

    fn cut(&mut self, found: &mut dyn FnMut(Found)) {
        self.find(true, found);
        self.bytes.clear();
        // The next packet begins with a message.
        self.synchronous = true;
    }

    fn content(&self) -> Option<&Content> {
        self.content.as_ref()
    }
}
