//! Glazed city: the city with a window in every wall, about a tenth of its area.
//!
//! In: the number of boxes. Out: the city's objects; each wall as four parts around a pane of glass. Invariant: parts and pane meet in common
//! corners, which are shares of the wall's that `f64` has exactly. Written as NFF, a transmittance of 0 in place of the pane's makes it opaque.

use antumbra_geometry::DVec3;

use crate::defaults::nff_material;
use crate::model::{Object, Scene, Shape};

use super::{GenerateError, city, polygon};

/// Where the pane is, as shares of the wall's width and height: 3/32 of its area.
const ALONG: [f64; 2] = [0.375, 0.625];
const UP: [f64; 2] = [0.375, 0.75];

/// Makes a city of `size` boxes with windows.
///
/// # Errors
/// The size is not from 1 to 1,000,000.
pub fn glazed_city(size: u32) -> Result<Scene, GenerateError> {
    let mut scene = city(size)?;
    let glass = scene.materials.len();
    scene
        .materials
        .push(nff_material([0.25, 0.375, 0.5, 1.0, 0.0, 1.0, 0.75, 1.0]));
    let objects = std::mem::take(&mut scene.objects);
    for object in objects {
        match wall(&object) {
            Some(wall) => glaze(&mut scene.objects, wall, object.material, glass),
            None => scene.objects.push(object),
        }
    }
    Ok(scene)
}

/// Returns the corners of a wall, the lower ones first; `None` for what is no wall.
fn wall(object: &Object) -> Option<[DVec3; 4]> {
    let Shape::Polygon(polygon) = &object.shape else {
        return None;
    };
    let corners: [DVec3; 4] = polygon.vertices[..].try_into().ok()?;
    let [a, b, c, d] = corners.map(|corner| corner.z);
    (a == b && c == d && a != c).then_some(corners)
}

fn glaze(objects: &mut Vec<Object>, [a, b, c, d]: [DVec3; 4], stone: usize, glass: usize) {
    let at = |along: f64, up: f64| {
        let (low, high) = (a + (b - a) * along, d + (c - d) * along);
        low + (high - low) * up
    };
    let inner = [
        at(ALONG[0], UP[0]),
        at(ALONG[1], UP[0]),
        at(ALONG[1], UP[1]),
        at(ALONG[0], UP[1]),
    ];
    let outer = [a, b, c, d];
    for i in 0..4 {
        let j = (i + 1) % 4;
        objects.push(polygon(vec![outer[i], outer[j], inner[j], inner[i]], stone));
    }
    objects.push(polygon(inner.to_vec(), glass));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(object: &Object) -> f64 {
        let Shape::Polygon(polygon) = &object.shape else {
            panic!("{object:?}");
        };
        let [a, b, c, d]: [DVec3; 4] = polygon.vertices[..].try_into().unwrap();
        0.5 * (c - a).cross(d - b).length()
    }

    #[test]
    fn walls_keep_their_area_and_a_tenth_of_it_is_glass() {
        let (plain, glazed) = (city(40).unwrap(), glazed_city(40).unwrap());
        let walls: f64 = plain
            .objects
            .iter()
            .filter(|o| wall(o).is_some())
            .map(area)
            .sum();
        let of_glass = glazed.objects.iter().filter(|object| object.material == 2);
        let glass: f64 = of_glass.map(area).sum();
        let all = |scene: &Scene| scene.objects.iter().map(area).sum::<f64>();
        assert!((glass / walls - 3.0 / 32.0).abs() < 1e-12);
        assert!((all(&plain) / all(&glazed) - 1.0).abs() < 1e-12);
        assert_eq!(glazed.objects.len(), plain.objects.len() + 4 * 4 * 40);
    }
}
