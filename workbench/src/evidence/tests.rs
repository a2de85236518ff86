use super::*;
use gyro_model::pooled::{Column, Key, piece::Noise};
use proptest::prelude::*;

/// A log that says something, made from its number.
fn one(number: u64) -> LogEvidence {
    let x = |k: u64| ((number * 7919 + k * 104_729) % 99_991) as f64 / 99_991.0;
    let columns = vec![
        Column { key: Key::new(Axis::Z, "scale-factor", "alpha"), unit: "1".into(), at: 0.9 + 0.1 * x(1), own: false },
        Column { key: Key::new(Axis::Z, "delay", "d"), unit: "s".into(), at: 0.0, own: false },
    ];
    let piece = Piece {
        axes: vec![Axis::Z],
        columns,
        information: vec![1e9 * (1.0 + x(2)), 1e3 * x(3), 1e7 * (1.0 + x(4))],
        score: vec![x(5) / 3.0, -1e-7 * x(6)],
        expected: vec![0.0, 1.0 / 3.0],
        inflation: vec![1.0, 1.0 + x(7)],
        shows: vec![x(8), 1e12 * x(9)],
        squares: 5_999.123_456_789,
        readings: 6000,
        noise: Noise {
            angle_random_walk: 7.1e-5 * x(1),
            bias_random_walk: 0.0,
            encoder: 1e-4,
            correlated: 0.0,
            correlation_time: 1.0,
            rate_random_walk: 0.0,
        },
    };
    LogEvidence {
        sha256: several::hexadecimal(&sum(&[number.to_string()])),
        log: format!("log-{number}.csv"),
        part: format!("p{}", number % 5),
        kind: "MPU-6050".into(),
        meta: BTreeMap::from([("range".to_owned(), "250".to_owned())]),
        day: "2026-05-31".parse().ok(),
        seconds: 60.0 + x(10),
        samples: 6000,
        temperature: Some((20.0 + x(11), 30.0)),
        axes: Vec::new(),
        pieces: vec![piece],
        by: "truerate".into(),
    }
}

fn of(numbers: impl IntoIterator<Item = u64>) -> Evidence {
    Evidence::new(numbers.into_iter().map(one)).unwrap()
}

proptest! {
    #[test]
    fn however_it_was_split_and_ordered_the_same_logs_give_the_same_bytes(
        order in Just((0_u64..24).collect::<Vec<_>>()).prop_shuffle(),
        cuts in proptest::collection::vec(0_usize..24, 1..6),
        again in 0_u64..24,
    ) {
        let whole = of(0..24).render().unwrap();
        let mut cuts = cuts;
        cuts.extend([0, 24]);
        cuts.sort_unstable();
        let mut merged = of([again]);
        for cut in cuts.windows(2).filter(|cut| cut[0] < cut[1]) {
            // Each goes through a file.
            let part = of(order[cut[0]..cut[1]].iter().copied()).render().unwrap();
            let part = Evidence::parse("part", &part).unwrap();
            let text = Evidence::merge([merged, part]).unwrap().0.render().unwrap();
            merged = Evidence::parse("merged", &text).unwrap();
        }
        prop_assert_eq!(merged.render().unwrap(), whole);
    }

    #[test]
    fn merging_is_associative(a in 0_u64..20, b in 0_u64..20, c in 0_u64..20) {
        let (a, b, c) = (of(a..a + 3), of(b..b + 4), of(c..c + 2));
        let merge = |x: &Evidence, y: &Evidence| Evidence::merge([x.clone(), y.clone()]).unwrap().0;
        prop_assert_eq!(merge(&merge(&a, &b), &c), merge(&a, &merge(&b, &c)));
        prop_assert_eq!(merge(&a, &b), merge(&b, &a));
    }

    #[test]
    fn numbers_come_back_to_the_last_bit(number in 0_u64..100_000) {
        let own = of([number]);
        prop_assert_eq!(Evidence::parse("x", &own.render().unwrap()).unwrap(), own);
    }

    #[test]
    fn whatever_stands_in_a_file_is_understood_or_refused(cut in 0_usize..3000, at in 0_usize..3000, byte in 0_u8..128) {
        let text = of([1, 2]).render().unwrap();
        let refused = |text: &str| Evidence::parse("f.json", text).err().map(|error| format!("{error:#}"));
        if cut < text.trim_end().len() {
            let said = refused(&text[..cut]);
            prop_assert!(said.as_ref().is_some_and(|said| said.starts_with("f.json")), "{said:?}");
        }
        let mut bytes = text.clone().into_bytes();
        if at < bytes.len() && bytes[at] != byte {
            bytes[at] = byte;
            if let Ok(changed) = String::from_utf8(bytes) {
                // White space between the values says nothing.
                let same = Evidence::parse("f.json", &changed).is_ok_and(|own| own == of([1, 2]));
                prop_assert!(same || refused(&changed).is_some_and(|said| said.starts_with("f.json")));
            }
        }
    }
}

/// What is said of evidence, and what was done to it.
type Poison = (&'static str, fn(&mut LogEvidence));

#[test]
fn what_is_not_to_be_used_is_refused_in_words() {
    let text = of([1]).render().unwrap();
    let said = |text: &str| format!("{:#}", Evidence::parse("f.json", text).unwrap_err());
    assert!(said("").contains("f.json: is empty"));
    assert!(said("t,gyro_z\n0,1\n").contains("not an evidence file"));
    assert!(said(&text.replace("evidence/1", "evidence/2")).contains("a newer truerate made it"));
    assert!(said(&text.replace("truerate.evidence/1", "truerate.model/1")).contains("schema truerate.model/1"));
    assert!(said(&text[..text.len() / 2]).contains("ends in the middle"));
    assert!(said(&text.replace("\"readings\":6000", "\"readings\":6001")).contains("was changed after it was written"));
    let none = Evidence::default().render().unwrap();
    assert!(said(&none).contains("holds no log"), "{}", said(&none));
    let poisons: [Poison; 9] = [
        ("`information` of delay.d on axis z with scale-factor.alpha", |log| log.pieces[0].information[1] = 1e30),
        ("`score` of scale-factor.alpha on axis z is 1e12", |log| log.pieces[0].score[0] = 1e12),
        ("`score` has 1e200", |log| log.pieces[0].score[1] = 1e200),
        ("`expected` has 1e300", |log| log.pieces[0].expected[0] = 1e300),
        ("`expected` of delay.d on axis z is 1e9", |log| log.pieces[0].expected[1] = 1e9),
        ("`squares` is -3e0", |log| log.pieces[0].squares = -3.0),
        ("the diagonal of `information` of delay.d", |log| log.pieces[0].information[2] = -1.0),
        ("its `sha256` is \"xyz\"", |log| log.sha256 = "xyz".into()),
        ("its length is -1 s", |log| log.seconds = -1.0),
    ];
    for (why, poison) in poisons {
        let mut poisoned = one(1);
        poison(&mut poisoned);
        let said = said(&Evidence { logs: vec![poisoned] }.render().unwrap());
        assert!(said.starts_with("f.json: log-1.csv has numbers that no log makes") && said.contains(why), "{said}");
    }
}

#[test]
fn numbers_that_are_written_in_another_way_are_read_where_the_checksum_is_of_them() {
    let text = of([1]).render().unwrap();
    let line =
        text.lines().nth(1).unwrap().replace("\"samples\":6000", "\"samples\": 6000").replace("1000000.0", "1e6");
    let other = format!("{}\n{line}\n{}\n", head(), tail(&sum(std::slice::from_ref(&line))));
    assert!(other != text);
    assert_eq!(Evidence::parse("x", &other).unwrap(), of([1]));
    let line = line.replace("\"squares\":5999.123456789", "\"squares\":-3");
    let poisoned = format!("{}\n{line}\n{}\n", head(), tail(&sum(std::slice::from_ref(&line))));
    let said = format!("{:#}", Evidence::parse("x", &poisoned).unwrap_err());
    assert!(said.contains("x: log-1.csv has numbers that no log makes (`squares` is -3e0"), "{said}");
}

#[test]
fn one_log_of_two_parts_is_refused() {
    let other = LogEvidence { part: "another".into(), ..one(3) };
    let said = format!("{:#}", Evidence::new([one(3), other]).unwrap_err());
    assert!(said.contains("the same log") && said.contains("part another"), "{said}");
    assert_eq!(Evidence::merge([of([1, 2]), of([2, 3])]).unwrap().1, 1);
    let other = Evidence { logs: vec![LogEvidence { part: "another".into(), ..one(3) }] };
    let named = Evidence::merge_named([(of([1, 3]), "a.evidence"), (other, "b.evidence")]);
    let said = format!("{:#}", named.unwrap_err());
    assert!(said.contains("in a.evidence and log-3.csv (part another") && said.contains("in b.evidence"), "{said}");
}

#[test]
fn bytes_are_written_as_two_digits_each() {
    assert_eq!(several::hexadecimal(&[0, 10, 255]), "000aff");
}

#[test]
fn files_are_merged_line_by_line_into_the_bytes_of_a_merge_in_memory() {
    let folder = tempfile::tempdir().unwrap();
    let place = |name: &str| folder.path().join(name);
    let file = |name: &str, text: &str| {
        fs::write(place(name), text).unwrap();
        place(name)
    };
    let parts = [of([3, 9, 1]), of([9, 4]), of([7])].map(|own| own.render().unwrap());
    // One is written by another hand: white space between the values, and lines that end as on Windows.
    let spaced = parts[1].replace(",\"log\"", " , \"log\"").replace('\n', "\r\n");
    let files = [file("a", &parts[0]), file("b", &spaced), file("c", &parts[2])];
    let merged = merge(&files, &place("all")).unwrap();
    let whole = of([1, 3, 4, 7, 9]).render().unwrap();
    assert_eq!(merged, Merged { logs: 5, twice: 1, bytes: whole.len() as u64 });
    assert_eq!(fs::read_to_string(place("all")).unwrap(), whole);
    // Into one of them.
    merge(&[files[2].clone(), place("all")], &files[2]).unwrap();
    assert_eq!(fs::read_to_string(&files[2]).unwrap(), whole);
    let mut names = Vec::new();
    each(&files[2], |log| names.push(log.log)).unwrap();
    assert_eq!(names.len(), 5);
    for (damaged, says) in [
        (parts[0].replace("\"readings\":6000", "\"readings\":6001"), "was changed after it was written"),
        (parts[0][..parts[0].len() / 2].to_owned(), "ends in the middle"),
        (String::new(), "is empty"),
        (Evidence { logs: vec![LogEvidence { seconds: f64::MAX * 2.0, ..one(1) }] }.render().unwrap(), "is damaged"),
    ] {
        let bad = file("bad", &damaged);
        let said = format!("{:#}", merge(&[files[0].clone(), bad.clone()], &place("none")).unwrap_err());
        assert!(said.contains("bad: ") && said.contains(says) && !place("none").exists(), "{said}");
        assert!(each(&bad, drop).is_err());
    }
    let other = Evidence { logs: vec![LogEvidence { part: "another".into(), ..one(3) }] }.render().unwrap();
    let said = format!("{:#}", merge(&[files[0].clone(), file("other", &other)], &place("none")).unwrap_err());
    assert!(said.contains("the same log and differ") && said.contains("part another"), "{said}");
    // The logs have one name: the files tell them apart.
    assert!(
        said.contains(&files[0].display().to_string()) && said.contains(&place("other").display().to_string()),
        "{said}"
    );
}
