//! Starts near each other, and what each triangle of the tree may block of them.
//!
//! In: up to 64 starts, and for each the triangle that it is on with the one side asked about. Out: their box, and for a leaf's
//! triangles the starts that have something of it on that side. Invariant: a triangle that has nothing there blocks nothing
//! of the start (README.md of `crate::query::beam`, "Tiles").

use antumbra_geometry::{Occluders, ReceiverPoint, SurfaceId, SurfacePlane};

use super::super::data::{Bvh, Child, ChildKind, LANES};
use super::super::ray::{INSIDE, USUAL_ORIGIN_ERROR};
use super::super::walk::lanes;
use super::forms::{Origins, Seen, StartBox};
use super::targets::{TARGETS, bits};

/// Answers about leaves that a tile remembers.
const REMEMBERED: usize = 256;

/// Starts near each other.
#[derive(Clone, Debug)]
pub(crate) struct Tile {
    /// Of the starts that the tree can take.
    bounds: StartBox,
    origins: Origins,
    /// Origins seen from the middle of the box.
    seen: Seen,
    /// Which starts these are, and how far each is moved onto its surface.
    inside: u64,
    offsets: [f64; TARGETS],
    largest_offset: f64,
    /// Triangles with the side that is asked about, and which starts these hold for.
    planes: Vec<(SurfacePlane, i8, u64)>,
    /// Starts of no such triangle.
    free: u64,
    /// Which starts each triangle of some leaves may block: those with something of it on their side.
    leaves: Vec<(Child, [u64; LANES])>,
}

/// A start of a tile.
#[derive(Debug)]
pub(crate) struct OfTile<'a> {
    pub(crate) tile: &'a mut Tile,
    /// Its number among the tile's.
    pub(crate) place: usize,
}

impl Tile {
    /// Returns a tile without starts.
    pub(crate) fn new() -> Self {
        Self {
            bounds: StartBox::new([0.0; 3], [0.0; 3]),
            origins: [[0.0; TARGETS]; 3],
            seen: Seen::default(),
            inside: 0,
            offsets: [0.0; TARGETS],
            largest_offset: 0.0,
            planes: Vec::with_capacity(TARGETS),
            free: 0,
            leaves: vec![(Child::NONE, [0; LANES]); REMEMBERED],
        }
    }

    /// Becomes the tile of up to 64 starts. `sides` has for each of them, or once for all, the triangle that it is on and the
    /// one side that is asked about: 1 in front, -1 behind; `None` where there is no such thing, or it is not to be used.
    pub(crate) fn hold(
        &mut self,
        bvh: &Bvh,
        occluders: &Occluders,
        starts: &[ReceiverPoint],
        sides: &[Option<(SurfaceId, i8)>],
    ) {
        (self.inside, self.largest_offset) = (0, 0.0);
        self.origins = [[0.0; TARGETS]; 3];
        for (number, start) in starts.iter().enumerate().take(TARGETS) {
            let offset = occluders.start_offset(start);
            let place = bvh.frame.point_in_frame(start.point);
            // Not for NaN.
            let is_inside =
                offset <= bvh.frame.margin_of_starts() && place.abs().max_element() <= INSIDE;
            if is_inside {
                self.inside |= 1 << number;
                self.offsets[number] = offset;
                self.largest_offset = self.largest_offset.max(offset);
                for axis in 0..3 {
                    self.origins[axis][number] = place[axis] as f32;
                }
            }
        }
        if self.inside != 0 {
            self.bounds = StartBox::of(&self.origins, self.inside);
        }
        self.seen = Seen::new(&self.origins, &self.bounds);
        self.hold_sides(occluders, sides);
    }

    fn hold_sides(&mut self, occluders: &Occluders, sides: &[Option<(SurfaceId, i8)>]) {
        let is_kept = |kept: &(SurfacePlane, i8, u64)| {
            kept.2 == u64::MAX && sides == [Some((kept.0.surface(), kept.1))]
        };
        if matches!(&self.planes[..], [kept] if is_kept(kept)) {
            return;
        }
        self.leaves.fill((Child::NONE, [0; LANES]));
        self.planes.clear();
        self.free = 0;
        for (number, side) in sides.iter().enumerate() {
            let starts = if sides.len() == 1 {
                u64::MAX
            } else {
                1 << number
            };
            let is_same = |&(own, side): &(SurfaceId, i8), plane: &(SurfacePlane, i8, u64)| {
                plane.0.surface() == own && plane.1 == side
            };
            let mut planes = self.planes.iter_mut();
            let known = side.and_then(|side| planes.find(|plane| is_same(&side, plane)));
            if let Some((.., mask)) = known {
                *mask |= starts;
                continue;
            }
            match side.and_then(|(own, side)| Some((occluders.plane_of(own)?, side))) {
                Some((plane, side)) => self.planes.push((plane, side, starts)),
                None => self.free |= starts,
            }
        }
    }

    /// Returns the starts that are moved little enough, where lengths are multiplied by up to a scale.
    #[inline]
    pub(super) fn fit_for(&self, scale: f64) -> u64 {
        let is_fit = |offset: f64| offset * scale <= USUAL_ORIGIN_ERROR;
        if is_fit(self.largest_offset) {
            return self.inside;
        }
        let starts = bits(self.inside).filter(|&start| is_fit(self.offsets[start]));
        starts.fold(0, |mask, start| mask | 1 << start)
    }

    /// Returns the starts that the tree can take, a bit each.
    pub(super) fn inside(&self) -> u64 {
        self.inside
    }

    pub(super) fn bounds(&self) -> StartBox {
        self.bounds
    }

    pub(super) fn origins(&self) -> &Origins {
        &self.origins
    }

    pub(super) fn seen(&self) -> &Seen {
        &self.seen
    }

    /// Returns for each triangle of a leaf the starts that it may block, by the sides asked about.
    #[inline]
    pub(super) fn starts_below(
        &mut self,
        bvh: &Bvh,
        occluders: &Occluders,
        leaf: Child,
    ) -> &[u64; LANES] {
        const ALL: [u64; LANES] = [u64::MAX; LANES];
        if self.planes.is_empty() || leaf.kind() != ChildKind::Triangles {
            return &ALL;
        }
        let entry = &mut self.leaves[leaf.index() % REMEMBERED];
        if entry.0 != leaf {
            let members = &bvh.triangles[leaf.index()].members;
            let mut masks = [0; LANES];
            for lane in lanes(u32::from(members.opaque)) {
                let surface = members.surfaces[lane % LANES];
                let planes = self.planes.iter();
                let below = planes.filter(|(plane, side, _)| {
                    !occluders.has_nothing_beyond(plane, *side, surface)
                });
                masks[lane % LANES] = below.fold(self.free, |mask, plane| mask | plane.2);
            }
            *entry = (leaf, masks);
        }
        &entry.1
    }

    /// Returns which triangles of a leaf may block some starts.
    #[inline]
    pub(super) fn may_block(
        &mut self,
        bvh: &Bvh,
        occluders: &Occluders,
        leaf: Child,
        starts: u64,
    ) -> u32 {
        let masks = self.starts_below(bvh, occluders, leaf);
        (0..LANES).fold(0, |lanes, lane| {
            lanes | u32::from(masks[lane] & starts != 0) << lane
        })
    }

    /// Returns whether nothing of a leaf blocks a segment that is asked about.
    #[inline]
    pub(super) fn rules_out(&mut self, bvh: &Bvh, occluders: &Occluders, leaf: Child) -> bool {
        leaf.kind() == ChildKind::Triangles
            && self.may_block(bvh, occluders, leaf, u64::MAX)
                & u32::from(bvh.triangles[leaf.index()].members.opaque)
                == 0
    }
}
