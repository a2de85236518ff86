//! The confusion matrix, as text and as a picture.

use crate::table::Table;
use plotters::{
    backend::SVGBackend,
    drawing::IntoDrawingArea,
    element::{Rectangle, Text},
    style::{
        BLACK, Color, FontTransform, IntoFont, RGBColor, WHITE,
        text_anchor::{HPos, Pos, VPos},
    },
};
use std::{error::Error, path::Path};

/// Counts: rows hidden, columns named.
pub struct Matrix {
    rows: Vec<String>,
    columns: Vec<String>,
    counts: Vec<Vec<usize>>,
}

impl Matrix {
    /// All zero.
    pub fn new(rows: &[&str], columns: &[&str]) -> Self {
        let own = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        Self { rows: own(rows), columns: own(columns), counts: vec![vec![0; columns.len()]; rows.len()] }
    }

    /// Counts one log.
    pub fn add(&mut self, row: usize, column: usize) {
        self.counts[row][column] += 1;
    }

    /// What each effect was called, most frequent first.
    pub fn print(&self) {
        let mut table = Table::new(&["hidden", "logs", "named"]);
        for (row, counts) in self.rows.iter().zip(&self.counts) {
            let mut named: Vec<(usize, &str)> =
                counts.iter().zip(&self.columns).filter(|(n, _)| **n > 0).map(|(&n, c)| (n, c.as_str())).collect();
            named.sort_by_key(|&(n, _)| std::cmp::Reverse(n));
            let all: usize = counts.iter().sum();
            if all > 0 {
                let named: Vec<String> = named.iter().map(|(n, name)| format!("{name} × {n}")).collect();
                table.row([row.clone(), all.to_string(), named.join(", ")]);
            }
        }
        table.print();
    }
}

/// Side of a cell, pixels.
const CELL: i32 = 26;
/// Room for the names.
const MARGIN: i32 = 190;
/// What is right.
const RIGHT: RGBColor = RGBColor(120, 190, 140);
/// What names the right one among others, or nothing.
const HALF: RGBColor = RGBColor(240, 200, 110);
/// What is wrong.
const WRONG: RGBColor = RGBColor(235, 130, 115);

/// Draws it: the more logs of its row a cell has, the fuller its colour.
pub fn draw(matrix: &Matrix, path: &Path) -> Result<(), Box<dyn Error>> {
    let (rows, columns) = (i32::try_from(matrix.rows.len())?, i32::try_from(matrix.columns.len())?);
    let size = (MARGIN + CELL * columns + 20, MARGIN + CELL * rows + 50);
    let area = SVGBackend::new(path, (u32::try_from(size.0)?, u32::try_from(size.1)?)).into_drawing_area();
    area.fill(&WHITE)?;
    let font = ("sans-serif", 13).into_font();
    let right = font.clone().color(&BLACK).pos(Pos::new(HPos::Right, VPos::Center));
    let centre = font.clone().color(&BLACK).pos(Pos::new(HPos::Center, VPos::Center));
    let upright = font.transform(FontTransform::Rotate270).color(&BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    for (j, name) in (0..).zip(&matrix.columns) {
        area.draw(&Text::new(name.as_str(), (MARGIN + CELL * j + CELL / 2, MARGIN - 8), upright.clone()))?;
    }
    for (i, (name, counts)) in (0..).zip(matrix.rows.iter().zip(&matrix.counts)) {
        let top = MARGIN + CELL * i;
        area.draw(&Text::new(name.as_str(), (MARGIN - 8, top + CELL / 2), right.clone()))?;
        let all = counts.iter().sum::<usize>().max(1);
        for (j, &count) in (0..).zip(counts) {
            let left = MARGIN + CELL * j;
            let corners = [(left, top), (left + CELL, top + CELL)];
            let colour = match j {
                _ if i == j => RIGHT,
                _ if (rows..rows + 2).contains(&j) => HALF,
                _ => WRONG,
            };
            let fullness = if count == 0 { 0.0 } else { 0.25 + 0.75 * count as f64 / all as f64 };
            area.draw(&Rectangle::new(corners, colour.mix(fullness).filled()))?;
            area.draw(&Rectangle::new(corners, RGBColor(220, 220, 220).stroke_width(1)))?;
            if count > 0 {
                area.draw(&Text::new(count.to_string(), (left + CELL / 2, top + CELL / 2), centre.clone()))?;
            }
        }
    }
    let below = MARGIN + CELL * rows + 24;
    area.draw(&Text::new("rows: hidden, columns: named, cells: logs", (MARGIN + CELL * columns / 2, below), centre))?;
    area.present()?;
    Ok(())
}
