//! A [`Report`] as one HTML file.

use std::fmt::Write;

use super::escape::escape;
use super::plot::{classes, stroke_class};
use super::{Block, Fact, Plot, Report, Section, Table};

/// The style sheet, light and dark.
pub(super) const STYLE: &str = include_str!("style.css");

/// Cursor and zoom of the plots.
const SCRIPT: &str = include_str!("interact.js");

pub(super) fn page(report: &Report) -> String {
    let title = escape(&report.title);
    let mut text = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n<header>\n<h1>{title}</h1>\n"
    );
    // Writing to a String cannot fail, here and below.
    if !report.lead.is_empty() {
        let _ = writeln!(text, "<p class=\"lead\">{}</p>", prose(&report.lead));
    }
    if !report.next.is_empty() {
        // A command line stands as it is typed.
        let next = if report.next.starts_with("sinew") {
            format!("<code>{}</code>", escape(&report.next))
        } else {
            prose(&report.next)
        };
        let _ = writeln!(text, "<p class=\"next\"><strong>Next:</strong> {next}</p>");
    }
    push_facts(&mut text, &report.facts);
    text.push_str("</header>\n");
    for section in &report.sections {
        push_section(&mut text, section);
    }
    if !report.footer.is_empty() {
        let _ = writeln!(text, "<footer>{}</footer>", escape(&report.footer));
    }
    text.push_str("</main>\n");
    let mut blocks = report.sections.iter().flat_map(|section| &section.blocks);
    if blocks.any(|block| matches!(block, Block::Plot(_))) {
        let _ = write!(text, "<script>\n{SCRIPT}</script>\n");
    }
    text.push_str("</body>\n</html>\n");
    text
}

/// Escaped, and what stands between two backticks as code.
fn prose(text: &str) -> String {
    let parts: Vec<&str> = text.split('`').collect();
    // A single backtick is one.
    if parts.len().is_multiple_of(2) {
        return escape(text);
    }
    let parts = parts.into_iter().enumerate().map(|(index, part)| {
        let part = escape(part);
        if index % 2 == 1 {
            format!("<code>{part}</code>")
        } else {
            part
        }
    });
    parts.collect()
}

fn push_section(text: &mut String, section: &Section) {
    let _ = writeln!(text, "<section>\n<h2>{}</h2>", escape(&section.title));
    for block in &section.blocks {
        match block {
            Block::Text(paragraphs) => {
                for paragraph in paragraphs
                    .split("\n\n")
                    .filter(|paragraph| !paragraph.trim().is_empty())
                {
                    let _ = writeln!(text, "<p>{}</p>", prose(paragraph.trim()));
                }
            }
            Block::Notice(notice) => {
                let _ = writeln!(text, "<p class=\"notice\">{}</p>", prose(notice));
            }
            Block::Code(code) => {
                let _ = writeln!(text, "<pre><code>{}</code></pre>", escape(code));
            }
            Block::Table(table) => push_table(text, table),
            Block::Plot(plot) => push_plot(text, plot),
            Block::Facts(facts) => push_facts(text, facts),
            Block::Html(html) => text.push_str(html),
        }
    }
    text.push_str("</section>\n");
}

fn push_facts(text: &mut String, facts: &[Fact]) {
    if facts.is_empty() {
        return;
    }
    text.push_str("<dl class=\"facts\">\n");
    for fact in facts {
        let _ = write!(
            text,
            "<div><dt>{}</dt><dd>{}</dd>",
            escape(&fact.label),
            escape(&fact.value)
        );
        if !fact.note.is_empty() {
            let _ = write!(text, "<dd class=\"note\">{}</dd>", escape(&fact.note));
        }
        text.push_str("</div>\n");
    }
    text.push_str("</dl>\n");
}

fn push_table(text: &mut String, table: &Table) {
    text.push_str("<div class=\"wide\"><table>\n");
    if !table.caption.is_empty() {
        let _ = writeln!(text, "<caption>{}</caption>", escape(&table.caption));
    }
    let class = |numeric: bool| if numeric { " class=\"number\"" } else { "" };
    text.push_str("<thead><tr>");
    for column in &table.columns {
        let _ = write!(
            text,
            "<th scope=\"col\"{}>{}</th>",
            class(column.numeric),
            escape(&column.title)
        );
    }
    text.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        text.push_str("<tr>");
        for (index, column) in table.columns.iter().enumerate() {
            let cell = row.get(index).map_or("", String::as_str);
            let _ = write!(text, "<td{}>{}</td>", class(column.numeric), escape(cell));
        }
        text.push_str("</tr>\n");
    }
    text.push_str("</tbody>\n</table></div>\n");
}

fn push_plot(text: &mut String, plot: &Plot) {
    let _ = writeln!(
        text,
        "<figure>\n<figcaption><strong>{}</strong>",
        escape(&plot.title)
    );
    for (series, tone) in plot.series.iter().zip(classes(plot)) {
        if series.name.is_empty() {
            continue;
        }
        let stroke = stroke_class(series.stroke);
        let sample = if stroke == "points" {
            "M4 6h0M12 6h0M20 6h0"
        } else {
            "M0 6H24"
        };
        let _ = writeln!(
            text,
            "<span class=\"key\"><svg viewBox=\"0 0 24 12\" aria-hidden=\"true\">\
             <path class=\"series {tone} {stroke}\" d=\"{sample}\"/></svg>{}</span>",
            escape(&series.name)
        );
    }
    text.push_str("</figcaption>\n");
    text.push_str(&plot.to_svg());
    text.push_str("</figure>\n");
}
