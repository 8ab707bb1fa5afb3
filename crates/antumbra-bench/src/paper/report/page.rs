//! The page: words, pictures, plots and tables in one file.

use maud::{DOCTYPE, Markup, PreEscaped, html};

use antumbra_cli::outputs::PAGE_MARK;

use super::super::figures::{Figures, SceneFigures, Sweep};
use super::super::table::Table;
use super::super::tables::{self, percent};
use super::super::{GRID, METHODS, VOXEL, VOXEL_1990};
use super::findings::Findings;
use super::pictures::ScenePictures;
use super::plot::{self, Bar, Group, Line};
use super::proposals::Proposal;

const STYLE: &str = include_str!("page.css");
const SCRIPT: &str = include_str!("page.js");

/// Returns the page.
pub(super) fn page(
    figures: &Figures,
    findings: &Findings,
    pictures: &[ScenePictures],
    proposals: &[Proposal],
) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                meta name="generator" content={ (PAGE_MARK) " paper" };
                title { "Voxel occlusion testing, measured again" }
                link rel="icon" href="data:,";
                style { (PreEscaped(STYLE)) }
            }
            body {
                header {
                    p.kicker { "antumbra" }
                    h1 { "Voxel occlusion testing, measured again" }
                    p.lead {
                        "In 1990 Andrew Woo and John Amanatides proposed to keep two bits for each light in each \
                         voxel of a ray tracer’s grid: lit, in shadow, or not known. This page rebuilds the two \
                         tables of their paper, beside the method that grew from it and the rivals that they \
                         argued against. All methods give the same picture, byte for byte; only the work differs."
                    }
                    p.head { (figures.head.text()) "." }
                }
                main {
                    section {
                        h2 { "What was found" }
                        div.findings {
                            (finding_list("Where it wins", &findings.wins))
                            (finding_list("Where it loses", &findings.losses))
                            (finding_list("To be known", &findings.notes))
                        }
                    }
                    section {
                        h2 { "The scenes" }
                        p {
                            "Tetra and Flakes are those of the Standard Procedural Databases. The others are lost; \
                             these have their counts of objects, lights and voxels. Move the slider: to the right \
                             of it colors say how shadow queries were decided."
                        }
                        (legend())
                        div.cards { @for scene in pictures { (card(scene, figures)) } }
                    }
                    section {
                        h2 { "Time" }
                        p {
                            "Seconds on one core, each scene on its own scale. Grey is what the picture costs \
                             without any light: no shadow method can go below."
                        }
                        (time_legend())
                        (plot::bars(&time_groups(&figures.scenes), None, "Time of each method on each scene"))
                        @for table in tables::all(figures).iter().take(1) { (table.html()) }
                    }
                    section {
                        h2 { "What the paper proposes" }
                        p { "Sections that the paper leaves to others to try, each with a picture by voxel-1990." }
                        div.cards { @for proposal in proposals { (proposal_card(proposal)) } }
                    }
                    section {
                        h2 { "Knowledge" }
                        p {
                            "Share of the shadow queries that are answered without a shadow ray. For voxel \
                             with all values made before."
                        }
                        (plot::bars(&known_groups(&figures.scenes), Some(1.0), "Known share of each method"))
                        @for table in tables::all(figures).iter().skip(1) { (table.html()) }
                    }
                    @if !figures.sweeps.is_empty() { (sweep_section(figures)) }
                    section {
                        h2 { "How it was measured" }
                        (how(figures))
                    }
                }
                footer { "Made by " code { "antumbra-bench paper --html docs/report" } "." }
                script { (PreEscaped(SCRIPT)) }
            }
        }
    }
}

fn finding_list(title: &str, all: &[String]) -> Markup {
    html! {
        div {
            h3 { (title) }
            @if all.is_empty() { p { "Nothing." } }
            @else { ul { @for finding in all { li { (finding) } } } }
        }
    }
}

/// The colors of decisions.
fn legend() -> Markup {
    let entries = [
        ("first-pass", "by the start’s voxel"),
        ("intermediate", "by a voxel on the way"),
        ("list", "by a list of few blockers"),
        ("ray", "by a ray"),
        ("away", "faces away: not asked"),
    ];
    html! {
        ul.legend {
            @for (class, text) in entries { li { span.swatch.(class) {} (text) } }
            li { "darker: in shadow" }
        }
    }
}

fn time_legend() -> Markup {
    html! {
        ul.legend {
            li { span.swatch.dark {} "without lights" }
            li { span.swatch.preparing {} "preparing" }
            li { span.swatch.shadows {} "shadows" }
        }
    }
}

/// One scene: its pictures under a slider, and what is in it.
fn proposal_card(proposal: &Proposal) -> Markup {
    let [width, height] = proposal.size;
    let title = format!("{}, {}", proposal.section, proposal.title);
    html! {
        figure.card {
            img src=(proposal.picture) width=(width) height=(height) alt=(title);
            figcaption {
                h3 { (title) }
                p { (proposal.figure) }
            }
        }
    }
}

fn card(pictures: &ScenePictures, figures: &Figures) -> Markup {
    let [width, height] = pictures.size;
    let name = pictures.name;
    let found = figures.scenes.iter().find(|scene| scene.name == name);
    html! {
        figure.card {
            div.compare {
                img src=(pictures.plain) width=(width) height=(height) alt=(format!("{name}, rendered"));
                img.over.by-1990 src=(pictures.by_1990) width=(width) height=(height)
                    alt=(format!("{name}, how voxel-1990 decided its shadow queries"));
                img.over.by-voxel src=(pictures.by_voxel) width=(width) height=(height) hidden
                    alt=(format!("{name}, how voxel with all values made before decided its shadow queries"));
                span.cut {}
                input type="range" min="0" max="100" value="50" aria-label=(format!("How much of {name} is shown as rendered"));
            }
            figcaption {
                div.choice role="group" aria-label="whose decisions" {
                    button type="button" data-over="by-1990" aria-pressed="true" { "voxel-1990" }
                    button type="button" data-over="by-voxel" aria-pressed="false" { "voxel" }
                }
                h3 { (name) }
                @if let Some(scene) = found {
                    p {
                        (tables::grouped(scene.objects as i64)) " objects, "
                        (scene.lights) @if scene.lights == 1 { " light, " } @else { " lights, " }
                        "grid " (scene.grid) "³; " (percent(scene.shadow_ray_share))
                        " of all rays are shadow rays, " (percent(scene.shadowed_share)) " of them find shadow"
                    }
                }
            }
        }
    }
}

fn time_groups(scenes: &[SceneFigures]) -> Vec<Group> {
    let bar = |scene: &SceneFigures, name: &str| {
        let found = scene.methods.get(name)?;
        let rest = found.total_s - found.prepare_s - scene.without_lights_s;
        Some(Bar {
            label: name.to_owned(),
            parts: vec![
                (scene.without_lights_s, "dark"),
                (found.prepare_s, "preparing"),
                (rest, "shadows"),
            ],
            note: if name == GRID.name() {
                format!("{:.3} s", found.total_s)
            } else {
                format!("{:.3} s, {:.2}×", found.total_s, found.speedup)
            },
        })
    };
    let group = |scene: &SceneFigures| Group {
        title: scene.name.clone(),
        bars: METHODS
            .iter()
            .filter_map(|method| bar(scene, method.name()))
            .collect(),
    };
    scenes.iter().map(group).collect()
}

fn known_groups(scenes: &[SceneFigures]) -> Vec<Group> {
    let bar = |label: &str, share: f64, class| Bar {
        label: label.to_owned(),
        parts: vec![(share, class)],
        note: format!("{:.1}%", 100.0 * share),
    };
    let group = |scene: &SceneFigures| {
        let paper = f64::from(scene.paper.known_percent) / 100.0;
        let mut bars = vec![Bar {
            note: format!("{}%", scene.paper.known_percent),
            ..bar("the paper", paper, "paper")
        }];
        let known = |name: &str| scene.methods.get(name).map(|found| found.known_share);
        if let Some(share) = known(VOXEL_1990.name()) {
            bars.push(bar(VOXEL_1990.name(), share, "m-voxel-1990"));
        }
        if let Some(share) = known(VOXEL.name()) {
            bars.push(bar(VOXEL.name(), share, "m-voxel"));
        }
        Group {
            title: scene.name.clone(),
            bars,
        }
    };
    scenes.iter().map(group).collect()
}

fn sweep_section(figures: &Figures) -> Markup {
    let kinds = [
        ("grid", "By grid level", "voxels along each axis", false),
        ("size", "By picture size", "pixels along each side", true),
        ("lights", "By lights", "lights", false),
        ("rooms", "Nine rooms with many lights", "lights", true),
    ];
    let tables = tables::sweeps(figures);
    let table = |title: &str| {
        tables
            .iter()
            .find(|table| table.title == title)
            .map(Table::html)
    };
    html! {
        section {
            h2 { "Grid, size, lights" }
            p { "Seconds, preparing and rendering, one core." }
            ul.legend {
                li { span.swatch.m-grid {} "grid" }
                li { span.swatch.m-voxel-1990 {} "voxel-1990" }
                li { span.swatch.m-voxel {} "voxel" }
            }
            @for (of, title, unit, is_log) in kinds {
                h3 { (title) }
                div.charts {
                    @for sweep in figures.sweeps.iter().filter(|sweep| sweep.of == of) {
                        (chart(sweep, unit, is_log))
                    }
                }
            }
            details {
                summary { "The same as tables" }
                @for title in ["Grid level", "Picture size", "Lights", "Many lights"] { @if let Some(html) = table(title) { (html) } }
            }
        }
    }
}

fn chart(sweep: &Sweep, unit: &str, is_log: bool) -> Markup {
    let at: Vec<u32> = sweep.points.iter().map(|point| point.at).collect();
    let line = |class, name: &str| Line {
        class,
        points: sweep
            .points
            .iter()
            .filter_map(|point| Some((f64::from(point.at), *point.total_s.get(name)?)))
            .collect(),
    };
    let all = [
        line("m-grid", GRID.name()),
        line("m-voxel-1990", VOXEL_1990.name()),
        line("m-voxel", VOXEL.name()),
    ];
    plot::lines(&sweep.scene, &at, unit, is_log, &all)
}

fn how(figures: &Figures) -> Markup {
    let different: u32 = figures
        .scenes
        .iter()
        .map(|scene| scene.different_pictures)
        .sum();
    html! {
        ul {
            li {
                "One picture of one sample a pixel, rays of up to five generations as in the SPD test procedure, one \
                 thread, its own processor time. Each method prepares everything anew in each round: surfaces, grid, \
                 tree, values. Methods take turns, each round begins with another one; figures are medians."
            }
            li {
                "Eye rays and mirrored rays walk through the uniform grid, whatever the method, as in the paper."
            }
            li {
                "An object is what a file of the Standard Procedural Databases counts: a polygon, a sphere, a cone or \
                 a cylinder. So a box of the lattice is six, and a triangle of Tetra one."
            }
            li {
                "A query is asked for each hit and light unless the surface faces away; the paper does not say \
                 whether it counted those."
            }
            li {
                "Every picture of every round is compared byte for byte with the others of its scene; "
                @if different == 0 { "none differs." } @else { (different) " differ." }
            }
        }
    }
}
