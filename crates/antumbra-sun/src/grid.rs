//! Grids of sensors on faces.
//!
//! In: triangles, a spacing. Out: sensors in the plane of each triangle, at the middles of square cells. Invariants: the
//! cells depend on the direction of a plane and on world space alone, so triangles of one wall share them; a cell's
//! middle belongs to one of two triangles that share an edge; every face (polygon) has a sensor, and its sensors have
//! equal shares of its area.

use antumbra_geometry::{DVec3, Occluders, SurfaceId};

use crate::error::BadSetting;
use crate::sensors::{Facing, Sensors};

/// Settings of a grid.
#[derive(Clone, Copy, Debug)]
pub struct GridSettings {
    /// Side of a cell, in the scene's unit; above 0.
    pub spacing: f64,
    /// Which way is up: rows of cells on walls are level. Any length but zero.
    pub up: DVec3,
    /// Whether each cell has a second sensor on the back of its face.
    pub both_sides: bool,
    /// Most sensors that are made.
    pub most: usize,
}

/// Puts sensors on all faces whose triangles `keep` accepts, face after face. A face that holds no middle of a cell has one
/// sensor, at the centroid of its largest triangle. Curved surfaces and triangles without
/// area have none, and a note says how many there are.
///
/// # Errors
/// The spacing is not above 0, or gives more sensors than allowed; or no triangle is accepted.
pub fn grid_sensors(
    occluders: &Occluders,
    settings: &GridSettings,
    keep: impl Fn(SurfaceId) -> bool,
) -> Result<Sensors, BadSetting> {
    let &GridSettings {
        spacing,
        up,
        both_sides,
        most,
    } = settings;
    if !(spacing > 0.0 && spacing.is_finite()) {
        return Err(BadSetting(format!(
            "the spacing of the grid is {spacing}: expected above 0, in the scene's unit"
        )));
    }
    let (mut curved, mut flat) = (0_usize, 0_usize);
    let mut faces = Vec::new();
    // The rows that are looked at count, too: time is bounded as memory is.
    let mut expected = 0.0_f64;
    for surface in antumbra_task::checked(occluders.present_surfaces()) {
        if !keep(surface) {
            continue;
        }
        let Some(corners) = occluders.triangle_positions(surface) else {
            curved += 1;
            continue;
        };
        match Cells::new(corners, up, spacing) {
            Some(cells) if occluders.dominant_axis(surface).is_some() => {
                expected += cells.expected();
                faces.push((surface, cells));
            }
            _ => flat += 1,
        }
    }
    let sides: &[i8] = if both_sides { &[1, -1] } else { &[1] };
    let expected = expected * sides.len() as f64;
    if expected > most as f64 {
        return Err(BadSetting(format!(
            "a spacing of {spacing} gives up to {expected:.0} sensors, more than {most}: expected a larger spacing, or fewer faces"
        )));
    }
    if faces.is_empty() {
        return Err(BadSetting(
            "no face has sensors: expected triangles with an area".to_owned(),
        ));
    }
    let mut sensors = Sensors {
        points: Vec::new(),
        surfaces: None,
        facing: Facing::All,
        areas: None,
        notes: Vec::new(),
    };
    let (mut surfaces, mut areas, mut facing) = (Vec::new(), Vec::new(), Vec::new());
    // Of one face: places, and the triangle of each.
    let (mut found, mut own) = (Vec::new(), Vec::new());
    let element = |face: &(SurfaceId, Cells)| occluders.element_of(face.0);
    for triangles in faces.chunk_by(|one, next| element(one) == element(next)) {
        antumbra_task::check();
        own.clear();
        for (surface, cells) in triangles {
            let before = found.len();
            cells.middles(&mut found);
            own.resize(own.len() + found.len() - before, surface.0);
        }
        if found.is_empty() {
            let largest = triangles
                .iter()
                .max_by(|a, b| a.1.area.total_cmp(&b.1.area));
            if let Some((surface, cells)) = largest {
                found.push(cells.centroid());
                own.push(surface.0);
            }
        }
        let area = triangles.iter().map(|(_, cells)| cells.area).sum::<f64>();
        let share = area / found.len() as f64;
        for (point, &surface) in found.drain(..).zip(&own) {
            for &side in sides {
                sensors.points.push(point.to_array());
                surfaces.push(surface);
                areas.push(share);
                facing.push(side);
            }
        }
    }
    sensors.surfaces = Some(surfaces);
    sensors.areas = Some(areas);
    sensors.facing = Facing::Sides(facing);
    if curved > 0 {
        sensors.notes.push(format!(
            "{curved} curved surfaces have no sensors: grids lie on triangles alone"
        ));
    }
    if flat > 0 {
        sensors
            .notes
            .push(format!("{flat} triangles have no area, and no sensors"));
    }
    Ok(sensors)
}

/// Square cells in the plane of a triangle.
struct Cells {
    corners: [DVec3; 3],
    /// Unit vectors of the plane: along the rows, and from row to row.
    axes: [DVec3; 2],
    /// Coordinates of the corners along these, in world space.
    flat: [[f64; 2]; 3],
    spacing: f64,
    area: f64,
}

impl Cells {
    /// Returns `None` for a triangle without area.
    fn new(corners: [DVec3; 3], up: DVec3, spacing: f64) -> Option<Self> {
        let [a, b, c] = corners;
        let cross = (b - a).cross(c - a);
        let normal = cross.try_normalize()?;
        // Level rows; on a level face any rows do, and those along +x or, failing that, +y are taken.
        let level = up.normalize_or(DVec3::Z).cross(normal);
        let along = if level.length() > 1e-9 {
            level
        } else {
            let x = DVec3::X - normal * normal.x;
            match x.length() > 0.5 {
                true => x,
                false => DVec3::Y - normal * normal.y,
            }
        };
        let along = along.normalize();
        let axes = [along, normal.cross(along)];
        Some(Self {
            corners,
            axes,
            flat: corners.map(|corner| axes.map(|axis| corner.dot(axis))),
            spacing,
            area: 0.5 * cross.length(),
        })
    }

    fn centroid(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        a + ((b - a) + (c - a)) / 3.0
    }

    /// Returns about how many sensors and rows there are, rather too many.
    fn expected(&self) -> f64 {
        let rows = self.flat.map(|[_, row]| row);
        let height = rows[0].max(rows[1]).max(rows[2]) - rows[0].min(rows[1]).min(rows[2]);
        (self.area / self.spacing / self.spacing + height / self.spacing).ceil() + 1.0
    }

    /// Adds the middles of the cells that lie in the triangle, row by row.
    fn middles(&self, points: &mut Vec<DVec3>) {
        let spacing = self.spacing;
        let middle = |cell: f64| (cell + 0.5) * spacing;
        let rows = self.flat.map(|[_, row]| row);
        let low = rows[0].min(rows[1]).min(rows[2]);
        let high = rows[0].max(rows[1]).max(rows[2]);
        let mut row = (low / spacing - 0.5).floor();
        while middle(row) <= high {
            let across = middle(row);
            if let Some([first, last]) = self.crossed(across) {
                let mut column = (first / spacing - 0.5).ceil();
                while middle(column) < last {
                    let [from_along, from_across] = self.flat[0];
                    let [along, up] = self.axes;
                    points.push(
                        self.corners[0]
                            + along * (middle(column) - from_along)
                            + up * (across - from_across),
                    );
                    // Far from the origin, cells may be too small to be counted.
                    if column + 1.0 == column {
                        break;
                    }
                    column += 1.0;
                }
            }
            if row + 1.0 == row {
                break;
            }
            row += 1.0;
        }
    }

    /// Returns where a row enters and leaves the triangle. An edge holds its lower end and not its upper one, so that
    /// rows through corners count once.
    fn crossed(&self, across: f64) -> Option<[f64; 2]> {
        let mut found = [f64::INFINITY, f64::NEG_INFINITY];
        for corner in 0..3 {
            let (mut one, mut other) = (self.flat[corner], self.flat[(corner + 1) % 3]);
            // Two triangles run along a shared edge in opposite directions and have to find one place.
            if other[1] < one[1] {
                std::mem::swap(&mut one, &mut other);
            }
            if one[1] <= across && across < other[1] {
                let share = (across - one[1]) / (other[1] - one[1]);
                let place = one[0] + share * (other[0] - one[0]);
                found = [found[0].min(place), found[1].max(place)];
            }
        }
        (found[0] <= found[1]).then_some(found)
    }
}
