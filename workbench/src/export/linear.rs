//! What of a model a linear calibration can hold: a matrix, an offset, and a polynomial of the temperature.
//!
//! ```text
//! ω̂ = S (ω_g − o(T)),   o(T) = (c₀ + c₁ ΔT + c₂ ΔT² + c₃ ΔT³ − δ)/α,   S = (I + M)⁻¹ diag α,   ΔT = T − 25 °C
//! ```
//!
//! Whether an effect is such a one is seen from its error itself, at made-up rates and temperatures, not from its name.

use crate::model_file::ModelFile;
use gyro_model::{
    Axis, Term,
    effects::{Memory, Signals, Stage},
};
use nalgebra::{Matrix3, Vector3};

/// A linear calibration, and what it leaves out.
pub struct Linear {
    /// S.
    pub matrix: Matrix3<f64>,
    /// Coefficients of o(T), rad/s per Kⁿ, axis by axis.
    pub offset: [[f64; 4]; 3],
    /// The axes that the model has.
    pub axes: Vec<Axis>,
    /// What it cannot hold: axis and effect.
    pub left_out: Vec<(Axis, &'static str)>,
}

/// What one term is to a linear calibration.
enum Kind {
    Polynomial([f64; 4]),
    Row(Vector3<f64>),
    Nothing,
    Other,
}

impl Linear {
    /// Of a model.
    #[must_use]
    pub fn of(file: &ModelFile) -> Self {
        let mut coupling = Matrix3::identity();
        let mut scale = Matrix3::identity();
        let mut offset = [[0.0; 4]; 3];
        let (mut axes, mut left_out) = (Vec::new(), Vec::new());
        for axis in Axis::ALL {
            let i = axis.index();
            let Some(model) = &file.model.axes[i] else { continue };
            axes.push(axis);
            scale[(i, i)] = model.alpha();
            offset[i][0] -= model.delta();
            for term in &model.terms {
                match kind(term, axis) {
                    Kind::Polynomial(c) => offset[i].iter_mut().zip(c).for_each(|(sum, c)| *sum += c),
                    Kind::Row(row) => (0..3).for_each(|j| coupling[(i, j)] += row[j]),
                    Kind::Nothing => {}
                    Kind::Other => left_out.push((axis, term.effect.card().id)),
                }
            }
            offset[i].iter_mut().for_each(|c| *c /= model.alpha());
        }
        // Couplings are a few per cent, so this has a solution; where it has none they are left out.
        let matrix = coupling.lu().solve(&scale).unwrap_or(scale);
        Self { matrix, offset, axes, left_out }
    }

    /// The reading of an axis at rest at this temperature, rad/s.
    #[must_use]
    pub fn at_rest(&self, axis: usize, temperature: f64) -> f64 {
        let d = temperature - 25.0;
        self.offset[axis].iter().rev().fold(0.0, |sum, c| sum * d + c)
    }

    /// The polynomial about another temperature than 25 °C.
    #[must_use]
    pub fn about(&self, axis: usize, temperature: f64) -> [f64; 4] {
        let [c0, c1, c2, c3] = self.offset[axis];
        let d = temperature - 25.0;
        [c0 + d * (c1 + d * (c2 + d * c3)), c1 + d * (2.0 * c2 + 3.0 * d * c3), c2 + 3.0 * d * c3, c3]
    }

    /// Whether an offset goes by the temperature.
    #[must_use]
    pub fn goes_by_temperature(&self) -> bool {
        self.offset.iter().any(|c| c[1..].iter().any(|c| *c != 0.0))
    }

    /// `axis z: 'delay' has no place in …` for each effect that is left out.
    #[must_use]
    pub fn warnings(&self, place: &str) -> Vec<String> {
        self.left_out.iter().map(|(axis, id)| format!("axis {axis}: {place} cannot hold '{id}': left out")).collect()
    }
}

fn kind(term: &Term, axis: Axis) -> Kind {
    match term.effect.stage() {
        Stage::Calibration | Stage::Reference | Stage::Shown => return Kind::Nothing,
        Stage::Felt => {}
        Stage::Timing | Stage::Response | Stage::Reading => return Kind::Other,
    }
    // After another instant, so that what remembers shows: from a lower rate or from a higher one.
    let error = |signals: Signals, shift: f64| {
        let signals = Signals { axis: axis.index(), dt: 0.01, ..signals };
        let mut memory = Memory::default();
        let rates = signals.rates.map(|rate| rate + shift);
        let before = Signals { rates, delta_temperature: signals.delta_temperature - 2.0, ..signals };
        let _ = term.effect.error(&term.values, &before, &mut memory);
        term.effect.error(&term.values, &signals, &mut memory)
    };
    let at = |rates: [f64; 3], delta_temperature: f64| {
        error(Signals { rates, delta_temperature, ..Signals::default() }, -0.3)
    };
    // A second look, in which all else differs: what goes by time, acceleration, supply or a channel is no constant.
    let elsewhere = |rates: [f64; 3], delta_temperature: f64| {
        let other = Signals {
            rates,
            delta_temperature,
            t: 171.3,
            rate_dot: 2.7,
            angle: 0.7,
            accel: [1.3, -4.1, 8.7],
            temperature_dot: 0.31,
            delta_supply: -0.13,
            supply: 4.87,
            free: [0.9; gyro_model::record::FREE_CHANNELS],
            ..Signals::default()
        };
        error(other, 0.4)
    };
    let scale = [at([1.0, -2.0, 0.5], 20.0), at([0.3, 0.4, -0.2], -30.0), elsewhere([0.1, 0.2, 0.3], 5.0)]
        .iter()
        .fold(1e-300, |a: f64, b| a.max(b.abs()));
    let same = |a: f64, b: f64| (a - b).abs() <= 1e-9 * scale;
    let polynomial = through([-30.0, -10.0, 10.0, 30.0].map(|d| (d, at([0.0; 3], d))));
    let tests = [([0.7, -0.2, 1.1], 17.0), ([-1.9, 2.3, 0.4], -23.0), ([0.2, 0.1, -3.0], 41.0)];
    let evaluate = |d: f64| polynomial.iter().rev().fold(0.0, |sum, c| sum * d + c);
    if tests.iter().all(|&(rates, d)| same(at(rates, d), evaluate(d)) && same(elsewhere(rates, d), evaluate(d))) {
        // A coefficient that is rounding alone is none.
        let powers = [1.0, 40.0, 1600.0, 64000.0];
        let counts = |k: usize| polynomial[k].abs() * powers[k] > 1e-9 * scale;
        return Kind::Polynomial(std::array::from_fn(|k| if counts(k) { polynomial[k] } else { 0.0 }));
    }
    let row = Vector3::from_fn(|j, _| at(std::array::from_fn(|i| if i == j { 1.0 } else { 0.0 }), 0.0));
    let linear = |rates: [f64; 3]| row.dot(&Vector3::from(rates));
    if tests.iter().all(|&(rates, d)| same(at(rates, d), linear(rates)) && same(elsewhere(rates, d), linear(rates))) {
        return Kind::Row(row);
    }
    Kind::Other
}

/// The cubic through four points.
fn through(points: [(f64, f64); 4]) -> [f64; 4] {
    let powers = nalgebra::Matrix4::from_fn(|row, column| {
        [1.0, points[row].0, points[row].0.powi(2), points[row].0.powi(3)][column]
    });
    let values = nalgebra::Vector4::from_fn(|row, _| points[row].1);
    powers.lu().solve(&values).map_or([0.0; 4], Into::into)
}

/// T, lower triangular with a positive diagonal, and the rotation R for which S = Rᵀ T⁻¹.
pub fn triangular(matrix: &Matrix3<f64>) -> (Matrix3<f64>, Matrix3<f64>) {
    // S J = Q U, J the columns in reverse, gives S = (Q J) (J U J), whose second factor is lower triangular.
    let reverse = Matrix3::new(0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0);
    let (turn, upper) = (matrix * reverse).qr().unpack();
    let (turn, lower) = (turn * reverse, reverse * upper * reverse);
    let signs = Matrix3::from_diagonal(&lower.diagonal().map(f64::signum));
    let (turn, lower) = (turn * signs, signs * lower);
    let triangle = lower.try_inverse().unwrap_or_else(Matrix3::identity);
    (triangle.lower_triangle(), turn.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use gyro_model::{AxisModel, Row, compensation::Compensation, effects};

    fn term(id: &str, values: &[f64]) -> Term {
        let effect = effects::find(id).unwrap();
        Term { effect, values: values.to_vec(), std_errors: vec![f64::NAN; values.len()] }
    }

    #[test]
    fn matrix_offset_and_polynomial_do_what_compensation_does() {
        let mut file = ModelFile::default();
        for axis in Axis::ALL {
            let terms = vec![
                term("scale-factor", &[0.97 + 0.01 * axis.index() as f64]),
                term("bias", &[0.02]),
                term("cross-axis", &[0.03, -0.05]),
                term("temperature-bias", &[5e-4, -2e-6]),
            ];
            file.model.axes[axis.index()] = Some(AxisModel { terms, ..AxisModel::default() });
        }
        let linear = Linear::of(&file);
        assert!(linear.left_out.is_empty() && linear.goes_by_temperature());
        let row = Row { gyro: [0.4, -1.2, 0.9], temperature: 41.0, ..Row::EMPTY };
        let wanted = Compensation::new(&file.model).step(&row, [0.0; 3]);
        let rest = Vector3::from_fn(|i, _| row.gyro[i] - linear.at_rest(i, row.temperature));
        let got = linear.matrix * rest;
        for i in 0..3 {
            let wanted = wanted[i].unwrap().rate;
            assert!((got[i] - wanted).abs() < 1e-12, "{} for {wanted}", got[i]);
            let d = row.temperature - 33.0;
            let about = linear.about(i, 33.0).iter().rev().fold(0.0, |sum, c| sum * d + c);
            assert!((about - linear.at_rest(i, row.temperature)).abs() < 1e-15);
        }
    }

    #[test]
    fn no_effect_is_taken_for_a_linear_one_that_is_not() {
        let holds = |effect: &&&'static dyn effects::Effect| {
            let values = effect.parameters(Axis::Y).iter().map(|p| p.typical).collect();
            let term = Term { effect: **effect, values, std_errors: Vec::new() };
            !matches!(kind(&term, Axis::Y), Kind::Other)
        };
        let held: Vec<&str> = effects::CATALOGUE.iter().filter(holds).map(|e| e.card().id).collect();
        let encoder = [
            "encoder-eccentricity",
            "encoder-subdivision",
            "encoder-backlash",
            "lost-counts",
            "reference-smoothing",
            "reference-lag",
        ];
        let wanted: Vec<&str> =
            ["scale-factor", "bias", "cross-axis", "temperature-bias"].into_iter().chain(encoder).collect();
        assert_eq!(held, wanted);
    }

    #[test]
    fn the_two_factors_are_a_triangle_and_a_rotation_and_make_the_matrix() {
        let matrix = Matrix3::new(0.99, -0.012, 0.004, 0.006, 1.008, -0.009, -0.015, 0.003, 0.996);
        let (triangle, turned) = triangular(&matrix);
        let again = turned.transpose() * triangle.try_inverse().unwrap();
        assert!((again - matrix).norm() < 1e-12, "{again}");
        assert!(triangle.upper_triangle() == Matrix3::from_diagonal(&triangle.diagonal()), "{triangle}");
        assert!((turned * turned.transpose() - Matrix3::identity()).norm() < 1e-12 && turned.determinant() > 0.0);
        assert!(triangle.diagonal().iter().all(|d| *d > 0.0));
        // What is triangular already is not turned.
        let (_, turned) = triangular(&Matrix3::new(0.99, 0.0, 0.0, 0.01, 1.0, 0.0, -0.02, 0.03, 1.01));
        assert!((turned - Matrix3::identity()).norm() < 1e-12, "{turned}");
    }
}
