//! One self-contained page: styles, scripts and data inside, nothing fetched. It works from disk, offline.

use super::{terminal::Terminal, text, view::Page};
use crate::web;

const PAGE: &str = include_str!("page.html");
const STYLES: [&str; 2] = [web::UPLOT_STYLE, web::STYLE];
const SCRIPTS: [&str; 4] = [web::UPLOT, web::CHARTS, web::PARTS, web::REPORT];

/// The whole page.
pub(super) fn render(page: &Page) -> String {
    // serde_json can't fail on these types; `<` is escaped so that no text of the log can end the script element.
    let data = serde_json::to_string(page).unwrap_or_else(|_| "null".into()).replace('<', "\\u003c");
    let parts = [
        ("title", escaped(&format!("{}: {}", page.title, page.log))),
        ("styles", STYLES.join("\n")),
        ("heading", escaped(&page.title)),
        ("log", escaped(&page.log)),
        ("about", escaped(&page.about.join(" · "))),
        ("words", escaped(&text::render(page, Terminal::PLAIN))),
        ("data", data),
        ("licence", web::UPLOT_LICENCE.replace("--", "–")),
        ("scripts", SCRIPTS.join("\n")),
    ];
    // One pass, so that a value which holds another's marker stays text.
    let mut html = String::with_capacity(PAGE.len() + parts.iter().map(|p| p.1.len()).sum::<usize>());
    let mut rest = PAGE;
    while let Some((before, marked)) = rest.split_once("{{") {
        html.push_str(before);
        let (name, after) = marked.split_once("}}").unwrap_or((marked, ""));
        html.push_str(parts.iter().find(|p| p.0 == name).map_or("", |p| &p.1));
        rest = after;
    }
    html.push_str(rest);
    html
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
