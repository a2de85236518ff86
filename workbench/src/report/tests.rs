use super::*;
use gyro_model::{
    Axis, Noise,
    detail::{Channel, Input, detail},
    diagnosis::{
        AxisResult, BudgetPoint, DataFault, ErrorPoint, FailsWhere, FaultKind, FloorFrom, LADDER, LadderStep, Limit,
        LimitedBy, NoiseValue, ParameterValue, Suspect, Verdict,
    },
    finding::{Adequate, Excess, Finding, NamedEffect, Remark, Why},
};

fn curve(excess: f64) -> Vec<ErrorPoint> {
    (0..20)
        .map(|i| {
            let tau_s = 0.02 * 1.43f64.powi(i);
            let floor = 2e-3 / tau_s.sqrt() + 3e-4;
            let error = floor.hypot(excess / (1.0 + 0.3 * tau_s));
            ErrorPoint { tau_s, error: Some(error), floor: Some(floor), floor_99: Some(1.2 * floor) }
        })
        .collect()
}

fn parameter(effect: &str, name: &str, value: f64, std_error: f64, unit: &str) -> ParameterValue {
    ParameterValue {
        effect: effect.into(),
        name: name.into(),
        value: Some(value),
        std_error: Some(std_error),
        unit: unit.into(),
        typical: Some(value * 0.8),
    }
}

/// A log of 100 s whose gyro is 12 ms late.
fn late(verdict: Verdict) -> AxisResult {
    let t: Vec<f64> = (0..10_000).map(|k| f64::from(k) * 0.01).collect();
    let rate: Vec<f64> = t.iter().map(|t| 2.0 * (1.1 * t).sin() + (0.31 * t).sin()).collect();
    let error: Vec<f64> = t.iter().zip(&rate).map(|(t, w)| -0.012 * w + 1e-3 * (97.0 * t).sin().powi(3)).collect();
    let change: Vec<f64> = t.iter().map(|t| 2.2 * (1.1 * t).cos() + 0.31 * (0.31 * t).cos()).collect();
    let channels = [
        Channel { regressor: "time".into(), unit: "s", values: t.clone() },
        Channel { regressor: "rate".into(), unit: "rad/s", values: rate.clone() },
        Channel { regressor: "rate-change".into(), unit: "rad/s²", values: change },
        Channel {
            regressor: "direction".into(),
            unit: "1",
            values: rate.iter().map(|w| if w.abs() < 0.1 { 0.0 } else { w.signum() }).collect(),
        },
        Channel { regressor: "temperature".into(), unit: "°C", values: t.iter().map(|t| 24.0 + 0.08 * t).collect() },
    ];
    let noise = Noise { angle_random_walk: 7e-5, bias_random_walk: 0.0, encoder: 4.5e-4, ..Noise::default() };
    let detail = detail(&Input { t: &t, rate: &rate, error_angle: &error, channels: &channels, noise });
    AxisResult {
        effects: vec!["scale-factor".into(), "bias".into()],
        parameters: vec![
            parameter("scale-factor", "alpha", 0.9939, 1e-5, "1"),
            parameter("bias", "delta", 8.6e-4, 2e-6, "rad/s"),
        ],
        noise: NoiseValue { angle_random_walk: Some(7.1e-5), bias_random_walk: None, encoder: Some(4.5e-4) },
        error_curve: curve(0.05),
        error_over_floor: Some(31.0),
        within_floor: Some(false),
        floor_source: "gyro noise from standing still, encoder from its quantum".into(),
        fails_where: gyro_model::detail::fails_where(&detail)
            .into_iter()
            .chain([FailsWhere {
                regressor: "temperature".into(),
                from: Some(31.0),
                to: None,
                samples: 900,
                mean_error: Some(0.012),
                std_error: Some(0.001),
                says: "above 31 °C the rate reads 0.70 ± 0.06 °/s high".into(),
            }])
            .collect(),
        searched: true,
        explained: vec![],
        unfinished: false,
        missing: vec![],
        missing_error_curve: vec![],
        suspects: vec![
            Suspect {
                effect: "delay".into(),
                aliases: vec!["lag".into()],
                separate_by: "turn faster than 20 times a second: only a lag loses amplitude".into(),
                p_value: Some(1e-12),
                error_fall: Some(0.98),
                log_likelihood_gain: Some(61.0),
                parameters: vec![parameter("delay", "d", 0.0121, 1e-4, "s")],
                error_curve: curve(1e-4),
            },
            Suspect {
                effect: "encoder-backlash".into(),
                aliases: vec![],
                separate_by: String::new(),
                p_value: Some(0.02),
                error_fall: Some(0.31),
                log_likelihood_gain: Some(53.0),
                parameters: vec![parameter("encoder-backlash", "b", 0.004, 5e-4, "rad")],
                error_curve: curve(0.03),
            },
        ],
        data_faults: vec![DataFault {
            kind: FaultKind::Outliers,
            axis: Some(Axis::Z),
            count: 3,
            first_t: Some(12.5),
            says: "gyro_z jumps by more than 20 times its usual step; those rows are left out".into(),
        }],
        floor_from: FloorFrom::Measured,
        budget: budget(),
        error_by_frequency: vec![],
        limited_by: Some(LimitedBy::Timing),
        limited_says: "the stamps of gyro and reference scatter by 2.8 ms. Log both with one clock.".into(),
        random: Vec::new(),
        detail: Some(detail),
        ..AxisResult::new(Axis::Z, Finding::Bare { verdict })
    }
}

/// Three quarters of the error are the clock's.
fn budget() -> Vec<BudgetPoint> {
    let point = |p: &ErrorPoint| {
        let square = p.error.unwrap_or(0.0).powi(2);
        let mut point = BudgetPoint { tau_s: p.tau_s, ..BudgetPoint::default() };
        for (part, share) in [(LimitedBy::GyroNoise, 0.15), (LimitedBy::Timing, 0.75), (LimitedBy::Unattributed, 0.1)] {
            point.parts[part as usize] = share * square;
        }
        point
    };
    curve(0.05).iter().map(point).collect()
}

#[test]
fn what_limits_a_log_is_told_with_its_shares_and_its_remedy() {
    let text = render(&diagnosis(Verdict::Unexplained), Format::Text, &context(Command::Diagnose));
    assert!(text.contains("what limits this log: timing"), "{text}");
    assert!(text.contains("scatter by 2.8 ms"), "{text}");
    let timing = text.lines().find(|line| line.trim_start().starts_with("timing")).unwrap_or_default();
    assert!(timing.contains("75 %"), "{text}");
    assert!(!text.contains("aliased motion"), "{text}");
}

fn diagnosis(verdict: Verdict) -> Diagnosis {
    Diagnosis {
        schema: "truerate.diagnosis/1".into(),
        log: "yaw.csv.gz".into(),
        axes: vec![late(verdict)],
        several: None,
    }
}

fn ladder() -> Diagnosis {
    let axis = late(Verdict::Adequate);
    let step = |added: Option<&str>, excess: f64, ratio: f64| LadderStep {
        added: added.map(Into::into),
        removed: None,
        aliases: if added == Some("delay") { vec!["lag".into()] } else { vec![] },
        error_curve: curve(excess),
        error_over_floor: Some(ratio),
    };
    Diagnosis {
        schema: LADDER.into(),
        log: "yaw.csv.gz".into(),
        axes: vec![AxisResult {
            effects: vec!["scale-factor".into(), "bias".into(), "delay".into()],
            steps: vec![
                step(None, 0.05, 31.0),
                step(Some("delay"), 0.004, 3.1),
                step(Some("encoder-backlash"), 0.0, 1.02),
            ],
            suspects: vec![],
            data_faults: vec![],
            ..axis
        }],
        several: None,
    }
}

fn context(command: Command) -> Context {
    Context::new(command, "yaw.csv.gz")
}

#[test]
fn text_opens_with_the_verdict_and_ends_with_the_next_command() {
    let text = render(&diagnosis(Verdict::MissingEffect), Format::Text, &context(Command::Diagnose));
    let verdict = text.find("missing effect: delay").expect("the verdict");
    let table = text.find("drift over a time τ").expect("the curve");
    let next = text.find("truerate add yaw.csv.gz delay -o model.toml").expect("the next command");
    assert!(verdict < table && table < next, "{text}");
    assert!(text.contains("°/s") && text.contains("12.10 ± 0.10 ms") && text.contains("98 %"), "{text}");
    assert!(text.contains("odds against the next suspect: 2\u{a0}981 to 1 (encoder-backlash)"), "{text}");
    assert!(text.contains("above 31 °C") && text.contains("outliers"), "{text}");
    assert!(!text.contains('\x1b') && !text.contains("NaN"), "{text}");
}

#[test]
fn text_stays_within_its_terminal() {
    for width in [60, 80, 110] {
        let context = Context { terminal: Terminal { width, colour: false }, ..context(Command::Diagnose) };
        for line in render(&diagnosis(Verdict::Ambiguous), Format::Text, &context).lines() {
            assert!(line.chars().count() <= width, "{width}: {line}");
        }
    }
}

/// The text with its line ends taken out.
fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn what_headline_and_label_say_is_not_said_again() {
    let limit =
        |what: &str, share: &str, remedy: &str| Limit { what: what.into(), share: share.into(), remedy: remedy.into() };
    let text = |finding: Finding, limit: &Limit| {
        let mut diagnosis = diagnosis(finding.verdict());
        let axis = &mut diagnosis.axes[0];
        axis.find(finding);
        axis.remarks.push(Remark::AtRest);
        (axis.limited_says, axis.limit) = (limit.says(), Some(limit.clone()));
        words(&render(&diagnosis, Format::Text, &context(Command::Diagnose)))
    };
    let delay = |aliases: &[&str]| NamedEffect {
        effect: "delay".into(),
        aliases: aliases.iter().map(|&alias| alias.into()).collect(),
    };
    let noise =
        limit("noise of the reference, 0.025° a reading", "99 % of the error² at 40 ms", "Record a finer reference.");
    let missing = text(Finding::Missing { effects: vec![delay(&[])], over_floor: None }, &noise);
    assert!(missing.contains("Verdict: missing effect: delay. Axis z does not turn in this log:"), "{missing}");
    assert!(!missing.contains("look again") && missing.contains("the error's largest part: timing"), "{missing}");
    // What to do is to add the effect.
    assert!(missing.contains("(99 % of the error² at 40 ms).") && !missing.contains("Record a finer"), "{missing}");
    let ambiguous = text(Finding::Ambiguous { effects: vec![delay(&["lag"])], over_floor: None, added: false }, &noise);
    assert_eq!(ambiguous.matches("cannot tell which").count(), 1, "{ambiguous}");
    let stamps = limit("stamps that scatter", "", "");
    let unknown = text(Finding::CannotTell(Why::NotExcited { travel: 0.05, uncertainty: 0.09 }), &stamps);
    assert_eq!(unknown.matches("so its scale factor is not known to better than 9 %").count(), 1, "{unknown}");
    assert!(unknown.contains("Turn it to and fro through at least a quarter turn"), "{unknown}");
    let hidden = text(Finding::CannotTell(Why::Hidden { known: 0.9 }), &stamps);
    assert_eq!(hidden.to_lowercase().matches("stamps that scatter").count(), 1, "{hidden}");
}

#[test]
fn effects_that_are_missing_together_have_no_odds_against_one_another() {
    let mut diagnosis = diagnosis(Verdict::MissingEffect);
    let axis = &mut diagnosis.axes[0];
    axis.missing = vec!["delay".into(), "encoder-backlash".into()];
    axis.missing_error_curve = curve(0.0);
    let named = |effect: &str| NamedEffect { effect: effect.into(), aliases: vec![] };
    let effects = vec![named("delay"), named("encoder-backlash")];
    axis.find(Finding::Missing { effects, over_floor: Some(1.0) });
    let text = words(&render(&diagnosis, Format::Text, &context(Command::Diagnose)));
    assert!(text.contains("Verdict: missing effects: delay, encoder-backlash. the error's largest part"), "{text}");
    assert!(text.contains("12.10 ± 0.10 ms late. The encoder has") && text.contains("Together they make"), "{text}");
    assert!(!text.contains("odds") && !text.contains("noise alone looks like"), "{text}");
    assert!(text.contains("truerate add yaw.csv.gz delay encoder-backlash -o model.toml"), "{text}");
}

#[test]
fn the_curve_shows_the_time_at_which_the_error_is_worst() {
    let mut diagnosis = diagnosis(Verdict::Unexplained);
    let worst = &mut diagnosis.axes[0].error_curve[7];
    worst.error = worst.floor.map(|floor| 77.0 * floor);
    let text = render(&diagnosis, Format::Text, &context(Command::Diagnose));
    assert!(text.lines().any(|line| line.contains("°  ") && line.contains(" 77 ")), "{text}");
}

#[test]
fn sizes_of_one_effect_have_one_unit_in_the_sentence_and_in_the_list() {
    let mut diagnosis = diagnosis(Verdict::MissingEffect);
    let step = [parameter("clock-step", "j", 0.02, 4e-6, "s"), parameter("clock-step", "t0", 30.0, 5e-4, "s")];
    let mount =
        [parameter("mount-resonance", "f", 12.0, 0.01, "Hz"), parameter("mount-resonance", "zeta", 0.097, 6e-3, "1")];
    diagnosis.axes[0].suspects[0].effect = "clock-step".into();
    diagnosis.axes[0].suspects[0].parameters = step.to_vec();
    diagnosis.axes[0].suspects[1].effect = "mount-resonance".into();
    diagnosis.axes[0].suspects[1].parameters = mount.to_vec();
    let text = words(&render(&diagnosis, Format::Text, &context(Command::Diagnose)));
    assert!(text.contains("j = 20.0000 ± 0.0040 ms, t0 = 30.00000 ± 0.00050 s"), "{text}");
    assert!(text.contains("zeta = 0.0970 ± 0.0060"), "{text}");
}

#[test]
fn a_count_is_told_once() {
    let mut diagnosis = diagnosis(Verdict::Adequate);
    let fault = &mut diagnosis.axes[0].data_faults[0];
    (fault.kind, fault.count, fault.says) = (FaultKind::Dropouts, 3, "3 gaps, about 5 samples missing".into());
    let text = render(&diagnosis, Format::Text, &context(Command::Diagnose));
    assert!(text.contains("dropouts (first at 12.50 s): 3 gaps"), "{text}");
}

#[test]
fn an_ambiguous_verdict_prints_the_group_and_the_manoeuvre() {
    let text = render(&diagnosis(Verdict::Ambiguous), Format::Text, &context(Command::Diagnose));
    assert!(text.contains("ambiguous: delay or lag"), "{text}");
    assert!(text.contains("only a lag loses amplitude"), "{text}");
}

#[test]
fn an_excess_is_called_unexplained_only_where_its_cause_was_looked_for() {
    let said = |command| {
        let mut diagnosis = diagnosis(Verdict::Unexplained);
        diagnosis.axes[0].searched = command == Command::Diagnose;
        render(&diagnosis, Format::Text, &context(command))
    };
    for command in [Command::Compare, Command::Fit, Command::Add, Command::Remove] {
        let text = said(command);
        assert!(text.contains("the model leaves more than noise") && !text.contains("unexplained"), "{text}");
    }
    assert!(said(Command::Compare).contains("truerate diagnose yaw.csv.gz"));
    assert!(said(Command::Diagnose).contains("unexplained: more than noise is left"));
}

/// A component that the log does not excite has no value, a walk of 10⁻²² is none, and what is left unexplained stands in the
/// noise; in an adequate model nothing fails anywhere.
#[test]
fn what_is_not_known_is_not_shown_as_if_it_were() {
    let text = |verdict| {
        let mut diagnosis = diagnosis(verdict);
        let unseen =
            ParameterValue { typical: Some(1e-4), ..parameter("g-sensitivity", "g_x", 1e-5, 0.5, "rad/s per m/s²") };
        diagnosis.axes[0].parameters.push(unseen);
        diagnosis.axes[0].parameters.push(parameter("mount-resonance", "zeta", 0.005, 0.004, "1"));
        diagnosis.axes[0].noise.bias_random_walk = Some(1e-24);
        render(&diagnosis, Format::Text, &context(Command::Compare))
    };
    let (adequate, unexplained) = (text(Verdict::Adequate), text(Verdict::Unexplained));
    assert!(adequate.contains("g_x") && adequate.contains("not seen on this log"), "{adequate}");
    assert!(adequate.contains("zeta") && adequate.contains("0.00500, at its limit"), "{adequate}");
    assert!(
        adequate.contains("Noise: angle random walk") && !adequate.contains("random walk of the bias"),
        "{adequate}"
    );
    assert!(unexplained.contains("Noise (too high while an effect is missing): angle random walk"), "{unexplained}");
    assert!(unexplained.contains("where it fails") && !adequate.contains("where it fails"), "{adequate}");
}

#[test]
fn every_verdict_of_every_command_has_a_next_command() {
    let verdicts = [
        Verdict::Adequate,
        Verdict::MissingEffect,
        Verdict::Ambiguous,
        Verdict::Unexplained,
        Verdict::CannotTell,
        Verdict::BadData,
    ];
    for command in [Command::Fit, Command::Compare, Command::Diagnose, Command::Add, Command::Remove] {
        for verdict in verdicts {
            let text = render(&diagnosis(verdict), Format::Text, &context(command));
            assert!(text.contains("\nnext  truerate "), "{command:?} {verdict:?}: {text}");
        }
    }
}

#[test]
fn the_ladder_falls() {
    let text = render(&ladder(), Format::Text, &context(Command::Ladder));
    let bars: Vec<usize> = text
        .lines()
        .filter(|l| l.contains('█') && l.contains("at 1 s"))
        .map(|l| l.chars().filter(|&c| c == '█').count())
        .collect();
    assert_eq!(bars.len(), 3, "{text}");
    assert!(bars.windows(2).all(|w| w[1] < w[0]), "{bars:?}");
    assert!(text.contains("or lag"), "{text}");
    // What each step has won is green; what is faulty in the data is not.
    let mut ladder = ladder();
    ladder.axes[0].data_faults = diagnosis(Verdict::Adequate).axes.remove(0).data_faults;
    let coloured = Context { terminal: Terminal { colour: true, ..Terminal::PLAIN }, ..context(Command::Ladder) };
    let text = render(&ladder, Format::Text, &coloured);
    let green = |line: &str| line.contains("\u{1b}[1;32m");
    let steps: Vec<&str> = text.lines().filter(|line| line.contains('█') && line.contains("at 1 s")).collect();
    assert_eq!(
        steps.iter().map(|line| green(line) && line.contains(" → ")).collect::<Vec<_>>(),
        [false, true, true],
        "{text}"
    );
    let faults: Vec<&str> = text.lines().filter(|line| line.starts_with("  ! ")).collect();
    assert!(!faults.is_empty() && faults.iter().all(|line| !green(line)), "{text}");
}

#[test]
fn before_and_after_stand_beside_each_other() {
    let (before, mut after) = (diagnosis(Verdict::MissingEffect), diagnosis(Verdict::Adequate));
    after.axes[0].error_curve = curve(0.0);
    let added = ["delay".to_string()];
    let change = Change { added: &added, removed: &[], before: &before, after: &after };
    let text = render_change(&change, Format::Text, &context(Command::Add));
    assert!(text.contains("before") && text.contains("delay added"), "{text}");
    let json: serde_json::Value =
        serde_json::from_str(&render_change(&change, Format::Json, &context(Command::Add))).unwrap();
    assert_eq!(json["schema"], "truerate.diagnosis/1");
    assert_eq!(json["added"][0], "delay");
    assert_eq!(json["before"][0]["verdict"], "missing-effect");
    assert_eq!(json["axes"][0]["verdict"], "adequate");
}

#[test]
fn json_has_null_where_a_number_is_not_finite() {
    let mut diagnosis = diagnosis(Verdict::Adequate);
    diagnosis.axes[0].error_over_floor = Some(f64::NAN);
    diagnosis.axes[0].error_curve[0].error = Some(f64::INFINITY);
    let json: serde_json::Value =
        serde_json::from_str(&render(&diagnosis, Format::Json, &context(Command::Compare))).unwrap();
    assert!(json["axes"][0]["error_over_floor"].is_null());
    assert!(json["axes"][0]["error_curve"][0]["error"].is_null());
    assert_eq!(json["axes"][0]["suspects"][0]["aliases"][0], "lag");
}

#[test]
fn html_is_one_file_that_fetches_nothing_and_holds_text_as_text() {
    let mut diagnosis = diagnosis(Verdict::MissingEffect);
    diagnosis.log = "<script><b>{{scripts}}.csv".into();
    diagnosis.axes[0].floor_source = "</script><b>".into();
    let html = render(&diagnosis, Format::Html, &context(Command::Diagnose));
    for fetching in ["src=\"", "@import", "url(http", "<link rel=\"stylesheet\""] {
        assert!(!html.contains(fetching), "{fetching}");
    }
    assert!(html.contains("default-src 'none'") && html.contains("MIT"));
    assert!(!html.contains("</script><b>"), "a text ends the script");
    assert!(html.contains("&lt;script&gt;&lt;b&gt;{{scripts}}.csv"));
}

/// Three axes, each 12.1 ms late to within its error; z has a play of its encoder as well.
fn three_axes() -> Diagnosis {
    let mut ladder = ladder();
    let of = |axis: Axis, late: f64, more: &str| {
        let mut own = ladder.axes[0].clone();
        own.axis = axis;
        own.effects.push(more.into());
        own.parameters.push(parameter("delay", "d", late, 1e-4, "s"));
        own.parameters.push(parameter("encoder-backlash", "b", 0.004, 5e-5, "rad"));
        own
    };
    let axes =
        vec![of(Axis::X, 0.01212, "bias"), of(Axis::Y, 0.01205, "bias"), of(Axis::Z, 0.0121, "encoder-backlash")];
    ladder.axes = axes;
    ladder
}

#[test]
fn several_axes_are_one_story_and_what_they_share_is_said_once() {
    let ladder = three_axes();
    let faulty = DataFault {
        kind: FaultKind::Dropouts,
        axis: None,
        count: 1,
        first_t: Some(0.5),
        says: "1 gap; nothing is assumed inside".into(),
    };
    let axes = ladder.axes.into_iter().map(|axis| AxisResult { data_faults: vec![faulty.clone()], ..axis }).collect();
    let ladder = Diagnosis { axes, ..ladder };
    let text = render(&ladder, Format::Text, &context(Command::Ladder));
    println!("{text}");
    assert_eq!(text.matches("ms late").count(), 1, "{text}");
    assert!(text.contains("Your gyro is 12.090 ± 0.058 ms late, on all three axes."), "{text}");
    let table = text.find("axis   what").unwrap();
    assert!(table < text.find("axis x  ").unwrap(), "{text}");
    let row = |start: &str| text.lines().find(|line| line.starts_with(start)).unwrap_or_default().to_owned();
    assert!(row("x y z  delay").contains("12.090 ± 0.058 ms"), "{text}");
    assert!(row("x      nothing else").contains(" °/s over 1"), "{text}");
    assert!(row("z      encoder-backlash").contains("0.2292"), "{text}");
    assert_eq!(text.matches("1 gap").count(), 1, "{text}");
    let json: serde_json::Value =
        serde_json::from_str(&render(&ladder, Format::Json, &context(Command::Ladder))).unwrap();
    assert_eq!(json["shared"][0]["effect"], "delay");
    assert_eq!(json["shared"][0]["axes"].as_array().unwrap().len(), 3);
    assert!(json["rotation"].is_null() && json["axes"][0]["headline"].as_str().unwrap().contains("ms late"));
}

#[test]
fn what_is_mailed_names_no_folder_and_brings_the_model() {
    let context = Context {
        log: "/home/me/logs/yaw.csv.gz".into(),
        output: Some("/home/me/new model.toml".into()),
        flags: vec!["--reference".into(), "/home/me/mocap.csv".into(), "--map".into(), "ref_q=/mocap/pose".into()],
        product: Some(Product { name: "new model.toml".into(), text: "schema = 1".into() }),
        ..context(Command::Ladder)
    };
    let ladder = Diagnosis { log: context.log.clone(), ..ladder() };
    let html = render(&ladder, Format::Html, &context);
    assert!(!html.contains("/home/me") && html.contains("yaw.csv.gz"));
    assert!(html.contains("ref_q=/mocap/pose") && html.contains(r#""text":"schema = 1""#));
    assert!(!render(&ladder, Format::Text, &context.for_file()).contains("/home/me"));
    assert!(render(&ladder, Format::Text, &context).contains("/home/me"));
    // Where no script runs the words stand there.
    assert!(html.contains("<noscript>") && html.contains("error ÷ floor at its worst, step by step (bar"));
}

#[test]
fn colour_is_for_terminals_that_want_it() {
    let context = Context { terminal: Terminal { width: 90, colour: true }, ..context(Command::Diagnose) };
    assert!(render(&diagnosis(Verdict::Adequate), Format::Text, &context).contains("\x1b["));
}

/// A report of each verdict, as it is printed.
fn reports() -> [Diagnosis; 6] {
    let delay = |aliases: &[&str]| {
        vec![NamedEffect { effect: "delay".into(), aliases: aliases.iter().map(|id| (*id).into()).collect() }]
    };
    let findings = [
        Finding::Missing { effects: delay(&[]), over_floor: None },
        Finding::Ambiguous { effects: delay(&["lag"]), over_floor: None, added: false },
        Finding::Adequate(Adequate::WithinFloor { silent: 0.1 }),
        Finding::CannotTell(Why::TooShort { seconds: 6.0 }),
        Finding::Unexplained(Excess::NoEffect { over_floor: 31.0, unattributed: 0.1 }),
        Finding::BadData { fault: FaultKind::WrongSign, axis: Some(Axis::Z), count: 9 },
    ];
    findings.map(|finding| {
        let mut diagnosis = diagnosis(finding.verdict());
        let axis = &mut diagnosis.axes[0];
        match &finding {
            Finding::Missing { .. } => axis.suspects[0].aliases.clear(),
            Finding::Ambiguous { .. } => {}
            Finding::BadData { fault, axis: of, count } => {
                let says = "gyro_z turns against ref_angle_z: negate one of them. Then look again".into();
                axis.data_faults = vec![DataFault { kind: *fault, axis: *of, count: *count, first_t: None, says }];
                axis.fails_where.clear();
            }
            Finding::Adequate(_) | Finding::CannotTell(_) => {
                (axis.error_curve, axis.error_over_floor, axis.within_floor) = (curve(0.0), Some(1.02), Some(true));
                (axis.limited_by, axis.fails_where) = (Some(LimitedBy::GyroNoise), Vec::new());
                axis.limited_says = "the gyro's own white noise, 0.0050 °/√s. Use a quieter gyro.".into();
                axis.suspects.clear();
            }
            _ => axis.suspects.clear(),
        }
        axis.find(finding);
        diagnosis
    })
}

#[test]
fn a_report_of_each_verdict_is_what_its_file_shows() {
    for diagnosis in reports() {
        let name = serde_json::to_value(diagnosis.axes[0].verdict).unwrap();
        let name = format!("{}.txt", name.as_str().unwrap());
        let text = render(&diagnosis, Format::Text, &context(Command::Diagnose));
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/report/snapshots").join(&name);
        if std::env::var_os("TRUERATE_SNAPSHOTS").is_some_and(|wish| wish == "write") {
            std::fs::write(&path, &text).unwrap();
        }
        let kept = std::fs::read_to_string(&path).unwrap();
        assert!(kept == text, "{name} is\n{kept}and would be\n{text}with TRUERATE_SNAPSHOTS=write");
    }
}
