//! Figures as SVG: panels above each other over one x axis, lines with a legend, units at every axis.
//!
//! Light background, so that a figure can be printed or put into a document as it is.

use plotters::{
    chart::{ChartBuilder, SeriesLabelPosition},
    element::{Circle, PathElement},
    prelude::{BLACK, Color, IntoDrawingArea, IntoFont, RGBColor, SVGBackend, ShapeStyle, TRANSPARENT, WHITE},
    series::LineSeries,
};
use std::ops::Range;
use thiserror::Error;

/// A figure could not be drawn.
#[derive(Debug, Error)]
#[error("figure '{title}' cannot be drawn: {why}")]
pub struct PlotError {
    title: String,
    why: String,
}

/// Panels over one x axis.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Above it all.
    pub title: String,
    /// Name and unit of the x axis.
    pub x: String,
    /// From the top.
    pub panels: Vec<Panel>,
}

/// One pair of axes.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Name and unit of the y axis.
    pub y: String,
    /// Whether y is drawn over its logarithm.
    pub logarithmic: bool,
    /// What is drawn, the later above the earlier.
    pub series: Vec<Series>,
}

/// One line of a panel.
#[derive(Clone, Debug)]
pub struct Series {
    /// In the legend.
    pub label: String,
    /// Out of [`Colour`].
    pub colour: Colour,
    /// How it is drawn.
    pub mark: Mark,
    /// (x, y); a point that is not finite is left out.
    pub points: Vec<(f64, f64)>,
}

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// A thin line, for noise.
    Thin,
    /// A line.
    Line,
    /// A wide line that shows under another.
    Wide,
    /// A line with a dot at each point.
    Dotted,
}

/// Colours that people with colour-blindness can tell apart (Okabe and Ito).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Colour {
    /// The reference, where it lies under something.
    Grey,
    /// The reference.
    Black,
    /// The reading.
    Sky,
    /// The answer.
    Vermilion,
    /// Its rival.
    Blue,
    /// Another.
    Green,
}

impl Colour {
    fn rgb(self) -> RGBColor {
        match self {
            Self::Grey => RGBColor(190, 190, 190),
            Self::Black => RGBColor(60, 60, 60),
            Self::Sky => RGBColor(86, 180, 233),
            Self::Vermilion => RGBColor(213, 94, 0),
            Self::Blue => RGBColor(0, 90, 170),
            Self::Green => RGBColor(0, 140, 100),
        }
    }
}

/// Width of a figure, px.
const WIDTH: u32 = 920;
/// Height of one panel, px.
const PANEL: u32 = 300;
/// Height of the title, px.
const TITLE: u32 = 44;
const FONT: &str = "system-ui, sans-serif";

/// Draws a figure.
///
/// # Errors
/// A panel without any finite point.
pub fn svg(figure: &Figure) -> Result<String, PlotError> {
    let failed = |why: String| PlotError { title: figure.title.clone(), why };
    let mut text = String::new();
    {
        let height = TITLE + PANEL * figure.panels.len() as u32 + 20;
        let root = SVGBackend::with_string(&mut text, (WIDTH, height)).into_drawing_area();
        root.fill(&WHITE).map_err(|e| failed(e.to_string()))?;
        let body = root.titled(&figure.title, (FONT, 19).into_font()).map_err(|e| failed(e.to_string()))?;
        let x_range =
            span(figure.panels.iter().flat_map(|p| &p.series).flat_map(|s| s.points.iter().map(|p| p.0)), 0.0)
                .ok_or_else(|| failed("it has no point".into()))?;
        let areas = body.split_evenly((figure.panels.len(), 1));
        for (k, (panel, area)) in figure.panels.iter().zip(&areas).enumerate() {
            let x = if k + 1 == figure.panels.len() { figure.x.as_str() } else { "" };
            draw(panel, x, x_range.clone(), area).map_err(&failed)?;
        }
        root.present().map_err(|e| failed(e.to_string()))?;
    }
    Ok(text)
}

type Area<'a> = plotters::drawing::DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw(panel: &Panel, x: &str, x_range: Range<f64>, area: &Area<'_>) -> Result<(), String> {
    let value = |y: f64| if panel.logarithmic { y.log10() } else { y };
    let finite = |s: &Series| -> Vec<(f64, f64)> {
        s.points.iter().map(|&(x, y)| (x, value(y))).filter(|p| p.0.is_finite() && p.1.is_finite()).collect()
    };
    let all: Vec<f64> = panel.series.iter().flat_map(|s| finite(s).into_iter().map(|p| p.1)).collect();
    // Room for the legend above the lines.
    let y_range = span(all.into_iter(), 0.06).ok_or("a panel has no point")?;
    let legend = 0.04 + 0.09 * panel.series.len() as f64;
    let y_range = y_range.start..y_range.end + legend * (y_range.end - y_range.start);
    // Whole numbers (iterations) get a tick each.
    let whole = x_range.end <= 20.0 && panel.series.iter().flat_map(|s| &s.points).all(|p| p.0.fract() == 0.0);
    let x_ticks = if whole { (x_range.end - x_range.start) as usize + 1 } else { 12 };
    let ticks = |v: f64| if panel.logarithmic { number(10_f64.powf(v)) } else { number(v) };
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .margin_right(24)
        .x_label_area_size(if x.is_empty() { 26 } else { 46 })
        .y_label_area_size(76)
        .build_cartesian_2d(x_range, y_range)
        .map_err(|e| e.to_string())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .x_desc(x)
        .y_desc(panel.y.as_str())
        .x_labels(x_ticks)
        .y_labels(7)
        .x_label_formatter(&|v| number(*v))
        .y_label_formatter(&|v| ticks(*v))
        .label_style((FONT, 14))
        .axis_desc_style((FONT, 15))
        .draw()
        .map_err(|e| e.to_string())?;
    for series in &panel.series {
        let colour = series.colour.rgb();
        let style = match series.mark {
            Mark::Thin => ShapeStyle::from(&colour).stroke_width(1),
            Mark::Wide => ShapeStyle::from(&colour).stroke_width(5),
            Mark::Line | Mark::Dotted => ShapeStyle::from(&colour).stroke_width(2),
        };
        let points = finite(series);
        chart
            .draw_series(LineSeries::new(points.iter().copied(), style))
            .map_err(|e| e.to_string())?
            .label(series.label.as_str())
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 22, y)], colour.stroke_width(3)));
        if series.mark == Mark::Dotted {
            chart
                .draw_series(points.into_iter().map(|p| Circle::new(p, 4, colour.filled())))
                .map_err(|e| e.to_string())?;
        }
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .legend_area_size(30)
        .background_style(WHITE.mix(0.85))
        .border_style(BLACK.mix(0.15))
        .label_font((FONT, 14))
        .draw()
        .map_err(|e| e.to_string())
}

/// From the least to the largest finite value, widened by a share on either side.
fn span(values: impl Iterator<Item = f64>, share: f64) -> Option<Range<f64>> {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return None;
    }
    let room = if high > low { share * (high - low) } else { 0.5 * high.abs().max(1e-3) };
    Some(low - room..high + room)
}

/// A number at an axis: as many digits as it needs.
fn number(v: f64) -> String {
    let size = v.abs();
    if size < 1e-12 {
        "0".into()
    } else if !(1e-3..1e5).contains(&size) {
        format!("{v:.1e}").replace('-', "−")
    } else {
        let digits = (2.0 - size.log10().floor()).clamp(0.0, 5.0) as usize;
        let text = format!("{v:.digits$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        text.replace('-', "−")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure(points: Vec<(f64, f64)>) -> Figure {
        let series = Series { label: "a < b".into(), colour: Colour::Blue, mark: Mark::Dotted, points };
        let panel = Panel { y: "angle, °".into(), logarithmic: false, series: vec![series] };
        Figure { title: "A figure".into(), x: "time, s".into(), panels: vec![panel] }
    }

    #[test]
    fn a_figure_holds_its_title_axes_and_legend_and_escapes_them() {
        let text = svg(&figure(vec![(0.0, 1.0), (1.0, 2.0), (2.0, f64::NAN)])).unwrap();
        for part in ["<svg", "A figure", "time, s", "angle, °", "a &lt; b", "<polyline", "<circle"] {
            assert!(text.contains(part), "{part}");
        }
        assert!(!text.contains("NaN"));
    }

    #[test]
    fn a_figure_without_points_is_an_error_that_names_it() {
        let error = svg(&figure(vec![(f64::NAN, 1.0)])).unwrap_err().to_string();
        assert!(error.contains("A figure"), "{error}");
    }

    #[test]
    fn numbers_at_the_axes_have_the_digits_they_need() {
        assert_eq!(
            ["0", "−0.5", "150", "12.5", "2.16"].map(String::from),
            [0.0, -0.5, 150.0, 12.5, 2.156].map(number).map(|t| t)
        );
    }
}
