//! Whatever a function of an effect is given, it returns: numbers that are none, endless ones, and logs of no or one row.

use super::*;
use proptest::prelude::*;

/// Any number at all, the awkward ones as often as the others.
fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        -10.0..10.0_f64,
        any::<f64>(),
        prop::sample::select(vec![
            0.0,
            -0.0,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
            f64::MIN_POSITIVE,
            1e-300,
            1e300,
        ]),
    ]
}

/// A parameter: any number, its typical size, nothing, or an end of what is physical.
fn value(card: &ParameterCard, (choice, any): (u8, f64)) -> f64 {
    match choice % 5 {
        0 => any,
        1 => card.typical,
        2 => card.neutral,
        3 => card.bounds.0,
        _ => card.bounds.1,
    }
}

/// A log of few rows: its times, and the values at them.
fn rows() -> impl Strategy<Value = (Vec<f64>, Vec<f64>)> {
    let constant = (any_number(), any_number(), 0..40_usize).prop_map(|(t, y, n)| (vec![t; n], vec![y; n]));
    let wild = prop::collection::vec((any_number(), any_number()), 0..40);
    let even = prop::collection::vec(any_number(), 0..40)
        .prop_map(|y| ((0..y.len()).map(|k| 0.01 * k as f64).collect::<Vec<f64>>(), y));
    prop_oneof![constant, wild.prop_map(|pairs| pairs.into_iter().unzip()), even]
}

fn signals(numbers: &[f64], axis: Axis) -> Signals {
    let n = |k: usize| numbers[k % numbers.len()];
    Signals {
        t: n(0),
        dt: n(1),
        axis: axis.index(),
        rates: [n(2), n(3), n(4)],
        rate_dot: n(5),
        angle: n(6),
        accel: [n(7), n(8), n(9)],
        delta_temperature: n(10),
        temperature_dot: n(11),
        delta_supply: n(12),
        supply: n(13),
        ..Signals::default()
    }
}

/// Calls each function of an effect.
fn call(effect: &dyn Effect, axis: Axis, p: &[f64], numbers: &[f64], (t, y): &(Vec<f64>, Vec<f64>)) {
    let signals = signals(numbers, axis);
    for step in [<dyn Effect>::error, <dyn Effect>::error_seen] {
        let mut memory = Memory::default();
        for angle in numbers {
            let _ = step(effect, p, &Signals { angle: *angle, rates: [*angle; 3], ..signals }, &mut memory);
            let _ = effect.is_guess(p, &memory);
        }
    }
    for step in [<dyn Effect>::respond, <dyn Effect>::undo_response] {
        let mut memory = Memory::default();
        for pair in numbers.windows(2) {
            let _ = step(effect, p, pair[0], pair[1], &mut memory);
        }
    }
    for &number in numbers {
        let _ = effect.valid_time(p, number);
        let _ = effect.limit(p, number);
        let _ = effect.lost(p, number);
        let _ = effect.silent(p, number);
        assert!(!effect.window(p, number).weights.is_empty(), "{}", effect.card().id);
    }
    let _ = effect.reach(p);
    assert_eq!(effect.undo_response_whole(p, t, y).len(), y.len(), "{}", effect.card().id);
    let whole = effect.error_whole(p, t, y);
    assert!(whole.error.is_empty() || whole.error.len() == t.len(), "{}", effect.card().id);
    assert_eq!(effect.carried_over(p, axis, Axis::X).len(), p.len(), "{}", effect.card().id);
    let measured: Vec<Measured> = p.iter().map(|value| Measured { value: *value, std_error: numbers[0] }).collect();
    assert!(!effect.says(axis, &measured).is_empty());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_function_of_an_effect_panics_whatever_it_is_given(
        choices in prop::collection::vec((any::<u8>(), any_number()), 4),
        numbers in prop::collection::vec(any_number(), 14..20),
        rows in rows(),
        axis in 0..3_usize,
    ) {
        let axis = Axis::ALL[axis];
        for effect in CATALOGUE {
            let cards = effect.parameters(axis);
            let p: Vec<f64> = cards.iter().zip(&choices).map(|(card, choice)| value(card, *choice)).collect();
            call(*effect, axis, &p, &numbers, &rows);
        }
    }

    #[test]
    fn a_grid_is_of_few_points_that_are_parameters(numbers in prop::collection::vec(any_number(), 7)) {
        let [start, duration, dt, reference_dt, reading_min, reading_max, travel] = numbers[..] else { unreachable!() };
        let span = Span { start, duration, dt, reference_dt, reading_min, reading_max, travel };
        for (effect, axis) in CATALOGUE.iter().flat_map(|effect| Axis::ALL.map(|axis| (effect, axis))) {
            let shapes = effect.parameters(axis).iter().filter(|card| card.role != Role::Linear).count();
            let grid = effect.grid(&span);
            prop_assert!(grid.len() < 2000 && grid.iter().all(|point| point.len() == shapes), "{}", effect.card().id);
        }
    }
}
