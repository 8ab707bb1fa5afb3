//! The page: words, picture, plots and tables in one file.

use antumbra_sun::{Groups, Instant, Spread, Study, Sums, SunKind, Total};
use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::super::picture;
use super::plot::{self, Bins, Day};
use crate::outputs::STUDY_PAGE_MARK;

const STYLE: &str = include_str!("page.css");

/// All that a page says.
pub(super) struct Page<'a> {
    pub(super) study: &'a Study,
    pub(super) sums: &'a Sums,
    /// Address of the picture, with its data, and its size.
    pub(super) picture: Option<(String, [u32; 2])>,
    /// Kind of the groups: object, material, or nothing for all sensors together.
    pub(super) by: &'static str,
    pub(super) groups: Groups,
    pub(super) totals: Vec<Total>,
    pub(super) days: Vec<Day>,
    pub(super) notes: &'a [String],
}

/// Returns the page.
pub(super) fn html(page: &Page<'_>) -> Markup {
    let about = &page.study.about;
    let (title, kind) = match about.kind {
        SunKind::Suns => ("Sun study", "suns"),
        SunKind::Sky => ("Sky study", "patches of the sky"),
    };
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="generator" content=(STUDY_PAGE_MARK);
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) ", " (about.source) }
                link rel="icon" href="data:,";
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (title) }
                p.soft {
                    (about.source) ": " (page.study.sensor_count()) " sensors, " (page.study.suns.len()) " " (kind) ". "
                    "Every answer is exact for its sensor; numbers are rounded."
                }
                @if let Some((address, [width, height])) = &page.picture {
                    figure {
                        img src=(address) width=(width) height=(height) alt="the scene in the colors of what its sensors have";
                        figcaption { "Each place has the color of the nearest sensor of its face. Grey faces have no sensors." }
                    }
                }
                (distribution(page))
                (table(page))
                @if !page.days.is_empty() {
                    h2 { "Course of a day" }
                    p.soft { "Share of the area of all sensors that the sun reaches." }
                    (plot::days(&page.days))
                }
                (settings(page))
            }
        }
    }
}

fn distribution(page: &Page<'_>) -> Markup {
    let areas = page.study.areas.as_deref();
    let of = |list: &[f64], unit: &str| {
        let bins = Bins::of(list, |place| areas.map_or(1.0, |areas| areas[place]));
        plot::bins(&bins, unit)
    };
    html! {
        @if let Some(shown) = picture::shown(page.sums) {
            h2 { "Distribution" }
            (of(shown.list, &shown.unit.join(" ")))
            @if let (Some(hours), Some(_)) = (&page.sums.hours, &page.sums.irradiation) {
                (of(hours, "hours of sun"))
            }
        }
    }
}

/// Numbers of a group in a column.
type Column = fn(&Total) -> Option<Spread>;

fn table(page: &Page<'_>) -> Markup {
    let columns: [(&str, Column); 6] = [
        ("hours of sun", |total| total.hours),
        ("direct kWh/m2", |total| total.irradiation),
        ("diffuse kWh/m2", |total| total.diffuse),
        ("sum of both", |total| total.total),
        ("visible sky", |total| total.sky_visible),
        ("sky view factor", |total| total.sky_view_factor),
    ];
    let is_there = |of: Column| page.totals.iter().any(|total| of(total).is_some());
    let columns: Vec<_> = columns
        .into_iter()
        .filter(|&(_, of)| is_there(of))
        .collect();
    let has_areas = page.study.areas.is_some();
    let rows = page.groups.names.iter().zip(&page.totals);
    html! {
        h2 { "Totals" @if !page.by.is_empty() { " by " (page.by) } }
        div.scroll {
            table {
                caption { "Means are weighted by area; areas are in the scene’s unit squared." }
                thead {
                    tr {
                        th { @if page.by.is_empty() { "sensors" } @else { (page.by) } }
                        th { "sensors" }
                        @if has_areas { th { "area" } }
                        @for (name, _) in &columns { th { (name) ", mean" } th { "least" } th { "most" } }
                    }
                }
                tbody {
                    @for (name, total) in rows {
                        tr {
                            td { (name) }
                            td { (total.sensors) }
                            @if has_areas { td { (format!("{:.2}", total.area)) } }
                            @for (_, of) in &columns {
                                @match of(total) {
                                    Some(spread) => {
                                        td { (format!("{:.3}", spread.mean)) }
                                        td { (format!("{:.3}", spread.least)) }
                                        td { (format!("{:.3}", spread.most)) }
                                    }
                                    None => { td {} td {} td {} }
                                }
                            }
                        }
                    }
                }
            }
        }
    }
}

fn settings(page: &Page<'_>) -> Markup {
    let study = page.study;
    let about = &study.about;
    let is_missing = |sun: &&antumbra_sun::Sun| sun.direct_normal.is_none();
    let missing = study.suns.iter().filter(is_missing).count();
    let instant = match about.instant {
        Instant::Start => "begin of each step",
        Instant::Middle => "middle of each step",
        Instant::End => "end of each step",
    };
    let mut rows: Vec<(&str, String)> = vec![("source", about.source.clone())];
    if let Some(at) = about.location {
        rows.push(("latitude", format!("{} degrees", at.latitude)));
        rows.push((
            "longitude",
            format!("{} degrees, east positive", at.longitude),
        ));
        let hours = f64::from(at.offset_minutes) / 60.0;
        rows.push((
            "clock",
            format!("{hours} hours ahead of UTC, no daylight saving"),
        ));
        rows.push(("moment of a sun", instant.to_owned()));
        let air = match about.refraction {
            Some(air) => format!("{} hPa, {} degrees Celsius", air.pressure, air.temperature),
            None => "none: geometric positions".to_owned(),
        };
        rows.push(("refraction", air));
    }
    rows.push((
        "true north",
        format!("{} degrees clockwise from the scene’s own", about.north),
    ));
    let [x, y, z] = about.up;
    rows.push(("up", format!("{x}, {y}, {z}")));
    rows.push(("sensors", study.sensor_count().to_string()));
    match about.kind {
        SunKind::Sky => rows.push(("patches of the sky", study.suns.len().to_string())),
        SunKind::Suns => {
            rows.push(("suns", study.suns.len().to_string()));
            rows.push(("suns below the horizon", about.below_horizon.to_string()));
        }
    }
    if let Some(degrees) = about.sun_diameter {
        rows.push(("diameter of the sun", format!("{degrees} degrees")));
    }
    if about.through_glass {
        rows.push(("see-through surfaces", "filter light".to_owned()));
    }
    if let Some(diffuse) = &about.diffuse {
        let of_sky = format!(
            "isotropic, {:.3} kWh/m2 on open level ground; view factors of {}; no light from the ground",
            diffuse.horizontal, diffuse.sky
        );
        rows.push(("light of the sky", of_sky));
    }
    if about.has_weather {
        rows.push(("suns without irradiance, counted as 0", missing.to_string()));
    }
    html! {
        h2 { "Settings and counts" }
        div.scroll {
            table { tbody { @for (name, value) in &rows { tr { th { (name) } td { (value) } } } } }
        }
        @if !page.notes.is_empty() {
            h2 { "Notes" }
            ul { @for note in page.notes { li { (note) } } }
        }
    }
}
