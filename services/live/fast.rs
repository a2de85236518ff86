//! Rates that no low-cost gyro reads. A stream of them is in another unit than its names say, as raw counts are that nobody scaled: none of its
//! readings is a rate then.

use gyro_model::{Axis, Row, faults::FASTEST};

/// How much of the count of such readings is left after each row, and from which count on the unit is wrong.
const FORGETS: f64 = 0.999;
const MANY: f64 = 20.0;

/// Watches the gyros of a stream.
#[derive(Debug, Default)]
pub struct Fast {
    /// Readings of late that are too fast.
    count: f64,
    /// The last of them.
    last: Option<(Axis, f64)>,
}

impl Fast {
    /// Takes out of a row what is no rate; how many readings.
    pub fn take(&mut self, row: &mut Row) -> u32 {
        self.count *= FORGETS;
        let last = Axis::ALL.into_iter().find(|axis| row.gyro[axis.index()].abs() > FASTEST);
        if let Some(axis) = last {
            self.count += 1.0;
            self.last = Some((axis, row.gyro[axis.index()]));
        }
        let is_none = self.is_other_unit();
        let mut left_out = 0;
        for reading in row.gyro.iter_mut().filter(|reading| reading.abs() > FASTEST || is_none && reading.is_finite()) {
            *reading = f64::NAN;
            left_out += 1;
        }
        left_out
    }

    fn is_other_unit(&self) -> bool {
        self.count > MANY
    }

    /// The words for it; `None` where the readings are rates.
    pub fn says(&self) -> Option<String> {
        let (axis, reading) = self.last.filter(|_| self.is_other_unit())?;
        Some(format!(
            "gyro_{axis} reads {reading:.0} rad/s, and no low-cost gyro more than {FASTEST:.0} (4000 °/s): no rate is sent. Say its unit: \
             --map gyro_{axis}_dps=CHANNEL if it is in °/s, --map gyro_{axis}_dps=CHANNEL/131 if it is in counts of 131 a °/s"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(z: f64) -> Row {
        Row { gyro: [0.01, f64::NAN, z], ..Row::EMPTY }
    }

    #[test]
    fn counts_are_no_rates_and_a_few_bad_readings_leave_the_others() {
        let mut fast = Fast::default();
        let mut left_out = 0;
        for k in 0..500 {
            let mut row = row(if k % 100 == 0 { 9000.0 } else { 3.0 });
            left_out += fast.take(&mut row);
            assert_eq!(row.gyro[2].is_nan(), k % 100 == 0);
        }
        assert_eq!((left_out, fast.says()), (5, None));
        let mut counts = Fast::default();
        let taken: Vec<Row> = (0..200)
            .map(|k| {
                let mut row = row(2000.0 * (0.05 * f64::from(k)).sin());
                counts.take(&mut row);
                row
            })
            .collect();
        assert!(taken[50..].iter().all(|row| row.gyro.iter().all(|x| x.is_nan())));
        assert!(counts.says().unwrap().contains("gyro_z_dps=CHANNEL/131"));
    }
}
