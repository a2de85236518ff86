//! Properties of reading and writing: what is written is read back to the bit, and no bytes make the reader panic.

#![allow(clippy::format_push_string)] // made once, for the test

use super::{Options, Reader, read, write_record};
use gyro_model::{Record, Row};
use proptest::prelude::*;
use std::{fs, path::Path};

/// Reads every row of these bytes; whatever comes of it.
fn read_all(name: &str, bytes: &[u8]) -> Option<(Vec<Row>, u64)> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    let mut reader = Reader::open(&path, &Options::default()).ok()?;
    let mut rows = Vec::new();
    while let Some(row) = reader.next_row().ok()? {
        rows.push(row);
    }
    let _ = reader.faults();
    Some((rows, reader.rows_read()))
}

fn value() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -1e3..1e3_f64,
        1 => Just(f64::NAN),
        1 => proptest::num::f64::NORMAL.prop_filter("physical", |x| x.abs() < 1e9),
    ]
}

fn row() -> impl Strategy<Value = (i64, [f64; 8])> {
    (1..20_000_000_i64, proptest::array::uniform8(value()))
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits() || (a.is_nan() && b.is_nan())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_record_is_read_back_to_the_bit(
        steps in proptest::collection::vec(row(), 1..60),
        start in -4_000_000_000_000_000_000..4_000_000_000_000_000_000_i64,
        packed: bool,
    ) {
        let mut record = Record { free_names: vec!["load, N".into(), "\"quoted\"".into()], ..Record::default() };
        let mut t_ns = 0;
        for (step, v) in &steps {
            let row = Row {
                t_ns,
                gyro: [v[0], f64::NAN, v[1]],
                ref_angle: [v[2], f64::NAN, f64::NAN],
                temperature: v[3],
                supply: v[4],
                accel: [v[5], v[5], v[5]],
                ..Row::EMPTY
            };
            record.rows.push(row);
            let free = &mut record.rows.last_mut().unwrap().free;
            (free[0], free[1]) = (v[6], v[7]);
            t_ns += step;
        }
        // Columns of which some row has a value, so that they are written.
        record.rows[0].gyro[0] = 1.0;
        record.rows[0].free[0] = 1.0;
        record.rows[0].free[1] = 1.0;
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(if packed { "log.csv.gz" } else { "log.csv" });
        write_record(&path, &record, i128::from(start)).unwrap();
        let mut reader = Reader::open(&path, &Options::default()).unwrap();
        for wanted in &record.rows {
            let found = reader.next_row().unwrap().unwrap();
            prop_assert_eq!(found.t_ns, wanted.t_ns);
            let pairs = found.gyro.iter().chain(&found.ref_angle).chain(&found.accel).chain(&found.free)
                .zip(wanted.gyro.iter().chain(&wanted.ref_angle).chain(&wanted.accel).chain(&wanted.free));
            for (a, b) in pairs {
                prop_assert!(same(*a, *b), "{a} {b}");
            }
            prop_assert!(same(found.temperature, wanted.temperature) && same(found.supply, wanted.supply));
        }
        prop_assert_eq!(reader.next_row().unwrap(), None);
        prop_assert_eq!(reader.start_ns(), Some(i128::from(start)));
        prop_assert_eq!(&reader.layout().free_names, &record.free_names);
    }

    #[test]
    fn no_bytes_make_the_reader_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300), packed: bool) {
        read_all(if packed { "x.csv.gz" } else { "x.csv" }, &bytes);
        read_all("x.csv", &[b"t,gyro_x\n".as_slice(), &bytes].concat());
    }

    #[test]
    fn a_damaged_log_gives_rows_in_time_or_an_error(
        place in 0usize..2000,
        junk in proptest::collection::vec(prop_oneof![Just(b','), Just(b'\n'), Just(b'"'), Just(b'\r'), Just(b'-'), Just(b'e'), Just(b'9'), any::<u8>()], 0..6),
        packed: bool,
    ) {
        let mut bytes: Vec<u8> = b"t,gyro_x,ref_qw,ref_qx,ref_qy,ref_qz,load\n".to_vec();
        for k in 0..60 {
            bytes.extend(format!("{},{},1,0,0,0,{}\n", f64::from(k) * 0.01, f64::from(k).sin(), k % 3).bytes());
        }
        let place = place.min(bytes.len());
        bytes.splice(place..place, junk);
        if packed {
            let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
            std::io::Write::write_all(&mut packer, &bytes).unwrap();
            bytes = packer.finish().unwrap();
        }
        if let Some((rows, read)) = read_all(if packed { "x.csv.gz" } else { "x.csv" }, &bytes) {
            prop_assert!(rows.len() as u64 <= read);
            prop_assert!(rows.windows(2).all(|pair| pair[1].t_ns > pair[0].t_ns));
            prop_assert!(rows.iter().all(|row| row.gyro.iter().all(|x| !x.is_infinite())));
        }
    }

    #[test]
    fn a_cut_or_damaged_archive_is_an_error_and_never_a_shorter_log(cut in 20usize..400, flip in proptest::option::of(0u8..8)) {
        let text: String = (0..400).fold("t,gyro_x\n".to_owned(), |t, k| t + &format!("{k},{}\n", (k * 7919) % 1009));
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut packer, text.as_bytes()).unwrap();
        let mut bytes = packer.finish().unwrap();
        let cut = cut.min(bytes.len() - 1);
        match flip {
            Some(bit) => bytes[cut] ^= 1 << bit,
            None => bytes.truncate(cut),
        }
        let found = read_all("x.csv.gz", &bytes);
        prop_assert!(found.is_none(), "{} rows", found.map_or(0, |f| f.0.len()));
    }
}

#[test]
fn archives_of_several_members_are_read_to_the_end() {
    let pack = |text: &str| {
        let mut packer = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
        std::io::Write::write_all(&mut packer, text.as_bytes()).unwrap();
        packer.finish().unwrap()
    };
    let bytes = [pack("t,gyro_x\n0,1\n"), pack("1,2\n2,"), pack("3\n")].concat();
    let (rows, _) = read_all("x.csv.gz", &bytes).unwrap();
    assert_eq!(rows.iter().map(|r| r.gyro[0]).collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
}

#[test]
fn a_byte_order_mark_windows_line_ends_and_blank_lines_are_no_trouble() {
    let (rows, _) = read_all("x.csv", b"\xef\xbb\xbft, gyro_x \r\n0, 1\r\n\r\n1 ,2\r\n").unwrap();
    assert_eq!(rows.iter().map(|r| (r.t_ns, r.gyro[0])).collect::<Vec<_>>(), [(0, 1.0), (1_000_000_000, 2.0)]);
}

#[test]
fn what_other_programs_write_above_a_header_is_no_trouble() {
    let rows = "0,0.1,0.2\n0.01,0.3,0.4\n";
    for above in ["# MPU-6050, 250 dps\n", "sep=,\n", "SEP=,\r\n# made by hand\n#\n"] {
        let (read, _) = read_all("log.csv", format!("{above}t,gyro_x,ref_angle_x\n{rows}").as_bytes()).unwrap();
        assert_eq!((read.len(), read[1].gyro[0]), (2, 0.3), "{above}");
    }
    let (read, _) = read_all("log.csv", format!("# t,gyro_x,ref_angle_x\n{rows}").as_bytes()).unwrap();
    assert_eq!((read.len(), read[1].ref_angle[0]), (2, 0.4), "as NumPy writes it");
    let refused = |bytes: &str| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        fs::write(&path, bytes).unwrap();
        Reader::open(&path, &Options::default()).err().unwrap().to_string()
    };
    let says = refused(&format!("#timestamp [ns],w_x,angle\n{rows}"));
    assert!(
        says.contains("line 1")
            && says.contains("`gyro_x, gyro_y or gyro_z`")
            && says.contains("--map 't_ns=timestamp [ns]'"),
        "{says}"
    );
    let says = refused("# nothing else\n");
    assert!(says.contains("empty"), "{says}");
}

#[test]
fn one_time_far_ahead_costs_one_row_and_one_behind_costs_one_row() {
    let rows = |times: &[&str]| {
        let text: String = times.iter().fold("t,gyro_x\n".to_owned(), |all, t| all + t + ",1\n");
        read_all("x.csv", text.as_bytes()).unwrap().0.iter().map(|r| r.t_ns / 1_000_000).collect::<Vec<_>>()
    };
    assert_eq!(rows(&["0", "0.01", "99", "0.02", "0.03"]), [0, 10, 20, 30]);
    assert_eq!(rows(&["0", "0.01", "0.005", "0.02", "0.03"]), [0, 10, 20, 30]);
    assert_eq!(rows(&["0", "0.01", "0.01", "0.02", ""]), [0, 10, 20]);
    assert_eq!(rows(&["99", "0", "0.01", "0.02"]), [0, 10, 20], "a clock that is set behind the first row");
}

#[test]
fn a_free_column_of_text_is_left_out_and_said_but_text_among_numbers_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.csv");
    let text = |of: &dyn Fn(usize) -> String| {
        (0..200).fold("t,gyro_x,state\n".to_owned(), |all, k| all + &format!("{k},{}.5,{}\n", (k * 31) % 17, of(k)))
    };
    fs::write(&path, text(&|_| "ok".to_owned())).unwrap();
    let (_, faults, _) = read(&path, &Options::default()).unwrap();
    assert!(faults.iter().any(|f| f.kind.name() == "unused-columns" && f.count == 200), "{faults:?}");
    fs::write(&path, text(&|k| if k == 90 { "ok".to_owned() } else { k.to_string() })).unwrap();
    let refused = read(&path, &Options::default()).unwrap_err().to_string();
    assert!(refused.contains("line 92 column 3 (state)"), "{refused}");
}

#[test]
fn a_slower_encoder_or_one_in_rows_of_its_own_is_no_fault() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.csv");
    let rate = |t: f64| 2.0 * (1.3 * t).cos() + 1e-3 * (1e4 * t).sin();
    let angle = |t: f64| 2.0 / 1.3 * (1.3 * t).sin();
    let mut slower = "t,gyro_x,ref_angle_x\n".to_owned();
    let mut apart = slower.clone();
    for k in 0..2000 {
        let t = f64::from(k) * 0.01;
        let encoder = if k % 7 == 0 { angle(t).to_string() } else { String::new() };
        slower += &format!("{t},{},{encoder}\n", rate(t));
        apart += &format!("{t},{},\n{},,{}\n", rate(t), t + 0.004, angle(t + 0.004));
    }
    for text in [slower, apart] {
        fs::write(&path, text).unwrap();
        let (record, faults, _) = read(&path, &Options { needs_reference: true, ..Options::default() }).unwrap();
        assert!(faults.is_empty(), "{faults:?}");
        assert!(record.len() >= 2000);
    }
    assert!(Reader::open(Path::new("-nowhere"), &Options::default()).is_err());
}

#[test]
fn a_clock_that_is_set_while_recording_costs_the_shorter_side() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.csv");
    let write = |jump_at: i32| {
        let text = (0..1000).fold("t,gyro_x\n".to_owned(), |all, k| {
            let t = f64::from(k) * 0.01 + if k >= jump_at { 1.7e9 } else { 0.0 };
            all + &format!("{t:.2},{}.5\n", (k * 31) % 17)
        });
        fs::write(&path, text).unwrap();
    };
    for (jump_at, rows, start_ns) in [(20, 980, 1_700_000_000_200_000_000), (990, 990, 0)] {
        write(jump_at);
        let (record, faults, provenance) = read(&path, &Options::default()).unwrap();
        assert_eq!((record.len(), record.rows[0].t_ns), (rows, 0));
        assert_eq!(provenance.start_ns, start_ns);
        assert!(faults.iter().any(|f| f.says.contains("1700000000 s")), "{faults:?}");
        assert!(record.duration() < 10.0);
    }
    write(500);
    assert!(read(&path, &Options::default()).unwrap_err().to_string().contains("more than 10 %"));
}

/// The first row of a text that is read with these maps.
fn first_row(text: &str, maps: &[&str]) -> Row {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    fs::write(&path, text).unwrap();
    let map = maps.iter().map(|map| (*map).to_owned()).collect();
    Reader::open(&path, &Options { map, ..Options::default() }).unwrap().next_row().unwrap().unwrap()
}

#[test]
fn an_accelerometer_whose_unit_nobody_says_is_read_by_gravity_or_not_at_all() {
    let text = |z: f64| {
        let rows: Vec<String> = (0..50).map(|k| format!("{k},0,0,0,{z}\n")).collect();
        "t,gz,ax,ay,az\n".to_owned() + &rows.concat()
    };
    for (z, wanted) in [(1.0, 9.806_65), (1000.0, 9.806_65), (4096.0, 9.806_65), (9.8, 9.8)] {
        let read = first_row(&text(z), &[]).accel[2];
        assert!((read - wanted).abs() < 1e-9, "{z}: {read}");
    }
    assert!(first_row(&text(70.0), &[]).accel[2].is_nan());
}

#[test]
fn roll_pitch_and_yaw_are_an_orientation() {
    let rows = (0..50).map(|k| format!("{k},0,90,0,0\n{k}.5,0,0,30,90\n")).collect::<Vec<_>>().concat();
    let text = format!("t,gz,roll,pitch,yaw\n{rows}");
    let q = first_row(&text, &["ref_rpy_deg=roll,pitch,yaw"]).ref_quaternion;
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!(q.iter().zip([half, half, 0.0, 0.0]).all(|(a, b)| (a - b).abs() < 1e-12), "{q:?}");
    let q = first_row(&text, &["ref_rpy_deg=pitch,roll,yaw"]).ref_quaternion;
    assert!((q[2] - half).abs() < 1e-12, "{q:?}");
}
