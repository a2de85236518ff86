//! Files of other programs' formats: the same rows that independent readers find, and of independent writers' files the very
//! verdict of the CSV that they were made of.
//!
//! The independent programs are Python packages (`pyulog`, `pymavlink`, `rosbags`). They are put into a folder of their own in
//! the build's; where that cannot be, or where a file is missing, a test says that it was skipped.

mod common;

use common::Bench;
use serde_json::Value;
use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|e| panic!("{e}: {text}"))
}

/// A Python that has the packages: the one that `TRUERATE_PYTHON` names, or one made here.
fn python() -> Option<&'static Path> {
    static PYTHON: OnceLock<Option<PathBuf>> = OnceLock::new();
    let made = PYTHON.get_or_init(|| {
        let works = |python: &Path| {
            let says =
                Command::new(python).args(["-c", "import numpy, pyulog, rosbags.rosbag1, pymavlink.DFReader"]).output();
            says.is_ok_and(|output| output.status.success())
        };
        if let Some(given) = std::env::var_os("TRUERATE_PYTHON").map(PathBuf::from) {
            return works(&given).then_some(given);
        }
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("independent-readers");
        let python = folder.join("bin/python");
        if !works(&python) {
            let ran = |command: &mut Command| command.output().is_ok_and(|output| output.status.success());
            let _ = ran(Command::new("python3").arg("-m").arg("venv").arg(&folder))
                && ran(Command::new(&python).args([
                    "-m",
                    "pip",
                    "install",
                    "-q",
                    "numpy",
                    "pyulog",
                    "pymavlink",
                    "rosbags",
                ]));
        }
        works(&python).then_some(python)
    });
    if made.is_none() {
        eprintln!("skipped: no Python with pyulog, pymavlink and rosbags; set TRUERATE_PYTHON");
    }
    made.as_deref()
}

/// The same with `python-can` and `cantools`.
fn python_with_can() -> Option<&'static Path> {
    let python = python()?;
    let has = || Command::new(python).args(["-c", "import can, cantools"]).output().is_ok_and(|o| o.status.success());
    if !has() {
        let _ = Command::new(python).args(["-m", "pip", "install", "-q", "python-can", "cantools"]).output();
    }
    if has() {
        return Some(python);
    }
    eprintln!("skipped: no Python with python-can and cantools; set TRUERATE_PYTHON");
    None
}

/// The same with `pandas`, `pyarrow` and `polars`.
fn python_with_tables() -> Option<&'static Path> {
    let python = python()?;
    let has = || {
        let says = Command::new(python).args(["-c", "import pandas, pyarrow, polars"]).output();
        says.is_ok_and(|output| output.status.success())
    };
    if !has() {
        let _ = Command::new(python).args(["-m", "pip", "install", "-q", "pandas", "pyarrow", "polars"]).output();
    }
    if has() {
        return Some(python);
    }
    eprintln!("skipped: no Python with pandas, pyarrow and polars; set TRUERATE_PYTHON");
    None
}

/// A file to try with.
fn foreign(name: &str) -> Option<String> {
    let folder = std::env::var_os("TRUERATE_LOGS")
        .map_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data"), PathBuf::from);
    let path = folder.join("foreign").join(name);
    if !path.is_file() {
        eprintln!("skipped: no file {}; set TRUERATE_LOGS", path.display());
        return None;
    }
    Some(path.display().to_string())
}

/// What a script prints, as JSON.
fn independent(python: &Path, script: &str, words: &[&str]) -> Value {
    let output = Command::new(python).arg("-c").arg(script).args(words).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    json(&String::from_utf8_lossy(&output.stdout))
}

/// Messages of each topic, as `truerate channels` counts them.
fn counted(bench: &Bench, file: &str) -> BTreeMap<String, u64> {
    let list = json(&bench.ok(&["channels", file, "--format", "json"]));
    let channels = list["channels"].as_array().unwrap().iter();
    channels.map(|c| (c["topic"].as_str().unwrap().to_owned(), c["rows"].as_u64().unwrap())).collect()
}

/// An archive of these files; `stream` writes it as what cannot be rewound.
const ZIP: &str = "
import sys, json, zipfile
class Stream:
    def __init__(self, file): self.file = file
    def write(self, data): return self.file.write(data)
    def flush(self): self.file.flush()
to, how, *names = sys.argv[1:]
with open(to, 'wb') as file:
    with zipfile.ZipFile(Stream(file) if how == 'stream' else file, 'w', zipfile.ZIP_DEFLATED) as archive:
        for name in names: archive.write(name, name.split('/')[-1])
print('{}')";

#[test]
fn a_log_in_an_archive_is_the_log_and_of_several_files_one_is_named() {
    let Some(python) = python() else { return };
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "20", "--axis", "z", "--seed", "3", "-o", "log.csv"]);
    bench.file("Metadata.csv", "device,platform\nPixel,android\n");
    let [log, metadata] = ["log.csv", "Metadata.csv"].map(|name| bench.path(name).display().to_string());
    let fitted = |file: &str| {
        bench.ok(&["fit", file, "-o", "model.toml"]);
        let model = bench.text("model.toml");
        let own = |line: &&str| !["fitted = ", "log = "].iter().any(|begins| line.starts_with(begins));
        model.lines().filter(own).map(str::to_owned).collect::<Vec<_>>()
    };
    let wanted = fitted("log.csv");
    assert!(wanted.iter().any(|line| line.contains("sha256")), "{wanted:?}");
    for how in ["file", "stream"] {
        let [one, two] = ["one.zip", "two.zip"].map(|name| bench.path(name).display().to_string());
        independent(python, ZIP, &[&one, how, &log]);
        independent(python, ZIP, &[&two, how, &log, &metadata]);
        assert_eq!(fitted("one.zip"), wanted, "{how}");
        assert_eq!(fitted("two.zip/log.csv"), wanted, "{how}");
        let refused = bench.refused(&["fit", "two.zip"]);
        assert!(refused.contains("is an archive of 2 files ('Metadata.csv', 'log.csv')"), "{refused}");
        assert!(bench.refused(&["fit", "two.zip/other.csv"]).contains("has no file of this name"));
    }
}

const ULOG: &str = "
import sys, json, pyulog
log = pyulog.ULog(sys.argv[1])
name = lambda d: d.name if d.multi_id == 0 else f'{d.name}_{d.multi_id}'
print(json.dumps({name(d): len(d.data['timestamp']) for d in log.data_list}))";

#[test]
fn a_ulog_has_the_rows_that_pyulog_finds() {
    let Some(python) = python() else { return };
    let bench = Bench::new();
    for name in ["px4-flight.ulg", "px4-sitl-groundtruth.ulg", "px4-cube-three-imus.ulg"] {
        let Some(file) = foreign(name) else { return };
        let mut found = counted(&bench, &file);
        found.retain(|_, rows| *rows > 0);
        let wanted = independent(python, ULOG, &[&file]);
        let wanted: BTreeMap<String, u64> =
            wanted.as_object().unwrap().iter().map(|(k, v)| (k.clone(), v.as_u64().unwrap())).collect();
        assert_eq!(found, wanted, "{name}");
    }
}

const DATAFLASH: &str = "
import sys, json, collections
from pymavlink import DFReader
log, rows = DFReader.DFReader_binary(sys.argv[1]), collections.Counter()
while (m := log.recv_msg()) is not None:
    rows[m.get_type()] += 1
print(json.dumps(rows))";

#[test]
fn an_ardupilot_log_has_the_rows_that_pymavlink_finds() {
    let Some(python) = python() else { return };
    let Some(file) = foreign("ardupilot-two-imus.bin") else { return };
    let bench = Bench::new();
    let mut found: BTreeMap<String, u64> = BTreeMap::new();
    for (topic, rows) in counted(&bench, &file) {
        *found.entry(topic.split('[').next().unwrap().to_owned()).or_default() += rows;
    }
    let wanted = independent(python, DATAFLASH, &[&file]);
    for (name, rows) in &found {
        assert_eq!(wanted[name], *rows, "{name}");
    }
    assert!(found.contains_key("IMU") && found.len() > 5, "{found:?}");
}

#[test]
fn an_independent_reference_is_judged_and_a_dependent_one_is_named() {
    let bench = Bench::new();
    let Some(truth) = foreign("px4-sitl-groundtruth.ulg") else { return };
    let axes = json(&bench.ok(&["diagnose", &truth, "--axis", "z", "--format", "json"]))["axes"].clone();
    assert!(!axes[0]["data_faults"].to_string().contains("dependent-reference"), "{axes}");
    assert!(!axes[0]["parameters"].as_array().unwrap().is_empty(), "{axes}");
    let Some(cube) = foreign("px4-cube-three-imus.ulg") else { return };
    let list = json(&bench.ok(&["channels", &cube, "--format", "json"]));
    // Its topics of single IMUs hold a handful of messages.
    assert!(list["map"].to_string().contains("gyro_x=sensor_combined.gyro_rad[0]"), "{}", list["map"]);
    let Some(flight) = foreign("px4-flight.ulg") else { return };
    let axes = json(&bench.ok(&["ladder", &flight, "--axis", "z", "--format", "json"]))["axes"].clone();
    assert_eq!(axes[0]["verdict"], "cannot-tell", "{axes}");
    assert!(axes[0]["says"].as_str().unwrap().contains("the autopilot's estimator computed the reference"), "{axes}");
}

/// Writes a log of three axes as a bag: gyro and orientation a topic each, at the rows' own times. The kind of a ROS 2 bag says
/// what it is stored as, whether it is split in two, whether it is without definitions, and what is packed.
const BAG: &str = "
import sys, csv, pathlib, sqlite3
from rosbags.typesys import Stores, get_typestore
kind, source, target = sys.argv[1:4]
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import Writer as Writer2, StoragePlugin, CompressionMode, CompressionFormat
rows = list(csv.DictReader(open(source)))
store = get_typestore(Stores.ROS1_NOETIC if kind.startswith('ros1') else Stores.ROS2_HUMBLE)
T = store.types
Time, Header, Vector, Quaternion = T['builtin_interfaces/msg/Time'], T['std_msgs/msg/Header'], T['geometry_msgs/msg/Vector3'], T['geometry_msgs/msg/Quaternion']
Imu, Pose, Point, Stamped = T['sensor_msgs/msg/Imu'], T['geometry_msgs/msg/Pose'], T['geometry_msgs/msg/Point'], T['geometry_msgs/msg/PoseStamped']
import numpy
none = numpy.zeros(9)
if kind.startswith('ros1'):
    header = lambda s, n: Header(seq=0, stamp=Time(sec=s, nanosec=n), frame_id='body')
    pack = store.serialize_ros1
else:
    header = lambda s, n: Header(stamp=Time(sec=s, nanosec=n), frame_id='body')
    pack = store.serialize_cdr

def opened(target):
    if kind.startswith('ros1'):
        writer = Writer1(target)
        if kind != 'ros1':
            writer.set_compression(Writer1.CompressionFormat.LZ4 if kind == 'ros1-lz4' else Writer1.CompressionFormat.BZ2)
        return writer
    writer = Writer2(target, version=9, storage_plugin=StoragePlugin.SQLITE3 if 'db3' in kind else StoragePlugin.MCAP)
    modes = {'file': CompressionMode.FILE, 'message': CompressionMode.MESSAGE, 'chunk': CompressionMode.STORAGE}
    mode = modes.get(kind.split('-')[-1])
    if mode is not None:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    return writer

def write(target, rows):
    with opened(target) as writer:
        imu = writer.add_connection('/imu', 'sensor_msgs/msg/Imu', typestore=store)
        pose = writer.add_connection('/vicon/body', 'geometry_msgs/msg/PoseStamped', typestore=store)
        for row in rows:
            ns = 1_700_000_000_000_000_000 + round(float(row['t']) * 1e9)
            f = lambda *names: [float(row[n]) for n in names]
            head = header(*divmod(ns, 10**9))
            message = Imu(head, Quaternion(0.0, 0.0, 0.0, 0.0), none, Vector(*f('gyro_x', 'gyro_y', 'gyro_z')), none, Vector(0.0, 0.0, 0.0), none)
            writer.write(imu, ns + 3_000_000, pack(message, 'sensor_msgs/msg/Imu'))
            message = Stamped(head, Pose(Point(0.0, 0.0, 0.0), Quaternion(*f('ref_qx', 'ref_qy', 'ref_qz', 'ref_qw'))))
            writer.write(pose, ns + 5_000_000, pack(message, 'geometry_msgs/msg/PoseStamped'))

if 'split' in kind:
    # The later half in the folder of the earlier one, the list of which names both; what else lies there is no part of it.
    target = pathlib.Path(target)
    later = target.with_name(target.name + 'later')
    write(target, rows[:len(rows) // 2])
    write(later, rows[len(rows) // 2:])
    first, second = next(target.glob('*.*[3p]')), next(later.glob('*.*[3p]'))
    first.rename(target / f'recording_1{first.suffix}')
    second.rename(target / f'recording_0{first.suffix}')
    (target / f'recording_2{first.suffix}').write_text('of another recording')
    list_ = target / 'metadata.yaml'
    list_.write_text(list_.read_text().replace(f'- {first.name}', f'- recording_1{first.suffix}\\n  - recording_0{first.suffix}'))
    assert 'recording_0' in list_.read_text(), list_.read_text()
else:
    write(target, rows)
if 'old' in kind:
    base = sqlite3.connect(next(pathlib.Path(target).glob('*.db3')))
    base.executescript('DROP TABLE message_definitions; DROP TABLE schema; DROP TABLE metadata; VACUUM;')
    base.close()
print('null')";

#[test]
fn a_bag_of_an_independent_writer_gives_the_very_numbers_of_the_csv() {
    let Some(python) = python() else { return };
    let bench = Bench::new();
    bench.ok(&[
        "simulate",
        "--seconds",
        "30",
        "--rate",
        "100",
        "--seed",
        "3",
        "--hide",
        "delay:d=0.02",
        "-o",
        "all.csv",
    ]);
    let rows: Vec<Vec<String>> = three_axes(&bench.text("all.csv"));
    let text: String = rows.iter().map(|row| row.join(",") + "\n").collect();
    bench.file("three.csv", text);
    let parameters = |words: &[&str]| {
        let axes = json(&bench.ok(&[&["compare"], words, &["--format", "json"]].concat()))["axes"].clone();
        axes.as_array()
            .unwrap()
            .iter()
            .map(|a| (a["verdict"].clone(), a["parameters"].clone(), a["error_over_floor"].clone()))
            .collect::<Vec<_>>()
    };
    let wanted = parameters(&["three.csv"]);
    assert_eq!(wanted.len(), 3);
    for kind in [
        "ros1",
        "ros1-lz4",
        "ros1-bz2",
        "ros2-mcap",
        "ros2-mcap-split",
        "ros2-mcap-zstd-chunk",
        "ros2-mcap-zstd-message",
        "ros2-db3",
        "ros2-db3-split",
        "ros2-db3-old",
        "ros2-db3-zstd-message",
        "ros2-db3-zstd-file",
    ] {
        // A recording of ROS 2 is a folder.
        let target = bench.path(&format!("{kind}.bag")).display().to_string();
        independent(python, BAG, &[kind, &bench.path("three.csv").display().to_string(), &target]);
        assert_eq!(
            counted(&bench, &target),
            BTreeMap::from([("/imu".to_owned(), 3000), ("/vicon/body".to_owned(), 3000)]),
            "{kind}"
        );
        assert_eq!(parameters(&[&target]), wanted, "{kind}");
    }
    // Of a recording of which a file is missing nothing is guessed.
    std::fs::remove_file(bench.path("ros2-mcap-split.bag").join("recording_0.mcap")).unwrap();
    let line = bench.refused(&["diagnose", "ros2-mcap-split.bag"]);
    assert!(line.contains("recording_0.mcap") && line.contains("not there"), "{line}");
}

const CAN: &str = "
import sys, csv, can, cantools
from can.io import ASCWriter, CanutilsLogWriter
dbc, source, target = sys.argv[1:4]
base = cantools.database.load_file(dbc)
rows = list(csv.DictReader(open(source)))
writers = [CanutilsLogWriter(target + '.log'), ASCWriter(target + '.asc')]
out = csv.writer(open(target + '.csv', 'w'), lineterminator='\\n')
out.writerow(['t', 'gyro_z_dps', 'ref_angle_z_deg', 'temp', 'supply'])
degrees = 57.29577951308232
for k, row in enumerate(rows):
    t = round(float(row['t']), 6)
    frames = [
        ('IMU', {'COUNT': k % 256, 'YAW_RATE': float(row['gyro_x']) * degrees}),
        ('TURNTABLE_ENCODER', {'ANGLE': float(row['ref_angle_x']) * degrees}),
        ('STATUS', {'KIND': 0, 'TEMP': 25 + k % 3} if k % 2 == 0 else {'KIND': 1, 'SUPPLY': 3.3}),
    ]
    values = {}
    for name, signals in frames:
        message = base.get_message_by_name(name)
        data = message.encode(signals)
        values.update(base.decode_message(message.frame_id, data))
        frame = can.Message(timestamp=1_700_000_000 + t, arbitration_id=message.frame_id, is_extended_id=message.is_extended_frame, data=data, is_fd=message.is_fd, channel='can0')
        for writer in writers:
            writer(frame)
    out.writerow([f'{t:.6f}'] + [values.get(name, '') for name in ['YAW_RATE', 'ANGLE', 'TEMP', 'SUPPLY']])
for writer in writers:
    writer.stop()
print('null')";

const CAN_DBC: &str = "VERSION \"\"\n\nBU_: ECU\n\nBO_ 256 IMU: 8 ECU\n SG_ COUNT : 0|8@1+ (1,0) [0|0] \"\" ECU\n \
    SG_ YAW_RATE : 11|20@0- (0.001,0) [0|0] \"deg/s\" ECU\n\nBO_ 2566844885 TURNTABLE_ENCODER: 4 ECU\n \
    SG_ ANGLE : 0|32@1- (0.0001,0) [0|0] \"deg\" ECU\n\nBO_ 512 STATUS: 4 ECU\n SG_ KIND M : 0|8@1+ (1,0) [0|0] \"\" ECU\n \
    SG_ TEMP m0 : 8|12@1+ (0.5,-40) [0|0] \"degC\" ECU\n SG_ SUPPLY m1 : 8|16@1+ (0.001,0) [0|0] \"V\" ECU\n";

/// Frames of random bytes of every message, and what cantools finds in them. Identifiers that are none are left out first:
/// cantools refuses a file that has such.
const REAL_DBC: &str = "
import sys, json, random, re, cantools
dbc, target = sys.argv[1:3]
parts = re.split(r'(?m)^(?=BO_ )', open(dbc, encoding='latin-1').read())
odd = lambda part: part.startswith('BO_ ') and int(part.split()[1]) >> 30 & 1
kept = ''.join(part if not odd(part) else part.partition('\\n\\n')[2] for part in parts)
base = cantools.database.load_string(kept, 'dbc', strict=False)
random.seed(1)
found, t = {}, 0
with open(target, 'w') as log:
    for _ in range(20):
        for message in base.messages:
            data = bytes(random.randrange(256) for _ in range(message.length))
            name = f'{message.frame_id:08X}' if message.is_extended_frame else f'{message.frame_id:03X}'
            t += 1
            log.write(f'({1_700_000_000 + t // 1000}.{t % 1000:03d}000) can0 {name}#{data.hex()}\\n')
            for signal, value in message.decode(data, decode_choices=False).items():
                found.setdefault(f'{message.name}.{signal}', []).append(value)
print(json.dumps({name: [len(values), min(values), max(values)] for name, values in found.items()}))";

#[test]
fn frames_of_a_real_vehicle_have_the_values_that_cantools_finds() {
    let (Some(python), Some(dbc)) = (python_with_can(), foreign("toyota-2017.dbc")) else { return };
    let bench = Bench::new();
    let wanted = independent(python, REAL_DBC, &[&dbc, &bench.path("all.log").display().to_string()]);
    let list = json(&bench.ok(&["channels", "all.log", "--dbc", &dbc, "--format", "json"]));
    let found: BTreeMap<&str, &Value> =
        list["channels"].as_array().unwrap().iter().map(|c| (c["channel"].as_str().unwrap(), c)).collect();
    assert!(found.len() > 1000 && found.len() == wanted.as_object().unwrap().len(), "{}", found.len());
    for (name, values) in wanted.as_object().unwrap() {
        let of = found[name.as_str()];
        assert_eq!(of["values"], values[0], "{name}");
        for (key, k) in [("min", 1), ("max", 2)] {
            let (a, b) = (of[key].as_f64().unwrap(), values[k].as_f64().unwrap());
            assert!((a - b).abs() <= 1e-9 * b.abs().max(1.0), "{name}: {key} {a}, not {b}");
        }
    }
}

#[test]
fn frames_of_independent_writers_have_the_very_verdict_of_the_csv() {
    let Some(python) = python_with_can() else { return };
    let bench = Bench::new();
    let words = "simulate --seconds 30 --rate 100 --seed 3 --axis x --hide delay:d=0.02 -o all.csv";
    bench.ok(&words.split(' ').collect::<Vec<_>>());
    bench.file("car.dbc", CAN_DBC);
    let path = |name: &str| bench.path(name).display().to_string();
    independent(python, CAN, &[&path("car.dbc"), &path("all.csv"), &path("drive")]);
    let judged = |words: &[&str]| {
        let axis = json(&bench.ok(&[&["diagnose"], words, &["--format", "json"]].concat()))["axes"][0].clone();
        (axis["axis"].clone(), axis["verdict"].clone(), axis["parameters"].clone(), axis["error_curve"].clone())
    };
    let wanted = judged(&["drive.csv"]);
    assert_eq!((&wanted.0, &wanted.1), (&Value::from("z"), &Value::from("missing-effect")));
    for log in ["drive.log", "drive.asc"] {
        // Names and units of the DBC file say it all; named by hand, the unit is the file's unless the name says another.
        assert_eq!(judged(&[log, "--dbc", "car.dbc"]), wanted, "{log}");
        let by_hand = ["--map", "gyro_z=IMU.YAW_RATE", "--map", "ref_angle_z_deg=TURNTABLE_ENCODER.ANGLE"];
        assert_eq!(judged(&[&[log, "--dbc", "car.dbc"], &by_hand[..]].concat()), wanted, "{log}");
        let list = json(&bench.ok(&["channels", log, "--dbc", "car.dbc", "--format", "json"]));
        let rows: BTreeMap<String, u64> = (list["channels"].as_array().unwrap().iter())
            .map(|c| (c["topic"].as_str().unwrap().to_owned(), c["rows"].as_u64().unwrap()))
            .collect();
        let each = |name: &str| (name.to_owned(), 3000);
        assert_eq!(rows, BTreeMap::from([each("IMU"), each("STATUS"), each("TURNTABLE_ENCODER")]), "{log}");
    }
}

/// Time, gyros and an orientation made of the angle about z, of a simulated log.
fn three_axes(text: &str) -> Vec<Vec<String>> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = |name: &str| names.iter().position(|n| *n == name).unwrap_or_else(|| panic!("no {name} in {names:?}"));
    let (t, gyro, angle) = (column("t"), column("gyro_x"), column("ref_angle_x"));
    let header = "t,gyro_x,gyro_y,gyro_z,ref_qw,ref_qx,ref_qy,ref_qz".split(',').map(str::to_owned).collect();
    let rows = lines.enumerate().filter_map(|(k, line)| {
        let fields: Vec<&str> = line.split(',').collect();
        let half = fields[angle].parse::<f64>().ok()? / 2.0;
        let still = 1e-3 * ((k * 7919) % 997) as f64 / 997.0;
        let row = [fields[t].to_owned(), fields[gyro].to_owned(), still.to_string(), (-still).to_string()];
        Some(row.into_iter().chain([half.cos(), half.sin(), 0.0, 0.0].map(|q| q.to_string())).collect())
    });
    std::iter::once(header).chain(rows).collect()
}

const PARQUET: &str = "
import sys, json, pandas, polars
table = pandas.read_csv(sys.argv[1])
table.to_parquet('plain.parquet', index=False)
polars.read_csv(sys.argv[1]).write_parquet('polars.parquet')
dated = table.assign(t=pandas.to_datetime(table.t + 1.7e9, unit='s'), label='a, b')
dated['when'] = dated.t.dt.date
dated.to_csv('dated.csv', index=False)
dated.to_parquet('dated.parquet', index=False, compression='gzip', row_group_size=700)
dated.set_index('t').to_parquet('indexed.parquet', compression='zstd')
table.to_parquet('second.parquet', compression='zstd', data_page_version='2.0')
table.to_parquet('brotli.parquet', compression='brotli')
print('{}')";

#[test]
fn a_parquet_of_independent_writers_has_the_very_verdict_of_the_csv() {
    let Some(python) = python_with_tables() else { return };
    let bench = Bench::new();
    bench.ok(&["simulate", "--seconds", "20", "--axis", "x", "--hide", "delay:d=0.012", "-o", "log.csv"]);
    let written = Command::new(python).args(["-c", PARQUET, "log.csv"]).current_dir(bench.path(".")).output().unwrap();
    assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
    let axes = |log: &str| json(&bench.ok(&["diagnose", log, "--format", "json"]))["axes"].clone();
    for (csv, parquets) in [
        ("log.csv", &["plain.parquet", "polars.parquet", "second.parquet"][..]),
        ("dated.csv", &["dated.parquet", "indexed.parquet"]),
    ] {
        let wanted = axes(csv);
        assert_eq!(wanted[0]["suspects"][0]["effect"], "delay", "{wanted}");
        for parquet in parquets {
            assert_eq!(axes(parquet), wanted, "{parquet}");
        }
    }
    let refused = bench.refused(&["diagnose", "brotli.parquet"]);
    assert!(refused.contains("Brotli or LZO: write it with"), "{refused}");
    let cut = std::fs::read(bench.path("plain.parquet")).unwrap();
    bench.file("cut.parquet", &cut[..cut.len() / 2]);
    let refused = bench.refused(&["diagnose", "cut.parquet"]);
    assert!(refused.contains("Parquet") && refused.contains("copy it again"), "{refused}");
}
