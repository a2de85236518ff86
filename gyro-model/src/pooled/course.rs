//! One part in time, as control charts with known errors: an exponentially weighted moving average (EWMA) and cumulated sums (CUSUM).
//!
//! ```text
//! x_i = (y_i − level)/√(s_i² + scatter²)
//! z_i = λ x_i + (1 − λ) z_{i−1}          |z_i| > 3 √(λ/(2 − λ) (1 − (1 − λ)^{2i})):  it has moved        (Roberts 1959)
//! C⁺_i = max(0, C⁺_{i−1} + x_i − k)      C⁻ alike        C > h:  it has moved by some σ and stayed         (Page 1954)
//! ```
//!
//! The level is that of the part before it changed, or of all its readings where it did not.

/// λ of the moving average.
pub const WEIGHT: f64 = 0.2;
/// Its limits, standard deviations.
pub const LIMIT: f64 = 3.0;
/// k: half of the shift, in σ, that the sums are made for.
pub const SLACK: f64 = 0.5;
/// h: in σ. Without a change a sum comes to this once in 465 readings.
pub const ALARM: f64 = 5.0;

/// One reading of a part on its charts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Days.
    pub day: f64,
    /// What the log says.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
    /// The moving average, in the unit of the value.
    pub average: f64,
    /// How far it may lie from the level, in the unit of the value.
    pub limit: f64,
    /// The larger of the two sums, σ.
    pub sum: f64,
}

/// A part in time.
#[derive(Clone, Debug, PartialEq)]
pub struct Course {
    /// What the charts are held against.
    pub level: f64,
    /// Reading by reading.
    pub points: Vec<Point>,
}

impl Course {
    /// The same of values that are counted from elsewhere.
    #[must_use]
    pub fn above(self, neutral: f64) -> Self {
        let moved = |point: Point| Point { value: point.value + neutral, average: point.average + neutral, ..point };
        Self { level: self.level + neutral, points: self.points.into_iter().map(moved).collect() }
    }
}

/// The charts of these readings: day, value, variance of the log's own error. `scatter` is the variance beyond it, `before` how many readings
/// the level is taken from.
#[must_use]
pub fn course(readings: &[(f64, f64, f64)], scatter: f64, before: usize) -> Course {
    let (mut weight, mut along) = (0.0, 0.0);
    for (_, value, variance) in readings.iter().take(before.max(1)) {
        let w = 1.0 / (variance + scatter);
        (weight, along) = (weight + w, along + w * value);
    }
    let level = along / weight;
    // What an average is in the readings' unit goes by their usual error.
    let usual = (readings.iter().map(|(.., variance)| variance + scatter).sum::<f64>() / readings.len() as f64).sqrt();
    let (mut average, mut up, mut down, mut memory) = (0.0, 0.0_f64, 0.0_f64, 1.0);
    let points = readings.iter().map(|(day, value, variance)| {
        let x = (value - level) / (variance + scatter).sqrt();
        average = WEIGHT * x + (1.0 - WEIGHT) * average;
        memory *= (1.0 - WEIGHT).powi(2);
        up = (up + x - SLACK).max(0.0);
        down = (down - x - SLACK).max(0.0);
        Point {
            day: *day,
            value: *value,
            std_error: variance.sqrt(),
            average: level + usual * average,
            limit: usual * LIMIT * (WEIGHT / (2.0 - WEIGHT) * (1.0 - memory)).sqrt(),
            sum: up.max(down),
        }
    });
    Course { points: points.collect(), level }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    fn drawn(n: usize, shift: impl Fn(usize) -> f64, random: &mut ChaCha8Rng) -> Vec<(f64, f64, f64)> {
        let reading = |k: usize| {
            let noise: f64 = StandardNormal.sample(random);
            (k as f64, 7.0 + 0.2 * (noise + shift(k)), 0.04)
        };
        (0..n).map(reading).collect()
    }

    fn leaves(course: &Course) -> Option<usize> {
        course.points.iter().position(|point| (point.average - course.level).abs() > point.limit)
    }

    fn sums_up(course: &Course) -> Option<usize> {
        course.points.iter().position(|point| point.sum > ALARM)
    }

    #[test]
    fn a_part_that_stays_hardly_ever_leaves_its_limits_and_one_that_shifts_by_a_sigma_does_so_soon() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let (mut false_average, mut false_sum, mut soon) = (0, 0, 0);
        for _ in 0..400 {
            // The level is known well: that of a hundred readings before.
            let still = course(&drawn(120, |_| 0.0, &mut random), 0.0, 100);
            false_average += usize::from(leaves(&still).is_some());
            false_sum += usize::from(sums_up(&still).is_some());
            let moved = course(&drawn(130, |k| if k < 100 { 0.0 } else { 1.5 }, &mut random), 0.0, 100);
            let both = [leaves(&moved), sums_up(&moved)];
            soon += usize::from(both.iter().all(Option::is_some));
        }
        // The run lengths without a change are some 500 readings.
        assert!((20..200).contains(&false_average) && (20..200).contains(&false_sum), "{false_average} {false_sum}");
        assert!(soon > 380, "{soon}");
    }

    #[test]
    fn charts_are_in_the_unit_of_the_values_and_about_the_level_before_a_change() {
        let readings: Vec<(f64, f64, f64)> =
            (0..10).map(|k| (f64::from(k), if k < 5 { 1.0 } else { 3.0 }, 0.01)).collect();
        let own = course(&readings, 0.0, 5);
        assert!((own.level - 1.0).abs() < 1e-12);
        assert!(own.points[..5].iter().all(|point| (point.average - 1.0).abs() < 1e-12 && point.sum == 0.0));
        let last = own.points[9];
        assert!(last.average > 2.0 && last.average < 3.0 && last.sum > 90.0, "{last:?}");
        // λ/(2 − λ) = 1/9 in the long run: three standard deviations are one reading's error.
        assert!((last.limit - 0.1).abs() < 0.01, "{last:?}");
    }
}
