//! The unit of an accelerometer that neither a name nor the file says: gravity, which it shows for the most part, tells it.

use gyro_model::Row;

/// Rows with all three axes, at least.
const FEWEST: usize = 20;
/// How far what is shown may be from gravity, as a share.
const NEAR: f64 = 0.15;
/// No low-cost gyro's vehicle feels more than this for half of the time, m/s².
const MOST: f64 = 30.0;
/// Share of the rows that are gravity's length for it to be what is shown.
const MOSTLY: f64 = 0.6;
/// Numbers for one g: g itself, mg, and the steps of a word of 16 bits over ±2 to ±16 g (MPU, ICM, BMI), of 12 and 10 bits over ±2 g (MMA, ADXL).
const STEPS: [f64; 8] = [1.0, 1000.0, 16_384.0, 8192.0, 4096.0, 2048.0, 1024.0, 256.0];

/// What an accelerometer shows for gravity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Gravity {
    /// What is no contradiction to m/s².
    Metres,
    /// So many for one g.
    Steps(f64),
    /// More than an acceleration in m/s² can be, and no unit that is known.
    Unknown,
}

impl Gravity {
    /// Whether these are the steps of one of the ranges of an MPU.
    pub fn is_of_mpu(self) -> bool {
        matches!(self, Self::Steps(steps) if STEPS[2..6].contains(&steps))
    }

    /// Of rows that were read without a unit.
    pub fn of(rows: &[Row]) -> Self {
        let length = |row: &Row| row.accel.iter().map(|a| a * a).sum::<f64>().sqrt();
        let mut lengths: Vec<f64> = rows.iter().map(length).filter(|x| x.is_finite()).collect();
        if lengths.len() < FEWEST {
            return Self::Metres;
        }
        let middle = lengths.len() / 2;
        let shown = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
        let off = |steps: f64| (shown / steps).ln().abs();
        let nearest = STEPS.into_iter().min_by(|a, b| off(*a).total_cmp(&off(*b)));
        let is_gravity = share_near(&lengths, shown) > MOSTLY;
        match nearest.filter(|steps| is_gravity && off(*steps) < NEAR) {
            Some(steps) => Self::Steps(steps),
            None if shown > MOST => Self::Unknown,
            None => Self::Metres,
        }
    }
}

/// Share of these lengths that lie within 30 % of one. Where gravity is in them most do; of a motion without it half lie about the middle.
pub fn share_near(lengths: &[f64], one: f64) -> f64 {
    lengths.iter().filter(|length| (0.7..1.3).contains(&(*length / one))).count() as f64 / lengths.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_tells_the_unit() {
        for (shown, wanted) in [
            (9.81, Gravity::Metres),
            (0.02, Gravity::Metres),
            (0.99, Gravity::Steps(1.0)),
            (990.0, Gravity::Steps(1000.0)),
            (16_217.0, Gravity::Steps(16_384.0)),
            (4200.0, Gravity::Steps(4096.0)),
            (70.0, Gravity::Unknown),
        ] {
            let row = Row { accel: [0.6 * shown, 0.0, 0.8 * shown], ..Row::EMPTY };
            assert_eq!(Gravity::of(&[row; 50]), wanted, "{shown}");
        }
        // 1 m/s² in the middle, without gravity.
        let moved: Vec<Row> = (0..60).map(|k| Row { accel: [f64::from(k) / 30.0, 0.0, 0.0], ..Row::EMPTY }).collect();
        assert_eq!(Gravity::of(&moved), Gravity::Metres);
        assert_eq!(Gravity::of(&[Row { accel: [1.0, f64::NAN, f64::NAN], ..Row::EMPTY }; 50]), Gravity::Metres);
    }
}
