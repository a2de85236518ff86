//! Readings that stand for none: what a driver writes where a read failed (the least number of the word, −2000, 999). Of a log they are
//! found by looking through all of it; of a stream, row by row, by the step to them, which no low-cost gyro's motion makes.

use gyro_model::Row;

/// What hands and vehicles do at most, rad/s²: 10 000 °/s².
const FASTEST: f64 = 175.0;
/// Times the largest steps of late.
const BEYOND: f64 = 8.0;
/// How much larger a step may be than one that was doubted and was motion.
const ALLOWS: f64 = 1.5;
/// How much of the largest step is left after each row.
const FORGETS: f64 = 0.999;
/// So many readings left out in a row, each elsewhere, are a motion; so many that are the same to the last digit are a sensor's own end.
const IN_A_ROW: u32 = 3;
const SAME: u32 = 100;
/// So many of late, each another value, are a motion, too; and what is left of them after each row.
const MOST_STRANGE: f64 = 3.0;
const FORGETS_STRANGE: f64 = 0.99;
/// Steps of time that count, s.
const STEP: (f64, f64) = (1e-4, 0.1);

/// Watches the gyros of a stream.
#[derive(Debug, Default)]
pub struct Spikes([Gyro; 3]);

#[derive(Debug, Default)]
struct Gyro {
    /// The last reading that was taken, and its time, ns.
    last: Option<(f64, i128)>,
    /// The largest steps of late.
    usual: f64,
    /// The reading that was left out last, and how many were, one after the other.
    left_out: Option<f64>,
    count: u32,
    /// The last of all that were left out, and how many of late were each another value.
    known: Option<f64>,
    strange: f64,
}

impl Spikes {
    /// Takes out of a row what is no reading; how many.
    pub fn take(&mut self, row: &mut Row, own_ns: i128) -> u32 {
        let mut count = 0;
        for (gyro, reading) in self.0.iter_mut().zip(&mut row.gyro) {
            if reading.is_finite() && !gyro.is_one(*reading, own_ns) {
                *reading = f64::NAN;
                count += 1;
            }
        }
        count
    }
}

impl Gyro {
    fn is_one(&mut self, reading: f64, own_ns: i128) -> bool {
        let Some((last, last_ns)) = self.last else {
            self.last = Some((reading, own_ns));
            return true;
        };
        let dt = ((own_ns - last_ns) as f64 / 1e9).clamp(STEP.0, STEP.1);
        let far = (BEYOND * self.usual).max(FASTEST * dt);
        let step = (reading - last).abs();
        self.strange *= FORGETS_STRANGE;
        if step > far && self.goes_on(reading, far) {
            // What comes back to the last digit is a marker, of which there may be many.
            self.strange += f64::from(u8::from(self.known != Some(reading)));
            (self.left_out, self.known) = (Some(reading), Some(reading));
            self.count += 1;
            return false;
        }
        // A step that was doubted without reason is allowed from now on, and no more than that.
        let step = if step > far { ALLOWS * step / BEYOND } else { step };
        self.usual = (FORGETS * self.usual).max(step);
        (self.last, self.left_out, self.count) = (Some((reading, own_ns)), None, 0);
        true
    }

    /// Whether what was left out before this is no motion that has begun.
    fn goes_on(&self, reading: f64, far: f64) -> bool {
        match self.left_out {
            None => self.known == Some(reading) || self.strange < MOST_STRANGE,
            Some(before) if before == reading => self.count < SAME,
            Some(before) => (reading - before).abs() > far && self.count < IN_A_ROW,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream at 100 Hz: what is left of it.
    fn left(readings: &[f64]) -> Vec<f64> {
        let mut spikes = Spikes::default();
        let one = |(k, reading): (usize, &f64)| {
            let mut row = Row { gyro: [f64::NAN, f64::NAN, *reading], ..Row::EMPTY };
            spikes.take(&mut row, k as i128 * 10_000_000);
            row.gyro[2]
        };
        readings.iter().enumerate().map(one).collect()
    }

    fn motion(k: usize) -> f64 {
        let t = k as f64 * 0.01;
        2.0 * (3.1 * t).sin() + (7.9 * t).cos() + 1e-3 * ((k * 7919) % 97) as f64 / 97.0
    }

    #[test]
    fn a_marker_is_no_reading_however_often_it_comes_and_all_else_is() {
        let is_marked = |k: usize| k % 97 == 5 || (700..706).contains(&k);
        let readings: Vec<f64> = (0..2000).map(|k| if is_marked(k) { -34.9 } else { motion(k) }).collect();
        for (k, reading) in left(&readings).iter().enumerate() {
            assert_eq!(reading.is_nan(), is_marked(k), "row {k}");
        }
    }

    #[test]
    fn a_blow_costs_a_reading_at_most() {
        let readings: Vec<f64> = (0..600).map(|k| motion(k) + if k >= 300 { 8.0 } else { 0.0 }).collect();
        let lost = left(&readings).iter().filter(|reading| reading.is_nan()).count();
        assert_eq!(lost, 1);
        // And one that goes to and fro, a few.
        let readings: Vec<f64> = (0..600).map(|k| motion(k) + if k >= 300 && k % 2 == 0 { 8.0 } else { 0.0 }).collect();
        let lost = left(&readings).iter().filter(|reading| reading.is_nan()).count();
        assert!(lost <= 5, "{lost}");
    }

    #[test]
    fn a_sensor_that_stays_at_its_end_is_told_as_it_is() {
        let readings: Vec<f64> = (0..600).map(|k| if k < 200 { motion(k) } else { 34.9 }).collect();
        let left = left(&readings);
        assert!(left[200].is_nan() && left[599] == 34.9, "{:?}", &left[590..]);
    }
}
