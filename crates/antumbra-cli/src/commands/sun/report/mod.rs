//! The page about a study: a file that needs no other file and no network.
//!
//! In: a study, its sums, and the scene where it was asked. Out: `index.html` in a folder.
//!
//! | module | what |
//! |---|---|
//! | `plot` | distribution and days as SVG |
//! | `page` | the page |

mod page;
mod plot;

use std::path::{Path, PathBuf};

use antumbra_render::film::Picture;
use antumbra_render::image_file::png_bytes;
use antumbra_sun::{Study, Sums, SunKind, sunlit_shares, totals};
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;

use super::groups;
use super::picture::Looked;
use crate::failure::Failure;
use crate::outputs::{self, Content, Outputs};
use page::Page;
use plot::Day;

/// Days that are shown: equinox and solstices, by month and day.
const DAYS: [(u32, u32); 3] = [(3, 20), (6, 21), (12, 21)];

fn file_of(folder: &Path) -> PathBuf {
    folder.join("index.html")
}

/// Makes the folder, unless it is there, and adds the page to the files that are written. A page of somebody else is
/// refused.
pub(super) fn prepare(folder: &Path, outputs: &mut Outputs) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|error| Failure::system(format!("cannot make {}: {error}", folder.display())))?;
    outputs.add_made("--report", &file_of(folder), Content::StudyPage)
}

/// Writes the page.
pub(super) fn write(
    folder: &Path,
    study: &Study,
    sums: &Sums,
    looked: Option<&Looked>,
    picture: Option<&Picture>,
) -> Result<(), Failure> {
    let file = file_of(folder);
    let picture = picture
        .map(|picture| {
            let bytes =
                png_bytes(picture, 0.0).map_err(|error| outputs::unwritable(&file, error))?;
            let address = format!("data:image/png;base64,{}", STANDARD.encode(bytes));
            Ok::<_, Failure>((address, picture.size))
        })
        .transpose()?;
    let (by, groups) = groups::of(study, looked);
    let page = Page {
        study,
        sums,
        picture,
        by,
        totals: totals(study, sums, &groups),
        days: days(study),
        groups,
        notes: looked.map_or(&[], |looked| &looked.notes),
    };
    outputs::write(&file, page::html(&page).into_string().as_bytes())
}

/// Returns the sunlit shares of the whole area on the days that the study has of [`DAYS`]; on its first day if it has none.
fn days(study: &Study) -> Vec<Day> {
    let times: Option<Vec<_>> = study.suns.iter().map(|sun| sun.time).collect();
    let Some(times) = times.filter(|_| study.about.kind == SunKind::Suns) else {
        return Vec::new();
    };
    let is_of = |date: (u32, u32)| {
        times
            .iter()
            .position(|time| (time.date().1, time.date().2) == date)
    };
    let mut firsts: Vec<usize> = DAYS.into_iter().filter_map(is_of).collect();
    if firsts.is_empty() && !times.is_empty() {
        firsts.push(0);
    }
    let all = groups::whole(study);
    let day = |begin: usize| {
        // Suns of a day follow each other; months of a typical year are of different years.
        let first = times[begin];
        let is_same = |time: &antumbra_sun::Time| time.day() == first.day();
        let count = times[begin..]
            .iter()
            .take_while(|time| is_same(time))
            .count();
        let end = begin + count;
        let shares = sunlit_shares(study, &all, begin..end);
        let hours = times[begin..end]
            .iter()
            .map(|time| time.second() as f64 / 3600.0);
        let (year, month, day) = first.date();
        Day {
            name: format!("{year:04}-{month:02}-{day:02}"),
            points: hours
                .zip(shares)
                .map(|(hour, share)| [hour, share])
                .collect(),
        }
    };
    firsts.into_iter().map(day).collect()
}
