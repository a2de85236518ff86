//! What a user can define, and what the definition then does.

use super::{
    expression::{ExpressionError, Problem},
    *,
};

fn parameter(name: &str, typical: f64) -> ParameterDefinition {
    ParameterDefinition { name: name.to_owned(), unit: "1".to_owned(), typical }
}

fn definition(id: &str, regressor: &str, parameters: &[(&str, f64)]) -> Definition {
    Definition {
        id: id.to_owned(),
        regressor: regressor.to_owned(),
        parameters: parameters.iter().map(|(name, typical)| parameter(name, *typical)).collect(),
    }
}

const SPAN: Span = Span {
    start: 0.0,
    duration: 60.0,
    dt: 0.01,
    reference_dt: 0.01,
    reading_min: 0.001,
    reading_max: 1.0,
    travel: 1.0,
};

#[test]
fn an_expression_is_an_effect_like_any_other() {
    let twist = define(&definition("cable-twist", "k * sin(angle) * temp", &[("k", 1e-4)]), &[]).unwrap();
    let signals = Signals { angle: 0.5, delta_temperature: 10.0, ..Signals::default() };
    let mut memory = Memory::default();
    assert!((twist.error(&[2.0], &signals, &mut memory) - 2.0 * 0.5_f64.sin() * 35.0).abs() < 1e-12);
    assert_eq!(twist.error(&[0.0], &signals, &mut memory), 0.0);
    assert_eq!((twist.card().id, twist.card().needs), ("cable-twist", &[Need::Temperature][..]));
    assert_eq!(twist.card().equation, "ω_f = ω + k * sin(angle) * temp");
    assert!(twist.grid(&SPAN).is_empty());
}

#[test]
fn shapes_come_after_coefficients_whatever_their_order_in_the_file() {
    let own = definition("own-warm-up", "a * exp(-t / tau)", &[("tau", 30.0), ("a", 0.01)]);
    let effect = define(&own, &[]).unwrap();
    let cards = effect.parameters(Axis::X);
    assert_eq!((cards[0].name, cards[0].role, cards[0].neutral), ("a", Role::Linear, 0.0));
    assert_eq!((cards[1].name, cards[1].role, cards[1].neutral), ("tau", Role::Shape, 30.0));
    let signals = Signals { t: 12.0, ..Signals::default() };
    let expected = 0.5 * (-12.0_f64 / 6.0).exp();
    assert!((effect.error(&[0.5, 6.0], &signals, &mut Memory::default()) - expected).abs() < 1e-12);
    assert!(effect.grid(&SPAN).iter().all(|p| p.len() == 1 && cards[1].bounds.0 <= p[0] && p[0] <= cards[1].bounds.1));
}

#[test]
fn the_same_definition_is_the_same_effect_and_can_be_had_back() {
    let own = definition("wind", "k * rate^2", &[("k", 1e-3)]);
    let [a, b] = [define(&own, &[]).unwrap(), define(&own, &[]).unwrap()];
    assert!(std::ptr::eq(a.card(), b.card()));
    assert_eq!(super::definition(a), Some(own));
    assert_eq!(super::definition(super::super::find("delay").unwrap()), None);
}

#[test]
fn a_free_channel_is_found_by_name_and_holds_its_last_value() {
    let names = ["rpm".to_owned(), "motor_current".to_owned()];
    let own = definition("motor-field", "k * motor_current", &[("k", 1.0)]);
    let effect = define(&own, &names).unwrap();
    let (mut signals, mut memory) = (Signals::default(), Memory::default());
    let mut with = |value| {
        signals.free[1] = value;
        effect.error(&[2.0], &signals, &mut memory)
    };
    assert_eq!([with(f64::NAN), with(1.5), with(f64::NAN), with(2.0)], [0.0, 3.0, 3.0, 4.0]);
    let error = define(&own, &names[..1]).err().unwrap();
    assert!(error.to_string().contains("free channels of the log are rpm"), "{error}");
}

#[test]
fn where_the_expression_has_no_finite_value_the_effect_is_absent() {
    let effect = define(&definition("odd", "k * ln(rate)", &[("k", 1.0)]), &[]).unwrap();
    let signals = Signals { rates: [-1.0; 3], ..Signals::default() };
    assert_eq!(effect.error(&[2.0], &signals, &mut Memory::default()), 0.0);
}

#[test]
fn every_signal_means_what_the_table_says() {
    let all = "k * (rate + 10*rate_dot + 100*angle + 1000*t + 1e4*gyro_y + 1e5*accel_z + 1e6*temp + 1e8*supply)";
    let effect = define(&definition("all-signals", all, &[("k", 1.0)]), &[]).unwrap();
    let signals = Signals {
        t: 4.0,
        axis: 2,
        rates: [9.0, 5.0, 1.0],
        rate_dot: 2.0,
        angle: 3.0,
        accel: [0.0, 0.0, 6.0],
        delta_temperature: -18.0,
        supply: 3.0,
        ..Signals::default()
    };
    assert_eq!(effect.error(&[1.0], &signals, &mut Memory::default()), 307_654_321.0);
}

#[test]
fn a_wrong_definition_is_refused_with_its_reason_and_place() {
    let refused = |id: &str, text: &str, parameters: &[(&str, f64)]| {
        define(&definition(id, text, parameters), &[]).err().unwrap()
    };
    let k = &[("k", 1.0)][..];
    for id in ["", "Twist", "2x", "a_b", "käse"] {
        assert!(matches!(refused(id, "k", k), DefinitionError::BadId { .. }), "{id}");
    }
    assert!(matches!(refused("delay", "k", k), DefinitionError::TakenId { .. }));
    assert!(matches!(refused("own", "k * t", &[("t", 1.0)]), DefinitionError::BadParameter { .. }));
    assert!(matches!(refused("own", "k", &[("k", 1.0), ("k", 2.0)]), DefinitionError::RepeatedParameter { .. }));
    assert!(matches!(refused("own", "k", &[("k", 1.0), ("m", 2.0)]), DefinitionError::UnusedParameter { .. }));
    assert!(matches!(refused("own", "k", &[("k", f64::NAN)]), DefinitionError::BadTypical { .. }));
    assert_eq!(refused("own", "sin(k * t)", k), DefinitionError::NoCoefficient);
    assert_eq!(refused("own", "k * t + 1", k), DefinitionError::NoCoefficient);
    assert!(matches!(refused("own", "k", &[("k", 1.0); 9]), DefinitionError::TooManyParameters { given: 9 }));
    match refused("own", "k * temperature", k) {
        DefinitionError::Expression(ExpressionError { span, problem: Problem::UnknownName { .. } }) => {
            assert_eq!(span, 4..15);
        }
        other => panic!("{other:?}"),
    }
}
