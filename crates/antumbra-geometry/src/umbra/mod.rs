//! How an element's umbra lies to a box (Paper 6, "the shadow umbra is projected").
//!
//! In: an element, a light and a [`Shaft`], the hull of a box and the light. Out: [`Relation`].
//! Invariants: `Covers` means that the element blocks every start in the box by the rule of
//! EXACTNESS.md, `Misses` that it blocks none; `Crosses` is always allowed. Both hold for starts
//! that lie in the box before their rounding is repaired, because callers inflate boxes by far more
//! than a rounding.

mod cone;
mod disk;
mod face;
mod freeform;
mod relation;
mod shaft;
mod sphere;

use std::ops::ControlFlow;

use crate::Bounds;

pub use shaft::Shaft;
pub(crate) use shaft::{MAX_CORNERS, SidePlane};

pub(crate) use cone::ConeUmbra;
pub(crate) use disk::DiskUmbra;
pub(crate) use face::FaceUmbra;
pub(crate) use freeform::FreeformUmbra;
pub use relation::Relation;
pub(crate) use relation::SHRINK;
pub(crate) use sphere::SphereUmbra;

/// One element's umbra behind one light.
#[derive(Clone, Debug)]
pub struct Umbra {
    pub(crate) shape: UmbraShape,
    pub(crate) is_self_clear: bool,
    /// Light may come through it, so it covers nothing.
    pub(crate) has_holes: bool,
}

#[derive(Clone, Debug)]
pub(crate) enum UmbraShape {
    /// Never blocks: transparent, degenerate, or seen from the edge.
    Nothing,
    /// In a box too small for arithmetic with error bounds.
    Tiny(Bounds),
    Face(FaceUmbra),
    Sphere(SphereUmbra),
    Cone(ConeUmbra),
    Disk(DiskUmbra),
    Freeform(FreeformUmbra),
}

impl Umbra {
    /// Returns how the umbra lies to the box of `shaft`.
    pub fn relation(&self, shaft: &Shaft) -> Relation {
        let relation = match &self.shape {
            UmbraShape::Nothing => Relation::Misses,
            UmbraShape::Tiny(bounds) if shaft.misses_box(bounds) => Relation::Misses,
            UmbraShape::Tiny(_) => Relation::Crosses,
            UmbraShape::Face(face) => face.relation(shaft),
            UmbraShape::Sphere(sphere) => sphere.relation(shaft),
            UmbraShape::Cone(cone) => cone.relation(shaft),
            UmbraShape::Disk(disk) => disk.relation(shaft),
            UmbraShape::Freeform(freeform) => freeform.relation(shaft),
        };
        if self.has_holes && relation == Relation::Covers {
            Relation::Crosses
        } else {
            relation
        }
    }

    /// Visits the surfaces of a patch, counted from its first, that may block some start of a shaft's box, until a visit
    /// breaks it off; `false` for other elements, of which nothing is visited.
    pub fn try_for_each_part(
        &self,
        shaft: &Shaft,
        visit: impl FnMut(u32) -> ControlFlow<()>,
    ) -> bool {
        let UmbraShape::Freeform(freeform @ FreeformUmbra::Patch(_)) = &self.shape else {
            return false;
        };
        let _ = freeform.try_for_each_in_the_way(shaft, visit);
        true
    }

    /// Returns whether the element can block none of its own points whose side faces the light
    /// (Paper 6.2: "only one convex object"). For closed curved shapes, points whose side faces
    /// away are decided by their own rule alone.
    pub fn is_self_clear(&self) -> bool {
        self.is_self_clear
    }

    /// Returns whether the element blocks nothing at all.
    pub fn is_nothing(&self) -> bool {
        matches!(self.shape, UmbraShape::Nothing)
    }
}
