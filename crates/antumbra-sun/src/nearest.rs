//! The sensor that stands for a place on a face.
//!
//! In: a study whose sensors lie on surfaces. Out: for a place, the nearest sensor of the same face and side. On a grid
//! that is the sensor of the place's cell, or of the nearest cell where the middle of its own lies beside the face. Invariant: the
//! answer is the nearest one, the first of equally near ones; a face without sensors has none.

use antumbra_geometry::{DVec3, Occluders, SurfaceId};

use crate::record::Study;

/// Sensors of a leaf of the search tree.
const LEAF: usize = 8;

/// Sensors sorted by face and side, each group as a k-d tree.
#[derive(Clone, Debug)]
pub struct NearestSensors {
    /// Face, and whether it is the back; sensors of that face begin there.
    groups: Vec<(u32, bool, usize)>,
    /// Sensors and their points; the middle of a stretch parts it along its axis.
    sensors: Vec<(u32, DVec3)>,
    axes: Vec<u8>,
}

impl NearestSensors {
    /// Sorts the sensors of a study of these surfaces. `None` if they lie on no surfaces, or on others.
    pub fn of(study: &Study, occluders: &Occluders) -> Option<Self> {
        let surfaces = study.surfaces.as_ref()?;
        if surfaces
            .iter()
            .any(|&surface| surface as usize >= occluders.surface_count())
        {
            return None;
        }
        let place = |sensor: usize| {
            let (surface, point) = (SurfaceId(surfaces[sensor]), study.points[sensor].into());
            let normal = study.normals.as_ref().map(|normals| normals[sensor].into());
            let is_back = normal
                .is_some_and(|normal: DVec3| normal.dot(occluders.normal_at(surface, point)) < 0.0);
            (occluders.element_of(surface).0, is_back, sensor)
        };
        let mut sorted: Vec<_> = antumbra_task::checked(0..surfaces.len())
            .map(place)
            .collect();
        sorted.sort_unstable();
        let mut found = Self {
            groups: Vec::new(),
            sensors: Vec::with_capacity(sorted.len()),
            axes: vec![0; sorted.len()],
        };
        for group in sorted.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            antumbra_task::check();
            let first = found.sensors.len();
            found.groups.push((group[0].0, group[0].1, first));
            let of_group = group
                .iter()
                .map(|&(.., sensor)| (sensor as u32, study.points[sensor].into()));
            found.sensors.extend(of_group);
            part(&mut found.sensors[first..], &mut found.axes[first..]);
        }
        Some(found)
    }

    /// Returns the sensor nearest to a place on a surface, seen from the front or from the back.
    pub fn nearest(
        &self,
        occluders: &Occluders,
        surface: SurfaceId,
        is_back: bool,
        point: DVec3,
    ) -> Option<usize> {
        let element = occluders.element_of(surface).0;
        let group = self
            .groups
            .binary_search_by_key(&(element, is_back), |&(element, is_back, _)| {
                (element, is_back)
            })
            .ok()?;
        let first = self.groups[group].2;
        let end = self
            .groups
            .get(group + 1)
            .map_or(self.sensors.len(), |next| next.2);
        let mut best = (f64::INFINITY, u32::MAX);
        search(
            &self.sensors[first..end],
            &self.axes[first..end],
            point,
            &mut best,
        );
        (best.1 != u32::MAX).then_some(best.1 as usize)
    }

    /// Returns the bytes that the tree of so many sensors takes while it is made.
    pub fn predict_bytes(sensors: usize) -> u64 {
        let own = size_of::<(u32, bool, usize)>() + size_of::<(u32, DVec3)>() + 1;
        // Groups: one a sensor at most.
        (sensors * (own + size_of::<(u32, bool, usize)>())) as u64
    }
}

/// Sorts a stretch: the middle parts it along the axis in which it is longest.
fn part(sensors: &mut [(u32, DVec3)], axes: &mut [u8]) {
    if sensors.len() <= LEAF {
        return;
    }
    let nowhere = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    let [low, high] = sensors.iter().fold(nowhere, |[low, high], &(_, point)| {
        [low.min(point), high.max(point)]
    });
    let long = high - low;
    let axis = (0..3).fold(0, |best, axis| match long[axis] > long[best] {
        true => axis,
        false => best,
    });
    let middle = sensors.len() / 2;
    sensors.select_nth_unstable_by(middle, |a, b| {
        a.1[axis].total_cmp(&b.1[axis]).then(a.0.cmp(&b.0))
    });
    axes[middle] = axis as u8;
    let (before, behind) = sensors.split_at_mut(middle);
    let (axes_before, axes_behind) = axes.split_at_mut(middle);
    part(before, axes_before);
    part(&mut behind[1..], &mut axes_behind[1..]);
}

/// Looks for a nearer sensor, or an equally near one with a lower number.
fn search(sensors: &[(u32, DVec3)], axes: &[u8], point: DVec3, best: &mut (f64, u32)) {
    let mut look = |&(sensor, place): &(u32, DVec3)| {
        let found = (place.distance_squared(point), sensor);
        if found < *best {
            *best = found;
        }
    };
    if sensors.len() <= LEAF {
        sensors.iter().for_each(look);
        return;
    }
    let middle = sensors.len() / 2;
    look(&sensors[middle]);
    let axis = usize::from(axes[middle]);
    let beside = point[axis] - sensors[middle].1[axis];
    let before = (&sensors[..middle], &axes[..middle]);
    let behind = (&sensors[middle + 1..], &axes[middle + 1..]);
    let (near, far) = match beside < 0.0 {
        true => (before, behind),
        false => (behind, before),
    };
    search(near.0, near.1, point, best);
    // Rounded down alike: the square of one axis is never more than that of all.
    if beside * beside <= best.0 {
        search(far.0, far.1, point, best);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tree_finds_what_looking_at_all_finds() {
        let number = |seed: u64| {
            let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
            (mixed % 97) as f64
        };
        for count in [1, 8, 9, 17, 200, 1000] {
            let point = |seed: u64| DVec3::new(number(3 * seed), number(3 * seed + 1), 0.5);
            let mut sensors: Vec<(u32, DVec3)> = (0..count)
                .map(|sensor| (sensor, point(sensor.into())))
                .collect();
            let mut axes = vec![0; sensors.len()];
            part(&mut sensors, &mut axes);
            for seed in 5000..5200 {
                let place = point(seed);
                let mut best = (f64::INFINITY, u32::MAX);
                search(&sensors, &axes, place, &mut best);
                let due = sensors
                    .iter()
                    .map(|&(sensor, at)| (at.distance_squared(place), sensor))
                    .min_by(|a, b| a.partial_cmp(b).unwrap());
                assert_eq!(Some(best), due, "{count} {seed}");
            }
        }
    }
}
