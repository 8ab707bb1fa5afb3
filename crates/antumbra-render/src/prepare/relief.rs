//! The relief of a surface at a hit: how high it may be, how high it is, and how it leans.
//!
//! In: a material's [`Bump`], a point, how its picture lies there. Out: a [`Relief`]; the share of the height; a normal.
//! Invariant: all is `f64`, each operation rounded once, as EXACTNESS.md ("Bumps") has it, so the same on every platform.
//! Absent here: who asks about shadows. Paper 7.2.

use antumbra_geometry::DVec3;
use antumbra_scene::model::{Bump, Texture};

use crate::vector::unit;

/// Reliefs of pictures of heights have this share of their picture's length.
const OF_HEIGHTS: f64 = 1.0 / 64.0;

/// Largest lift by pictures of normals, whose reliefs are flatter, as a rule.
const OF_NORMALS: f64 = 1.0 / 256.0;

/// The least share of its height: it keeps starts off the surface, which they may be rounded behind.
const LEAST_SHARE: f64 = 1.0 / 64.0;

/// Lower reliefs, in shares of the largest coordinate, are not told from rounding.
const LOWEST: f64 = 1.0 / (1_u64 << 30) as f64;

/// Points and what is measured from them stay below: 2^99.
const LARGEST: f64 = 6.338253001141147e29;

/// The least cosine between normals of a relief and of its surface.
const LEAST_COSINE: f64 = 1e-3;

/// The relief of a surface at a hit.
#[derive(Clone, Copy, Debug)]
pub struct Relief<'a> {
    /// Height of the whole, world units.
    height: f64,
    kind: Kind<'a>,
}

#[derive(Clone, Copy, Debug)]
enum Kind<'a> {
    Heights {
        picture: Picture<'a>,
        is_turned: bool,
    },
    Normals {
        picture: Picture<'a>,
        scale: f64,
    },
    InSpace(Bump),
}

/// A picture, and how it lies on a triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Picture<'a> {
    texture: &'a Texture,
    place: [f64; 2],
    /// How the position changes along both axes of the picture.
    along: [DVec3; 2],
    /// World units that the picture takes, in the mean of both axes.
    length: f64,
}

impl<'a> Relief<'a> {
    /// Returns the relief of a height at a point, if it is told from rounding and in range.
    fn of(height: f64, kind: Kind<'a>, point: DVec3) -> Option<Self> {
        let reach = point.abs().max_element();
        // Not for what is no number.
        let is_tangible = height > LOWEST * reach && height + reach < LARGEST;
        is_tangible.then_some(Self { height, kind })
    }

    /// Returns the relief of a material in space at a point.
    pub(super) fn in_space(bump: Bump, point: DVec3) -> Option<Self> {
        Self::of(bump.height_in_space()?, Kind::InSpace(bump), point)
    }

    /// Returns the relief of a picture of a material at a point.
    pub(super) fn in_picture(bump: Bump, picture: Picture<'a>, point: DVec3) -> Option<Self> {
        let (factor, kind) = match bump {
            Bump::Heights { multiplier, .. } => {
                let is_turned = multiplier < 0.0;
                (
                    multiplier * OF_HEIGHTS,
                    Kind::Heights { picture, is_turned },
                )
            }
            Bump::Normals { scale, .. } => (scale * OF_NORMALS, Kind::Normals { picture, scale }),
            Bump::Noise { .. } | Bump::Ripples { .. } => return None,
        };
        Self::of(factor.abs() * picture.length, kind, point)
    }
}

impl Relief<'_> {
    /// Returns the point that is a share of the relief's height over another, along a unit normal.
    pub(crate) fn lifted(&self, point: DVec3, normal: DVec3, share: f64) -> DVec3 {
        point + (share.max(LEAST_SHARE) * self.height) * normal
    }

    /// Returns the ends of all places where [`Relief::lifted`] may put a point.
    pub(crate) fn reach(&self, point: DVec3, normal: DVec3) -> [DVec3; 2] {
        [LEAST_SHARE, 1.0].map(|share| self.lifted(point, normal, share))
    }

    /// Returns the share of the height that the relief has at a point, 0 to 1.
    pub(crate) fn share(&self, point: DVec3) -> f64 {
        match &self.kind {
            Kind::Heights { picture, is_turned } => picture.height(picture.place, *is_turned),
            Kind::Normals { picture, scale } => {
                let leaning = picture.normal(*scale);
                let flat = DVec3::new(leaning.x, leaning.y, 0.0);
                let share = flat.length() / leaning.length();
                // Not for no direction at all.
                if share.is_finite() {
                    share.min(1.0)
                } else {
                    0.0
                }
            }
            Kind::InSpace(bump) => bump.share_in_space(point).0,
        }
    }

    /// Returns the shading normal of the relief: of heights that grow to the front, or if `is_back` to the back
    /// (Blinn 1978, "Simulation of Wrinkled Surfaces"). `geometric` and `shading` are the unit normals of the surface, to the
    /// front, and so is what is returned.
    pub(crate) fn normal(
        &self,
        point: DVec3,
        geometric: DVec3,
        shading: DVec3,
        is_back: bool,
    ) -> DVec3 {
        let up = if is_back { -1.0 } else { 1.0 };
        let leaning = match &self.kind {
            Kind::Heights { picture, is_turned } => {
                let slope = picture.slope(geometric, *is_turned);
                unit(shading - (up * self.height) * slope)
            }
            Kind::Normals { picture, scale } => picture.turned(picture.normal(*scale), shading),
            Kind::InSpace(bump) => {
                let (_, slope) = bump.share_in_space(point);
                let slope = slope - slope.dot(geometric) * geometric;
                unit(shading - (up * self.height) * slope)
            }
        };
        let leaning = leaning.unwrap_or(shading);
        let cosine = leaning.dot(geometric);
        if cosine >= LEAST_COSINE {
            return leaning;
        }
        // A steeper one would be seen from behind.
        unit(leaning + (LEAST_COSINE - cosine) * geometric).unwrap_or(shading)
    }
}

impl<'a> Picture<'a> {
    /// Returns a picture at a place in it, as it lies on a triangle by the places of its corners; `None` where it has no size.
    pub(super) fn on_triangle(
        texture: &'a Texture,
        place: [f64; 2],
        [a, b, c]: [DVec3; 3],
        [uv_a, uv_b, uv_c]: [[f64; 2]; 3],
    ) -> Option<Self> {
        let (f, g) = (b - a, c - a);
        let [[u1, v1], [u2, v2]] = [uv_b, uv_c].map(|uv| [0, 1].map(|i: usize| uv[i] - uv_a[i]));
        let turn = u1 * v2 - u2 * v1;
        let picture = Self {
            texture,
            place,
            along: [(f * v2 - g * v1) / turn, (g * u1 - f * u2) / turn],
            length: (f.cross(g).length() / turn.abs()).sqrt(),
        };
        let is_fine =
            picture.length.is_finite() && picture.along.iter().all(|along| along.is_finite());
        is_fine.then_some(picture)
    }

    fn height(&self, place: [f64; 2], is_turned: bool) -> f64 {
        let [red, ..] = self.texture.sample_stored(place);
        if is_turned { 1.0 - red } else { red }
    }

    /// Returns how the height grows along a surface with a unit normal.
    fn slope(&self, normal: DVec3, is_turned: bool) -> DVec3 {
        let sides = [self.texture.width, self.texture.height];
        let [by_u, by_v] = [0, 1].map(|axis: usize| {
            let side = f64::from(sides[axis].max(1));
            let beside = |step: f64| {
                let mut place = self.place;
                place[axis] += step / side;
                self.height(place, is_turned)
            };
            (beside(1.0) - beside(-1.0)) * (0.5 * side)
        });
        let [along_u, along_v] = self.along;
        let turn = normal.dot(along_u.cross(along_v));
        let slope = (by_u * along_v.cross(normal) + by_v * normal.cross(along_u)) / turn;
        if slope.is_finite() {
            slope
        } else {
            DVec3::ZERO
        }
    }

    /// Returns the normal that the picture has: x along its rows, y up its columns, z out of the surface.
    fn normal(&self, scale: f64) -> DVec3 {
        let [x, y, z, _] = self.texture.sample_stored(self.place);
        let [x, y, z] = [x, y, z].map(|stored| 2.0 * stored - 1.0);
        DVec3::new(scale * x, scale * y, z)
    }

    /// Returns a normal of the picture in world space, for a surface with a unit normal.
    fn turned(&self, leaning: DVec3, normal: DVec3) -> Option<DVec3> {
        let [along_u, along_v] = self.along;
        let right = unit(along_u - along_u.dot(normal) * normal)?;
        let up = normal.cross(right);
        // Places in pictures go down.
        let up = if up.dot(along_v) > 0.0 { -up } else { up };
        unit(leaning.x * right + leaning.y * up + leaning.z * normal)
    }
}
