//! Small files of every format, written by hand from the formats' own descriptions.

#![allow(dead_code, clippy::cast_lossless)] // each test file uses a part

mod db3;

use log_readers::{
    can::Database,
    format::{START, Sink, Unreadable},
    formats::{can, recognise},
    json,
};
use std::io::Write;

pub use db3::db3;

/// Messages in each file.
pub const MESSAGES: u64 = 200;

/// Name of the format, and a file of it.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("delimited text", text()),
        ("PX4 ULog", ulog()),
        ("ArduPilot log", ardupilot()),
        ("CAN log (candump)", candump()),
        ("CAN log (Vector ASC)", asc()),
        ("MCAP", mcap("")),
        ("MCAP", mcap("lz4")),
        ("MCAP", mcap("zstd")),
        ("ROS 2 .db3", db3()),
        ("ROS 1 bag", bag("none")),
        ("ROS 1 bag", bag("lz4")),
        ("ROS 1 bag", bag("bz2")),
        #[cfg(feature = "parquet")]
        ("Parquet", parquet()),
    ]
}

/// Written by pyarrow with `parquet.py`.
#[cfg(feature = "parquet")]
pub fn parquet() -> Vec<u8> {
    include_bytes!("small.parquet").to_vec()
}

/// Rate of turn about z at a message.
pub fn rate(k: u64) -> f32 {
    (k as f32 * 0.05).sin()
}

pub fn text() -> Vec<u8> {
    let mut text = "Recorder 7\n# remark\ntime;Gyro Z\n[s];[deg/s]\n".to_owned();
    for k in 0..MESSAGES {
        text += &format!("{:.2};{}\n", k as f64 * 0.01, rate(k)).replace('.', ",");
    }
    text.into_bytes()
}

pub fn json() -> Vec<u8> {
    let record = |k: u64| {
        let (t, rate) = (k as f64 * 0.01, rate(k));
        format!(
            "{{\"t\": {t}, \"gyro\": {{\"y\": 0, \"z\": {rate}}}, \"accel\": [0, 0, 9.81], \"at\": \"a \\\"place\\\"\"}}\n"
        )
    };
    (0..MESSAGES).map(record).collect::<String>().into_bytes()
}

/// What the frames of [`candump`] and [`asc`] mean.
pub const DBC: &str = "\
VERSION \"\"

BU_: IMU ENCODER

BO_ 2566844885 IMU: 12 IMU
 SG_ GYRO_X : 7|16@0- (0.01,0) [0|0] \"deg/s\"  X
 SG_ GYRO_Z : 16|32@1- (1,0) [0|0] \"rad/s\"  X
 SG_ KIND M : 48|8@1+ (1,0) [0|0] \"\"  X
 SG_ TEMP m0 : 56|16@1- (0.01,25) [0|0] \"degC\"  X
 SG_ SUPPLY m1 : 56|16@1+ (0.001,0) [0|0] \"V\"  X

BO_ 291 ENCODER: 2 ENCODER
 SG_ ANGLE_Z : 0|16@1- (0.1,0) [0|0] \"deg\"  X

CM_ BO_ 291 \"on the shaft
BO_ of the turntable\";
SIG_VALTYPE_ 2566844885 GYRO_Z : 1;
";

/// Number of a frame, identifier as it is shown, bytes.
fn frames() -> impl Iterator<Item = (u64, &'static str, Vec<u8>)> {
    (0..MESSAGES).flat_map(|k| {
        let mut imu = (k as i16 - 100).to_be_bytes().to_vec();
        imu.extend(rate(k).to_le_bytes());
        imu.push((k % 2) as u8);
        imu.extend((k as u16).to_le_bytes());
        imu.resize(12, 0);
        [(k, "18FEF1D5", imu), (k, "123", (10 * k as u16).to_le_bytes().to_vec())]
    })
}

pub fn candump() -> Vec<u8> {
    let hex = |data: &[u8]| data.iter().map(|byte| format!("{byte:02X}")).collect::<Vec<_>>().concat();
    let line = |(k, id, data): (u64, &str, Vec<u8>)| {
        let mark = if data.len() > 8 { "##1" } else { "#" };
        format!("({}.{:06}) can0 {id}{mark}{}\n", 1_700_000_000 + k / 100, k % 100 * 10_000, hex(&data))
    };
    frames().map(line).collect::<String>().into_bytes()
}

pub fn asc() -> Vec<u8> {
    let mut text = "date Tue Nov 14 10:13:20.000 pm 2023\nbase hex  timestamps absolute\n// version 8.5.0\n".to_owned();
    for (k, id, data) in frames() {
        let hex = data.iter().map(|byte| format!(" {byte:02X}")).collect::<Vec<_>>().concat();
        let (time, length) = (format!("{}.{:06}", 1_700_000_000 + k / 100, k % 100 * 10_000), data.len());
        let line = match length {
            12 => format!("{time} CANFD   1 Rx {id}x  1 0 9 {length}{hex} 100000 130 3000 0 0 0 0 0\n"),
            _ => format!("{time} 1  {id}             Rx   d {length}{hex}  Length = 200000\n"),
        };
        text.push_str(&line);
    }
    text.into_bytes()
}

/// Reads a file of any format; frames mean what this DBC file says.
pub fn read(bytes: &[u8], dbc: &[u8], sink: &mut dyn Sink) -> Result<(), Unreadable> {
    if json::is_records(&bytes[..bytes.len().min(START)]) {
        return recognise(b"t").read(&mut json::AsCsv::new(bytes), sink);
    }
    let (format, database) = (recognise(bytes), Database::parse(dbc).ok());
    match database.as_ref().and_then(|database| can::with(format, database)) {
        Some(frames) => log_readers::format::Format::read(&frames, &mut &bytes[..], sink),
        None => format.read(&mut &bytes[..], sink),
    }
}

/// A message of a ULog.
pub fn record(out: &mut Vec<u8>, kind: u8, body: &[u8]) {
    out.extend((body.len() as u16).to_le_bytes());
    out.push(kind);
    out.extend(body);
}

pub fn ulog() -> Vec<u8> {
    let mut out = b"ULog\x01\x12\x35\x01".to_vec();
    out.extend(0_u64.to_le_bytes());
    record(&mut out, b'B', &[0; 40]);
    record(&mut out, b'F', b"part:float[2] low;int16_t high;");
    record(&mut out, b'F', b"sensor_gyro:uint64_t timestamp;float x;float y;float z;part more;uint8_t[2] _padding0;");
    record(&mut out, b'A', b"\x00\x07\x00sensor_gyro");
    record(&mut out, b'A', b"\x01\x08\x00sensor_gyro");
    for k in 0..MESSAGES {
        for id in [7_u16, 8] {
            let mut body = id.to_le_bytes().to_vec();
            body.extend((1_000_000 + k * 5000).to_le_bytes());
            for value in [0.5, -0.5, rate(k), 1.0, 2.0] {
                body.extend(value.to_le_bytes());
            }
            body.extend((-3_i16).to_le_bytes());
            record(&mut out, b'D', &body);
        }
        if k % 50 == 0 {
            record(&mut out, b'S', b"\x2f\x73\x13\x20\x25\x0c\xbb\x12");
        }
    }
    record(&mut out, b'O', &20_u16.to_le_bytes());
    out
}

fn padded(text: &str, length: usize) -> Vec<u8> {
    let mut bytes = text.as_bytes().to_vec();
    bytes.resize(length, 0);
    bytes
}

pub fn ardupilot() -> Vec<u8> {
    let mut out = Vec::new();
    let define = |out: &mut Vec<u8>, kind: u8, length: u8, name: &str, format: &str, labels: &str| {
        out.extend([0xa3, 0x95, 128, kind, length]);
        out.extend(padded(name, 4));
        out.extend(padded(format, 16));
        out.extend(padded(labels, 64));
    };
    define(&mut out, 128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns");
    define(&mut out, 129, 12 + 64, "UNIT", "QbZ", "TimeUS,Id,Label");
    define(&mut out, 130, 12 + 32, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds");
    define(&mut out, 131, 3 + 8 + 1 + 12 + 2 + 4, "IMU", "QBfffcn", "TimeUS,I,GyrX,GyrY,GyrZ,T,Tag");
    out.extend([0xa3, 0x95, 129]);
    out.extend([0; 8]);
    out.push(b'E');
    out.extend(padded("rad/s", 64));
    out.extend([0xa3, 0x95, 130]);
    out.extend([0; 8]);
    out.push(131);
    out.extend(padded("s#EEEO-", 16));
    out.extend(padded("F-000--", 16));
    for k in 0..MESSAGES {
        for instance in [0, 1] {
            out.extend([0xa3, 0x95, 131]);
            out.extend((k * 2500).to_le_bytes());
            out.push(instance);
            for value in [0.1, 0.2, rate(k)] {
                out.extend(value.to_le_bytes());
            }
            out.extend(2512_i16.to_le_bytes());
            out.extend(b"abcd");
        }
    }
    out
}

const IMU: &str = "Header header\nVector3 angular_velocity\nfloat64[9] covariance\n================\nMSG: std_msgs/Header\nTIME stamp\n\
    string frame_id\n================\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n";

fn stamp_ns(k: u64) -> u64 {
    1_700_000_000_000_000_000 + k * 10_000_000
}

/// An Imu message's bytes, in ROS 2's way or ROS 1's.
fn imu(k: u64, cdr: bool) -> Vec<u8> {
    let mut body: Vec<u8> = if cdr { vec![0, 1, 0, 0] } else { 0_u32.to_le_bytes().to_vec() };
    body.extend(((stamp_ns(k) / 1_000_000_000) as u32).to_le_bytes());
    body.extend(((stamp_ns(k) % 1_000_000_000) as u32).to_le_bytes());
    let name: &[u8] = if cdr { b"imu\0" } else { b"imu" };
    body.extend((name.len() as u32).to_le_bytes());
    body.extend(name);
    while cdr && !(body.len() - 4).is_multiple_of(8) {
        body.push(0);
    }
    for value in [0.0, 1.0, f64::from(rate(k))] {
        body.extend(value.to_le_bytes());
    }
    body.extend([0; 72]);
    body
}

fn prefixed(out: &mut Vec<u8>, bytes: &[u8]) {
    out.extend((bytes.len() as u32).to_le_bytes());
    out.extend(bytes);
}

pub fn mcap(compression: &str) -> Vec<u8> {
    mcap_of(compression, "sensor_msgs/msg/Imu", &IMU.replace("TIME", "builtin_interfaces/Time"), |k| imu(k, true))
}

/// Messages of one kind under `/imu`.
pub fn mcap_of(compression: &str, kind: &str, definition: &str, body: impl Fn(u64) -> Vec<u8>) -> Vec<u8> {
    let magic = b"\x89MCAP0\r\n";
    let record = |out: &mut Vec<u8>, kind: u8, body: &[u8]| {
        out.push(kind);
        out.extend((body.len() as u64).to_le_bytes());
        out.extend(body);
    };
    let mut out = magic.to_vec();
    let mut header = Vec::new();
    prefixed(&mut header, b"ros2");
    prefixed(&mut header, b"by hand");
    record(&mut out, 1, &header);
    let mut inner = Vec::new();
    let mut schema = 1_u16.to_le_bytes().to_vec();
    prefixed(&mut schema, kind.as_bytes());
    prefixed(&mut schema, b"ros2msg");
    prefixed(&mut schema, definition.as_bytes());
    record(&mut inner, 3, &schema);
    let mut channel = [1_u16.to_le_bytes(), 1_u16.to_le_bytes()].concat();
    prefixed(&mut channel, b"/imu");
    prefixed(&mut channel, b"cdr");
    channel.extend([0; 4]);
    record(&mut inner, 4, &channel);
    for k in 0..MESSAGES {
        let mut message = 1_u16.to_le_bytes().to_vec();
        message.extend((k as u32).to_le_bytes());
        message.extend((stamp_ns(k) + 2_000_000).to_le_bytes());
        message.extend(stamp_ns(k).to_le_bytes());
        message.extend(body(k));
        record(&mut inner, 5, &message);
    }
    let size = inner.len() as u64;
    let packed = match compression {
        "lz4" => lz4(&inner),
        "zstd" => ruzstd::encoding::compress_to_vec(&inner[..], ruzstd::encoding::CompressionLevel::Fastest),
        _ => inner,
    };
    let mut chunk = [0_u64, 0, size].map(u64::to_le_bytes).concat();
    chunk.extend([0; 4]);
    prefixed(&mut chunk, compression.as_bytes());
    chunk.extend((packed.len() as u64).to_le_bytes());
    chunk.extend(packed);
    record(&mut out, 6, &chunk);
    record(&mut out, 0x0f, &[0; 4]);
    record(&mut out, 2, &[0; 20]);
    out.extend(magic);
    out
}

fn lz4(bytes: &[u8]) -> Vec<u8> {
    let mut packer = lz4_flex::frame::FrameEncoder::new(Vec::new());
    packer.write_all(bytes).unwrap();
    packer.finish().unwrap()
}

pub fn bag(compression: &str) -> Vec<u8> {
    let head = |fields: &[(&str, &[u8])]| {
        let mut out = Vec::new();
        for (name, value) in fields {
            prefixed(&mut out, &[name.as_bytes(), b"=", value].concat());
        }
        out
    };
    let record = |out: &mut Vec<u8>, fields: &[(&str, &[u8])], data: &[u8]| {
        prefixed(out, &head(fields));
        prefixed(out, data);
    };
    let mut out = b"#ROSBAG V2.0\n".to_vec();
    record(&mut out, &[("op", &[3]), ("index_pos", &[0; 8]), ("conn_count", &[1, 0, 0, 0])], &[b' '; 64]);
    let mut inner = Vec::new();
    let definition = IMU.replace("TIME", "time").replace("std_msgs/Header\n", "std_msgs/Header\nuint32 seq\n");
    let data = head(&[("topic", b"/imu"), ("type", b"sensor_msgs/Imu"), ("message_definition", definition.as_bytes())]);
    record(&mut inner, &[("op", &[7]), ("conn", &[0; 4]), ("topic", b"/imu")], &data);
    for k in 0..MESSAGES {
        let time =
            [(stamp_ns(k) / 1_000_000_000) as u32, (stamp_ns(k) % 1_000_000_000) as u32].map(u32::to_le_bytes).concat();
        record(&mut inner, &[("op", &[2]), ("conn", &[0; 4]), ("time", &time)], &imu(k, false));
    }
    let size = (inner.len() as u32).to_le_bytes();
    let packed = match compression {
        "lz4" => lz4(&inner),
        "bz2" => {
            let mut packer = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::fast());
            packer.write_all(&inner).unwrap();
            packer.finish().unwrap()
        }
        _ => inner,
    };
    record(&mut out, &[("op", &[5]), ("compression", compression.as_bytes()), ("size", &size)], &packed);
    out
}
