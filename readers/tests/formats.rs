//! Every format on files whose content is known: counts, times, values; and what a cut or a damage costs.

mod seeds;

use log_readers::{
    format::{Field, Note, Sink, Topic},
    formats::{can, recognise},
    meaning::{Pick, Proposal, of_topics},
    survey::{Survey, Surveyed},
};
use seeds::MESSAGES;

/// Everything that a file holds.
#[derive(Default)]
struct All {
    topics: Vec<Topic>,
    messages: Vec<(usize, i64, Vec<f64>)>,
    notes: Vec<Note>,
}

impl Sink for All {
    fn topic(&mut self, topic: &Topic) -> bool {
        self.topics.push(topic.clone());
        true
    }

    fn message(&mut self, topic: usize, time_ns: i64, values: &[f64]) {
        self.messages.push((topic, time_ns, values.to_vec()));
    }

    fn note(&mut self, note: Note) {
        self.notes.push(note);
    }
}

fn read(bytes: &[u8]) -> All {
    let mut all = All::default();
    seeds::read(bytes, seeds::DBC.as_bytes(), &mut all).unwrap();
    all
}

/// What a log says of its device.
fn said(bytes: &[u8]) -> Vec<(String, String)> {
    let mut survey = Survey::default();
    seeds::read(bytes, seeds::DBC.as_bytes(), &mut survey).unwrap();
    survey.said.into_iter().collect()
}

fn pairs(expected: &[(&str, &str)]) -> Vec<(String, String)> {
    expected.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect()
}

#[test]
fn what_a_log_says_of_its_board_and_its_driver_is_told() {
    let mut ulog = seeds::ulog();
    for (key, value) in
        [("char[6] ver_hw", "V5X00\0"), ("char[4] sys_uuid", "00A7"), ("uint32_t ver_sw_release", "1234")]
    {
        let body = [&[key.len() as u8][..], key.as_bytes(), value.as_bytes()].concat();
        ulog.extend((body.len() as u16).to_le_bytes());
        ulog.push(b'I');
        ulog.extend(body);
    }
    assert_eq!(said(&ulog), pairs(&[("sys_uuid", "00A7"), ("ver_hw", "V5X00")]));

    let mut ardupilot = seeds::ardupilot();
    let padded = |text: &str, length: usize| [text.as_bytes(), &vec![0; length - text.len()]].concat();
    ardupilot.extend([0xa3, 0x95, 128, 140, 3 + 8 + 64]);
    ardupilot.extend([padded("MSG", 4), padded("QZ", 16), padded("TimeUS,Message", 64)].concat());
    for words in
        ["ArduCopter V4.3.1 (a1b2c3d4)", "ChibiOS: 93e6e03d", "fmuv5 00380035 3035510B 32343536", "EKF3 is using GPS"]
    {
        ardupilot.extend([0xa3, 0x95, 140]);
        ardupilot.extend([0; 8]);
        ardupilot.extend(padded(words, 64));
    }
    let wanted =
        [("board", "fmuv5"), ("sys_uuid", "003800353035510B32343536"), ("ver_sw", "ArduCopter V4.3.1 (a1b2c3d4)")];
    assert_eq!(said(&ardupilot), pairs(&wanted));

    // A record of metadata behind the head of an MCAP.
    let prefixed = |bytes: &[u8]| [&(bytes.len() as u32).to_le_bytes()[..], bytes].concat();
    let map = [prefixed(b"serial_number"), prefixed(b"S17"), prefixed(b"operator"), prefixed(b"someone")].concat();
    let body = [prefixed(b"imu"), prefixed(&map)].concat();
    let mut mcap = seeds::mcap("");
    let head = 8 + 9 + usize::try_from(u64::from_le_bytes(mcap[9..17].try_into().unwrap())).unwrap();
    let record = [&[0x0c][..], &(body.len() as u64).to_le_bytes(), &body].concat();
    mcap.splice(head..head, record);
    assert_eq!(said(&mcap), pairs(&[("imu.serial_number", "S17")]));
    assert_eq!(said(&seeds::text()), pairs(&[]));
}

#[test]
fn every_format_is_recognised_by_its_content_and_read_to_the_end() {
    for (name, bytes) in seeds::all() {
        assert_eq!(recognise(&bytes).name(), name);
        let all = read(&bytes);
        let of_first: Vec<_> = all.messages.iter().filter(|message| message.0 == 0).collect();
        assert_eq!(of_first.len() as u64, MESSAGES, "{name}: {:?}", all.notes);
        let (step, last) = match name {
            "PX4 ULog" => (5_000_000, 1_000_000_000 + 199 * 5_000_000),
            "ArduPilot log" => (2_500_000, 199 * 2_500_000),
            "delimited text" => (10_000_000, 1_990_000_000),
            _ => (10_000_000, 1_700_000_001_990_000_000),
        };
        assert_eq!((of_first[1].1 - of_first[0].1, of_first[199].1), (step, last), "{name}");
        let topic = &all.topics[0];
        let z = topic.fields.iter().position(|field| field.name.ends_with(['z', 'Z'])).unwrap();
        for (k, (_, _, values)) in of_first.iter().enumerate() {
            assert_eq!(values.len(), topic.fields.len());
            assert!((values[z] - f64::from(seeds::rate(k as u64))).abs() < 1e-6, "{name}: message {k}: {values:?}");
        }
    }
}

#[test]
fn fields_have_their_names_and_units() {
    let names = |bytes: &[u8], topic: usize| -> (String, Vec<String>) {
        let all = read(bytes);
        let fields = all.topics[topic].fields.iter();
        (
            all.topics[topic].name.clone(),
            fields.map(|f| format!("{}{}", f.name, f.unit.map_or("", |u| u.symbol))).collect(),
        )
    };
    let of = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
    assert_eq!(
        names(&seeds::ulog(), 1),
        ("sensor_gyro_1".to_owned(), of(&["x", "y", "z", "more.low[0]", "more.low[1]", "more.high"]))
    );
    assert_eq!(
        names(&seeds::ardupilot(), 1),
        ("IMU[1]".to_owned(), of(&["TimeUS", "I", "GyrXrad/s", "GyrYrad/s", "GyrZrad/s", "T"]))
    );
    for bytes in [seeds::mcap("zstd"), seeds::bag("bz2")] {
        let wanted = of(&["angular_velocity.x", "angular_velocity.y", "angular_velocity.z"]);
        let (name, mut found) = names(&bytes, 0);
        found.retain(|field| field != "header.seq");
        assert_eq!((name, found), ("/imu".to_owned(), wanted));
    }
}

#[test]
fn frames_of_both_writers_are_signals_with_units_and_those_that_are_not_there_are_none() {
    for bytes in [seeds::candump(), seeds::asc()] {
        let all = read(&bytes);
        let fields: Vec<_> = all.topics.iter().flat_map(|of| of.fields.iter().map(|f| of.channel(f))).collect();
        let wanted = ["IMU.GYRO_X", "IMU.GYRO_Z", "IMU.KIND", "IMU.TEMP", "IMU.SUPPLY", "ENCODER.ANGLE_Z"];
        assert_eq!(fields, wanted);
        let symbols: Vec<_> = all.topics[0].fields.iter().map(|f| f.unit.map_or("", |unit| unit.symbol)).collect();
        assert_eq!(symbols, ["deg/s", "rad/s", "", "degC", "V"]);
        let [(0, _, even), (1, _, encoder), (0, _, odd)] = &all.messages[..3] else { panic!("{:?}", all.messages) };
        assert!((even[0] + 1.0).abs() < 1e-9 && even[3] == 25.0 && even[4].is_nan(), "{even:?}");
        assert!(odd[3].is_nan() && (odd[4] - 0.001).abs() < 1e-12 && encoder[0] == 0.0, "{odd:?}");
        assert_eq!(all.notes, []);
    }
    let mut survey = Survey::default();
    seeds::read(&seeds::candump(), seeds::DBC.as_bytes(), &mut survey).unwrap();
    let map: Vec<String> = of_topics(&survey.topics, &|_| false, &[]).chosen.iter().map(ToString::to_string).collect();
    assert_eq!(
        map,
        [
            "gyro_x_dps=IMU.GYRO_X",
            "gyro_z=IMU.GYRO_Z",
            "temp=IMU.TEMP",
            "supply=IMU.SUPPLY",
            "ref_angle_z_deg=ENCODER.ANGLE_Z"
        ]
    );
}

#[test]
fn frames_that_nothing_is_said_of_are_counted_by_their_identifiers() {
    for bytes in [seeds::candump(), seeds::asc()] {
        let mut survey = Survey::default();
        recognise(&bytes).read(&mut &bytes[..], &mut survey).unwrap();
        let of = |k: usize| {
            let of = &survey.topics[k];
            (of.topic.name.as_str(), of.topic.kind.as_str(), of.messages, of.fields[0].low, of.fields[0].high)
        };
        assert_eq!(survey.topics.len(), 2);
        assert_eq!(of(0), ("0x18FEF1D5", can::UNNAMED, MESSAGES, 12.0, 12.0));
        assert_eq!(of(1), ("0x123", can::UNNAMED, MESSAGES, 2.0, 2.0));
        assert_eq!(of_topics(&survey.topics, &|_| false, &[]), Proposal::default());
    }
}

#[test]
fn frames_of_other_senders_are_topics_of_their_own() {
    let mut survey = Survey::default();
    let text = String::from_utf8(seeds::candump()).unwrap();
    // Every second message comes from another sender, and with another priority.
    let mut count = 0;
    let lines = text.lines().map(|line| {
        count += usize::from(line.contains("18FEF1D5"));
        let id = if count % 2 == 0 { "0CFEF121" } else { "18FEF1D5" };
        line.replace("18FEF1D5", id) + "\n"
    });
    let text: String = lines.collect();
    seeds::read(text.as_bytes(), seeds::DBC.as_bytes(), &mut survey).unwrap();
    let of: Vec<_> = survey.topics.iter().map(|of| (of.topic.name.as_str(), of.messages)).collect();
    assert_eq!(of, [("IMU", 100), ("ENCODER", 200), ("IMU@0x21", 100)]);
    let map = of_topics(&survey.topics, &|_| false, &[]).chosen;
    assert!(map.iter().any(|pick| pick.to_string() == "gyro_z=IMU.GYRO_Z"), "{map:?}");
}

#[test]
fn a_file_that_breaks_off_gives_what_is_whole_and_says_where() {
    // Of a Parquet that breaks off nothing can be read: its columns are listed at its end.
    let others = seeds::all().into_iter().filter(|(name, _)| !["delimited text", "Parquet"].contains(name));
    for (name, bytes) in others {
        let whole = read(&bytes).messages;
        let (mut most, mut said, mut cuts) = (0, 0, 0);
        for cut in (bytes.len() / 2..bytes.len() - 40).step_by(61) {
            let part = read(&bytes[..cut]);
            assert!(part.messages.len() <= whole.len(), "{name}");
            let alike = part.messages.iter().zip(&whole).all(|(a, b)| a.0 == b.0 && a.1 == b.1);
            assert!(alike, "{name} cut at {cut}: not a prefix");
            most = most.max(part.messages.len());
            said += usize::from(part.notes.iter().any(|note| matches!(note, Note::BreaksOff { .. })));
            cuts += 1;
        }
        // A cut between two records of a format without an end is none.
        assert!(said > cuts * 9 / 10, "{name}: {said} of {cuts} said");
        // A packed chunk may be one block, which is whole or nothing.
        assert!(most > 0 || bytes.len() < 20_000, "{name}");
    }
}

#[test]
fn damage_in_the_middle_costs_what_is_damaged() {
    for (name, mut bytes) in [("ulog", seeds::ulog()), ("ardupilot", seeds::ardupilot())] {
        let whole = read(&bytes).messages.len();
        let middle = bytes.len() / 2;
        bytes[middle..middle + 100].fill(0xff);
        let all = read(&bytes);
        assert!(all.notes.iter().any(|note| matches!(note, Note::Damaged { .. })), "{name}: {:?}", all.notes);
        let lost = whole - all.messages.len();
        assert!(lost > 0 && lost < whole / 2, "{name}: {lost} of {whole} lost");
    }
}

#[test]
fn a_gyro_that_is_named_is_not_its_own_reference() {
    let mut survey = Survey::default();
    recognise(&seeds::ardupilot()).read(&mut &seeds::ardupilot()[..], &mut survey).unwrap();
    let mapped = [Pick::new("gyro_z", "IMU[1].GyrZ", None)];
    let map = of_topics(&survey.topics, &|name| name.starts_with("gyro"), &mapped).chosen;
    assert!(map.iter().any(|pick| pick.to_string() == "ref_rate_z=IMU[0].GyrZ"), "{map:?}");
}

/// PX4's message with the readings of the sensor that it selects, and the sensors one by one.
fn px4(selected: f64, rates: &[(&str, f64, u64)]) -> Vec<Surveyed> {
    let mut survey = Survey::default();
    let mut add = |name: &str, kind: &str, fields: &[&str], values: &[f64], messages: u64| {
        let fields = fields.iter().map(|name| Field::new(*name)).collect();
        survey.topic(&Topic { name: name.to_owned(), kind: kind.to_owned(), fields });
        let topic = survey.topics.len() - 1;
        (0..messages).for_each(|k| survey.message(topic, (k * 10_000_000_000 / messages).cast_signed(), values));
    };
    add("sensor_combined", "sensor_combined", &["gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]"], &[0.1; 3], 2000);
    add("vehicle_attitude", "vehicle_attitude", &["q[0]", "q[1]", "q[2]", "q[3]"], &[1.0; 4], 2000);
    add("sensor_selection", "sensor_selection", &["gyro_device_id"], &[selected], 1);
    for (name, device, messages) in rates {
        add(name, "sensor_gyro", &["x", "y", "z", "device_id"], &[0.1, 0.1, 0.1, *device], *messages);
    }
    survey.topics
}

#[test]
fn a_second_imu_is_the_reference_or_said_to_be_too_slow_and_the_selected_one_never_is() {
    let of = |selected, messages| {
        of_topics(&px4(selected, &[("sensor_gyro", 7.0, messages), ("sensor_gyro_1", 8.0, messages)]), &|_| false, &[])
    };
    let reference = |proposal: &Proposal| {
        let picks = proposal.chosen.iter().filter(|pick| pick.name.starts_with("ref_"));
        picks.map(|pick| pick.channel.clone()).next()
    };
    let slow = of(7.0, 10);
    assert_eq!(slow.seconds.iter().map(|of| of.topic.as_str()).collect::<Vec<_>>(), ["sensor_gyro_1"]);
    assert!(!slow.seconds[0].serves() && slow.seconds[0].picks[0].to_string() == "ref_rate_x=sensor_gyro_1.x");
    assert_eq!(of(8.0, 10).seconds[0].topic, "sensor_gyro");
    // Half as fast as what PX4 selects, and fast enough.
    assert_eq!(reference(&of(7.0, 900)).as_deref(), Some("sensor_gyro_1.x"));
    assert_eq!(reference(&of(8.0, 900)).as_deref(), Some("sensor_gyro.x"));
}

#[test]
fn two_gyros_are_gyro_and_reference() {
    for (bytes, wanted) in [
        (seeds::ulog(), ["gyro_z=sensor_gyro.z", "ref_rate_z=sensor_gyro_1.z"]),
        (seeds::ardupilot(), ["gyro_z=IMU[0].GyrZ", "ref_rate_z=IMU[1].GyrZ"]),
    ] {
        let mut survey = Survey::default();
        recognise(&bytes).read(&mut &bytes[..], &mut survey).unwrap();
        let map: Vec<String> =
            of_topics(&survey.topics, &|_| false, &[]).chosen.iter().map(ToString::to_string).collect();
        for pick in wanted {
            assert!(map.iter().any(|found| found == pick), "{pick} is not in {map:?}");
        }
    }
}

#[cfg(feature = "parquet")]
#[test]
fn a_parquet_is_the_table_that_it_means_with_what_is_no_reading_named() {
    let all = read(&seeds::parquet());
    let names: Vec<&str> = all.topics[0].fields.iter().map(|field| field.name.as_str()).collect();
    let wanted =
        ["stamp", "imu.gz", "accel.x", "accel.y", "accel.z", "encoder_z_deg", "temp", "ticks", "moving", "label"];
    assert_eq!(names, wanted);
    let (_, _, odd) = &all.messages[121];
    assert!(odd[5].is_nan() && odd[9].is_nan(), "a null and a text are no values: {odd:?}");
    assert_eq!((odd[4], odd[6], odd[7], odd[8]), (9.8125, 141.5, 65_421.0, 0.0));
    assert!((all.messages[122].2[5] - 12.2).abs() < 1e-12);
    assert_eq!(all.notes, [Note::LeftOut { names: vec!["picture".to_owned()] }]);
}

#[cfg(feature = "parquet")]
#[test]
fn a_parquet_without_its_end_is_refused_with_what_to_do() {
    let whole = seeds::parquet();
    for cut in [4, whole.len() / 2, whole.len() - 1] {
        let refused = seeds::read(&whole[..cut], b"", &mut All::default()).unwrap_err().to_string();
        assert!(refused.contains("copy it again"), "{refused}");
    }
}
