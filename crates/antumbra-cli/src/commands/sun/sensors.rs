//! Sensors of a study: a grid on faces, or points of a file.

use antumbra::{Nearness, ShadowIndex};
use antumbra_geometry::{DVec3, Precision, SurfaceId};
use antumbra_render::prepare::Prepared;
use antumbra_scene::gather::Gathered;
use antumbra_scene::model::Scene;
use antumbra_sun::{Facing, GridSettings, Sensors, grid_sensors, read_points};
use rayon::prelude::*;

use super::super::query::arrays::PointFile;
use super::super::query::asked::warn_of_surfaces;
use crate::failure::Failure;
use crate::screen::Screen;
use crate::typed::SunStudy;

/// Returns the bytes that a sensor takes: point, normal, surface, side, area, what its bits amount to, its bits, and its
/// shares if it has them.
pub(super) fn bytes_of_one(sun_count: usize, has_shares: bool) -> u64 {
    const OWN: usize = 24 + 24 + 4 + 1 + 8 + 72;
    let shares = if has_shares { 4 * sun_count } else { 0 };
    (OWN + 8 * sun_count.div_ceil(64) + shares) as u64
}

/// Sensors as they were typed, before the scene is read.
pub(super) enum Asked {
    Grid(f64),
    Points {
        points: Vec<[f64; 3]>,
        normals: Option<Vec<[f64; 3]>>,
        precision: Precision,
    },
}

impl Asked {
    /// Reads the files of points.
    pub(super) fn open(typed: &SunStudy) -> Result<Self, Failure> {
        let Some(path) = &typed.points else {
            return typed.sensors.map(Self::Grid).ok_or_else(|| {
                Failure::input(
                    "no sensors are given",
                    "give --sensors grid:SPACING, or --points P.npy",
                )
            });
        };
        let is_csv = path
            .extension()
            .is_some_and(|ending| ending.eq_ignore_ascii_case("csv"));
        let (points, of_file, precision) = if is_csv {
            let list = read_points(path).map_err(|error| Failure::input(error.to_string(), ""))?;
            (list.points, list.normals, Precision::Double)
        } else {
            let file = PointFile::open(path)?;
            let precision = file.precision();
            (file.read()?, None, precision)
        };
        let normals = match &typed.normals {
            None => of_file,
            Some(_) if of_file.is_some() => {
                let message = format!(
                    "{}: normals are there, and --normals is given",
                    path.display()
                );
                return Err(Failure::input(message, "leave --normals out"));
            }
            Some(path) => Some(PointFile::open(path)?.read()?),
        };
        if points.is_empty() {
            return Err(Failure::input(
                format!("{}: it has no points", path.display()),
                "",
            ));
        }
        Ok(Self::Points {
            points,
            normals,
            precision,
        })
    }

    /// Makes the sensors.
    pub(super) fn sensors(
        self,
        typed: &SunStudy,
        prepared: &Prepared,
        up: DVec3,
        most: usize,
        screen: &Screen,
    ) -> Result<Sensors, Failure> {
        let (gathered, index) = (prepared.gathered(), prepared.index());
        let (points, normals, precision) = match self {
            Self::Grid(spacing) => {
                let settings = GridSettings {
                    spacing,
                    up,
                    both_sides: typed.both_sides,
                    most,
                };
                let named = Named::of(prepared.scene(), &typed.on)?;
                let keep = |surface| named.has(gathered, surface);
                let sensors = grid_sensors(gathered.occluders(), &settings, keep);
                let sensors = sensors.map_err(|error| {
                    Failure::input(error.to_string(), "give --sensors a larger spacing, choose faces with --on, or raise --memory-limit")
                })?;
                sensors.notes.iter().for_each(|note| screen.note(note));
                return Ok(sensors);
            }
            Self::Points {
                points,
                normals,
                precision,
            } => (points, normals, precision),
        };
        let file = typed.points.as_deref().unwrap_or(std::path::Path::new(""));
        let sensors = Sensors::in_space(points, normals)
            .map_err(|error| Failure::input(format!("{}: {error}", file.display()), ""))?;
        if !typed.on_surface {
            warn_of_surfaces(index, &sensors.points, screen);
            return Ok(sensors);
        }
        let nearness = Nearness {
            precision,
            tolerance: typed.tolerance,
        };
        on_surfaces(sensors, index, nearness).map_err(|row| {
            let message = format!(
                "{}: point {row} (rows are counted from 0) lies on no surface",
                file.display()
            );
            Failure::input(
                message,
                "raise --tolerance, or leave --on-surface out for points of space",
            )
        })
    }
}

/// Looks for the surface of each sensor; fails with the first row that has none.
fn on_surfaces(
    mut sensors: Sensors,
    index: &ShadowIndex,
    nearness: Nearness,
) -> Result<Sensors, usize> {
    let task = antumbra_task::current();
    let normal = |sensor: usize| match &sensors.facing {
        Facing::Normals(normals) => Some(DVec3::from_array(normals[sensor])),
        Facing::All | Facing::Sides(_) => None,
    };
    let starts: Vec<_> = sensors
        .points
        .par_iter()
        .enumerate()
        .map(|(sensor, &point)| {
            task.enter(|| {
                antumbra_task::check();
                index.start_near(DVec3::from_array(point), normal(sensor), nearness)
            })
        })
        .collect();
    let mut surfaces = Vec::with_capacity(starts.len());
    for (row, start) in starts.into_iter().enumerate() {
        let Some((start, surface)) = start.and_then(|start| Some((start, start.surface?))) else {
            return Err(row);
        };
        sensors.points[row] = start.point.to_array();
        surfaces.push(surface.0);
    }
    sensors.surfaces = Some(surfaces);
    if sensors.facing == Facing::All {
        sensors.facing = Facing::Sides(vec![1; sensors.points.len()]);
    }
    Ok(sensors)
}

/// Objects whose faces have sensors.
struct Named {
    /// For each object whether it is one of them; empty for all.
    is_named: Vec<bool>,
}

impl Named {
    /// Looks for names of objects and materials.
    fn of(scene: &Scene, names: &[String]) -> Result<Self, Failure> {
        let mut is_named = Vec::new();
        if names.is_empty() {
            return Ok(Self { is_named });
        }
        is_named.resize(scene.objects.len(), false);
        for name in names {
            let mut is_found = false;
            for (object, is_named) in scene.objects.iter().zip(&mut is_named) {
                let material = scene.materials.get(object.material);
                if object.name == *name || material.is_some_and(|material| material.name == *name) {
                    *is_named = true;
                    is_found = true;
                }
            }
            if !is_found {
                let message = format!("no object and no material is called `{name}`");
                return Err(Failure::input(message, known_names(scene)));
            }
        }
        Ok(Self { is_named })
    }

    fn has(&self, gathered: &Gathered, surface: SurfaceId) -> bool {
        self.is_named.is_empty() || self.is_named[gathered.place_of(surface).object as usize]
    }
}

/// Says some of the names that there are.
fn known_names(scene: &Scene) -> String {
    const MOST: usize = 10;
    let objects = scene.objects.iter().map(|object| &object.name);
    let materials = scene.materials.iter().map(|material| &material.name);
    let mut names: Vec<&str> = Vec::new();
    for name in objects.chain(materials) {
        if !name.is_empty() && !names.contains(&name.as_str()) {
            names.push(name);
        }
        if names.len() > MOST {
            break;
        }
    }
    match names.len() {
        0 => "the scene has no names: leave --on out".to_owned(),
        count if count > MOST => format!("the scene has {} and others", names[..MOST].join(", ")),
        _ => format!("the scene has {}", names.join(", ")),
    }
}
