//! Sensors: the points of a study, and which way they face.
//!
//! In: points with surfaces or normals, in the caller's order. Out: [`Sensors`]. Invariant: coordinates are finite and
//! at most 2^100 in magnitude, so that every sensor has an answer for every direction.

use std::ops::Range;

use antumbra::{Batch, BatchKind, ReceiverSide};
use antumbra_geometry::{DVec3, LightShape, Occluders, ReceiverPoint, Short, SurfaceId};

use crate::error::BadSetting;

/// Largest magnitude of a coordinate (EXACTNESS.md).
const LARGEST: f64 = (1_u128 << 100) as f64;

/// Half of the sky that sensors look at. Slices have an item a sensor.
#[derive(Clone, Debug, PartialEq)]
pub enum Facing {
    /// All directions.
    All,
    /// Directions strictly on a side of the sensor's surface, by the exact sign: 1 for the front, as its winding says,
    /// and -1 for the back.
    Sides(Vec<i8>),
    /// Directions strictly on a normal's side, by the exact sign. Normals have any length; a zero one faces nothing.
    Normals(Vec<[f64; 3]>),
}

/// Points of a study, and which way they face.
#[derive(Clone, Debug, PartialEq)]
pub struct Sensors {
    /// Points in world space.
    pub points: Vec<[f64; 3]>,
    /// Numbers of the surfaces that the points lie on; `None` for points of space. A point starts exactly on its
    /// surface (EXACTNESS.md, "The start").
    pub surfaces: Option<Vec<u32>>,
    /// Directions that they look at.
    pub facing: Facing,
    /// Area that each stands for, in the scene's unit squared, if that is known.
    pub areas: Option<Vec<f64>>,
    /// Statements that a user should hear of.
    pub notes: Vec<String>,
}

impl Sensors {
    /// Makes sensors of points of space with a normal each, or without: then they see all directions.
    ///
    /// # Errors
    /// Lengths differ, or a row has a number that is not finite or beyond 2^100.
    pub fn in_space(
        points: Vec<[f64; 3]>,
        normals: Option<Vec<[f64; 3]>>,
    ) -> Result<Self, BadSetting> {
        check_rows("point", &points)?;
        if let Some(normals) = &normals {
            check_rows("normal", normals)?;
            if normals.len() != points.len() {
                return Err(BadSetting(format!(
                    "there are {} normals: expected one for each of {} points",
                    normals.len(),
                    points.len()
                )));
            }
        }
        Ok(Self {
            points,
            surfaces: None,
            facing: normals.map_or(Facing::All, Facing::Normals),
            areas: None,
            notes: Vec::new(),
        })
    }

    /// Returns the number of sensors.
    pub fn count(&self) -> usize {
        self.points.len()
    }

    /// Returns the receiver point of a sensor.
    pub(crate) fn start(&self, sensor: usize) -> ReceiverPoint {
        ReceiverPoint {
            point: DVec3::from_array(self.points[sensor]),
            surface: self
                .surfaces
                .as_ref()
                .map(|surfaces| SurfaceId(surfaces[sensor])),
        }
    }

    /// Returns some sensors in a row as a batch.
    pub(crate) fn batch(&self, sensors: Range<usize>) -> Batch<'_> {
        let kind = match &self.surfaces {
            Some(surfaces) => BatchKind::OnSurfaces {
                surfaces: &surfaces[sensors.clone()],
                // They were made for these surfaces, or looked for.
                tolerance: Some(f64::INFINITY),
            },
            None => BatchKind::Free,
        };
        Batch {
            points: &self.points[sensors],
            kind,
        }
    }

    /// Returns the side that a sensor looks at.
    pub(crate) fn side(&self, sensor: usize) -> ReceiverSide {
        match &self.facing {
            Facing::All => ReceiverSide::Both,
            Facing::Sides(sides) if sides[sensor] < 0 => ReceiverSide::Back,
            Facing::Sides(_) => ReceiverSide::Front,
            Facing::Normals(normals) => ReceiverSide::Normal(normals[sensor].into()),
        }
    }

    /// Returns whether a sensor looks at a direction, by the exact sign.
    pub(crate) fn faces(&self, occluders: &Occluders, sensor: usize, to: DVec3) -> bool {
        let start = self.start(sensor);
        let light = LightShape::Direction(to);
        let side = self.side(sensor);
        match side {
            ReceiverSide::Both => true,
            ReceiverSide::Normal(normal) => light.side_of(start.point, normal) > 0,
            ReceiverSide::Front | ReceiverSide::Back if start.surface.is_none() => true,
            ReceiverSide::Front => occluders.light_side(&start, &light) > 0,
            ReceiverSide::Back => occluders.light_side(&start, &light) < 0,
        }
    }

    /// Returns the unit normal of a sensor, rounded; zero where it faces nothing. `None` if it sees all directions.
    pub(crate) fn normal(&self, occluders: &Occluders, sensor: usize) -> Option<DVec3> {
        match &self.facing {
            Facing::All => None,
            Facing::Sides(sides) => {
                let start = self.start(sensor);
                let front = start
                    .surface
                    .map(|surface| occluders.normal_at(surface, start.point));
                Some(front.unwrap_or_default() * f64::from(sides[sensor]))
            }
            Facing::Normals(normals) => {
                let normal = DVec3::from_array(normals[sensor]);
                // Scaled first, so that very long and very short ones have a length.
                let most = normal.abs().max_element();
                Some(match most > 0.0 {
                    true => (normal / most).normalize_or_zero(),
                    false => DVec3::ZERO,
                })
            }
        }
    }

    /// Returns the unit normal of each sensor, rounded; zero where a sensor faces nothing. `None` for sensors that see all
    /// directions.
    pub fn normals(&self, occluders: &Occluders) -> Option<Vec<[f64; 3]>> {
        if self.facing == Facing::All {
            return None;
        }
        let normal = |sensor| self.normal(occluders, sensor).unwrap_or_default();
        let sensors = antumbra_task::checked(0..self.count());
        Some(sensors.map(|sensor| normal(sensor).to_array()).collect())
    }
}

/// Names the first row that has no answer.
fn check_rows(what: &str, rows: &[[f64; 3]]) -> Result<(), BadSetting> {
    let is_fine = |row: &[f64; 3]| row.iter().all(|x| x.abs() <= LARGEST);
    match rows.iter().position(|row| !is_fine(row)) {
        None => Ok(()),
        Some(row) => Err(BadSetting(format!(
            "{what} {row} (rows are counted from 0) is {}: expected finite numbers, at most 2^100 in magnitude",
            Short(DVec3::from_array(rows[row]))
        ))),
    }
}
