//! What is written is read back; every mistake is named where it stands.

use super::{ModelFile, parse, render};
use crate::toml_error::TomlError;
use gyro_model::{Axis, Term};
use proptest::prelude::*;
use std::path::Path;

const EXAMPLE: &str = r#"schema = "truerate.model/1"
epoch = 3

[provenance]
log = "yaw.csv.gz"
sha256 = "ab"
fitted = 2026-11-20T12:00:00Z
samples = 19973
temperature = [24.1, 33.0]

[axis.z]
effects = ["scale-factor", "bias", "delay"]
noise = { angle_random_walk = 7.1e-5, bias_random_walk = 0.0, encoder = 4.5e-4, unexplained = 0.02 }

[axis.z.parameters]
scale-factor.alpha = { value = 0.9939, std_error = 1.0e-5, unit = "1" }
bias.delta         = { value = 8.6e-4, std_error = 2.0e-6, unit = "rad/s" }
delay.d            = { value = 0.0121, std_error = 2.0e-5, unit = "s" }
"#;

const OWN: &str = r#"
[effect.cable-twist]
regressor = "k * sin(angle) * temp"
parameters = { k = { unit = "rad/s/K", typical = 1e-4 } }
"#;

fn parsed(text: &str) -> Result<ModelFile, TomlError> {
    parse(Path::new("m.toml"), text, &["load".to_owned()])
}

fn refused(from: &str, to: &str) -> TomlError {
    assert!(EXAMPLE.contains(from), "{from}");
    parsed(&EXAMPLE.replacen(from, to, 1)).expect_err(to)
}

#[test]
fn the_documented_example_is_read_whole() {
    let file = parsed(EXAMPLE).unwrap();
    let z = file.model.axes[2].as_ref().unwrap();
    assert_eq!(z.effect_ids(), ["scale-factor", "bias", "delay"]);
    assert_eq!((z.alpha(), z.delta(), z.terms[2].values[0]), (0.9939, 8.6e-4, 0.0121));
    assert_eq!((z.noise.encoder, z.noise.unexplained), (4.5e-4, 0.02));
    assert_eq!(file.model.epoch, 3);
    let provenance = file.provenance.unwrap();
    assert_eq!(provenance.temperature, Some((24.1, 33.0)));
    assert_eq!(provenance.fitted.unwrap().to_string(), "2026-11-20T12:00:00Z");
}

#[test]
fn what_is_written_is_read_back_the_same() {
    let file = parsed(EXAMPLE).unwrap();
    let text = render(&file);
    let again = parsed(&text).unwrap();
    assert_eq!(render(&again), text);
    assert_eq!(again.provenance, file.provenance);
}

#[test]
fn a_newer_schema_is_named_before_anything_else_in_the_file() {
    let text = EXAMPLE.replace("model/1", "model/2").replace("epoch", "era");
    let error = parsed(&text).unwrap_err();
    assert_eq!((error.line, error.column), (1, 10));
    assert!(error.says.contains("truerate.model/2") && error.says.contains("newer"), "{error}");
}

#[test]
fn mistakes_are_named_where_they_stand() {
    for (from, to, line, says) in [
        ("\"delay\"", "\"dely\"", 12, "did you mean 'delay'"),
        ("delay.d  ", "delay.e  ", 18, "unknown parameter 'e'"),
        ("delay.d  ", "lag.tau  ", 18, "not among this axis' effects"),
        ("epoch", "era", 2, "era"),
        ("encoder =", "encode =", 13, "encode"),
        ("unit = \"s\"", "unit = \"ms\"", 18, "unit 'ms'"),
        ("value = 0.0121", "value = \"late\"", 18, "late"),
        ("value = 0.0121", "value = nan", 18, "finite"),
        ("encoder = 4.5e-4", "encoder = -1.0", 13, "zero or more"),
        ("\"bias\", ", "\"bias\", \"bias\", ", 12, "twice"),
        ("bias.delta ", "# ", 12, "no value for bias.delta"),
        ("samples = 19973", "samples = -3", 8, "-3"),
        ("fitted = 2026-11-20T12:00:00Z", "fitted = 2026-11-20", 7, "zone"),
        ("[axis.z.parameters]", "[axis.z.parameters", 15, ""),
    ] {
        let error = refused(from, to);
        assert_eq!(error.line, line, "{error}");
        assert!(error.says.contains(says), "{error}");
        assert!(error.to_string().contains('^'), "{error}");
        assert_eq!(error.to_string().lines().count(), 3, "{error}");
    }
}

/// A reference's low-pass filter has no steps unless the file says so.
#[test]
fn a_form_that_is_not_said_is_the_usual_one() {
    let said = |more: &str| {
        let tau = format!("reference-lag.tau = {{ value = 0.0121, std_error = 2.0e-5, unit = \"s\" }}{more}");
        let line = "delay.d            = { value = 0.0121, std_error = 2.0e-5, unit = \"s\" }";
        let file = parsed(&EXAMPLE.replace("\"delay\"", "\"reference-lag\"").replace(line, &tau)).unwrap();
        file.model.axes[2].as_ref().unwrap().term("reference-lag").unwrap().values.clone()
    };
    assert_eq!(said(""), [0.0121, 0.0]);
    assert_eq!(said("\nreference-lag.step = { value = 0.01, unit = \"s\" }"), [0.0121, 0.01]);
}

#[test]
fn an_axis_that_does_not_exist_is_named() {
    let error = parsed(&EXAMPLE.replace("axis.z", "axis.w")).unwrap_err();
    assert_eq!((error.line, error.column), (11, 7), "{error}");
    assert!(error.says.contains("'w' is not an axis"), "{error}");
}

#[test]
fn a_users_own_effect_is_like_any_other_and_written_again() {
    let text = EXAMPLE.replace("\"delay\"", "\"cable-twist\"").replace(
        "delay.d            = { value = 0.0121, std_error = 2.0e-5, unit = \"s\" }",
        "cable-twist.k = { value = 2e-4, unit = \"rad/s/K\" }",
    ) + OWN;
    let file = parsed(&text).unwrap();
    let z = file.model.axes[2].as_ref().unwrap();
    assert_eq!(z.effect_ids(), ["scale-factor", "bias", "cable-twist"]);
    let again = render(&file);
    assert!(again.contains("regressor = \"k * sin(angle) * temp\""), "{again}");
    assert_eq!(render(&parsed(&again).unwrap()), again);
}

#[test]
fn an_own_effect_that_no_axis_has_yet_is_kept_for_adding() {
    let file = parsed(&format!("{EXAMPLE}{OWN}")).unwrap();
    assert_eq!(file.own_effects[0].card().id, "cable-twist");
    assert!(render(&file).contains("[effect.cable-twist]"));
}

#[test]
fn a_wrong_expression_is_shown_with_a_caret_under_the_mistake() {
    let whole = format!("{EXAMPLE}{OWN}");
    for (from, to, shown) in [
        ("sin(angle)", "sin(angel)", "angel"),
        ("* temp", "* (temp", "(temp"),
        ("cable-twist]", "delay]", "delay"),
        ("\"k * sin", "\"3 * sin", "k"),
        ("typical = 1e-4", "typical = inf", "k"),
        ("regressor", "regresor", "regresor"),
    ] {
        let text = whole.replacen(from, to, 1);
        let error = parsed(&text).unwrap_err();
        let (line, caret) = (error.excerpt.lines().next().unwrap(), error.excerpt.lines().nth(1).unwrap());
        assert!(line[caret.find('^').unwrap()..].starts_with(shown), "{error}");
    }
}

#[test]
fn a_file_without_schema_or_of_another_kind_is_refused() {
    assert!(parsed("").unwrap_err().says.contains("begins with schema"));
    assert!(parsed("schema = \"other/1\"").unwrap_err().says.contains("not a model file's"));
    assert!(parsed("schema = 3").is_err());
}

proptest! {
    #[test]
    fn any_value_survives_to_the_last_bit(value in proptest::num::f64::NORMAL | proptest::num::f64::ZERO, error in proptest::num::f64::POSITIVE) {
        let mut file = parsed(&format!("{EXAMPLE}{OWN}")).unwrap();
        let terms = &mut file.model.axes[2].as_mut().unwrap().terms;
        // The coefficient of a user's own effect has no physical bounds.
        terms[2] = Term::neutral(file.own_effects[0], Axis::Z);
        let term = &mut terms[2];
        term.values[0] = value;
        term.std_errors[0] = error;
        let again = parsed(&render(&file)).unwrap();
        let term = &again.model.axes[2].as_ref().unwrap().terms[2];
        prop_assert_eq!(term.values[0].to_bits(), value.to_bits());
        prop_assert_eq!(term.std_errors[0].is_finite(), error.is_finite());
        prop_assert!(!error.is_finite() || term.std_errors[0].to_bits() == error.to_bits());
    }

    #[test]
    fn no_text_makes_the_reader_panic(text in "\\PC*", cut in 0usize..700, junk in "[\\x00-\\x7f]{0,8}") {
        let _ = parsed(&text);
        let cut = cut.min(EXAMPLE.len());
        let _ = parsed(&format!("{}{junk}{}", &EXAMPLE[..cut], &EXAMPLE[cut..]));
        let _ = parsed(&EXAMPLE[..cut]);
    }
}
