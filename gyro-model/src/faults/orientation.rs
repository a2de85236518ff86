//! A reference orientation against three gyros: are its four numbers in another order, is it the inverse one, or do the two
//! sets of axes not point the same way?
//!
//! The rotation R that takes the gyro's mean rates to the reference's is that of Kabsch (1976): with Σ r gᵀ = U S Vᵀ,
//! R = U diag(1, 1, det UVᵀ) Vᵀ. What it explains is measured with any scale, so that no unit is taken for a direction.

use super::{
    Report,
    motion::{Motion, gyro_rates},
};
use crate::{Axis, Record, fault::FaultKind, record::ReferenceKind};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// How four numbers may be meant otherwise.
const READINGS: [Otherwise; 3] = [
    Otherwise {
        reading: |[w, x, y, z]| [w, -x, -y, -z],
        meant: Meant::Parts([(0, 1.0), (1, -1.0), (2, -1.0), (3, -1.0)]),
        says: "as world to body; it has to be body to world: negate ref_qx, ref_qy and ref_qz",
    },
    Otherwise {
        reading: |[x, y, z, w]| [w, x, y, z],
        meant: Meant::Parts([(3, 1.0), (0, 1.0), (1, 1.0), (2, 1.0)]),
        says: "in the order x, y, z, w: the columns are named w, x, y, z",
    },
    Otherwise {
        reading: |[x, y, z, w]| [w, -x, -y, -z],
        meant: Meant::Parts([(3, 1.0), (0, -1.0), (1, -1.0), (2, -1.0)]),
        says: "in the order x, y, z, w, and as world to body: rename the columns and negate the vector part",
    },
];

type Reading = fn([f64; 4]) -> [f64; 4];

/// A way to read four numbers.
struct Otherwise {
    reading: Reading,
    meant: Meant,
    says: &'static str,
}

/// What brings a reference orientation and the gyro together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Meant {
    /// w, x, y and z of the orientation are these of its four numbers, with this sign.
    Parts([(usize, f64); 4]),
    /// The gyro's axes x, y and z are these of its axes, with this sign.
    Axes([(usize, f64); 3]),
}

/// What a reading that is right explains at least, and one that is wrong at most.
const RIGHT: f64 = 0.95;
const WRONG: f64 = 0.8;
/// From this angle on axes are turned rather than badly aligned, rad: 20°, where `cross-axis` would be at a third.
const TURNED: f64 = 0.35;
/// Size of the second direction of motion over the first, from which on a rotation is known.
const SECOND: f64 = 0.05;

/// What a rotation that is undone explains at least, of all axes together and of each (r²).
const SURE: f64 = 0.98;
const SURE_OF_EACH: f64 = 0.95;

/// Turns a reference orientation into the gyro's axes, where the rates of all three say by which rotation. Axes in another order or
/// with another sign are left as they are: that may be the gyro's columns.
pub(super) fn check(record: &mut Record, report: &mut Report) {
    let Some(rotation) = mounted(record) else { return };
    let Some((axis, angle)) = rotation.axis_angle() else { return };
    let by = UnitQuaternion::from_rotation_matrix(&rotation);
    for row in record.rows.iter_mut().filter(|row| row.ref_quaternion[0].is_finite()) {
        let [w, i, j, k] = row.ref_quaternion;
        let q = Quaternion::new(w, i, j, k) * by.into_inner();
        row.ref_quaternion = [q.w, q.i, q.j, q.k];
    }
    let says = format!(
        "the axes of the reference orientation are turned by {:.1}° about ({:.2}, {:.2}, {:.2}) against the gyro's, as of a body that is \
         mounted so: they are turned back before anything is judged, which takes up how the sensor is aligned as a whole (the \
         reference times w, x, y, z = {:.4}, {:.4}, {:.4}, {:.4} from the right)",
        angle.to_degrees(),
        axis.x,
        axis.y,
        axis.z,
        by.w,
        by.i,
        by.j,
        by.k
    );
    report.add(FaultKind::TurnedReference, record.len() as u64, Some(0.0), says);
}

/// The rotation by which the two sets of axes differ, where that is all that is wrong.
fn mounted(record: &Record) -> Option<Rotation3<f64>> {
    let (g, r) = (gyro(record)?, reference(record, |q| q)?);
    let (explained, rotation) = fitted(&g, &r)?;
    if explained < SURE || rotation.angle() < TURNED || orders().any(|order| rotation.angle_to(&order) < TURNED) {
        return None;
    }
    // Another reading that turns less is likelier than a mounting.
    if READINGS.iter().any(|otherwise| {
        let other = reference(record, otherwise.reading).and_then(|r| fitted(&g, &r));
        other.is_some_and(|(explained, other)| explained > RIGHT && other.angle() < TURNED)
    }) {
        return None;
    }
    let turned: Vec<Vector3<f64>> = r.iter().map(|r| rotation.inverse() * r).collect();
    let along = |i: usize| correlation(&g, &turned, i) > SURE_OF_EACH.sqrt();
    (0..3).all(along).then_some(rotation)
}

/// The correlation of two rates about one axis.
fn correlation(g: &[Vector3<f64>], r: &[Vector3<f64>], i: usize) -> f64 {
    let n = g.len().min(r.len()).max(1) as f64;
    let mean = |of: &[Vector3<f64>]| of.iter().map(|v| v[i]).sum::<f64>() / n;
    let (of_g, of_r) = (mean(g), mean(r));
    let pairs = || g.iter().zip(r).map(|(g, r)| (g[i] - of_g, r[i] - of_r));
    let sum = |of: fn((f64, f64)) -> f64| pairs().map(of).sum::<f64>();
    sum(|(g, r)| g * r) / (sum(|(g, _)| g * g) * sum(|(_, r)| r * r)).sqrt()
}

/// The 23 rotations that give axes another order and other signs.
fn orders() -> impl Iterator<Item = Rotation3<f64>> {
    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let signs = (0..8_usize).map(|bits| [0, 1, 2].map(|i| if bits >> i & 1 == 1 { -1.0 } else { 1.0 }));
    let all =
        signs.flat_map(|signs| ORDERS.map(|order| Matrix3::from_fn(|i, j| if order[i] == j { signs[i] } else { 0.0 })));
    let turns = all.filter(|matrix| matrix.determinant() > 0.0 && *matrix != Matrix3::identity());
    turns.map(Rotation3::from_matrix_unchecked)
}

/// How the gyro asks for the orientation to be read, or its axes to be turned, where that is not as the columns' names say.
pub(super) fn meant_otherwise(record: &Record) -> Option<String> {
    otherwise(record).map(|(_, says)| says)
}

/// What brings a reference orientation and the gyro together, where that is another order or another sign.
#[must_use]
pub fn meant(record: &Record) -> Option<Meant> {
    otherwise(record)?.0
}

fn otherwise(record: &Record) -> Option<(Option<Meant>, String)> {
    let gyro = gyro(record)?;
    let (explained, rotation) = fitted(&gyro, &reference(record, |q| q)?)?;
    let is_wrong = explained < WRONG;
    let is_turned = rotation.angle() > TURNED;
    if !is_wrong && !is_turned {
        return None;
    }
    // More than one may fit, with axes that are turned: the one that turns them least.
    let fitting = READINGS.iter().filter_map(|otherwise| {
        let (explained, rotation) = fitted(&gyro, &reference(record, otherwise.reading)?)?;
        let angle = rotation.angle();
        (explained > RIGHT && (is_wrong || angle < TURNED)).then_some((angle, otherwise))
    });
    match fitting.min_by(|a, b| a.0.total_cmp(&b.0)) {
        Some((angle, Otherwise { meant, says, .. })) => {
            // Axes that are turned besides need another look once the numbers are read so.
            let meant = (angle < TURNED || is_wrong).then_some(*meant);
            Some((meant, format!("the reference orientation agrees with the gyro if it is read {says}")))
        }
        None => (explained > RIGHT && is_turned).then(|| Some((in_order(&rotation), turned(&rotation)?)))?,
    }
}

/// The order and the signs of the gyro's axes that such a rotation is, but for what a bad alignment makes.
fn in_order(rotation: &Rotation3<f64>) -> Option<Meant> {
    let order = orders().find(|order| rotation.angle_to(order) < TURNED)?;
    let axis = |i: usize| (0..3).find(|&j| order[(i, j)] != 0.0).map(|j| (j, order[(i, j)]));
    Some(Meant::Axes([axis(0)?, axis(1)?, axis(2)?]))
}

/// How axes that are turned against each other are brought together.
fn turned(rotation: &Rotation3<f64>) -> Option<String> {
    let (axis, angle) = rotation.axis_angle()?;
    let q = UnitQuaternion::from_rotation_matrix(rotation);
    Some(format!(
        "the gyro's axes are turned by {:.0}° about ({:.2}, {:.2}, {:.2}) against those of the reference orientation: align \
         them, or multiply the reference from the right by w, x, y, z = {:.4}, {:.4}, {:.4}, {:.4}",
        angle.to_degrees(),
        axis.x,
        axis.y,
        axis.z,
        q.w,
        q.i,
        q.j,
        q.k
    ))
}

/// Mean rates of the three gyros over the pieces of the reference; `None` where not all are there.
fn gyro(record: &Record) -> Option<Vec<Vector3<f64>>> {
    if Axis::ALL.iter().any(|&axis| record.reference(axis) != Some(ReferenceKind::Quaternion)) {
        return None;
    }
    let motion = Motion::of(record, Axis::X)?;
    let each = Axis::ALL.map(|axis| gyro_rates(record, axis, &motion));
    joined(each)
}

fn reference(record: &Record, reading: Reading) -> Option<Vec<Vector3<f64>>> {
    joined(Axis::ALL.map(|axis| Motion::of_orientation(record, axis, reading).map(|motion| motion.whole())))
}

fn joined(each: [Option<Vec<f64>>; 3]) -> Option<Vec<Vector3<f64>>> {
    let [x, y, z] = each;
    let (x, y, z) = (x?, y?, z?);
    Some(x.into_iter().zip(y).zip(z).map(|((x, y), z)| Vector3::new(x, y, z)).collect())
}

/// The square of the correlation of `r` and Rg, and R; `None` where the motion does not say which way axes point.
fn fitted(g: &[Vector3<f64>], r: &[Vector3<f64>]) -> Option<(f64, Rotation3<f64>)> {
    let n = g.len().min(r.len());
    let mean = |v: &[Vector3<f64>]| v[..n].iter().sum::<Vector3<f64>>() / n.max(1) as f64;
    let (of_g, of_r) = (mean(g), mean(r));
    let (mut across, mut own, mut gg, mut rr) = (Matrix3::zeros(), Matrix3::zeros(), 0.0, 0.0);
    for (g, r) in g.iter().zip(r).map(|(g, r)| (g - of_g, r - of_r)) {
        across += r * g.transpose();
        own += g * g.transpose();
        gg += g.norm_squared();
        rr += r.norm_squared();
    }
    let mut sizes: [f64; 3] = own.symmetric_eigenvalues().into();
    sizes.sort_by(f64::total_cmp);
    let is_known = sizes[1] > SECOND * SECOND * sizes[2] && rr > 0.0 && across.iter().all(|x| x.is_finite());
    if !is_known {
        return None;
    }
    let svd = across.svd(true, true);
    let (u, v) = (svd.u?, svd.v_t?);
    let flip = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v).determinant().signum()));
    let rotation = u * flip * v;
    let along = (rotation.transpose() * across).trace();
    Some((along.max(0.0).powi(2) / (gg * rr), Rotation3::from_matrix_unchecked(rotation)))
}
