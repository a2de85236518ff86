use super::{schema::Schema, *};
use crate::log::{self, Options, Reader};
use gyro_model::{
    Row,
    estimator::{Estimator, Options as EstimatorOptions},
};

/// Rows with awkward numbers, gaps and a free channel.
fn rows() -> Vec<Row> {
    (0..500_i32)
        .map(|k| {
            let t = f64::from(k) * 0.01;
            let mut row = Row { t_ns: i64::from(k) * 10_000_001, ..Row::EMPTY };
            row.gyro[2] = (t * 1.7).sin() / 3.0;
            row.gyro[0] = if k % 5 == 0 { f64::NAN } else { -1e-300 };
            row.ref_angle[2] = if k % 3 == 0 { t.cos() * 1e-7 } else { f64::NAN };
            row.temperature = 25.0 + t;
            row.free[0] = f64::from(k) * 0.1;
            row
        })
        .collect()
}

fn recorded(path: &std::path::Path, start_ns: i128) {
    let names = vec!["motor current, \"A\"".to_owned()];
    let mut writer = RecordingWriter::create(path, &[Axis::X, Axis::Z], &names, &[Axis::Z], start_ns).unwrap();
    let mut estimator = Estimator::new(EstimatorOptions::default());
    for row in rows() {
        writer.sample(&row).unwrap();
        writer.estimate(&estimator.step(&row)).unwrap();
    }
    writer.finish().unwrap();
}

#[test]
fn a_recording_reads_back_as_the_log_it_was_made_of_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.mcap");
    // A clock of this century, in ns: more digits than an f64 has.
    let start_ns = 1_763_683_200_123_456_789_i128;
    recorded(&path, start_ns);
    let mut reader = Reader::open(&path, &Options::default()).unwrap();
    let read: Vec<Row> = std::iter::from_fn(|| reader.next_row().unwrap()).collect();
    assert_eq!(reader.start_ns(), Some(start_ns));
    assert_eq!(reader.layout().free_names, ["motor current, \"A\""]);
    assert_eq!(read.len(), rows().len());
    let bits = |r: &Row| -> Vec<u64> {
        let values = r.gyro.iter().chain(&r.ref_angle).chain(&r.ref_quaternion).chain(&r.accel).chain(&r.free[..1]);
        values.chain([&r.temperature, &r.supply]).map(|v| if v.is_nan() { 1 } else { v.to_bits() }).collect()
    };
    for (a, b) in rows().iter().zip(&read) {
        assert_eq!(a.t_ns, b.t_ns);
        assert_eq!(bits(a), bits(b));
    }
}

#[test]
fn both_channels_say_what_they_hold_in_a_protobuf_schema() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.mcap");
    recorded(&path, 0);
    let bytes = std::fs::read(&path).unwrap();
    assert_eq!(bytes[..8], read::MAGIC);
    assert!(is_own(&bytes[..64]));
    let mut counts = [0, 0];
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), message.channel.message_encoding.as_str()), ("protobuf", "protobuf"));
        let schema = Schema::decode(&schema.name, &schema.data).unwrap();
        let mut values = Vec::new();
        schema.read(&message.data, &mut values).unwrap();
        assert_eq!(schema.columns().count(), values.len());
        counts[usize::from(message.channel.topic == ESTIMATE)] += 1;
    }
    assert_eq!(counts, [500, 500]);
}

#[test]
fn columns_that_protobuf_cannot_spell_keep_their_names() {
    let columns = ["motor current, \"A\"", "motor_current___A_", "3rd", "température", "t"].map(String::from);
    let schema = Schema::new("/sample", &columns).unwrap();
    let again = Schema::decode(schema.name(), &schema.encoded()).unwrap();
    assert!(again.columns().eq(columns.iter().map(String::as_str)));
    let values = [0.0, -0.0, f64::NAN, 1e-300, f64::MAX];
    let (mut bytes, mut read) = (Vec::new(), Vec::new());
    schema.encode(i64::MIN, &values, &mut bytes).unwrap();
    assert_eq!(again.read(&bytes, &mut read), Some(i64::MIN));
    assert!(values.iter().zip(&read).all(|(a, b)| a.to_bits() == b.to_bits()));
}

#[test]
fn a_recording_that_breaks_off_is_refused_as_a_log() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("r.mcap");
    recorded(&path, 0);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    assert!(log::read(&path, &Options::default()).is_err());
}
