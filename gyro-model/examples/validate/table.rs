//! Results as Markdown, and the bounds of a share.

/// A table with a head.
pub struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    /// No row yet.
    pub fn new(head: &[&str]) -> Self {
        Self { rows: vec![head.iter().map(|&cell| cell.to_owned()).collect()] }
    }

    /// Appends a row.
    pub fn row(&mut self, cells: impl IntoIterator<Item = String>) {
        self.rows.push(cells.into_iter().collect());
    }

    /// Writes it to standard output.
    pub fn print(&self) {
        for (k, row) in self.rows.iter().enumerate() {
            println!("| {} |", row.join(" | "));
            if k == 0 {
                println!("|{}", " --- |".repeat(row.len()));
            }
        }
        println!();
    }
}

/// So many of so many, in words and per cent.
pub fn share(part: usize, all: usize) -> String {
    let percent = 100.0 * part as f64 / all.max(1) as f64;
    format!("{part} of {all} ({percent:.1} %)")
}

/// Upper end of Wilson's 95 % interval of a share.
pub fn wilson_upper(part: usize, all: usize) -> f64 {
    const Z: f64 = 1.959_964;
    let (n, p) = (all as f64, part as f64 / all as f64);
    let spread = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    (p + Z * Z / (2.0 * n) + spread) / (1.0 + Z * Z / n)
}

/// Three digits, `–` where there is no value.
pub fn number(value: Option<f64>) -> String {
    match value {
        None => "–".to_owned(),
        Some(v) if v.is_infinite() => "not found".to_owned(),
        Some(v) if v == 0.0 || (1e-2..1e3).contains(&v.abs()) => {
            let digits = (2 - v.abs().max(1e-9).log10().floor() as i32).clamp(0, 4);
            format!("{v:.*}", digits as usize)
        }
        Some(v) => format!("{v:.2e}"),
    }
}

/// The median, of an even count the geometric mean of the middle two; `None` where there is nothing.
pub fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    (n > 0).then(|| if n % 2 == 1 { values[n / 2] } else { (values[n / 2 - 1] * values[n / 2]).sqrt() })
}
