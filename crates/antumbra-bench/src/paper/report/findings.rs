//! What the figures say, in words: good and bad.
//!
//! Every sentence is made from the figures of the run, so none outlives them.

use std::fmt::Write as _;

use super::super::figures::{Figures, SceneFigures, Sweep};
use super::super::tables::percent;
use super::super::{GRID, METHODS, VOXEL, VOXEL_1990};

/// Sentences.
pub(super) struct Findings {
    /// In favour of voxel occlusion.
    pub(super) wins: Vec<String>,
    /// Against it.
    pub(super) losses: Vec<String>,
    /// What else is to be known.
    pub(super) notes: Vec<String>,
}

impl Findings {
    pub(super) fn of(figures: &Figures) -> Self {
        let mut findings = Self {
            wins: Vec::new(),
            losses: Vec::new(),
            notes: Vec::new(),
        };
        for method in [VOXEL_1990, VOXEL] {
            findings.against_traversal(figures, method.name());
        }
        findings.known_values(&figures.scenes);
        findings.against_rivals(&figures.scenes);
        for method in [VOXEL_1990, VOXEL] {
            findings.small_pictures(&figures.sweeps, method.name());
        }
        findings.by_rays(&figures.scenes);
        findings.known(&figures.scenes);
        findings.grid_levels(&figures.sweeps);
        findings.checks(&figures.scenes);
        findings
    }

    /// Returns all of them in order.
    pub(super) fn all(&self) -> impl Iterator<Item = &String> {
        self.wins.iter().chain(&self.losses).chain(&self.notes)
    }

    fn against_traversal(&mut self, figures: &Figures, name: &str) {
        let all: Vec<(&str, f64)> = figures
            .scenes
            .iter()
            .filter_map(|scene| Some((&*scene.name, scene.methods.get(name)?.speedup)))
            .collect();
        let (won, lost, even) = sorted(&all);
        if !even.is_empty() {
            self.notes.push(format!(
                "{name} and plain traversal take the same time, as far as can be told, on {}.",
                list(&even)
            ));
        }
        if !won.is_empty() {
            self.wins.push(format!(
                "{name} takes less time than plain traversal on {} of {} scenes: {}.",
                won.len(),
                all.len(),
                list(&won)
            ));
        }
        if !lost.is_empty() {
            self.losses.push(format!(
                "{name} loses to plain traversal from nothing on {}.",
                list(&lost)
            ));
        }
    }

    fn known_values(&mut self, scenes: &[SceneFigures]) {
        let all: Vec<(&str, f64)> = scenes
            .iter()
            .filter_map(|scene| {
                let eager_s = scene.methods.get(VOXEL.name())?.second_render_s?;
                let by_grid = scene.methods.get(GRID.name())?;
                Some((&*scene.name, by_grid.render_s / eager_s))
            })
            .collect();
        if !all.is_empty() {
            self.wins.push(format!(
                "Rendering with all values made before, voxel is faster than plain traversal by {}.",
                list(&all)
            ));
        }
    }

    /// Says which rival is faster where.
    fn against_rivals(&mut self, scenes: &[SceneFigures]) {
        for method in METHODS {
            if [GRID, VOXEL_1990, VOXEL].contains(&method) {
                continue;
            }
            for ours in [VOXEL_1990, VOXEL] {
                let ratios = scenes.iter().filter_map(|scene| {
                    let [rival, ours] =
                        [method, ours].map(|method| scene.methods.get(method.name()));
                    Some((&*scene.name, rival?.total_s / ours?.total_s))
                });
                let ratios: Vec<(&str, f64)> = ratios.collect();
                let (won, lost, even) = sorted(&ratios);
                let (ours, rival) = (ours.name(), method.name());
                if !won.is_empty() {
                    self.wins
                        .push(format!("{ours} beats {rival} on {}.", list(&won)));
                }
                if !lost.is_empty() {
                    let inverse: Vec<(&str, f64)> = lost
                        .iter()
                        .map(|(scene, ratio)| (*scene, 1.0 / ratio))
                        .collect();
                    self.losses
                        .push(format!("{rival} beats {ours} on {}.", list(&inverse)));
                }
                if !even.is_empty() {
                    self.notes.push(format!(
                        "{ours} and {rival} take the same time, as far as can be told, on {}.",
                        list(&even)
                    ));
                }
            }
        }
    }

    fn small_pictures(&mut self, sweeps: &[Sweep], name: &str) {
        let mut lost = String::new();
        for sweep in sweeps.iter().filter(|sweep| sweep.of == "size") {
            let is_slower = |point: &&super::super::figures::SweepPoint| {
                point.total_s.get(name) > point.total_s.get(GRID.name())
            };
            let sizes: Vec<String> = sweep
                .points
                .iter()
                .filter(is_slower)
                .map(|point| point.at.to_string())
                .collect();
            if !sizes.is_empty() {
                let comma = if lost.is_empty() { "" } else { ", " };
                let _ = write!(lost, "{comma}{} at {}", sweep.scene, sizes.join(" and "));
            }
        }
        if !lost.is_empty() {
            self.losses.push(format!(
                "By picture size, in pixels a side, {name} loses to plain traversal on {lost}."
            ));
        }
    }

    /// Says where `voxel` prefers rays.
    fn by_rays(&mut self, scenes: &[SceneFigures]) {
        let shares = scenes.iter().filter_map(|scene| {
            let known = scene.methods.get(VOXEL.name())?.first_known_share;
            let scene = &scene.name;
            (known < 0.9).then(|| format!("{scene} {}", percent(known)))
        });
        let shares: Vec<String> = shares.collect();
        if !shares.is_empty() {
            self.losses.push(format!(
                "In a single picture voxel answers many queries by rays through its tree, because its cost \
                 rule has found no gain in values. It knows: {}.",
                shares.join(", ")
            ));
        }
    }

    fn known(&mut self, scenes: &[SceneFigures]) {
        for scene in scenes {
            let Some(found) = scene.methods.get(VOXEL_1990.name()) else {
                continue;
            };
            let on_the_way = found.intermediate as f64 / scene.queries.max(1) as f64;
            let paper = scene.paper.known_percent;
            if (100.0 * found.known_share).round() < f64::from(paper) {
                let scene_name = &scene.name;
                let (known, on_the_way) = (percent(found.known_share), percent(on_the_way));
                let why = if scene.name == "tetra" {
                    ": its triangles are smaller than voxels and touch, so hardly a voxel holds one object \
                     alone or lies in one object's umbra"
                } else {
                    ": the paper's scene is lost, and ours is only like it"
                };
                self.notes.push(format!(
                    "On {scene_name} voxel-1990 knows {known} of the queries at their start, the paper {paper}%; \
                     {on_the_way} more are decided on the way to the light{why}."
                ));
            }
        }
    }

    fn grid_levels(&mut self, sweeps: &[Sweep]) {
        let best = |sweep: &Sweep, name: &str| {
            let times = sweep.points.iter().filter_map(|point| {
                let seconds = *point.total_s.get(name)?;
                Some((point.at, seconds))
            });
            let best = times.min_by(|a, b| a.1.total_cmp(&b.1));
            best.map_or(0, |(at, _)| at)
        };
        let levels = sweeps
            .iter()
            .filter(|sweep| sweep.of == "grid")
            .map(|sweep| {
                let [by_grid, by_1990] =
                    [GRID, VOXEL_1990].map(|method| best(sweep, method.name()));
                format!("{} {by_grid} and {by_1990}", sweep.scene)
            });
        let levels: Vec<String> = levels.collect();
        if !levels.is_empty() {
            self.notes.push(format!(
                "The paper says that plain traversal's best grid is usually finer than that of voxel occlusion. \
                 Best here, plain traversal and voxel-1990: {}.",
                levels.join(", ")
            ));
        }
    }

    fn checks(&mut self, scenes: &[SceneFigures]) {
        let checks = scenes.iter().filter_map(|scene| scene.quick_check);
        let (count, right) = checks.fold((0, 0), |(count, right), check| {
            (count + 1, right + u32::from(check.is_right))
        });
        if count > 0 {
            self.notes.push(format!(
                "The quick check was right on {right} of {count} scenes."
            ));
        }
    }
}

/// Scenes, each with a ratio of times.
type Ratios<'a> = Vec<(&'a str, f64)>;

/// Times nearer to each other than this share are not told apart.
const NOISE: f64 = 0.02;

/// Returns those that are clearly above 1, clearly below, and neither.
fn sorted<'a>(all: &[(&'a str, f64)]) -> (Ratios<'a>, Ratios<'a>, Ratios<'a>) {
    let chosen = |is_chosen: &dyn Fn(f64) -> bool| {
        let chosen = all.iter().filter(|(_, ratio)| is_chosen(*ratio));
        chosen.copied().collect()
    };
    (
        chosen(&|ratio| ratio > 1.0 + NOISE),
        chosen(&|ratio| ratio < 1.0 - NOISE),
        chosen(&|ratio| (ratio - 1.0).abs() <= NOISE),
    )
}

/// Returns `graph 1.50, bars 1.20`.
fn list(all: &[(&str, f64)]) -> String {
    let items = all
        .iter()
        .map(|(scene, ratio)| format!("{scene} {ratio:.2}"));
    items.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_within_noise_is_neither_won_nor_lost() {
        let (won, lost, even) = sorted(&[("a", 1.5), ("b", 0.99), ("c", 0.5), ("d", 1.01)]);
        assert_eq!(list(&won), "a 1.50");
        assert_eq!(list(&lost), "c 0.50");
        assert_eq!(list(&even), "b 0.99, d 1.01");
    }
}
