//! Whatever bytes a source sends, in whatever pieces: nothing panics, times only grow, nothing infinite goes on.

use super::{
    Tally,
    address::Address,
    format::{self, Found},
    timeline::{LIVE_JUMP_NS, Timeline},
};
use std::io::Write;
use workbench::log::Options;

use proptest::{collection::vec, prelude::*};

/// Lines that are nearly right, and pieces of them.
fn piece() -> impl Strategy<Value = Vec<u8>> {
    let number = prop_oneof![
        any::<f64>().prop_map(|x| x.to_string()),
        (-1e3..1e3).prop_map(|x: f64| format!("{x:.3}")),
        Just("nan".to_owned()),
        Just("-inf".to_owned()),
        Just("9".repeat(400)),
        Just(String::new()),
    ];
    prop_oneof![
        4 => vec(number, 0..5).prop_map(|fields| (fields.join(",") + "\n").into_bytes()),
        1 => Just(b"t,gyro_z,ref_angle_z\n".to_vec()),
        1 => vec(any::<u8>(), 0..300),
        1 => ("[0-9]{1,3}", "[0-9A-F]{0,9}").prop_map(|(t, data)| format!("({t}.5) can0 100#{data}\n").into_bytes()),
        1 => vec(prop_oneof![Just(0_u8), Just(0xfd), Just(0xfe), Just(1), any::<u8>()], 0..300),
    ]
}

/// Rows that come out of these pieces.
fn rows(address: &str, pieces: &[Vec<u8>]) -> usize {
    let mut dbc = tempfile::NamedTempFile::new().unwrap();
    let text = "BO_ 256 IMU: 8 X\n SG_ YAW_RATE : 0|16@1- (1,0) [0|0] \"deg/s\" X\n SG_ F : 0|32@1- (1,0) [0|0] \"\" X\nSIG_VALTYPE_ 256 F : 1;\n";
    dbc.write_all(text.as_bytes()).unwrap();
    let address: Address = address.replace("FILE", &dbc.path().display().to_string()).parse().unwrap();
    let mut format = format::of(&address, &Options::default()).unwrap();
    let (mut timeline, mut tally) = (Timeline::new(LIVE_JUMP_NS, None), Tally::default());
    let (mut last, mut rows) = (i64::MIN, 0);
    for (k, piece) in pieces.iter().enumerate() {
        let mut found = |found| match found {
            Found::Row(row, own) => timeline.take(row, own, 1_000_000 * k as u64, &mut tally, |timed| {
                assert!(timed.row.t_ns > last, "{} after {last}", timed.row.t_ns);
                let row = timed.row;
                let values = row.gyro.iter().chain(&row.accel).chain(&row.ref_angle).chain(&row.ref_rate);
                assert!(values.chain(&row.ref_quaternion).chain(&row.free).all(|value| !value.is_infinite()));
                (last, rows) = (row.t_ns, rows + 1);
            }),
            Found::Fault(fault, says) => tally.add(fault, &says),
            Found::Missed(_) => {}
            Found::Begins => timeline.expect_beginning(),
        };
        format.take(piece, &mut found);
        if k % 7 == 0 {
            format.cut(&mut found);
        }
    }
    rows
}

proptest! {
    #[test]
    fn no_bytes_are_too_much(pieces in vec(piece(), 0..60)) {
        for address in ["udp:[::]:1?header=t,gyro_z,ref_angle_z", "udp:[::]:1?format=frames", "mavlink:udp:[::]:1", "udp:[::]:1", "udp:[::]:1?format=candump&dbc=FILE"] {
            rows(address, &pieces);
        }
    }
}

/// By hand, for as long as it is wanted: `TRUERATE_MINUTES=10 cargo test --release hostile -- --ignored --nocapture`.
#[test]
#[ignore = "takes as long as it is told to"]
fn hostile_samples_by_the_million() {
    use proptest::{strategy::ValueTree, test_runner::TestRunner};
    let minutes: f64 = std::env::var("TRUERATE_MINUTES").ok().and_then(|m| m.parse().ok()).unwrap_or(1.0);
    let (start, mut runner, mut pieces, mut given) = (std::time::Instant::now(), TestRunner::default(), 0_u64, 0);
    while start.elapsed().as_secs_f64() < 60.0 * minutes {
        let some = vec(piece(), 2000).new_tree(&mut runner).unwrap().current();
        for address in ["udp:[::]:1?header=t,gyro_z,ref_angle_z", "udp:[::]:1?format=frames", "mavlink:udp:[::]:1"] {
            given += rows(address, &some);
        }
        pieces += 3 * some.len() as u64;
    }
    eprintln!("{pieces} pieces, {given} rows");
}
