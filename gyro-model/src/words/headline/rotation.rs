//! The cross-axis terms of three axes as what they mostly are: a sensor that sits turned on its vehicle.
//!
//! Each axis i feels ω_i + Σ m_ik ω_k. With 1 in the place of i that is a row of the matrix that brings rates of the reference's frame
//! into the sensor's, but for its length, which the scale factor takes. Rows of length one that stand square to each other are a rotation.

use super::Named;
use crate::{Axis, measured::Measured, units};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::Serialize;

/// The effect whose terms are looked at.
pub(super) const EFFECT: &str = "cross-axis";

/// Standard errors that the axes may be off square and still be called one rotation.
const SQUARE_ERRORS: f64 = 3.0;
/// As a share of the turn: what the axes may be off square beyond their errors. Axes of one chip are, by 0.5 to 2 %.
const SQUARE_SHARE: f64 = 0.2;
/// Standard errors from nothing that a turn has to be worth saying.
const SEEN: f64 = 3.0;
/// The share of a turn that lies about one axis from which on it is said of that axis alone.
const ABOUT_ONE: f64 = 0.99;

/// How a sensor is turned against its reference.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rotation {
    /// By how much, rad.
    pub angle: f64,
    /// Its standard error, rad.
    pub std_error: f64,
    /// About which direction, a unit vector in the reference's frame; right-handed.
    pub axis: [f64; 3],
    /// Times a rate in the sensor's frame gives it in the reference's; row by row.
    pub reference_from_sensor: [[f64; 3]; 3],
    /// The same as a quaternion: w, x, y, z.
    pub quaternion: [f64; 4],
    /// By how much the axes are off square beyond that, at most, rad; 0 where that is within the errors.
    pub off_square: f64,
}

impl Rotation {
    /// Of the parameters of the three axes; `None` where one is missing, or the terms are no rotation.
    #[must_use]
    pub fn of(axes: &[Named]) -> Option<Self> {
        let term = |of: Axis, about: Axis| -> Option<Measured> {
            let name = format!("m_{about}");
            let own = axes.iter().find(|named| named.axis == of)?;
            // An axis that needs none has none.
            if !own.effects.contains(&EFFECT) {
                return Some(Measured { value: 0.0, std_error: 0.0 });
            }
            let found = own.parameters.iter().find(|p| p.effect == EFFECT && p.name == name)?;
            let (value, std_error) = (found.value?, found.std_error?);
            (value.is_finite() && std_error.is_finite()).then_some(Measured { value, std_error })
        };
        let mut felt = Matrix3::identity();
        let mut errors = Matrix3::zeros();
        for of in Axis::ALL {
            for about in Axis::ALL.into_iter().filter(|about| *about != of) {
                let found = term(of, about)?;
                felt[(of.index(), about.index())] = found.value;
                errors[(of.index(), about.index())] = found.std_error;
            }
        }
        let rows: Vec<Vector3<f64>> = (0..3).map(|i| felt.row(i).transpose().normalize()).collect();
        let sensor_from_reference = nearest(Matrix3::from_fn(|i, k| rows[i][k]))?;
        let turn = sensor_from_reference.inverse();
        let angle = turn.angle();
        let axis = turn.axis().map_or([0.0; 3], |axis| [axis.x, axis.y, axis.z]);
        // The turn about an axis is half the difference of the two terms in its plane.
        let pair = |i: usize, k: usize| errors[(i, k)].hypot(errors[(k, i)]);
        let planes = [(1, 2), (2, 0), (0, 1)];
        let part = |(n, &(i, k)): (usize, &(usize, usize))| (0.5 * axis[n] * pair(i, k)).powi(2);
        let std_error = planes.iter().enumerate().map(part).sum::<f64>().sqrt();
        let off = |&(i, k): &(usize, usize)| (rows[i].dot(&rows[k]).abs(), pair(i, k));
        let worst = planes.iter().map(off).filter(|(off, error)| *off > SQUARE_ERRORS * error).map(|(off, _)| off);
        let off_square = worst.fold(0.0, f64::max);
        if angle < SEEN * std_error || off_square > SQUARE_SHARE * angle {
            return None;
        }
        let q = UnitQuaternion::from_rotation_matrix(&turn);
        Some(Self {
            angle,
            std_error,
            axis,
            reference_from_sensor: [0, 1, 2].map(|i| [0, 1, 2].map(|k| turn[(i, k)])),
            quaternion: [q.w, q.i, q.j, q.k],
            off_square,
        })
    }

    /// `the sensor is turned by 3.700 ± 0.020° about z against the reference`, a clause.
    #[must_use]
    pub fn says(&self) -> String {
        let one = Axis::ALL.into_iter().find(|axis| self.axis[axis.index()].abs() > ABOUT_ONE);
        let (sign, about) = if let Some(axis) = one {
            (self.axis[axis.index()].signum(), axis.letter().to_owned())
        } else {
            let parts = self.axis.map(|part| format!("{part:.2}").replace('-', "−"));
            (1.0, format!("the direction ({})", parts.join(", ")))
        };
        let angle = Measured { value: sign * self.angle, std_error: self.std_error }.signed("rad");
        let beyond = if self.off_square > 0.0 {
            let off = units::uncertain(Some(self.off_square), None, &units::shown("rad", &[]));
            format!(", and its axes are up to {off} off square")
        } else {
            String::new()
        };
        format!("the sensor is turned by {angle} about {about} against the reference{beyond}")
    }

    /// What to do with it: the matrix and the quaternion to use.
    #[must_use]
    pub fn to_use(&self) -> String {
        // What rounds to nothing has no sign.
        let number = |value: f64| format!("{:.5}", (value * 1e5).round() * 1e-5 + 0.0).replace('-', "−");
        let rows = self.reference_from_sensor.map(|row| format!("[{}]", row.map(number).join(" ")));
        format!(
            "square it, or turn its readings: rate = R · reading, with R = {}; as a quaternion (w x y z) {}",
            rows.join(" "),
            self.quaternion.map(number).join(" ")
        )
    }
}

/// The rotation nearest to a matrix that is nearly one (Newton's iteration for the polar decomposition).
fn nearest(matrix: Matrix3<f64>) -> Option<Rotation3<f64>> {
    if matrix.determinant() < 0.1 {
        return None;
    }
    let mut at = matrix;
    for _ in 0..20 {
        at = 0.5 * (at + at.try_inverse()?.transpose());
    }
    Some(Rotation3::from_matrix_unchecked(at))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::ParameterValue;

    /// The terms of a sensor that is turned like this, each off by so many of its standard errors of 1e-4.
    fn terms(turn: Rotation3<f64>, off: [f64; 6]) -> [Vec<ParameterValue>; 3] {
        let felt = turn.inverse();
        let mut off = off.into_iter();
        Axis::ALL.map(|of| {
            let others = Axis::ALL.into_iter().filter(|about| *about != of);
            let own = others.map(|about| {
                let share = felt[(of.index(), about.index())] / felt[(of.index(), of.index())];
                let value = share + 1e-4 * off.next().unwrap();
                let (name, std_error) = (format!("m_{about}"), Some(1e-4));
                ParameterValue {
                    effect: EFFECT.into(),
                    name,
                    value: Some(value),
                    std_error,
                    unit: "1".into(),
                    typical: None,
                }
            });
            own.collect()
        })
    }

    fn found(terms: &[Vec<ParameterValue>; 3]) -> Option<Rotation> {
        let named =
            |axis: Axis| Named { axis, effects: vec![EFFECT], parameters: terms[axis.index()].iter().collect() };
        let named = Axis::ALL.map(named);
        Rotation::of(&named)
    }

    #[test]
    fn a_turned_sensor_is_told_with_its_sign_and_turned_back_by_its_matrix() {
        for degrees in [3.7_f64, -3.7, 21.0] {
            let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians());
            let told = found(&terms(turn, [0.5, -0.8, 0.3, 1.0, -0.4, 0.2])).unwrap();
            let says = told.says();
            assert!((told.angle.to_degrees() - degrees.abs()).abs() < 0.02, "{says}");
            assert_eq!(says.contains("turned by −"), degrees < 0.0, "{says}");
            assert!(says.contains("° about z against the reference"), "{says}");
            assert!(!says.contains("off square"), "{says}");
            // A sensor that is turned by +θ about z reads a rate about x as cos θ on x and −sin θ on y; the matrix undoes it.
            let reading = turn.inverse() * Vector3::x();
            assert!(reading.y * degrees < 0.0);
            let back = Matrix3::from_fn(|i, k| told.reference_from_sensor[i][k]) * reading;
            assert!((back - Vector3::x()).norm() < 5e-4, "{back}");
            let q = told.quaternion;
            let same = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(q[0], q[1], q[2], q[3])) * reading;
            assert!((same - Vector3::x()).norm() < 5e-4, "{same}");
        }
    }

    #[test]
    fn a_turn_about_an_axis_that_needs_no_term_is_told_all_the_same() {
        let terms = terms(Rotation3::from_axis_angle(&Vector3::z_axis(), 0.05), [0.0; 6]);
        let named = |axis: Axis| {
            let own = if axis == Axis::Z { &[][..] } else { &terms[axis.index()] };
            let effects = if axis == Axis::Z { vec![] } else { vec![EFFECT] };
            Named { axis, effects, parameters: own.iter().collect() }
        };
        assert!(Rotation::of(&Axis::ALL.map(named)).unwrap().says().contains("° about z"));
        assert!(Rotation::of(&[named(Axis::X), named(Axis::Y)]).is_none());
    }

    #[test]
    fn a_turn_about_no_axis_of_the_sensor_says_its_direction() {
        let turn = Rotation3::from_scaled_axis(Vector3::new(0.03, -0.04, 0.0));
        let says = found(&terms(turn, [0.0; 6])).unwrap().says();
        assert!(says.contains("2.86") && says.contains("about the direction (0.60, −0.80, 0.00)"), "{says}");
    }

    #[test]
    fn axes_that_are_off_square_are_no_rotation_and_a_little_beside_one_is_said() {
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.05);
        let mut little = terms(turn, [0.0; 6]);
        let add = |terms: &mut [Vec<ParameterValue>; 3], by: f64| {
            for (axis, k) in [(0, 0), (1, 0)] {
                terms[axis][k].value = terms[axis][k].value.map(|value| value + by);
            }
        };
        add(&mut little, 0.002);
        assert!(found(&little).unwrap().says().ends_with("off square"));
        add(&mut little, 0.02);
        assert!(found(&little).is_none());
        assert!(found(&terms(Rotation3::identity(), [0.4, 0.9, -0.7, 0.1, 1.2, -0.3])).is_none());
    }
}
