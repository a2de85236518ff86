use super::*;
use crate::{
    fault::FaultKind,
    finding::{Adequate, Became, Excess, NamedEffect, Wander, Why, ZeroMoves},
};

fn named(effect: &str, aliases: &[&str]) -> NamedEffect {
    NamedEffect { effect: effect.into(), aliases: aliases.iter().map(|&alias| alias.into()).collect() }
}

fn axis(finding: Finding) -> AxisResult {
    AxisResult {
        limited_says: "the gyro's own white noise, 0.0050 °/√s (80 % of the error² at 1.0 s). Use a quieter gyro."
            .into(),
        data_faults: vec![
            DataFault {
                kind: FaultKind::WrongSign,
                axis: Some(Axis::X),
                count: 9,
                first_t: None,
                says: "gyro_x turns against ref_angle_x: negate one of them. Then look again".into(),
            },
            DataFault {
                kind: FaultKind::DependentReference,
                axis: Some(Axis::X),
                count: 9,
                first_t: None,
                says: "ref_angle_x is made of gyro_x's own readings: nothing can be told".into(),
            },
        ],
        ..AxisResult::new(Axis::X, finding)
    }
}

/// One finding of each kind, with each reason.
fn all() -> Vec<Finding> {
    let wander = Wander { size: 2e-4, within_s: Some(31.0) };
    let whys = [
        Why::ReferenceAtRest,
        Why::Disagrees,
        Why::NotExcited { travel: 0.05, uncertainty: 0.4 },
        Why::OneRate { uncertainty: 0.09 },
        Why::AtRest { noise: Adequate::WithinFloor { silent: 0.0 } },
        Why::AtRest { noise: Adequate::Wanders(wander) },
        Why::TooShort { seconds: 6.0 },
        Why::Silent { share: 0.7 },
        Why::SlowOrWander { effect: "warm-up".into(), wander },
        Why::NoiseOrEffect { effect: "lag".into() },
        Why::NoneStandsOut { over_white: 4.6, unattributed: 0.3 },
        Why::NotSearched { over_floor: 2.1, small: true },
        Why::NotSearched { over_floor: 4.1, small: false },
        Why::Hidden { known: 0.92 },
        Why::Dependent,
    ];
    let missing = |effects: Vec<NamedEffect>, over_floor| Finding::Missing { effects, over_floor };
    let ambiguous = |effects: Vec<NamedEffect>, over_floor, added| Finding::Ambiguous { effects, over_floor, added };
    let mut all = vec![
        missing(vec![named("delay", &[])], None),
        missing(vec![named("delay", &[]), named("cross-axis", &[])], Some(1.1)),
        missing(vec![named("delay", &[])], Some(4.0)),
        ambiguous(vec![named("delay", &["lag"])], None, false),
        ambiguous(vec![named("delay", &["lag"]), named("cross-axis", &[])], Some(1.1), false),
        ambiguous(vec![named("delay", &["lag"])], None, true),
        Finding::Adequate(Adequate::WithinFloor { silent: 0.1 }),
        Finding::Adequate(Adequate::Wanders(Wander { size: 2e-4, within_s: None })),
        Finding::Adequate(Adequate::WhiteNoise { gyro: 5e-5, reference: 1e-4 }),
        Finding::Adequate(Adequate::Limited),
        Finding::Unexplained(Excess::NoEffect { over_floor: 4.84, unattributed: 0.61 }),
        Finding::Unexplained(Excess::NotSearched),
        Finding::Unexplained(Excess::OtherZero { size: 0.014, std_error: 2e-4, when: ZeroMoves::Moving }),
        Finding::Unexplained(Excess::OtherZero { size: 0.002, std_error: 2e-4, when: ZeroMoves::WithAngle }),
        Finding::Unexplained(Excess::OtherZero {
            size: -0.05,
            std_error: 2e-4,
            when: ZeroMoves::ForAWhile { between: [31.0, 58.0] },
        }),
        Finding::Unexplained(Excess::NoWander { over_floor: 13.2 }),
        Finding::BadData { fault: FaultKind::WrongSign, axis: Some(Axis::X), count: 9 },
        Finding::Stopped { over_floor: 7.0 },
    ];
    all.extend(whys.map(Finding::CannotTell));
    all
}

/// Remarks of each kind.
fn remarks() -> Vec<Remark> {
    let became = [
        Became::Undefined,
        Became::PartlyUndefined { share: 0.25 },
        Became::Noise,
        Became::NothingChanges,
        Became::Spanned,
        Became::RemovesNothing,
    ];
    let mut all = vec![
        Remark::Unexcited(Why::Disagrees),
        Remark::AtRest,
        Remark::OtherAxis { axis: Axis::Y, effect: "delay".into() },
        Remark::NotSeen { effects: vec!["lag".into()] },
        Remark::NotSeen { effects: vec!["lag".into(), "delay".into()] },
        Remark::JudgedWithout { axes: vec![Axis::Z] },
        Remark::JudgedWithout { axes: vec![Axis::X] },
        Remark::ReadTheTurn { shares: vec![(Axis::Y, 0.021), (Axis::Z, -0.013)] },
        Remark::CoarseTemperature { step: 1.0, error: 1.5e-4 },
        Remark::OtherClock,
        Remark::OwnLog,
        Remark::Moved { parameter: "delay.d".into(), errors: 7.4 },
    ];
    all.extend(became.map(|became| Remark::OwnEffect { effect: "hot".into(), became }));
    all
}

const VOICES: [Voice; 4] = [Voice::Log, Voice::Stream, Voice::Library, Voice::Page];

/// A text in every voice, each once.
fn in_every_voice(text: impl Fn(Voice) -> String) -> String {
    let mut all: Vec<(Vec<String>, String)> = Vec::new();
    for voice in VOICES {
        let (said, name) = (text(voice), format!("{voice:?}").to_lowercase());
        match all.iter_mut().find(|(_, other)| *other == said) {
            Some((voices, _)) => voices.push(name),
            None => all.push((vec![name], said)),
        }
    }
    let lines: Vec<String> = all.iter().map(|(voices, said)| format!("  {}: {said}\n", voices.join(", "))).collect();
    lines.concat()
}

/// Holds a text against its file in `snapshots/`; with `TRUERATE_SNAPSHOTS=write` it is written there.
fn hold(name: &str, text: &str) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("src/words/snapshots").join(name);
    if std::env::var_os("TRUERATE_SNAPSHOTS").is_some_and(|wish| wish == "write") {
        std::fs::write(&path, text).unwrap();
    }
    let kept = std::fs::read_to_string(&path).unwrap();
    assert!(kept == text, "{name} is\n{kept}and would be\n{text}with TRUERATE_SNAPSHOTS=write");
}

#[test]
fn what_is_said_of_each_finding_is_what_its_file_shows() {
    let mut files: std::collections::BTreeMap<String, Vec<String>> = std::collections::BTreeMap::new();
    for finding in all() {
        let name = serde_json::to_value(finding.verdict()).unwrap();
        let data = serde_json::to_string(&finding).unwrap();
        let said = in_every_voice(|voice| axis(finding.clone()).in_words(voice));
        files.entry(name.as_str().unwrap().to_owned()).or_default().push(format!("{data}\n{said}\n"));
    }
    assert_eq!(files.len(), 6, "a file a verdict");
    for (verdict, text) in files {
        hold(&format!("{verdict}.txt"), &text.concat());
    }
    let own = axis(Finding::Adequate(Adequate::Limited));
    let said: Vec<String> = remarks()
        .into_iter()
        .map(|beside| {
            let sentence = |voice| remark::sentence(&beside, &Subject::from(&own), voice).unwrap_or_default();
            format!("{}\n{}\n", serde_json::to_string(&beside).unwrap(), in_every_voice(sentence))
        })
        .collect();
    hold("remarks.txt", &said.concat());
}

#[test]
fn every_finding_has_a_sentence_and_only_a_command_line_names_commands() {
    for finding in all() {
        let axis = axis(finding.clone());
        for voice in VOICES {
            let says = axis.in_words(voice);
            assert!(says.len() > 20 && !says.contains("NaN") && !says.contains(".."), "{finding:?}: {says}");
            assert!(voice == Voice::Log || !says.contains("truerate") && !says.contains("--"), "{finding:?}: {says}");
            assert!(voice != Voice::Stream || !says.contains("this log"), "{finding:?}: {says}");
        }
    }
}

#[test]
fn a_report_says_beside_its_headline_only_what_that_does_not() {
    let left = |finding| beyond(&axis(finding), false, Voice::Log);
    assert_eq!(left(Finding::Missing { effects: vec![named("delay", &[])], over_floor: None }), "");
    assert_eq!(
        left(Finding::Ambiguous { effects: vec![named("delay", &["lag"])], over_floor: None, added: false }),
        ""
    );
    assert_eq!(left(Finding::Adequate(Adequate::WithinFloor { silent: 0.0 })), "");
    assert_eq!(left(Finding::CannotTell(Why::Hidden { known: 0.9 })), "");
    let short = Finding::CannotTell(Why::TooShort { seconds: 6.0 });
    assert_eq!(left(short.clone()), "record a minute or more, turning to and fro at several speeds");
    assert!(
        beyond(&axis(short), true, Voice::Log).starts_with("the error is what noise alone leaves, but 6.0 s of data")
    );
    let bad = Finding::BadData { fault: FaultKind::WrongSign, axis: Some(Axis::X), count: 9 };
    assert_eq!(left(bad), "Then look again");
    let many = Finding::Missing { effects: vec![named("delay", &[]), named("lag", &[])], over_floor: Some(5.0) };
    assert_eq!(left(many), "No effect of the catalogue explains what is then left.");
}

#[test]
fn remarks_stand_behind_the_finding_each_a_sentence() {
    let mut own = axis(Finding::CannotTell(Why::TooShort { seconds: 6.0 }));
    own.remarks = vec![
        Remark::Unexcited(Why::Disagrees),
        Remark::OwnEffect { effect: "hot".into(), became: Became::PartlyUndefined { share: 0.25 } },
        Remark::AtRest,
        Remark::OtherAxis { axis: Axis::Y, effect: "delay".into() },
        Remark::NotSeen { effects: vec!["lag".into(), "delay".into()] },
        Remark::JudgedWithout { axes: vec![Axis::Z] },
        Remark::CoarseTemperature { step: 1.0, error: 1.5e-4 },
        Remark::OwnLog,
        Remark::Moved { parameter: "delay.d".into(), errors: 7.4 },
    ];
    let says = own.in_words(Voice::Log);
    println!("{says}");
    assert!(says.starts_with("the error is what noise alone leaves, but 6.0 s of data are too short"), "{says}");
    assert!(says.contains("at several speeds. Besides, gyro_x and its reference do not agree"), "{says}");
    assert!(
        says.contains("Your `hot` has no finite value in 25 % of this log, and is taken for 0 there. Axis x"),
        "{says}"
    );
    assert!(says.contains("On this log lag and delay are less than 2 standard errors from zero"), "{says}");
    assert!(
        says.ends_with("7 standard errors away: what is shown here is refitted, and `truerate fit` keeps it."),
        "{says}"
    );
    assert!(!own.in_words(Voice::Library).contains("truerate") && !own.in_words(Voice::Stream).contains("this log"));
}
