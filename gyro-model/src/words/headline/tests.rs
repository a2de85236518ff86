use super::*;
use crate::{
    diagnosis::{FloorFrom, LadderStep},
    effects::CATALOGUE,
    fault::{DataFault, FaultKind},
    finding::{Finding, Why},
};

/// Made-up numbers: each parameter a little off its typical size, known to 2 %; `sign` turns coefficients round.
fn made_up(axis: Axis, id: &str, sign: f64) -> Vec<ParameterValue> {
    let effect = effects::find(id).unwrap();
    let typical = |card: &effects::ParameterCard| match (card.typical, card.neutral) {
        (0.0, _) => 0.3 * effect.parameters(axis)[0].typical,
        (typical, neutral) if card.bounds.0 < 0.0 && neutral == 0.0 => sign * typical,
        (typical, 1.0) if sign < 0.0 => 2.0 - typical,
        (typical, _) => typical,
    };
    let value = |card: &effects::ParameterCard| ParameterValue {
        effect: id.into(),
        name: card.name.into(),
        value: Some(1.005 * typical(card)),
        std_error: Some((0.02 * typical(card)).abs()),
        unit: card.unit.into(),
        typical: Some(card.typical),
    };
    effect.parameters(axis).iter().map(value).collect()
}

/// An error curve that lies at so many times its floor.
fn curve(ratio: f64) -> Vec<ErrorPoint> {
    [0.02, 0.1, 1.0, 6.0]
        .map(|tau_s: f64| {
            let floor = 6e-4 / tau_s.sqrt();
            ErrorPoint { tau_s, error: Some(ratio * floor), floor: Some(floor), floor_99: Some(1.3 * floor) }
        })
        .to_vec()
}

fn suspect(id: &str, aliases: &[&str], sign: f64) -> Suspect {
    Suspect {
        effect: id.into(),
        aliases: aliases.iter().map(|&a| a.into()).collect(),
        separate_by: "sharp steps".into(),
        p_value: Some(1e-9),
        error_fall: Some(0.99),
        log_likelihood_gain: Some(80.0),
        parameters: made_up(Axis::Z, id, sign),
        error_curve: curve(1.05),
    }
}

fn diagnosed(verdict: Verdict, suspects: Vec<Suspect>, ratio: f64) -> AxisResult {
    let finding = match verdict {
        Verdict::CannotTell => Finding::CannotTell(Why::NotExcited { travel: 0.0366, uncertainty: 0.12 }),
        Verdict::BadData => Finding::BadData { fault: FaultKind::WrongSign, axis: Some(Axis::Z), count: 9 },
        verdict => Finding::Bare { verdict },
    };
    AxisResult {
        effects: vec!["scale-factor".into(), "bias".into()],
        error_curve: curve(ratio),
        error_over_floor: Some(ratio),
        within_floor: Some(ratio < 1.3),
        searched: true,
        suspects,
        data_faults: vec![DataFault {
            kind: FaultKind::WrongSign,
            axis: Some(Axis::Z),
            count: 9,
            first_t: None,
            says: "gyro_z turns against ref_angle_z: negate one of them. Then look again".into(),
        }],
        floor_from: FloorFrom::Measured,
        ..AxisResult::new(Axis::Z, finding)
    }
}

#[test]
fn each_effect_says_what_it_does_with_its_number_and_what_to_do_about_it() {
    for effect in CATALOGUE {
        let id = effect.card().id;
        for sign in [1.0, -1.0] {
            let headline = of(&diagnosed(Verdict::MissingEffect, vec![suspect(id, &[], sign)], 14.0), Voice::Log);
            // `cargo test -p gyro-model headline -- --nocapture` prints them to be read.
            println!("{id}: {}\n    At the source: {}.", headline.answer, headline.at_source);
            let first = headline.answer.split(". ").next().unwrap();
            assert!(first.chars().any(|c| c.is_ascii_digit()) && first.contains('±'), "{id}: {first}");
            assert!(!first.contains(id) && first.starts_with(['Y', 'T']), "{id}: {first}");
            assert!(headline.answer.contains(" °/s of error over 1 s; corrected, "), "{id}: {}", headline.answer);
            assert!(headline.answer.contains("is left, which is noise."), "{id}: {}", headline.answer);
            assert!(!headline.at_source.is_empty() && !headline.at_source.ends_with('.'), "{id}");
            assert!(!headline.answer.contains("NaN") && !headline.answer.contains("inf"), "{id}: {}", headline.answer);
        }
        let encoder = effect.stage().is_of_reference();
        let says = of(&diagnosed(Verdict::MissingEffect, vec![suspect(id, &[], 1.0)], 14.0), Voice::Log).answer;
        assert_eq!(says.contains("Your gyro is not the cause."), encoder, "{says}");
    }
}

#[test]
fn what_the_recording_makes_of_the_rest_is_not_called_noise() {
    let says = |folded: f64| {
        let mut point = BudgetPoint { tau_s: 1.0, ..BudgetPoint::default() };
        point.parts[LimitedBy::GyroNoise as usize] = 1e-8;
        point.parts[LimitedBy::FoldedMotion as usize] = folded;
        point.parts[LimitedBy::MissingEffect as usize] = 1e-6;
        let axis = diagnosed(Verdict::MissingEffect, vec![suspect("delay", &[], 1.0)], 14.0);
        of(&AxisResult { budget: vec![point], ..axis }, Voice::Log).answer
    };
    assert!(says(1e-9).ends_with("is left, which is noise."), "{}", says(1e-9));
    assert!(says(1e-7).ends_with("is left, most of it from motion too fast for the log's rate."), "{}", says(1e-7));
}

#[test]
fn each_sentence_has_the_sign_that_its_equation_has() {
    let says = |id: &str, sign: f64| clause(Axis::Z, id, &made_up(Axis::Z, id, sign));
    assert_eq!(says("delay", 1.0), "your gyro is 10.05 ± 0.20 ms late");
    assert_eq!(
        says("delay", -1.0),
        "the gyro and its reference are 10.05 ± 0.20 ms apart, the gyro first: the reference is late, or its clock is"
    );
    // ω̂ = α ω_g: with α below 1 the reading is too large.
    assert!(says("scale-factor", 1.0).contains("too high"), "{}", says("scale-factor", 1.0));
    // ω_f = ω + k2 ω², k2 = 1.5e-3 s/rad at 1.745 rad/s is 0.26 °/s.
    assert!(says("quadratic-nonlinearity", 1.0).contains("0.2631 ± 0.0052 °/s too high at 100 °/s"));
    assert!(says("quadratic-nonlinearity", -1.0).contains("too low"));
    // A reading stamped t belongs to t (1 + s): its clock has counted too little.
    assert!(says("clock-skew", 1.0).ends_with("slow") && says("clock-skew", -1.0).ends_with("fast"));
    assert!(says("cross-axis", 1.0).contains("of turning about x and 2.010 ± 0.040 % of turning about y"));
    assert!(says("warm-up", -1.0).contains("too low"));
}

#[test]
fn each_verdict_has_its_answer_with_a_number() {
    let group = vec![suspect("delay", &["lag"], 1.0), suspect("lag", &["delay"], 1.0)];
    let cases = [
        (diagnosed(Verdict::Ambiguous, group, 14.0), "Either your gyro is 10.05 ± 0.20 ms late, or your gyro follows"),
        (
            diagnosed(Verdict::Adequate, Vec::new(), 1.02),
            "Nothing is missing: over 1 s the error is 0.0351 °/s, which is noise.",
        ),
        (
            diagnosed(Verdict::Adequate, Vec::new(), 1.9),
            "No effect is missing: over 1 s the error is 0.0653 °/s (white noise alone: 0.0344)",
        ),
        (diagnosed(Verdict::Unexplained, Vec::new(), 14.0), "up to 14 times what noise and the set-up alone make"),
        (
            AxisResult {
                limited_by: Some(LimitedBy::Timing),
                limit: Some(Limit {
                    what: "the stamps of gyro and reference scatter by 3 ms against each other".into(),
                    share: "90 % of the error² at 1 s".into(),
                    remedy: "Stamp in hardware, or log both with one clock.".into(),
                }),
                ..diagnosed(Verdict::Unexplained, Vec::new(), 14.0)
            },
            "Most of it: the stamps of gyro and reference scatter by 3 ms against each other.",
        ),
        (
            AxisResult { searched: false, ..diagnosed(Verdict::Unexplained, Vec::new(), 14.0) },
            "This model leaves more than noise: 0.481 °/s of error over 1 s",
        ),
        (
            diagnosed(Verdict::CannotTell, Vec::new(), 14.0),
            "This log cannot tell: axis z turns through 2.1° at most in this log, so its scale factor",
        ),
        (
            diagnosed(Verdict::BadData, Vec::new(), 14.0),
            "The data are at fault: gyro_z turns against ref_angle_z: negate one of them.",
        ),
    ];
    for (axis, wanted) in cases {
        let answer = of(&axis, Voice::Log).answer;
        println!("{:?}: {answer}", axis.verdict);
        assert!(answer.contains(wanted), "{:?}: {answer}", axis.verdict);
    }
}

/// A ladder that added a delay, then a backlash, and came to this many times its floor.
#[test]
fn an_alias_of_which_no_size_is_known_is_named_without_numbers() {
    let mut alias = suspect("warm-up", &["bias-drift"], 1.0);
    alias.parameters.iter_mut().for_each(|p| p.std_error = p.value.map(|value| 3.0 * value.abs()));
    let group = vec![suspect("bias-drift", &["warm-up"], 1.0), alias];
    let answer = of(&diagnosed(Verdict::Ambiguous, group, 14.0), Voice::Log).answer;
    assert!(answer.contains(", or warm-up is missing (turn-on transient"), "{answer}");
}

#[test]
fn what_a_correction_takes_away_is_told_where_the_error_falls() {
    let mut hysteresis = suspect("rate-hysteresis", &[], 1.0);
    hysteresis.error_curve = curve(14.0);
    hysteresis.error_curve[2].error = hysteresis.error_curve[2].error.map(|error| 1.2 * error);
    hysteresis.error_curve[1].error = hysteresis.error_curve[1].error.map(|error| 0.2 * error);
    let answer = of(&diagnosed(Verdict::MissingEffect, vec![hysteresis], 14.0), Voice::Log).answer;
    assert!(answer.contains("of error over 0.1 s; corrected"), "{answer}");
}

#[test]
fn a_correction_that_lowers_no_error_is_not_said_to_leave_more() {
    let mut zone = suspect("dead-zone", &[], 1.0);
    zone.error_curve = curve(1.2);
    let answer = of(&diagnosed(Verdict::MissingEffect, vec![zone], 1.02), Voice::Log).answer;
    assert!(answer.ends_with("It changes this log's error little: 0.0351 °/s over 1 s, which is noise."), "{answer}");
    let ladder = AxisResult {
        steps: climbed(Verdict::Adequate, 1.0)
            .steps
            .into_iter()
            .map(|step| LadderStep { error_curve: curve(1.0), ..step })
            .collect(),
        ..climbed(Verdict::Adequate, 1.0)
    };
    let answer = of(&ladder, Voice::Log).answer;
    assert!(answer.contains("They change this log's error little") && !answer.contains("corrected"), "{answer}");
}

#[test]
fn beside_what_a_log_cannot_tell_apart_what_is_sure_stays_sure() {
    let suspects = vec![suspect("warm-up", &[], 1.0), suspect("lag", &["delay"], 1.0), suspect("delay", &[], 1.0)];
    let mut axis = diagnosed(Verdict::Ambiguous, suspects, 14.0);
    axis.missing = vec!["warm-up".into(), "lag".into()];
    let answer = of(&axis, Voice::Log).answer;
    let (sure, open) = answer.split_once(" Either ").expect(&answer);
    assert!(sure.starts_with("Your gyro's zero starts") && sure.ends_with('.'), "{answer}");
    assert!(open.contains(", or ") && open.contains("ms late") && open.contains("cannot tell which."), "{answer}");
    assert_eq!(axis.in_question().unwrap().effect, "lag");
}

#[test]
fn effects_that_are_missing_together_are_told_together_with_one_error_before_and_after() {
    let axis = AxisResult {
        missing: vec!["delay".into(), "encoder-backlash".into()],
        missing_error_curve: curve(1.02),
        ..diagnosed(
            Verdict::MissingEffect,
            vec![
                Suspect { error_curve: curve(4.0), ..suspect("delay", &[], 1.0) },
                Suspect { error_curve: curve(13.0), ..suspect("encoder-backlash", &[], 1.0) },
            ],
            14.0,
        )
    };
    let headline = of(&axis, Voice::Log);
    // As the ladder says it, and the gyro is a cause.
    assert_eq!(headline.answer, of(&climbed(Verdict::Adequate, 1.02), Voice::Log).answer);
    assert!(headline.at_source.starts_with("for delay, stamp"), "{}", headline.at_source);
    let rest = of_beside(&axis, &["delay"], Voice::Log).answer;
    assert!(
        rest.starts_with("The encoder has") && rest.contains("Together with what the axes share, that makes"),
        "{rest}"
    );
    assert!(
        of_beside(&axis, &["delay", "encoder-backlash"], Voice::Log)
            .answer
            .starts_with("The causes that the axes share make")
    );
}

fn climbed(verdict: Verdict, ratio: f64) -> AxisResult {
    let step = |added: Option<&str>, ratio: f64| LadderStep {
        added: added.map(Into::into),
        removed: None,
        aliases: Vec::new(),
        error_curve: curve(ratio),
        error_over_floor: Some(ratio),
    };
    let mut parameters = made_up(Axis::Z, "delay", 1.0);
    parameters.extend(made_up(Axis::Z, "encoder-backlash", 1.0));
    AxisResult {
        effects: ["scale-factor", "bias", "delay", "encoder-backlash"].map(Into::into).to_vec(),
        parameters,
        steps: vec![step(None, 14.0), step(Some("delay"), 4.0), step(Some("encoder-backlash"), ratio)],
        floor_from: FloorFrom::Measured,
        ..AxisResult::new(Axis::Z, Finding::Bare { verdict })
    }
}

#[test]
fn a_ladder_tells_all_that_it_added_at_once_and_what_was_before() {
    let headline = of(&climbed(Verdict::Adequate, 1.02), Voice::Log);
    assert_eq!(
        headline.answer,
        "Your gyro is 10.05 ± 0.20 ms late. The encoder has 0.576 ± 0.011° of play against the shaft. Together they make 0.481 °/s of \
         error over 1 s; corrected, 0.0351 is left, which is noise."
    );
    let at_source = headline.at_source;
    assert!(at_source.starts_with("for delay, stamp gyro and reference") && !at_source.ends_with('.'), "{at_source}");
    assert!(at_source.contains(". For encoder backlash, take the play out"), "{at_source}");
}

/// `cargo test -p gyro-model headline -- --nocapture` prints them to be read.
#[test]
fn any_two_effects_are_told_in_a_sentence_each_and_what_to_do_about_both() {
    let known: Vec<&str> = CATALOGUE.iter().map(|effect| effect.card().id).filter(|id| *id != "bias").collect();
    for (k, one) in known.iter().enumerate().skip(1) {
        let other = known[(k + 7) % known.len()];
        let mut axis = climbed(Verdict::Adequate, 1.02);
        axis.effects = ["scale-factor", "bias", one, other].map(Into::into).to_vec();
        axis.parameters = [one, other].iter().flat_map(|id| made_up(Axis::Z, id, 1.0)).collect();
        axis.steps[1].added = Some((*one).into());
        axis.steps[2].added = Some(other.into());
        let Headline { answer, at_source } = of(&axis, Voice::Log);
        println!("{one}, {other}: {answer}\n    At the source: {at_source}.");
        let told = |id: &str| sentence(&clause(Axis::Z, id, &axis.parameters));
        assert_eq!(answer.find(&told(one)), Some(0), "{answer}");
        assert!(answer.contains(&told(other)) && answer.contains(" Together they make "), "{answer}");
        assert!(at_source.starts_with("for "), "{at_source}");
    }
    let both = ["temperature-bias", "temperature-scale"];
    assert!(sources(&both).starts_with("keep the sensor at one temperature"), "{}", sources(&both));
    assert_eq!(sources(&[]), "");
}

#[test]
fn what_a_ladder_leaves_by_the_set_up_s_fault_is_no_noise() {
    let limited = AxisResult {
        limited_by: Some(LimitedBy::FoldedMotion),
        limit: Some(Limit {
            what: "the rate swings by ±60 °/s at 83 Hz, beyond half the sampling rate".into(),
            share: "67 % of the error² at 0.1 s".into(),
            remedy: "Sample faster.".into(),
        }),
        ..climbed(Verdict::CannotTell, 1.07)
    };
    let answer = of(&limited, Voice::Log).answer;
    assert!(
        answer.ends_with("is left. Most of that: the rate swings by ±60 °/s at 83 Hz, beyond half the sampling rate."),
        "{answer}"
    );
    let unknown = AxisResult { limited_by: Some(LimitedBy::Unattributed), ..climbed(Verdict::Unexplained, 3.0) };
    assert!(of(&unknown, Voice::Log).answer.ends_with("is left, 3.0 times what noise and the set-up alone make."));
}

#[test]
fn a_change_tells_what_it_did_to_the_error() {
    let before = diagnosed(Verdict::MissingEffect, vec![suspect("delay", &[], 1.0)], 14.0);
    let mut after = diagnosed(Verdict::Adequate, Vec::new(), 1.02);
    after.effects.push("delay".into());
    after.parameters = made_up(Axis::Z, "delay", 1.0);
    let headline = of_change(&["delay".into()], &[], Some(&before), &after, Voice::Log);
    assert_eq!(
        headline.answer,
        "Delay added: the error over 1 s goes from 0.481 to 0.0351 °/s, which is noise. Your gyro is 10.05 ± 0.20 ms late."
    );
    after.parameters[0].std_error = Some(0.02);
    let needless = of_change(&["delay".into()], &[], Some(&before), &after, Voice::Log);
    assert!(needless.answer.ends_with("this log cannot distinguish it from zero.") && needless.at_source.is_empty());
}

#[test]
fn of_two_models_the_better_one_is_named_with_the_effect_that_makes_it_so() {
    let with = |ratio: f64, effects: &[&str]| AxisResult {
        effects: effects.iter().map(|id| (*id).to_owned()).collect(),
        parameters: effects.iter().flat_map(|id| made_up(Axis::Z, id, 1.0)).collect(),
        ..diagnosed(Verdict::Adequate, Vec::new(), ratio)
    };
    let base = with(60.0, &["scale-factor", "bias"]);
    let new = with(1.02, &["scale-factor", "bias", "delay"]);
    let says = |axis: &AxisResult, other: &AxisResult, told: &[&str]| {
        let answer = of_against(("new.toml", "base.toml"), axis, other, told).answer;
        println!("{answer}");
        answer
    };
    let better = says(&new, &base, &[]);
    assert!(better.contains("it is better. Your gyro is") && better.contains("which is noise"), "{better}");
    assert!(!says(&new, &base, &["delay"]).contains("Your gyro"), "a cause that was told is told again");
    // The worse model lacks what the better one has.
    let worse = says(&base, &new, &[]);
    assert!(worse.contains("it is worse. Your gyro is"), "{worse}");
    let same = says(&with(1.1, &["scale-factor", "bias"]), &new, &[]);
    assert!(same.contains("no difference beyond noise") && !same.contains("Your gyro"), "{same}");
    let standings = [(&new, &base), (&base, &new), (&new, &new)].map(|(a, b)| Beside::of(a, b).unwrap().standing);
    assert_eq!(standings, [Standing::Better, Standing::Worse, Standing::Same]);
}

#[test]
fn two_models_that_differ_only_at_short_times_are_told_there() {
    let new = diagnosed(Verdict::Adequate, Vec::new(), 1.0);
    let mut base = new.clone();
    base.error_curve[0].error = Some(9.0 * base.error_curve[0].floor.unwrap());
    let beside = Beside::of(&new, &base).unwrap();
    assert_eq!((beside.tau_s, beside.standing), (0.02, Standing::Better));
    // Without an error there is nothing to compare.
    base.error_curve.iter_mut().for_each(|p| p.error = None);
    assert!(Beside::of(&new, &base).is_none());
}
