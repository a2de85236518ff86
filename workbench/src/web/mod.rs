//! Scripts and styles that the report's page, the dashboard and the guide share.

/// Charts, on uPlot.
pub const CHARTS: &str = include_str!("charts.js");
/// Parts of a page: tables, tiles, sentences.
pub const PARTS: &str = include_str!("parts.js");
/// What is drawn while something runs.
pub const LIVE: &str = include_str!("live.js");
/// The report's page.
pub const REPORT: &str = include_str!("report.js");
/// How the pages look.
pub const STYLE: &str = include_str!("style.css");
/// The library that draws charts.
pub const UPLOT: &str = include_str!("uplot/uPlot.iife.min.js");
/// Its styles.
pub const UPLOT_STYLE: &str = include_str!("uplot/uPlot.min.css");
/// Its licence.
pub const UPLOT_LICENCE: &str = include_str!("uplot/LICENSE");
