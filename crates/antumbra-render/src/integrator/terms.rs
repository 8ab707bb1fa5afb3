//! The terms of Whitted's model in one point: light's power, local reflection, directions of rays.

use antumbra_geometry::{DVec3, LightShape};
use antumbra_scene::model::{Color, Light, LightKind};

use super::SurfacePoint;
use crate::cone;
use crate::prepare::Look;
use crate::vector::unit;

/// Returns the share of a light's power that it sends towards a point: 1 but for spots.
pub(super) fn cone_share(kind: &LightKind, point_in_world: DVec3) -> f64 {
    let LightKind::Spot {
        position,
        axis,
        inner_cosine,
        outer_cosine,
    } = *kind
    else {
        return 1.0;
    };
    let (Some(axis), Some(direction)) = (unit(axis), unit(point_in_world - position)) else {
        return 1.0;
    };
    cone::share_at(axis.dot(direction), inner_cosine, outer_cosine)
}

/// Returns a light's color at a point, weakened by distance if it weakens: with the color in
/// candela and distances in metres that is lux, the unit of directional lights.
pub(super) fn power_at(light: &Light, shape: &LightShape, point_in_world: DVec3) -> Color {
    match shape {
        LightShape::Point(position) if light.falls_off => {
            let square = position.distance_squared(point_in_world);
            if square > 0.0 {
                light.color / square
            } else {
                Color::ZERO
            }
        }
        _ => light.color,
    }
}

/// Returns the Lambertian and the Phong term for a light that reaches the point.
pub(super) fn local_term(
    look: &Look<'_>,
    point: &SurfacePoint<'_>,
    front_normal: DVec3,
    shape: &LightShape,
) -> Color {
    let Some(towards_light) = unit(shape.towards(point.hit.point)) else {
        return Color::ZERO;
    };
    let cosine = front_normal.dot(towards_light);
    if cosine <= 0.0 {
        return Color::ZERO;
    }
    let left = match point.relief {
        Some(_) => beside_terminator(point.geometric_normal, front_normal, towards_light),
        None => 1.0,
    };
    let material = look.material;
    let mut color = look.diffuse * cosine;
    if material.specular != Color::ZERO {
        let mirror_cosine = reflected(-towards_light, front_normal).dot(point.towards_viewer);
        if mirror_cosine > 0.0 {
            // The C library's pow differs between platforms; libm's does not.
            color += material.specular * libm::pow(mirror_cosine, material.shininess);
        }
    }
    left * color
}

/// Returns which share of a light's term is left where a normal leans to it farther than its surface: none where the surface
/// turns away, so that light does not end in a hard line there (Chiang, Li and Burley, "Taming the Shadow Terminator",
/// SIGGRAPH 2019 Talks). All are unit vectors; `geometric` may be to either side.
fn beside_terminator(geometric: DVec3, leaning: DVec3, towards_light: DVec3) -> f64 {
    let of_surface = geometric.dot(towards_light).abs();
    let of_leaning = leaning.dot(towards_light) * geometric.dot(leaning).abs();
    // One where normals are the same, or the surface faces the light more than the relief does.
    if of_surface >= of_leaning {
        return 1.0;
    }
    let share = of_surface / of_leaning;
    share + share * share - share * share * share
}

pub(super) fn reflected(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

/// Returns the direction after Snell's law, or `None` on total reflection. `normal` is on the side
/// the unit `direction` comes from; `ratio` is the index of refraction here over the one beyond.
pub(super) fn refracted(direction: DVec3, normal: DVec3, ratio: f64) -> Option<DVec3> {
    let cosine = -direction.dot(normal);
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    if !(square >= 0.0 && square.is_finite()) {
        return None;
    }
    unit(ratio * direction + (ratio * cosine - square.sqrt()) * normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(found: DVec3, expected: DVec3) {
        assert!(
            (found - expected).length() < 1e-15,
            "{found} is not {expected}"
        );
    }

    #[test]
    fn snell_bends_towards_the_normal_in_the_denser_medium_and_back() {
        let slanted = unit(DVec3::new(1.0, 0.0, -1.0)).unwrap();
        let inside = refracted(slanted, DVec3::Z, 1.0 / 1.5).unwrap();
        assert!((inside.x - slanted.x / 1.5).abs() < 1e-15, "{inside}");
        let outside = refracted(inside, DVec3::Z, 1.5).unwrap();
        assert_close(outside, slanted);
        assert_close(refracted(slanted, DVec3::Z, 1.0).unwrap(), slanted);
    }

    #[test]
    fn beyond_the_critical_angle_nothing_goes_through() {
        let grazing = unit(DVec3::new(1.0, 0.0, -0.5)).unwrap();
        assert_eq!(refracted(grazing, DVec3::Z, 1.5), None);
    }

    #[test]
    fn light_fades_where_its_surface_turns_away_whatever_the_relief() {
        let leaning = unit(DVec3::new(1.0, 0.0, 1.0)).unwrap();
        let at = |angle: f64| DVec3::new(libm::cos(angle), 0.0, libm::sin(angle));
        let left = |angle: f64| beside_terminator(DVec3::Z, leaning, at(angle));
        // From grazing to upright: from nothing to all, without a step.
        let all: Vec<f64> = (0..=900)
            .map(|step| left(f64::from(step) / 900.0 * 1.57))
            .collect();
        assert!(all[0] < 1e-15 && all[900] == 1.0, "{} {}", all[0], all[900]);
        assert!(
            all.windows(2)
                .all(|pair| (0.0..0.02).contains(&(pair[1] - pair[0])))
        );
        assert!((0.3..0.9).contains(&left(0.4)), "{}", left(0.4));
        // A relief that leans away, or not at all, loses nothing.
        let away = DVec3::new(-leaning.x, 0.0, leaning.z);
        assert_eq!(beside_terminator(DVec3::Z, away, at(1.2)), 1.0);
        assert_eq!(beside_terminator(-DVec3::Z, DVec3::Z, at(0.1)), 1.0);
    }

    #[test]
    fn mirrors_keep_the_tangent_and_turn_the_normal() {
        assert_close(
            reflected(DVec3::new(1.0, 2.0, -3.0), DVec3::Z),
            DVec3::new(1.0, 2.0, 3.0),
        );
    }

    #[test]
    fn a_spot_is_full_inside_dark_outside_and_smooth_between() {
        let spot = LightKind::Spot {
            position: DVec3::ZERO,
            axis: DVec3::new(0.0, 0.0, -2.0),
            inner_cosine: 0.9,
            outer_cosine: 0.5,
        };
        let at = |cosine: f64| {
            cone_share(
                &spot,
                DVec3::new((1.0 - cosine * cosine).sqrt(), 0.0, -cosine),
            )
        };
        assert_eq!(at(0.95), 1.0);
        assert_eq!(at(0.4), 0.0);
        assert_eq!(at(-1.0), 0.0);
        assert!((at(0.7) - 0.5).abs() < 1e-12, "{}", at(0.7));
    }

    #[test]
    fn a_light_in_the_point_itself_adds_nothing_and_gives_no_nan() {
        let light = Light {
            name: String::new(),
            kind: LightKind::Point {
                position: DVec3::ONE,
            },
            color: Color::ONE,
            falls_off: true,
        };
        let shape = LightShape::Point(DVec3::ONE);
        assert_eq!(power_at(&light, &shape, DVec3::ONE), Color::ZERO);
        assert_eq!(
            power_at(&light, &shape, DVec3::new(1.0, 1.0, 3.0)),
            Color::splat(0.25)
        );
    }
}
