use super::*;
use crate::{
    diagnose,
    effects::find,
    simulate::{Hidden, Scenario, SensorSpec},
    thin::thinned,
};

fn wanted(axes: &[Axis], ids: &[&str], course: bool) -> Wanted {
    let effects = ids.iter().map(|id| (find(id).unwrap(), Precision::OfTypical(0.02))).collect();
    Wanted { axes: axes.to_vec(), effects, course, temperature: false }
}

/// A guide and a hand, until it is over or this much was recorded; what was said on the way.
fn play(guide: &mut Guide, hand: &mut Hand, listens: bool, most: f64) -> (Record, Vec<String>) {
    let (mut record, mut says, mut asked) = (Record::default(), Vec::new(), 0.0);
    while record.duration() < most {
        let row = hand.step().row;
        record.rows.push(row);
        guide.take(&row);
        let t = record.duration();
        if t < asked + 0.5 {
            continue;
        }
        asked = t;
        if let Some(ask) = guide.ask() {
            guide.learn(ask.answer(&thinned(&record, 4000)));
        }
        let state = guide.state();
        if says.last() != Some(&state.says()) {
            says.push(state.says());
        }
        if let Some(correction) = state.correction() {
            says.push(correction);
        }
        match state.stage {
            Stage::Searching => {
                let axes = record.fitted_axes();
                let thin = thinned(&record, 12_000);
                let base = Model::base_for(&thin);
                let found = diagnose::diagnose(&thin, &base, &axes, &diagnose::Options::default()).unwrap();
                guide.judge(found);
            }
            Stage::Over => break,
            Stage::Recording => {}
        }
        if listens {
            hand.hear(state.order);
            if let Followed::Not { correction, .. } = state.hand {
                hand.mend(correction);
            }
        }
    }
    (record, says)
}

#[test]
#[ignore = "long: tests/nightly"]
fn a_course_of_temperatures_goes_cold_and_hot_before_it_searches_and_a_skipped_manoeuvre_is_not_asked_again() {
    let mut guide = Guide::new(Wanted {
        temperature: true,
        ..wanted(&[Axis::X], &["scale-factor", "bias", "temperature-bias"], false)
    });
    let mut sensor = SensorSpec::on(Axis::X);
    (sensor.temperature.swing, sensor.temperature.period, sensor.temperature.rise) = (14.0, 120.0, 0.0);
    let mut hand = hand(&["temperature-bias"], sensor, 3);
    let (record, says) = play(&mut guide, &mut hand, true, 600.0);
    let place =
        |start: &str| says.iter().position(|own| own.starts_with(start)).unwrap_or_else(|| panic!("{start}: {says:?}"));
    assert!(place("leave it alone") < place("cool it") && place("cool it") < place("warm it"), "{says:?}");
    assert!(place("warm it") < place("let it come back"), "{says:?}");
    let temperatures = || record.rows.iter().map(|row| row.temperature).filter(|t| t.is_finite());
    let (low, high) = temperatures().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), t| (l.min(t), h.max(t)));
    assert!(high - low > 20.0, "{low} to {high}");
    let bias = guide.state().goals.into_iter().find(|goal| goal.effect == "temperature-bias").unwrap();
    assert!(bias.known && guide.is_complete(), "{bias:?}");

    let mut guide = Guide::new(wanted(&[Axis::X], &["scale-factor"], true));
    guide.take(&Row { gyro: [0.0; 3], ref_rate: [0.0; 3], ..Row::EMPTY });
    let first = guide.state().order.unwrap();
    guide.skip();
    assert!(guide.is_order_due(), "{first:?}");
    let mut course = Guide::new(Wanted { temperature: true, ..wanted(&[Axis::X], &["bias"], false) });
    course.take(&Row { gyro: [0.0; 3], ref_rate: [0.0; 3], temperature: 25.0, ..Row::EMPTY });
    course.skip();
    assert!(course.state().says().starts_with("cool it by 10 K, to 15 °C"), "{}", course.state().says());
}

fn hand(hidden: &[&str], sensor: SensorSpec, seed: u64) -> Hand {
    let hidden = hidden.iter().map(|text| Hidden::parse(text, sensor.axis).unwrap()).collect();
    Hand::new(&Scenario { rate_hz: 100.0, seed, hidden, sensor, ..Scenario::default() })
}

#[test]
fn a_hand_that_follows_is_led_to_a_recording_that_tells_what_is_hidden() {
    led_to("delay:d=0.012", 1);
}

#[test]
#[ignore = "long: tests/nightly"]
fn the_same_of_other_effects() {
    for (hides, seed) in [("lag:tau=0.02", 2), ("rate-hysteresis", 3), ("scale-asymmetry:a=0.01", 4)] {
        led_to(hides, seed);
    }
}

fn led_to(hides: &str, seed: u64) {
    let mut hand = hand(&[hides], SensorSpec::on(Axis::Z), seed);
    let mut guide = Guide::new(wanted(&[Axis::Z], &["scale-factor", "bias", "delay"], true));
    let (record, says) = play(&mut guide, &mut hand, true, 300.0);
    let id = hides.split(':').next().unwrap();
    assert!(guide.is_complete(), "{hides}: {says:#?} {:#?}", guide.state());
    let best = &guide.axes()[0].suspects[0];
    assert!(best.effect == id || best.aliases.iter().any(|alias| alias == id), "{hides}: {best:?}");
    assert!(record.duration() < 200.0, "{hides}: {} s", record.duration());
}

/// Before the first motion nothing shows whether readings are late: the whole delay may as well begin with a clock that was set then.
#[test]
fn a_delay_is_no_clock_that_was_set_when_the_hand_began_to_move() {
    for seed in [5, 23] {
        let mut hand = hand(&["delay"], SensorSpec::random(seed), seed);
        let axis = SensorSpec::random(seed).axis;
        let mut guide = Guide::new(wanted(&[axis], &["scale-factor", "bias", "delay"], true));
        let (_, says) = play(&mut guide, &mut hand, true, 300.0);
        let best = guide.axes().first().and_then(|axis| axis.suspects.first());
        assert_eq!(best.map(|best| best.effect.as_str()), Some("delay"), "seed {seed}: {says:#?}");
    }
}

#[test]
fn a_hand_that_does_not_move_is_told_so_and_it_is_never_over() {
    let mut hand = hand(&[], SensorSpec::on(Axis::Z), 5);
    let mut guide = Guide::new(wanted(&[Axis::Z], &["scale-factor", "bias"], true));
    let (_, says) = play(&mut guide, &mut hand, false, 120.0);
    assert!(guide.state().stage == Stage::Recording && !guide.is_complete());
    assert!(says.last().unwrap().contains("does not move"), "{says:?}");
    let scale = guide.state().goals.into_iter().find(|goal| goal.effect == "scale-factor").unwrap();
    assert!(!scale.known && scale.gathered() < 0.01, "{scale:?}");
}
