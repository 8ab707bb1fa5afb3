//! The analytic shapes as plain data. World space throughout.

use glam::DVec3;

/// A sphere surface.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sphere {
    /// Centre, world space.
    pub center: DVec3,
    /// Radius, positive.
    pub radius: f64,
}

/// A truncated cone or a cylinder, from base to apex; with or without its two end caps.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Cone {
    /// Centre of the base circle, world space.
    pub base: DVec3,
    /// Radius at the base, not negative.
    pub base_radius: f64,
    /// Centre of the other end, world space.
    pub apex: DVec3,
    /// Radius at the apex end, not negative; equal radii make a cylinder.
    pub apex_radius: f64,
    /// Whether the two ends are closed by disks. NFF cones are open tubes.
    pub is_closed: bool,
}

/// A flat round disk.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Disk {
    /// Centre, world space.
    pub center: DVec3,
    /// Normal, any length but zero.
    pub normal: DVec3,
    /// Radius, positive.
    pub radius: f64,
}
