//! Every format on files whose content is known: counts, times, values; and what a cut or a damage costs.

mod seeds;

use log_readers::{
    format::{Note, Sink, Topic},
    formats::recognise,
    meaning::of_topics,
    survey::Survey,
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
    let map: Vec<String> = of_topics(&survey.topics, &|_| false).chosen.iter().map(ToString::to_string).collect();
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
    assert!(recognise(&seeds::candump()).read(&mut &seeds::candump()[..], &mut survey).is_err());
}

#[test]
fn a_file_that_breaks_off_gives_what_is_whole_and_says_where() {
    for (name, bytes) in seeds::all().into_iter().filter(|(name, _)| *name != "delimited text") {
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
fn two_gyros_are_gyro_and_reference() {
    for (bytes, wanted) in [
        (seeds::ulog(), ["gyro_z=sensor_gyro.z", "ref_rate_z=sensor_gyro_1.z"]),
        (seeds::ardupilot(), ["gyro_z=IMU[0].GyrZ", "ref_rate_z=IMU[1].GyrZ"]),
    ] {
        let mut survey = Survey::default();
        recognise(&bytes).read(&mut &bytes[..], &mut survey).unwrap();
        let map: Vec<String> = of_topics(&survey.topics, &|_| false).chosen.iter().map(ToString::to_string).collect();
        for pick in wanted {
            assert!(map.iter().any(|found| found == pick), "{pick} is not in {map:?}");
        }
    }
}
