//! Points to ask about: where they are, and what they are.

use antumbra_geometry::{DVec3, Precision, SurfaceId};

/// Three coordinates in the form that the caller has them.
pub trait Coordinates: Copy + Sync {
    /// How finely they are given.
    const PRECISION: Precision;

    /// Returns them as `f64`, without rounding.
    fn as_f64(self) -> DVec3;
}

impl Coordinates for DVec3 {
    const PRECISION: Precision = Precision::Double;

    fn as_f64(self) -> DVec3 {
        self
    }
}

impl Coordinates for [f64; 3] {
    const PRECISION: Precision = Precision::Double;

    fn as_f64(self) -> DVec3 {
        DVec3::from_array(self)
    }
}

impl Coordinates for [f32; 3] {
    const PRECISION: Precision = Precision::Single;

    fn as_f64(self) -> DVec3 {
        DVec3::from_array(self.map(f64::from))
    }
}

/// The name of a surface: a [`SurfaceId`], or its number.
pub trait SurfaceNumber: Copy {
    /// Returns the numbers of some, without a copy.
    fn numbers(surfaces: &[Self]) -> &[u32];
}

impl SurfaceNumber for SurfaceId {
    fn numbers(surfaces: &[Self]) -> &[u32] {
        Self::numbers(surfaces)
    }
}

impl SurfaceNumber for u32 {
    fn numbers(surfaces: &[Self]) -> &[u32] {
        surfaces
    }
}

/// Points to ask about, all of one kind.
///
/// Coordinates of points and normals are finite and at most 2^100 in magnitude.
#[derive(Clone, Copy, Debug)]
pub struct Batch<'a, P = [f64; 3]> {
    /// The points, world space.
    pub points: &'a [P],
    /// Kind of the points.
    pub kind: BatchKind<'a, P>,
}

/// Kind of the points of a [`Batch`]. Slices have an item a point.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub enum BatchKind<'a, P = [f64; 3]> {
    /// Points of space: free queries.
    Free,
    /// Points of space that face somewhere. Those whose light is not strictly on their normal's side
    /// (`N . L <= 0`, the exact sign) are shadowed; the others are free queries from the point as given.
    Facing {
        /// World space, any length; a zero normal faces no light.
        normals: &'a [P],
    },
    /// Points on surfaces, up to rounding: surface queries. On a triangle or a disk the rule of starts repairs it;
    /// on a curved surface the point stays as given.
    OnSurfaces {
        /// Numbers of [`SurfaceId`]s.
        surfaces: &'a [u32],
        /// Largest distance of a point from its surface, world units, infinite for any. `None` for what rounding to
        /// `f32` may make of it ([`Occluders::rounding`](antumbra_geometry::Occluders::rounding)), whatever the
        /// points are given in: a point farther off most likely names another mesh's surface.
        tolerance: Option<f64>,
    },
    /// Points on surfaces, up to rounding, whose surfaces [`ShadowIndex::start_near`](crate::ShadowIndex::start_near) finds: surface
    /// queries. As these do not depend on the side that is looked at, normals only choose among surfaces.
    OnNearest {
        /// World space, any length; zero for none.
        normals: Option<&'a [P]>,
        /// How near they are to them. The precision is that which the points had once, before they were
        /// perhaps widened.
        nearness: Nearness,
    },
}

impl<'a, P> Batch<'a, P> {
    /// Makes a batch of points of space.
    pub fn free(points: &'a [P]) -> Self {
        let kind = BatchKind::Free;
        Self { points, kind }
    }

    /// Makes a batch of points of space that face somewhere ([`BatchKind::Facing`]).
    pub fn facing(points: &'a [P], normals: &'a [P]) -> Self {
        let kind = BatchKind::Facing { normals };
        Self { points, kind }
    }

    /// Makes a batch of points on surfaces: a [`SurfaceId`] or its number for each ([`BatchKind::OnSurfaces`]).
    pub fn on_surfaces<S: SurfaceNumber>(points: &'a [P], surfaces: &'a [S]) -> Self {
        let kind = BatchKind::OnSurfaces {
            surfaces: S::numbers(surfaces),
            tolerance: None,
        };
        Self { points, kind }
    }

    /// Makes a batch of points on the nearest surfaces, as far as they are rounded
    /// ([`BatchKind::OnNearest`]).
    pub fn on_nearest(points: &'a [P], normals: Option<&'a [P]>) -> Self
    where
        P: Coordinates,
    {
        let nearness = Nearness {
            precision: P::PRECISION,
            tolerance: None,
        };
        let kind = BatchKind::OnNearest { normals, nearness };
        Self { points, kind }
    }
}

/// Which samples a receiver point can see at all, by its own plane. Free starts without a normal see all.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum ReceiverSide {
    /// Those in front of the surface, as its winding says.
    #[default]
    Front,
    /// Those behind it.
    Back,
    /// All, on whatever side of the surface they are.
    Both,
    /// Those on this normal's side of the point, by the exact sign.
    Normal(DVec3),
}

/// How far a point may be from the surface that it is meant to lie on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nearness {
    /// How the coordinates were rounded: what decides where nothing else is said, and which surfaces tie.
    pub precision: Precision,
    /// The largest distance, world units; `None` for what rounding may have moved the point
    /// ([`Occluders::rounding`](antumbra_geometry::Occluders::rounding)).
    pub tolerance: Option<f64>,
}
