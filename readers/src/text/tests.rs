//! Texts as programs and people write them.

use super::*;

/// Names, dialect, the rows' first and last fields with their lines, and what was skipped.
struct Read {
    head: Head,
    rows: Vec<(u64, Vec<String>)>,
    skipped: Vec<(Skip, u64, u64)>,
}

fn read(text: &str) -> Read {
    let mut table = Table::open(text.as_bytes(), &|names| names.iter().any(|name| name == "gyro_z")).unwrap();
    let mut rows = Vec::new();
    while let Some(row) = table.next_row().unwrap() {
        rows.push((row.line, row.fields().map(|f| String::from_utf8_lossy(f).into_owned()).collect()));
    }
    Read { head: table.head().clone(), rows, skipped: table.skipped().iter().collect() }
}

fn says(separator: char, comma: bool) -> Dialect {
    Dialect::new(
        if separator == ' ' { Separator::Blanks } else { Separator::Byte(separator as u8) },
        if comma { Point::Comma } else { Point::Dot },
    )
}

#[test]
fn every_separator_and_decimal_sign_is_recognised() {
    for (separator, comma) in
        [(',', false), (';', false), (';', true), ('\t', false), ('\t', true), ('|', false), (' ', false)]
    {
        let text: String =
            ["time,wx,note 1".replace(' ', "_"), "0,1.5,2".into(), "0.01,2.5,3".into(), "0.02,3,4.25".into()]
                .iter()
                .map(|line| {
                    let line = line.replace(',', "!");
                    let line = if comma { line.replace('.', ",") } else { line };
                    line.replace('!', &separator.to_string()) + "\n"
                })
                .collect();
        let read = read(&text);
        assert_eq!(read.head.dialect, says(separator, comma), "{text}");
        assert_eq!((read.head.names.len(), read.rows.len(), read.head.line), (3, 3, Some(1)), "{text}");
        assert!(read.skipped.is_empty());
    }
}

#[test]
fn what_stands_above_a_header_is_passed_by_and_counted() {
    let rows = "0.00,1.5,2\n0.01,2.5,3\n";
    for (above, counted) in [
        ("Date: 01-02-2020\nParadigm: turn\n\n", 2),
        ("# one\n% two\n// three\n", 0),
        ("sep=,\n", 0),
        ("Device,IMU 5\nRate (Hz),100\n\n", 2),
    ] {
        let read = read(&format!("{above}Time (s),Gyro Z (deg/s),Angle (deg)\n{rows}"));
        assert_eq!(read.head.names, ["Time (s)", "Gyro Z (deg/s)", "Angle (deg)"], "{above}");
        assert_eq!(read.rows.len(), 2, "{above}");
        assert_eq!(read.skipped.iter().map(|s| s.1).sum::<u64>(), counted, "{above}");
    }
}

#[test]
fn a_banner_with_as_many_words_as_a_row_is_no_header_and_a_row_without_values_neither() {
    let row = |k: u32| format!("[00:00:00.{k}00,000] <inf> imu: gyro 0.{k} 1 2 enc {k}\n");
    for banner in ["*** Booting Zephyr OS build v3.5.0 ***", "Booting the firmware of my new board"] {
        let read = read(&format!("{banner}\n{}{}{}", row(1), row(2), row(3)));
        assert_eq!((read.head.line, read.head.names.len(), read.rows.len()), (None, 7, 3), "{banner}");
    }
    let read = read("t,gyro,angle\n0.00,None,#N/A\n0.01,1.5,0\n0.02,1.6,1\n0.03,1.7,2\n");
    assert_eq!((read.head.names, read.rows.len()), (vec!["t".to_owned(), "gyro".into(), "angle".into()], 4));
    let units = Table::open(&b"\"sep=\t\"\na\tb\nms\tm/(s^2)\n1\t2\n3\t4\n"[..], &|_| false).unwrap();
    assert_eq!((units.head().names.clone(), units.head().units[1].is_some()), (vec!["a".to_owned(), "b".into()], true));
}

#[test]
fn a_header_may_be_a_remark_or_have_a_row_of_units_below() {
    let read_names = |text: &str| read(text).head.names;
    assert_eq!(read_names("#timestamp [ns],w_x [rad s^-1]\n1,2\n3,4\n"), ["timestamp [ns]", "w_x [rad s^-1]"]);
    assert_eq!(read_names("# by hand\n# timestamp tx ty\n1 2 3\n4 5 6\n"), ["timestamp", "tx", "ty"]);
    assert_eq!(read_names("%time,field.x\n1,2\n3,4\n"), ["time", "field.x"]);
    let read = read("t;gyro x;T\n[s];[deg/s];degC\n0;1;2\n1;2;3\n");
    assert_eq!(read.head.units.iter().map(|u| u.map_or("", |u| u.symbol)).collect::<Vec<_>>(), ["s", "deg/s", "degC"]);
    assert_eq!((read.rows.len(), read.skipped), (2, vec![(Skip::Units, 1, 2)]));
}

#[test]
fn a_text_without_header_numbers_its_columns() {
    let read = read("0.0 1 2\n0.1 3 4\n");
    assert_eq!((read.head.line, read.head.names.len(), read.rows.len()), (None, 3, 2));
    assert_eq!(read.head.names[2], "column_3");
}

#[test]
fn lines_among_the_rows_that_are_none_are_counted_where_they_stand() {
    let read = read("t,gyro_z\r\n0,1\r\n# pause\r\n1,2\r\nt,gyro_z\r\n2,3\r\nLogger resumed\r\n\r\n3,4\r\n4");
    assert_eq!(read.rows.iter().map(|r| r.0).collect::<Vec<_>>(), [2, 4, 6, 9]);
    let wanted = vec![(Skip::HeaderAgain, 1, 5), (Skip::Remark, 1, 3), (Skip::Text, 1, 7), (Skip::Torn, 1, 10)];
    assert_eq!(read.skipped, wanted);
}

#[test]
fn rows_of_another_length_are_given_as_they_are() {
    let read = read("t,gyro_z,a\n0,1,2,\n1,2\n2,oops,4\n3,4,5,6\n");
    assert_eq!(read.rows.iter().map(|r| r.1.len()).collect::<Vec<_>>(), [3, 2, 3, 4]);
    assert!(read.skipped.is_empty());
}

#[test]
fn commas_for_both_are_said() {
    let open = |text: &str| Table::open(text.as_bytes(), &|_| false).err().map(|e| e.to_string());
    let says = open("time, wz, angle\n0,00, 0,60, 12,04\n0,01, 0,70, 12,05\n").unwrap();
    assert!(says.contains("6 fields under 3 names"), "{says}");
    assert_eq!(open("\n\n").unwrap(), "is empty");
    assert_eq!(open("# only\n").unwrap(), "is empty");
}

#[test]
fn rows_come_as_they_come() {
    struct Slow(Vec<&'static [u8]>);
    impl std::io::Read for Slow {
        fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
            if self.0.is_empty() {
                return Ok(0);
            }
            let piece = self.0.remove(0);
            assert_ne!(piece, b"never", "read further than needed");
            buffer[..piece.len()].copy_from_slice(piece);
            Ok(piece.len())
        }
    }
    let source = Slow(vec![b"t,gyro_z\n", b"0,1\n", b"1,", b"2\n", b"never"]);
    let mut table = Table::open(source, &|names| names.len() == 2).unwrap();
    assert_eq!(table.next_row().unwrap().unwrap().line, 2);
    assert_eq!(table.next_row().unwrap().unwrap().line, 3);
}

#[test]
fn a_time_of_day_in_one_number_is_told_from_seconds_that_are_padded_with_zeros() {
    let is_clock = |names: &str, times: [&str; 2]| {
        let rows = times.map(|time| format!("{time},47.1,8.5,1.5\n")).concat();
        read(&format!("{names}\n{rows}{rows}")).head.is_clock_in_digits(0)
    };
    let (bare, receiver) = ("time,a,b,gyro_z", "time,lat,lon,gyro_z");
    assert!(is_clock(bare, ["091420.10", "091420.15"]) && is_clock(receiver, ["141420.10", "141420.15"]));
    for times in [["000000.010", "000000.020"], ["000123.40", "000123.50"], ["141420.10", "141420.15"]] {
        assert!(!is_clock(bare, times), "{times:?}");
    }
}
