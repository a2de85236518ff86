//! How many rows a computation may look at, so that it takes about as long as it may: learned from how long it took.

use std::time::Duration;

/// Rows of one computation.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    rows: f64,
    fewest: f64,
    most: f64,
    target: Duration,
}

impl Budget {
    /// Begins with the fewest rows; never less than those, whatever they take, nor more than the most.
    #[must_use]
    pub fn new(fewest: usize, most: usize, target: Duration) -> Self {
        let (fewest, most) = (fewest as f64, most.max(fewest) as f64);
        Self { rows: fewest, fewest, most, target }
    }

    /// Rows of the next computation.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows as usize
    }

    /// So many rows took so long: half the way to what that tells.
    pub fn took(&mut self, rows: usize, took: Duration) {
        let told = rows as f64 * self.target.as_secs_f64() / took.as_secs_f64().max(1e-6);
        self.rows = (0.5 * (self.rows + told)).clamp(self.fewest, self.most);
    }
}

#[cfg(test)]
mod tests {
    use super::{Budget, Duration};

    #[test]
    fn rows_settle_where_they_take_the_time_that_there_is() {
        let mut budget = Budget::new(1000, 30_000, Duration::from_millis(150));
        for (us_per_row, settles_at) in [(15, 10_000), (1, 30_000), (1000, 1000)] {
            for _ in 0..40 {
                let rows = budget.rows();
                budget.took(rows, Duration::from_micros(us_per_row * rows as u64));
            }
            assert!(budget.rows().abs_diff(settles_at) < 10, "{} at {us_per_row} µs a row", budget.rows());
        }
    }
}
