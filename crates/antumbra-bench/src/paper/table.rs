//! A table that can be printed, be written as Markdown, and be set as HTML.

use maud::{Markup, html};

/// A heading, notes, columns and rows of text.
pub(super) struct Table {
    pub(super) title: &'static str,
    /// What the columns are.
    pub(super) caption: String,
    pub(super) columns: Vec<String>,
    pub(super) rows: Vec<Vec<Cell>>,
}

/// One cell.
#[derive(Clone)]
pub(super) struct Cell {
    pub(super) text: String,
    pub(super) tone: Tone,
}

/// How a cell stands out.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Tone {
    Plain,
    /// From the paper, not measured here.
    Quoted,
    /// Better than plain traversal, or an aim that is met.
    Good,
    /// Worse, or missed.
    Bad,
}

impl Cell {
    pub(super) fn toned(text: impl Into<String>, tone: Tone) -> Self {
        let text = text.into();
        Self { text, tone }
    }

    pub(super) fn quoted(text: impl Into<String>) -> Self {
        Self::toned(text, Tone::Quoted)
    }
}

impl<T: Into<String>> From<T> for Cell {
    fn from(text: T) -> Self {
        Self::toned(text, Tone::Plain)
    }
}

impl Table {
    /// Returns lines with aligned columns, the first to the left.
    pub(super) fn text(&self) -> String {
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            let widths = cells.map(|cell| cell.text.chars().count());
            let head = self.columns[column].chars().count();
            widths.max().unwrap_or(0).max(head)
        };
        let widths: Vec<usize> = (0..self.columns.len()).map(width).collect();
        let line = |cells: Vec<&str>| {
            let padded = cells.iter().zip(&widths).enumerate();
            let padded = padded.map(|(column, (text, &width))| match column {
                0 => format!("{text:<width$}"),
                _ => format!("{text:>width$}"),
            });
            padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
        };
        let head = line(self.columns.iter().map(String::as_str).collect());
        let rows = self
            .rows
            .iter()
            .map(|row| line(row.iter().map(|cell| cell.text.as_str()).collect()));
        let lines: Vec<String> = [format!("\n{}", self.title), head]
            .into_iter()
            .chain(rows)
            .collect();
        lines.join("\n")
    }

    /// Returns the table as Markdown, with heading and caption.
    pub(super) fn markdown(&self) -> String {
        let line = |cells: &mut dyn Iterator<Item = String>| {
            format!("| {} |", cells.collect::<Vec<_>>().join(" | "))
        };
        let cell = |cell: &Cell| match cell.tone {
            Tone::Bad => format!("**{}**", cell.text),
            Tone::Quoted if !cell.text.is_empty() => format!("*{}*", cell.text),
            Tone::Plain | Tone::Good | Tone::Quoted => cell.text.clone(),
        };
        let mut lines = vec![
            format!("## {}", self.title),
            String::new(),
            self.caption.clone(),
            String::new(),
            line(&mut self.columns.iter().cloned()),
            line(
                &mut self
                    .columns
                    .iter()
                    .enumerate()
                    .map(|(column, _)| if column == 0 { "---" } else { "---:" }.to_owned()),
            ),
        ];
        lines.extend(self.rows.iter().map(|row| line(&mut row.iter().map(cell))));
        lines.push(String::new());
        lines.join("\n")
    }

    /// Returns the table as HTML.
    pub(super) fn html(&self) -> Markup {
        let class = |cell: &Cell| match cell.tone {
            Tone::Plain => None,
            Tone::Quoted => Some("quoted"),
            Tone::Good => Some("good"),
            Tone::Bad => Some("bad"),
        };
        html! {
            h3 { (self.title) }
            p.caption { (self.caption) }
            div.wide {
                table {
                    thead { tr { @for column in &self.columns { th scope="col" { (column) } } } }
                    tbody {
                        @for row in &self.rows {
                            tr {
                                @for (column, cell) in row.iter().enumerate() {
                                    @if column == 0 { th scope="row" { (cell.text) } }
                                    @else { td class=[class(cell)] { (cell.text) } }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_table_in_three_forms() {
        let table = Table {
            title: "Times",
            caption: "Seconds & more.".into(),
            columns: ["scene", "s"].map(String::from).into(),
            rows: vec![vec!["bars <3".into(), Cell::toned("10.5", Tone::Bad)]],
        };
        assert_eq!(table.text(), "\nTimes\nscene       s\nbars <3  10.5");
        assert!(table.markdown().contains("| bars <3 | **10.5** |"));
        let html = table.html().into_string();
        assert!(html.contains("Seconds &amp; more."), "{html}");
        assert!(html.contains(r#"<td class="bad">10.5</td>"#), "{html}");
        assert!(html.contains("bars &lt;3"), "{html}");
    }
}
