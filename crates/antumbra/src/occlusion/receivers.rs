//! Where the starts of points are, and whose values speak of them.
//!
//! In: a start. Out: a receiver class, if the start is within the room of its point; or where else one is that answers the
//! same. What is not surely told is left to rays.

use antumbra_geometry::{DVec3, LightShape, ReceiverPoint, SurfaceId};
use fearless_simd::Simd;

use super::lattice::Lattice;
use super::lookup::Lookup;
use super::value::ReceiverClass;

/// Where the answer to a start is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Asks {
    /// In the values of a receiver class, at the start's point.
    In(ReceiverClass),
    /// Its own rule shadows it.
    OwnShadow,
    /// The start may not be where its point is; or no values speak of it.
    Doubt,
}

impl Asks {
    /// Values speak of starts on a triangle by the side that the light is on; of those that the light's
    /// plane holds none do.
    #[inline(always)]
    fn on_side(side: i8) -> Self {
        match side {
            1 => Self::In(ReceiverClass::Front),
            -1 => Self::In(ReceiverClass::Back),
            _ => Self::Doubt,
        }
    }
}

/// Where a start is whose point may be off its surface.
pub(super) enum Moved {
    /// Its own rule shadows it.
    OwnShadow,
    /// Within the room of a point.
    To(DVec3, ReceiverClass),
    /// Nobody knows well enough.
    Unknown,
}

/// Where a segment comes into the box of all cells.
pub(super) enum Entry {
    /// Within half a room of a point of the segment, inside.
    At(DVec3),
    Never,
    /// Too far away to tell well.
    Unknown,
}

/// Points farther out are none: 2^100, as for geometry.
const LARGEST_POINT: f64 = 1.2676506002282294e30;

impl<S: Simd> Lookup<'_, S> {
    /// Returns whose values speak of a start that is where its point is.
    #[inline(always)]
    pub(super) fn class(&self, start: &ReceiverPoint, x: [f32; 3]) -> Asks {
        let Some(SurfaceId(surface)) = start.surface else {
            return Asks::In(ReceiverClass::Free);
        };
        let surface = surface as usize;
        let Some(forms) = self.tables.start_forms(surface) else {
            return self.class_on_ball(surface, start.point);
        };
        if !forms.is_start(self.simd, x) {
            return Asks::Doubt;
        }
        Asks::on_side(self.tables.side(surface).unwrap_or(0))
    }

    #[inline(always)]
    pub(super) fn class_on_ball(&self, surface: usize, point: DVec3) -> Asks {
        let number = surface.wrapping_sub(self.tables.triangle_count());
        let Some(ball) = self.tables.scene.ball_starts.get(number) else {
            return Asks::Doubt;
        };
        let on_ball = ball.tell(point, self.light(), self.room());
        match (on_ball.front & 1, on_ball.own_shadow & 1) {
            (1, _) => Asks::In(ReceiverClass::Front),
            (_, 1) => Asks::OwnShadow,
            _ => Asks::Doubt,
        }
    }

    /// Tells where the start of a point is that may be off its surface.
    pub(super) fn move_onto_surface(&self, start: &ReceiverPoint) -> Moved {
        let Some(surface) = start.surface else {
            return Moved::Unknown;
        };
        let is_near = start.point.abs().cmple(DVec3::splat(LARGEST_POINT)).all();
        if !is_near || surface.0 as usize >= self.occluders.surface_count() {
            return Moved::Unknown;
        }
        let segment = self.occluders.segment(start, self.light());
        let room = 0.5 * self.room();
        let asks = match self.tables.side(surface.0 as usize) {
            Some(side) => Asks::on_side(side),
            None => {
                // Values speak of starts that no own rule shadows.
                if self.occluders.own_rule_blocks(&segment) {
                    return Moved::OwnShadow;
                }
                let point = segment.origin();
                if self.occluders.is_surely_near_curved(surface, point, room) {
                    Asks::In(ReceiverClass::Front)
                } else {
                    Asks::Doubt
                }
            }
        };
        match asks {
            Asks::In(class) if segment.origin_error() < room => Moved::To(segment.origin(), class),
            _ => Moved::Unknown,
        }
    }

    /// Returns where the segment of a free start outside all cells comes in.
    #[inline(always)]
    pub(super) fn entry(&self, point: DVec3) -> Entry {
        let lattice = &self.values.lattices[ReceiverClass::Free as usize];
        let is_near = point.abs().cmple(DVec3::splat(LARGEST_POINT)).all();
        if !is_near || lattice.bounds().contains(point) {
            return Entry::Unknown;
        }
        enter(lattice, point, self.light())
    }
}

/// Returns where the segment from a point outside comes into a lattice's box: a slab test with a box
/// that is a quarter of the room wider, which covers its rounding.
fn enter(lattice: &Lattice, from: DVec3, light: &LightShape) -> Entry {
    const SHORTEST: f64 = 1e-200;
    let (towards, reach) = match *light {
        LightShape::Point(light) => (light - from, 1.0),
        LightShape::Direction(direction) => (direction, f64::INFINITY),
    };
    let (room, bounds) = (lattice.room(), lattice.bounds());
    // Each parameter errs by a few roundings of itself.
    let farthest = (from - bounds.center()).abs().max_element() + bounds.size().max_element();
    let is_known = farthest * 32.0 * f64::EPSILON < 0.125 * room;
    if !is_known || towards.abs().max_element() < SHORTEST {
        return Entry::Unknown;
    }
    let wider = bounds.inflated(DVec3::splat(0.25 * room));
    let (mut enters, mut leaves) = (0.0_f64, reach);
    for axis in 0..3 {
        let rate = 1.0 / towards[axis];
        if !rate.is_finite() {
            if from[axis] < wider.min[axis] || from[axis] > wider.max[axis] {
                return Entry::Never;
            }
            continue;
        }
        let at = |plane: DVec3| (plane[axis] - from[axis]) * rate;
        let (a, b) = (at(wider.min), at(wider.max));
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    if enters > leaves {
        return Entry::Never;
    }
    let inside = bounds.inflated(DVec3::splat(-room / 64.0));
    Entry::At((from + towards * enters).clamp(inside.min, inside.max))
}
