use super::super::observed::OtherZero;
use super::*;
use crate::{
    budget::Over,
    fault::{DataFault, FaultKind},
    finding::{NamedEffect, Wander, ZeroMoves},
};

/// A log of a minute with an error of noise alone.
fn clean() -> Observed {
    let low = Over { within: true, over: 1.0 };
    Observed {
        searched: true,
        unfinished: false,
        fault: None,
        named: Vec::new(),
        with_named: None,
        dominates: false,
        other_zero: None,
        unexcited: None,
        at_rest: false,
        alike: Vec::new(),
        within: true,
        seconds: 60.0,
        silent: 0.0,
        is_sensor_noise: false,
        wanders: false,
        wander: Wander::default(),
        white: [5e-5, 1e-4],
        slow: None,
        likely: None,
        wander_explains: false,
        floors: Floors { white: low, set_up: low, wander: low },
        unattributed: 0.0,
        limited_by: LimitedBy::GyroNoise,
    }
}

/// An error so many times its floor, whatever is counted to that, with this share that has no known cause.
fn high(over: f64, unattributed: f64) -> Observed {
    let high = Over { within: false, over };
    let floors = Floors { white: high, set_up: high, wander: high };
    Observed { within: false, floors, unattributed, limited_by: LimitedBy::Unattributed, ..clean() }
}

/// The same of noise that sensors have.
fn noisy(over: f64) -> Observed {
    Observed { is_sensor_noise: true, ..high(over, 0.5) }
}

fn named(aliases: &[&str]) -> Vec<NamedEffect> {
    let aliases = aliases.iter().map(|&alias| alias.into()).collect();
    vec![NamedEffect { effect: "delay".into(), aliases }]
}

fn fault() -> DataFault {
    DataFault { kind: FaultKind::WrongSign, axis: None, count: 3, first_t: None, says: String::new() }
}

/// The rule that decides: its place in the table.
fn rule(observed: &Observed) -> usize {
    VERDICTS.iter().position(|rule| rule.when.iter().all(|condition| condition.holds(observed))).unwrap()
}

/// What is observed, and the name of the rule that has to decide.
fn cases() -> Vec<(&'static str, Observed)> {
    let lost = Some(Why::NotExcited { travel: 0.1, uncertainty: 0.5 });
    let rests = |observed| Observed { at_rest: true, ..observed };
    let compared = |observed| Observed { searched: false, ..observed };
    let wander = |observed: Observed| {
        let floors = Floors { wander: Over { within: true, over: 0.9 }, ..observed.floors };
        Observed { floors, ..observed }
    };
    vec![
        ("adequate", clean()),
        ("adequate", wander(noisy(2.0))),
        ("bad-data", Observed { fault: Some(fault()), unfinished: true, named: named(&[]), ..high(9.0, 0.9) }),
        ("stopped", Observed { unfinished: true, named: named(&[]), ..high(9.0, 0.9) }),
        ("adequate", Observed { unfinished: true, ..clean() }),
        ("ambiguous", Observed { named: named(&["lag"]), ..high(9.0, 0.9) }),
        ("missing", Observed { named: named(&[]), ..high(9.0, 0.9) }),
        ("missing", Observed { named: named(&[]), unexcited: lost.clone(), dominates: true, ..high(9.0, 0.9) }),
        (
            "cannot-tell: the motion does not show it",
            Observed { named: named(&[]), unexcited: lost.clone(), ..high(9.0, 0.9) },
        ),
        ("cannot-tell: the motion does not show it", Observed { unexcited: lost, ..clean() }),
        (
            "unexplained: another zero at times",
            Observed {
                other_zero: Some(OtherZero {
                    size: Estimate { value: 0.014, std_error: 2e-4 },
                    when: ZeroMoves::Moving,
                    excess: 1.0,
                }),
                ..high(5.0, 0.5)
            },
        ),
        ("cannot-tell: too short", Observed { seconds: 6.0, ..clean() }),
        ("cannot-tell: the rate is not known", Observed { silent: 0.7, ..clean() }),
        ("cannot-tell: a slow effect or a wandering bias", Observed { slow: Some("warm-up".into()), ..noisy(2.0) }),
        ("cannot-tell: noise or an effect", Observed { likely: Some("lag".into()), ..noisy(2.0) }),
        ("adequate", Observed { likely: Some("lag".into()), wander_explains: true, ..wander(noisy(2.0)) }),
        ("cannot-tell: too large for a wandering bias", noisy(4.0)),
        ("unexplained: effects were not looked for", compared(high(9.0, 0.9))),
        ("unexplained: no effect removes it", high(9.0, 0.9)),
        ("cannot-tell: a known cause hides smaller effects", high(9.0, 0.1)),
        ("adequate", Observed { limited_by: LimitedBy::GyroNoise, ..high(2.0, 0.1) }),
        ("ambiguous: by the ladder", Observed { alike: named(&["lag"]), ..clean() }),
        ("cannot-tell: at rest", rests(clean())),
        ("unexplained: no effect removes it", rests(high(9.0, 0.9))),
        ("cannot-tell: a slow effect or a wandering bias, not looked for", compared(wander(noisy(9.0)))),
        ("unexplained: too large for a wandering bias, not looked for", compared(noisy(9.0))),
        ("cannot-tell: a small effect or a wandering bias, not looked for", compared(noisy(2.0))),
    ]
}

#[test]
fn each_rule_decides_what_it_is_for() {
    for (wanted, observed) in cases() {
        let decided = rule(&observed);
        assert_eq!(VERDICTS[decided].name, wanted, "{observed:?}");
        // The name begins with the kind that JSON has.
        let json = serde_json::to_value(decide(&observed)).unwrap();
        let kind = wanted.split(':').next().unwrap();
        assert_eq!(json["kind"], kind, "{json}");
    }
}

#[test]
fn no_rule_is_without_a_case() {
    let decided: Vec<&str> = cases().iter().map(|(_, observed)| VERDICTS[rule(observed)].name).collect();
    for rule in VERDICTS {
        assert!(decided.contains(&rule.name), "{}", rule.name);
    }
}

#[test]
fn a_finding_has_its_numbers() {
    let Finding::Unexplained(Excess::NoEffect { over_floor, unattributed }) = decide(&high(9.0, 0.9)) else { panic!() };
    assert!((over_floor - 9.0).abs() < 1e-12 && (unattributed - 0.9).abs() < 1e-12);
    assert_eq!(decide(&Observed { seconds: 6.0, ..clean() }), Finding::CannotTell(Why::TooShort { seconds: 6.0 }));
}

#[test]
fn a_wandering_bias_is_counted_to_the_floor_only_where_nothing_else_is_left() {
    assert!(leaves_noise(&clean()) && leaves_noise(&noisy(9.0)));
    assert!(!leaves_noise(&high(9.0, 0.1)) && !leaves_noise(&Observed { named: named(&[]), ..noisy(9.0) }));
    assert!(!leaves_noise(&Observed { fault: Some(fault()), ..clean() }));
}
