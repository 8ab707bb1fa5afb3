//! Conservative overlap of analytic surfaces and a box.

use glam::{DVec3, Vec3Swizzles};

use super::DiskPlane;
use crate::{Bounds, Cone, Sphere};

/// Returns whether a sphere's surface may meet the closed box.
pub(crate) fn box_meets_sphere(bounds: &Bounds, sphere: &Sphere) -> bool {
    let nearest = sphere.center.clamp(bounds.min, bounds.max);
    let to_min = (bounds.min - sphere.center).abs();
    let to_max = (bounds.max - sphere.center).abs();
    let farthest = to_min.max(to_max);
    let radius_squared = sphere.radius * sphere.radius;
    nearest.distance_squared(sphere.center) <= radius_squared
        && farthest.length_squared() >= radius_squared
}

/// Returns whether a cone's wall or caps may meet the closed box.
pub(crate) fn box_meets_cone(bounds: &Bounds, cone: &Cone) -> bool {
    if !bounds.overlaps(&cone_bounds(cone)) {
        return false;
    }
    // Against the slab between the end planes and the shell between the smallest and the largest
    // distance from the axis that the box's middle allows.
    let length = (cone.apex - cone.base).length();
    let axis = (cone.apex - cone.base) / length;
    let center = bounds.center() - cone.base;
    let half = 0.5 * bounds.size();
    let reach = half.length();
    let height = center.dot(axis);
    let height_reach = half.dot(axis.abs());
    if height - height_reach > length || height + height_reach < 0.0 {
        return false;
    }
    let off_axis = (center - axis * height).length();
    let radius_at = |z: f64| {
        cone.base_radius + (cone.apex_radius - cone.base_radius) * (z / length).clamp(0.0, 1.0)
    };
    let ends = [
        radius_at(height - height_reach),
        radius_at(height + height_reach),
    ];
    let is_beyond = off_axis - reach > ends[0].max(ends[1]);
    let meets_cap =
        cone.is_closed && (height - height_reach <= 0.0 || height + height_reach >= length);
    let is_hollow = off_axis + reach < ends[0].min(ends[1]) && !meets_cap;
    !is_beyond && !is_hollow
}

/// Returns whether a disk may meet the closed box.
pub(crate) fn box_meets_disk(bounds: &Bounds, disk: &DiskPlane) -> bool {
    let normal = unit_of(disk.normal());
    let half = 0.5 * bounds.size();
    let height = (bounds.center() - disk.center).dot(normal);
    height.abs() <= half.dot(normal.abs())
        && disk
            .center
            .distance_squared(disk.center.clamp(bounds.min, bounds.max))
            <= disk.radius * disk.radius
        && bounds.overlaps(&disk_bounds(disk.center, normal, disk.radius))
}

/// Returns the unit vector along `v`, also where its squared length underflows.
pub(crate) fn unit_of(v: DVec3) -> DVec3 {
    (v / v.abs().max_element()).normalize()
}

/// Returns the box around a disk; around its whole ball where the normal is zero.
pub(crate) fn disk_bounds(center: DVec3, normal: DVec3, radius: f64) -> Bounds {
    let unit = unit_of(normal);
    // The sine of the angle to each axis, from the other two components: 1 - x^2 would cancel for
    // normals near an axis and lose up to 2^-26 of the radius.
    let squares = unit * unit;
    let sines = (squares.yzx() + squares.zxy()).map(f64::sqrt);
    let reach = if sines.is_finite() {
        radius * sines
    } else {
        DVec3::splat(radius)
    };
    Bounds {
        min: center - reach,
        max: center + reach,
    }
}

/// Returns the box around a truncated cone.
pub(crate) fn cone_bounds(cone: &Cone) -> Bounds {
    let axis = cone.apex - cone.base;
    disk_bounds(cone.base, axis, cone.base_radius).union(disk_bounds(
        cone.apex,
        axis,
        cone.apex_radius,
    ))
}
