//! The figures as a page to look at, and as a summary in Markdown.
//!
//! In: figures, scenes. Out: `index.html`, which holds its pictures and plots and asks no network, and
//! `README.md` beside it.
//!
//! | module | what |
//! |---|---|
//! | `pictures` | each scene, and how its queries were decided, as JPEG in the page |
//! | `plot` | bars and lines as SVG |
//! | `findings` | where voxel occlusion wins and loses, in words |
//! | `proposals` | what the paper proposes beside its tables, a picture and a figure each |
//! | `page` | the page |

mod findings;
mod page;
mod pictures;
mod plot;
mod proposals;

use std::path::Path;

use super::figures::Figures;
use super::scenes::PaperScene;
use super::tables;
use antumbra_cli::failure::Failure;
use antumbra_cli::outputs::{self, Content, Outputs, SUMMARY_MARK};
use findings::Findings;
use pictures::ScenePictures;
use proposals::Proposal;

const PAGE: &str = "index.html";
const SUMMARY: &str = "README.md";

/// Makes the folder if it is not there, and adds the files to those that are written. A page or summary of somebody
/// else is refused.
pub(super) fn prepare(folder: &Path, outputs: &mut Outputs) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::system(format!("cannot make {}: {error}", folder.display())))?;
    outputs.add_made("--html", &folder.join(PAGE), Content::Page)?;
    outputs.add_made("--html", &folder.join(SUMMARY), Content::Summary)
}

/// Writes page and summary into a folder.
pub(super) fn write(
    folder: &Path,
    figures: &Figures,
    scenes: &[&PaperScene],
    size: [u32; 2],
) -> Result<(), Failure> {
    let pictures = scenes.iter().map(|scene| ScenePictures::take(scene, size));
    let pictures = pictures.collect::<Result<Vec<_>, _>>()?;
    let findings = Findings::of(figures);
    let proposals = proposals::all(size)?;
    let page = page::page(figures, &findings, &pictures, &proposals).into_string();
    outputs::write(&folder.join(PAGE), page.as_bytes())?;
    let summary = summary(figures, &findings, &proposals);
    outputs::write(&folder.join(SUMMARY), summary.as_bytes())
}

/// Returns the Markdown.
fn summary(figures: &Figures, findings: &Findings, proposals: &[Proposal]) -> String {
    let mut parts = vec![
        "# The paper's tables, measured again".to_owned(),
        format!(
            "{SUMMARY_MARK} paper --html docs/report`; the same with pictures and plots is in \
             [index.html](index.html).\n\n{}.\n",
            figures.head.text()
        ),
        "## What was found\n".to_owned(),
    ];
    let bullets = findings.all().map(|finding| format!("* {finding}"));
    parts.push(bullets.collect::<Vec<_>>().join("\n") + "\n");
    let tables = tables::all(figures)
        .into_iter()
        .chain(tables::sweeps(figures));
    parts.extend(tables.map(|table| table.markdown()));
    parts.push("## What the paper proposes\n".to_owned());
    let bullets = proposals
        .iter()
        .map(|it| format!("* **{}, {}.** {}", it.section, it.title, it.figure));
    parts.push(bullets.collect::<Vec<_>>().join("\n") + "\n");
    parts.join("\n")
}
