//! The end of a story: what was hidden beside what a model has of it, in the same words on page and terminal.

use gyro_model::{
    Axis, Model, Term,
    effects::{ParameterCard, Role},
    simulate::Hidden,
    units,
};

/// `hidden was: warm-up 0.57 °/s; found: 0.5720 ± 0.0040 °/s`, for each of `hidden` (as `--hide` takes it) that the model has.
#[must_use]
pub fn found(hidden: &[String], model: &Model) -> Vec<String> {
    hidden.iter().filter_map(|text| one(text, model)).collect()
}

fn one(text: &str, model: &Model) -> Option<String> {
    let id = text.split(':').next()?.trim();
    Axis::ALL.into_iter().find_map(|axis| {
        let term = model.axes[axis.index()].as_ref()?.term(id)?;
        let hidden = Hidden::parse(text, axis).ok()?;
        beside(id, axis, &hidden, term)
    })
}

/// The sizes that were hidden and found, in one unit for both.
fn beside(id: &str, axis: Axis, hidden: &Hidden, term: &Term) -> Option<String> {
    let cards = hidden.effect.parameters(axis);
    let sizes = sizes(cards, &hidden.values);
    let name = |k: usize| if sizes.len() > 1 { format!("{} = ", cards[k].name) } else { String::new() };
    let mut parts = [Vec::new(), Vec::new()];
    for &k in &sizes {
        let (was, is, error) = (hidden.values[k], *term.values.get(k)?, term.std_errors.get(k).copied());
        let unit = units::shown(cards[k].unit, &[Some(was), Some(is)]);
        parts[0].push(format!("{}{}{}", name(k), units::round(was * unit.factor), unit.unit));
        parts[1].push(format!("{}{}", name(k), units::uncertain(Some(is), error, &unit)));
    }
    let [was, found] = parts.map(|parts| parts.join(", "));
    (!was.is_empty()).then(|| format!("hidden was: {id} {was}; found: {found}"))
}

/// The parameters that say how large an effect is: its coefficients that are not at nothing, or the first of its shapes.
fn sizes(cards: &[ParameterCard], values: &[f64]) -> Vec<usize> {
    let counts = |k: &usize| cards[*k].role == Role::Linear && values[*k] != cards[*k].neutral;
    let coefficients: Vec<usize> = (0..cards.len()).filter(counts).collect();
    if coefficients.is_empty() { (0..cards.len().min(1)).collect() } else { coefficients }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyro_model::{AxisModel, effects::find};

    fn model(axis: Axis, id: &str, values: &[f64], std_errors: &[f64]) -> Model {
        let mut own = AxisModel::base(axis);
        let effect = find(id).unwrap();
        own.terms.push(Term { effect, values: values.to_vec(), std_errors: std_errors.to_vec() });
        let mut model = Model::default();
        model.axes[axis.index()] = Some(own);
        model
    }

    #[test]
    fn what_was_hidden_stands_beside_what_was_found_in_the_same_unit() {
        let degree = 1_f64.to_radians();
        let has = model(Axis::Z, "warm-up", &[0.572 * degree, 30.0], &[0.004 * degree, 1.0]);
        let hidden = [format!("warm-up:a={}", 0.57 * degree), "delay".to_owned()];
        assert_eq!(found(&hidden, &has), ["hidden was: warm-up 0.57 °/s; found: 0.5720 ± 0.0040 °/s"]);
        let has = model(Axis::X, "delay", &[0.01202], &[0.00005]);
        assert_eq!(found(&["delay:d=0.012".into()], &has), ["hidden was: delay 12 ms; found: 12.020 ± 0.050 ms"]);
    }

    #[test]
    fn several_coefficients_are_named_and_what_the_model_lacks_is_not_told() {
        let has = model(Axis::Z, "cross-axis", &[0.021, 0.009], &[0.001, 0.001]);
        let names: Vec<_> = find("cross-axis").unwrap().parameters(Axis::Z).iter().map(|card| card.name).collect();
        let said = found(&[format!("cross-axis:{}=0.02,{}=0.01", names[0], names[1])], &has);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(names.iter().all(|name| said[0].matches(&format!("{name} = ")).count() == 2), "{said:?}");
        assert!(found(&["lag".into(), "no-such".into()], &has).is_empty());
    }
}
