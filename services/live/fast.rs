//! Rates that are faster than any low-cost gyro can read. Where they are a tenth of the rows, as in a log (`gyro_model::faults`), the stream
//! is in another unit than its names say, raw counts for example, and none of its readings is taken for a rate.

use gyro_model::{Axis, Row, faults::FASTEST};

/// What each row leaves of the counts: they are those of the last thousand rows.
const FORGETS: f64 = 0.999;
/// The unit is wrong from so many rows on that are too fast, where they are this share of all.
const FEWEST: f64 = 20.0;
const SHARE: f64 = 0.1;

/// Watches the gyros of a stream.
#[derive(Debug, Default)]
pub struct Fast {
    /// Rows of late, and those that are too fast.
    rows: f64,
    count: f64,
    /// The last reading that was too fast.
    last: Option<(Axis, f64)>,
}

impl Fast {
    /// Takes out of a row what is not a rate, and says what it was; `None` where nothing was taken out.
    pub fn take(&mut self, row: &mut Row) -> Option<String> {
        (self.rows, self.count) = (FORGETS * self.rows + 1.0, FORGETS * self.count);
        let last = Axis::ALL.into_iter().find(|axis| row.gyro[axis.index()].abs() > FASTEST);
        if let Some(axis) = last {
            self.count += 1.0;
            self.last = Some((axis, row.gyro[axis.index()]));
        }
        let is_none = self.is_other_unit();
        let mut taken = None;
        for (axis, reading) in Axis::ALL.into_iter().zip(&mut row.gyro) {
            if reading.abs() > FASTEST || is_none && reading.is_finite() {
                taken = Some(format!("gyro_{axis} = {reading} rad/s"));
                *reading = f64::NAN;
            }
        }
        taken
    }

    fn is_other_unit(&self) -> bool {
        self.count > FEWEST && self.count > SHARE * self.rows
    }

    /// The words for it; `None` where the readings are rates.
    pub fn says(&self) -> Option<String> {
        let (axis, reading) = self.last.filter(|_| self.is_other_unit())?;
        Some(format!(
            "gyro_{axis} reads {reading:.0} rad/s, faster than any low-cost gyro can read ({FASTEST:.0} rad/s are 4000 °/s): no rate is sent. \
             Give its unit: --map gyro_{axis}_dps=CHANNEL if it is in °/s, --map gyro_{axis}_dps=CHANNEL/131 if it is in counts of 131 a °/s"
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
            left_out += usize::from(fast.take(&mut row).is_some());
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
