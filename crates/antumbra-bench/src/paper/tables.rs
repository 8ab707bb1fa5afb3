//! Figures become tables: the paper's two, what the quick check said, memory, and what was to be shown.

use antumbra_baselines::rival::formulas::PaperMemory;

use super::figures::{Figures, MethodFigures, SceneFigures, Sweep};
use super::scenes::PaperRow;
use super::table::{Cell, Table, Tone};
use super::{GRID, METHODS, VOXEL, VOXEL_1990};

/// Returns all tables but those of the sweeps.
pub(super) fn all(figures: &Figures) -> Vec<Table> {
    let scenes = &figures.scenes;
    vec![
        times(scenes),
        savings(scenes),
        shares(scenes),
        quick_check(scenes),
        memory(scenes),
        aims(scenes),
    ]
}

fn columns<const N: usize>(names: [&str; N]) -> Vec<String> {
    names.map(str::to_owned).into()
}

fn times(scenes: &[SceneFigures]) -> Table {
    let mut table = Table {
        title: "Table 1: time",
        caption: "Seconds for one picture on one core, preparing and rendering together, nothing kept from \
                  before; in brackets plain traversal's time over it. %Shad: shadow rays among all rays. dark: \
                  the picture without lights, which no shadow method can beat. Left, the paper's rows, on a \
                  SUN 3/280."
            .into(),
        columns: columns([
            "image", "#light", "grid", "#obj", "paper: %Shad", "voxel", "occ", "here: %Shad",
        ]),
        rows: Vec::new(),
    };
    let names = METHODS.iter().map(|method| method.name().to_owned());
    table.columns.extend(names.chain(["dark".to_owned()]));
    for scene in scenes {
        let paper = &scene.paper;
        let mut row: Vec<Cell> = vec![
            scene.name.clone().into(),
            scene.lights.to_string().into(),
            scene.grid.to_string().into(),
            scene.objects.to_string().into(),
            Cell::quoted(format!("{}%", paper.shadow_percent)),
            Cell::quoted(format!("{:.1}", paper.voxel_s)),
            Cell::quoted(format!("{:.1} ({:.2})", paper.occlusion_s, paper.speedup())),
            percent(scene.shadow_ray_share).into(),
        ];
        for method in METHODS {
            row.push(match scene.methods.get(method.name()) {
                None => "".into(),
                Some(found) if method == GRID => format!("{:.3}", found.total_s).into(),
                Some(found) => Cell::toned(
                    format!("{:.3} ({:.2})", found.total_s, found.speedup),
                    better(found.speedup > 1.0),
                ),
            });
        }
        row.push(format!("{:.3}", scene.without_lights_s).into());
        table.rows.push(row);
    }
    table
}

fn savings(scenes: &[SceneFigures]) -> Table {
    let mut table = Table {
        title: "Table 2: savings",
        caption: "%Known: queries that needed no shadow ray; for voxel with all values made before, in brackets in the \
                  picture of Table 1. By value: those of them for which no surface was tested either; the candidates of a light buffer \
                  are tested, but no ray is walked. #Trav and #Int: voxels entered and surfaces \
                  tested that plain traversal took more of. #Intermed: queries decided on the way. The paper's \
                  rows are as printed; in the last three #Trav and #Int look exchanged. Work of voxel counts \
                  nodes of its tree as traversals; what it does to make its values shows in Table 1 only."
            .into(),
        columns: columns(["image", "method", "%Known", "by value", "#Trav", "#Int", "#Intermed"]),
        rows: Vec::new(),
    };
    for scene in scenes {
        let paper = &scene.paper;
        table.rows.push(vec![
            scene.name.clone().into(),
            Cell::quoted("paper"),
            Cell::quoted(format!("{}%", paper.known_percent)),
            "".into(),
            Cell::quoted(grouped(paper.traversals as i64)),
            Cell::quoted(grouped(paper.intersections as i64)),
            Cell::quoted(grouped(paper.intermediate as i64)),
        ]);
        for method in METHODS.into_iter().filter(|&method| method != GRID) {
            let Some(found) = scene.methods.get(method.name()) else {
                continue;
            };
            let known = match found.second_render_s {
                Some(_) => format!(
                    "{} ({})",
                    percent(found.known_share),
                    percent(found.first_known_share)
                ),
                None => percent(found.known_share),
            };
            table.rows.push(vec![
                "".into(),
                method.name().into(),
                known.into(),
                percent(found.value_share).into(),
                saved(found.steps_saved),
                saved(found.intersections_saved),
                grouped(found.intermediate as i64).into(),
            ]);
        }
    }
    table
}

fn shares(scenes: &[SceneFigures]) -> Table {
    let mut table = Table {
        title: "What shadows cost",
        caption: "Seconds of Table 1 less those of the picture without lights, and how often that goes into plain \
                  traversal's. Known: rendering with all values made before."
            .into(),
        columns: columns(["image", "queries", "in shadow"]),
        rows: Vec::new(),
    };
    let names = METHODS.iter().map(|method| method.name().to_owned());
    table
        .columns
        .extend(names.chain(["voxel, known".to_owned()]));
    for scene in scenes {
        let by_grid = scene.methods.get(GRID.name()).map(|found| found.shadow_s);
        let cost = |seconds: f64| match by_grid {
            // Within the noise of the picture without lights.
            Some(_) if seconds <= 0.0 => format!("{seconds:.3}").into(),
            Some(by_grid) => Cell::toned(
                format!("{seconds:.3} ({:.1})", by_grid / seconds),
                better(seconds < by_grid),
            ),
            None => format!("{seconds:.3}").into(),
        };
        let mut row: Vec<Cell> = vec![
            scene.name.clone().into(),
            grouped(scene.queries as i64).into(),
            percent(scene.shadowed_share).into(),
        ];
        for method in METHODS {
            row.push(match scene.methods.get(method.name()) {
                None => "".into(),
                Some(found) if method == GRID => format!("{:.3}", found.shadow_s).into(),
                Some(found) => cost(found.shadow_s),
            });
        }
        let again = scene.methods.get(VOXEL.name());
        let again = again.and_then(|found| found.second_render_s);
        row.push(again.map_or("".into(), |second| cost(second - scene.without_lights_s)));
        table.rows.push(row);
    }
    table
}

fn quick_check(scenes: &[SceneFigures]) -> Table {
    let mut table = Table {
        title: "The quick check",
        caption: "Paper 7.3: the mean share of the grid's voxels that an object occupies says whether voxel \
                  occlusion testing as published is worth it. Right: whether that was so in Table 1."
            .into(),
        columns: columns(["image", "occupied", "threshold", "advice", "plain / voxel-1990", "right"]),
        rows: Vec::new(),
    };
    for scene in scenes {
        let (Some(check), Some(found)) = (scene.quick_check, scene.methods.get(VOXEL_1990.name()))
        else {
            continue;
        };
        let say = |is_so: bool, yes: &str, no: &str| if is_so { yes } else { no }.to_owned();
        table.rows.push(vec![
            scene.name.clone().into(),
            format!("{:.4}%", 100.0 * check.occupied_share).into(),
            format!("{:.4}%", 100.0 * check.threshold).into(),
            say(check.is_advised, "use it", "leave it").into(),
            format!("{:.2}", found.speedup).into(),
            Cell::toned(say(check.is_right, "yes", "no"), better(check.is_right)),
        ]);
    }
    table
}

fn memory(scenes: &[SceneFigures]) -> Table {
    let mut table = Table {
        title: "Memory",
        caption: "Bytes kept for shadow queries, mean over the lights, beside surfaces, grid and tree; in brackets \
                  what the paper expects: 2N^3 bits for its own method, an object in every cell of a light buffer \
                  (N^2 n), the shadow polygons of every edge in every voxel of hybrid shadow testing (E N^3 n), \
                  with the bytes that an entry takes here."
            .into(),
        columns: columns(["image"]),
        rows: Vec::new(),
    };
    let kept = METHODS.into_iter().filter(|&method| method != GRID);
    let names = kept.clone().map(|method| method.name().to_owned());
    table.columns.extend(names);
    for scene in scenes {
        let mut row: Vec<Cell> = vec![scene.name.clone().into()];
        for method in kept.clone() {
            let found = scene.methods.get(method.name());
            row.push(found.map_or("".into(), |found| {
                let bytes = grouped(found.bytes_per_light.round() as i64);
                match found.paper_memory {
                    Some(PaperMemory { bytes: paper, .. }) => {
                        format!("{bytes} ({})", grouped(paper.round() as i64)).into()
                    }
                    None => bytes.into(),
                }
            }));
        }
        table.rows.push(row);
    }
    table
}

/// What was to be shown.
fn aims(scenes: &[SceneFigures]) -> Table {
    let mut table = Table {
        title: "What was to be shown",
        caption: "Aims of this project for the paper's scenes. What is missed is said.".into(),
        columns: columns(["aim", "scene", "wanted", "is", ""]),
        rows: Vec::new(),
    };
    let mut last = String::new();
    let mut aim = |aim: &str, scene: &SceneFigures, wanted: String, is: String, is_met: bool| {
        // Each aim is named once.
        let name = if aim == last { "" } else { aim };
        table.rows.push(vec![
            name.into(),
            scene.name.clone().into(),
            wanted.into(),
            is.into(),
            Cell::toned(if is_met { "met" } else { "missed" }, better(is_met)),
        ]);
        last = aim.to_owned();
    };
    let find = |scene: &SceneFigures, name: &str| scene.methods.get(name).cloned();
    for scene in scenes
        .iter()
        .filter(|scene| ["flakes", "tetra"].contains(&&*scene.name))
    {
        if let Some(found) = find(scene, VOXEL_1990.name()) {
            let PaperRow { known_percent, .. } = scene.paper;
            aim(
                "voxel-1990: known share as in the paper",
                scene,
                format!("{known_percent}%"),
                format!("{:.1}%", 100.0 * found.known_share),
                // As the paper rounds.
                (100.0 * found.known_share).round() >= f64::from(known_percent),
            );
        }
    }
    for scene in scenes {
        if let Some(found) = find(scene, VOXEL.name()) {
            let is = format!("{:.1}%", 100.0 * found.known_share);
            let is_met = found.known_share >= 0.9;
            aim("voxel: known share", scene, "90%".into(), is, is_met);
        }
    }
    for scene in scenes {
        if let Some(MethodFigures { speedup, .. }) = find(scene, VOXEL.name()) {
            let wanted = if scene.paper.shadow_percent > 50 {
                1.5
            } else {
                1.0
            };
            let is_met = if wanted > 1.0 {
                speedup >= wanted
            } else {
                speedup > wanted
            };
            let (wanted, is) = (format!("{wanted:.1}"), format!("{speedup:.2}"));
            aim(
                "voxel: total time, plain / voxel",
                scene,
                wanted,
                is,
                is_met,
            );
        }
    }
    for scene in scenes {
        let is = scene.different_pictures;
        aim(
            "pictures that differ",
            scene,
            "0".into(),
            is.to_string(),
            is == 0,
        );
    }
    table
}

/// Returns a table a setting.
pub(super) fn sweeps(figures: &Figures) -> Vec<Table> {
    let kinds = [
        (
            "grid",
            "Grid level",
            "Plain traversal's time over the method's, at half the picture's size, with so many voxels along \
             each axis; in brackets the seconds of plain traversal.",
        ),
        (
            "size",
            "Picture size",
            "The same with so many pixels along each side, at the paper's grid.",
        ),
        (
            "lights",
            "Lights",
            "The same at half the picture's size with one to five lights, those of the scene's first, a fifth \
             of a turn apart.",
        ),
        (
            "rooms",
            "Many lights",
            "The same with the lights of nine rooms, few of which reach a point.",
        ),
    ];
    let tables = kinds.into_iter().filter_map(|(of, title, caption)| {
        let chosen: Vec<&Sweep> = figures
            .sweeps
            .iter()
            .filter(|sweep| sweep.of == of)
            .collect();
        let points = &chosen.first()?.points;
        let mut table = Table {
            title,
            caption: caption.into(),
            columns: columns(["image", "method"]),
            rows: Vec::new(),
        };
        let values = points.iter().map(|point| point.at.to_string());
        table.columns.extend(values);
        for sweep in chosen {
            for (number, method) in [GRID, VOXEL_1990, VOXEL].into_iter().enumerate() {
                let name = if number == 0 { &sweep.scene } else { "" };
                let mut row: Vec<Cell> = vec![name.into(), method.name().into()];
                row.extend(sweep.points.iter().map(|point| {
                    let seconds = |name: &str| point.total_s.get(name).copied();
                    match (seconds(GRID.name()), seconds(method.name())) {
                        (Some(seconds), _) if method == GRID => format!("({seconds:.3})").into(),
                        (Some(by_grid), Some(seconds)) => Cell::toned(
                            format!("{:.2}", by_grid / seconds),
                            better(seconds < by_grid),
                        ),
                        _ => "".into(),
                    }
                }));
                table.rows.push(row);
            }
        }
        Some(table)
    });
    tables.collect()
}

fn better(is_better: bool) -> Tone {
    if is_better { Tone::Good } else { Tone::Bad }
}

fn saved(count: i64) -> Cell {
    Cell::toned(grouped(count), better(count > 0))
}

pub(super) fn percent(share: f64) -> String {
    format!("{:.0}%", 100.0 * share)
}

/// Returns a number with its digits in threes.
pub(super) fn grouped(number: i64) -> String {
    let digits = number.unsigned_abs().to_string();
    let mut text = String::new();
    for (place, digit) in digits.chars().enumerate() {
        if place > 0 && (digits.len() - place).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    if number < 0 { format!("-{text}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_come_in_threes() {
        let texts = [0, 999, 1000, -1_234_567].map(grouped);
        assert_eq!(texts, ["0", "999", "1 000", "-1 234 567"]);
    }
}
