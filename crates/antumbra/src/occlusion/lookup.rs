//! What values know of starts.
//!
//! In: starts. Out: a [`Found`] each. Invariant: an answer that is found is the reference's. Absent here:
//! rays, lights' power, how values were made.

use antumbra_geometry::{DVec3, LightShape, Occluders, ReceiverPoint, SurfaceId};
use fearless_simd::{Simd, dispatch};

use super::adaptive::{AdaptiveValues, Known, Lists, PackedLight};
use super::bricks::{Finder, Leaf, Store};
use super::forms::Verdict;
pub(crate) use super::found::{BLOCK, Found, Looked};
use super::lattice::Code;
use super::links::Link;
pub(super) use super::looking::Lookup;
pub(crate) use super::looking::Source;
use super::many::{MANY, Told};
use super::packed::{self, Packed};
use super::receivers::{Asks, Entry, Moved};
use super::sync::{AtomicU32, Ordering};
use super::value::ReceiverClass;

/// Of a start's code, the first bits are its key: cells of 16^3.
const KEY_BITS: u32 = 12;

impl AdaptiveValues {
    /// Finds what is known of at most [`BLOCK`] starts.
    #[inline]
    pub(crate) fn find(
        &self,
        (lists, store): (&Lists, &Store),
        occluders: &Occluders,
        starts: &[ReceiverPoint],
        light: usize,
    ) -> Looked {
        let Some(tables) = self.tables(occluders, light, lists) else {
            return Looked::NOTHING;
        };
        dispatch!(self.level, simd => {
            let source = Source::Growing(store);
            let lookup = Lookup { simd, values: self, number: light, tables, source, occluders };
            lookup.find(store, starts)
        })
    }

    /// Answers at most [`MANY`] starts by values that are packed.
    #[inline]
    pub(crate) fn find_many(
        &self,
        PackedLight { packed, lists, .. }: &PackedLight,
        occluders: &Occluders,
        starts: &[ReceiverPoint],
        light: usize,
        is_shadowed: &mut [bool],
    ) -> Told {
        let Some(tables) = self.tables(occluders, light, lists) else {
            return Told::nothing(starts.len().min(MANY));
        };
        dispatch!(self.level, simd => {
            let source = Source::Packed(packed);
            let lookup = Lookup { simd, values: self, number: light, tables, source, occluders };
            lookup.find_many(packed, starts, is_shadowed)
        })
    }

    /// Finds what is known of one start by values that are packed.
    #[inline]
    pub(crate) fn find_packed(
        &self,
        PackedLight { packed, lists, .. }: &PackedLight,
        occluders: &Occluders,
        start: &ReceiverPoint,
        light: usize,
    ) -> Found {
        let Some(tables) = self.tables(occluders, light, lists) else {
            return Found::NOTHING;
        };
        dispatch!(self.level, simd => {
            let source = Source::Packed(packed);
            let lookup = Lookup { simd, values: self, number: light, tables, source, occluders };
            lookup.find_packed(packed, start)
        })
    }

    /// Finds what is known of one start, and where the link of its cell stands; 0 where that does not
    /// matter.
    #[inline]
    pub(crate) fn find_one(
        &self,
        (lists, store): (&Lists, &Store),
        occluders: &Occluders,
        start: &ReceiverPoint,
        light: usize,
    ) -> (Found, u32) {
        let Some(tables) = self.tables(occluders, light, lists) else {
            return (Found::NOTHING, 0);
        };
        dispatch!(self.level, simd => {
            let source = Source::Growing(store);
            let lookup = Lookup { simd, values: self, number: light, tables, source, occluders };
            lookup.find_one(store, start)
        })
    }

    /// How many keys there are.
    pub(crate) const KEYS: usize = 1 << KEY_BITS;

    /// Writes for each start a key that starts near each other share.
    pub(crate) fn keys(&self, starts: &[ReceiverPoint], keys: &mut [u16]) {
        let lattice = &self.lattices[ReceiverClass::Front as usize];
        dispatch!(self.level, simd => {
            for (starts, keys) in starts.chunks(BLOCK).zip(keys.chunks_mut(BLOCK)) {
                let codes = lattice.codes(simd, &self.places(starts));
                for (number, key) in keys.iter_mut().enumerate() {
                    *key = codes.get(number).key(KEY_BITS);
                }
            }
        });
    }

    /// Returns where some starts lie, coordinate by coordinate.
    #[inline(always)]
    pub(super) fn places(&self, starts: &[ReceiverPoint]) -> [[f32; BLOCK]; 3] {
        let mut places = [[0.0; BLOCK]; 3];
        for (number, start) in starts.iter().enumerate() {
            let [x, y, z] = self.narrow(start.point);
            places[0][number] = x;
            places[1][number] = y;
            places[2][number] = z;
        }
        places
    }

    /// Returns whose values speak of a start, and where it lies; none if it is not where its point is.
    pub(super) fn code_of_start(
        &self,
        known: &Known,
        occluders: &Occluders,
        light: usize,
        start: &ReceiverPoint,
    ) -> Option<(ReceiverClass, Code)> {
        let tables = self.tables(occluders, light, &known.lists)?;
        let x = self.narrow(start.point);
        dispatch!(self.level, simd => {
            let code = self.lattices[0].code_of(simd, x);
            let source = Source::Nothing;
            let lookup = Lookup { simd, values: self, number: light, tables, source, occluders };
            match lookup.class(start, x) {
                Asks::In(class) => Some((class, code)),
                Asks::OwnShadow | Asks::Doubt => None,
            }
        })
    }

    /// Returns a point in the frame's units.
    #[inline(always)]
    pub(super) fn narrow(&self, point: DVec3) -> [f32; 3] {
        let x = self.frame.point_in_frame(point);
        [x.x as f32, x.y as f32, x.z as f32]
    }
}

/// A surface of a list.
pub(super) trait Listed {
    fn surface(&self) -> SurfaceId;
}

impl Listed for AtomicU32 {
    #[inline(always)]
    fn surface(&self) -> SurfaceId {
        SurfaceId(self.load(Ordering::Relaxed))
    }
}

impl Listed for u32 {
    #[inline(always)]
    fn surface(&self) -> SurfaceId {
        SurfaceId(*self)
    }
}

impl<S: Simd> Lookup<'_, S> {
    /// One step for all starts before the next: so the memory that they need is fetched together.
    #[inline(always)]
    fn find(&self, store: &Store, starts: &[ReceiverPoint]) -> Looked {
        let places = self.values.places(starts);
        let place = |number: usize| [0, 1, 2].map(|axis: usize| places[axis][number]);
        let lattice = &self.values.lattices[ReceiverClass::Front as usize];
        let codes = lattice.codes(self.simd, &places);
        let mut classes = [Asks::Doubt; BLOCK];
        for (number, start) in starts.iter().enumerate() {
            classes[number] = self.class(start, place(number));
        }
        let mut leaves = [Leaf::OUTSIDE; BLOCK];
        for class in ReceiverClass::ALL {
            let wanted = Asks::In(class);
            if !classes.contains(&wanted) {
                continue;
            }
            let finder = self.finder(store, class);
            for (number, leaf) in leaves.iter_mut().enumerate() {
                if classes[number] == wanted {
                    *leaf = finder.find(codes.get(number));
                }
            }
        }
        for (leaf, asks) in leaves.iter_mut().zip(&classes) {
            if *asks == Asks::OwnShadow {
                *leaf = Leaf::of(true);
            }
        }
        let mut looked = Looked::NOTHING;
        for (number, start) in starts.iter().enumerate() {
            let leaf = leaves[number];
            looked.places[number] = leaf.place;
            looked.found[number] = self.found(store, leaf, classes[number], start, place(number));
        }
        looked
    }

    /// Finds what is known of one start, and where the link of its cell stands; 0 where that does not
    /// matter.
    #[inline(always)]
    fn find_one(&self, store: &Store, start: &ReceiverPoint) -> (Found, u32) {
        let x = self.values.narrow(start.point);
        let asks = self.class(start, x);
        let leaf = match asks {
            Asks::In(class) => {
                let lattice = &self.values.lattices[class as usize];
                self.finder(store, class)
                    .find(lattice.code_of(self.simd, x))
            }
            Asks::OwnShadow => Leaf::of(true),
            Asks::Doubt => Leaf::OUTSIDE,
        };
        (self.found(store, leaf, asks, start, x), leaf.place)
    }

    /// Finds what is known of one start by values that are packed.
    #[inline(always)]
    pub(super) fn find_packed(&self, packed: &Packed, start: &ReceiverPoint) -> Found {
        let x = self.values.narrow(start.point);
        // Told as many starts are, so that it does not matter in whose company one is asked.
        let surface = start.surface.map(|SurfaceId(surface)| surface as usize);
        let asks = match surface.and_then(|surface| self.tables.start_planes().get(surface)) {
            Some(plane) => match plane.tell_one(self.simd, x) {
                Some(true) => Asks::In(ReceiverClass::Back),
                Some(false) => Asks::In(ReceiverClass::Front),
                None => Asks::Doubt,
            },
            None => self.class(start, x),
        };
        match asks {
            Asks::In(class) => {
                let lattice = &self.values.lattices[class as usize];
                let code = lattice.code_of(self.simd, x);
                match packed.find(class, code) {
                    Ok(is_shadowed) => Found::by_value(is_shadowed),
                    Err(packed::Leaf::OUTSIDE) => self.find_from_outside(start),
                    Err(leaf) => self.find_in_packed(packed, leaf, start, start.point, x),
                }
            }
            Asks::OwnShadow => Found::by_value(true),
            Asks::Doubt => self.find_off_surface(start),
        }
    }

    #[inline(always)]
    fn find_in_packed(
        &self,
        packed: &Packed,
        leaf: packed::Leaf,
        start: &ReceiverPoint,
        point: DVec3,
        x: [f32; 3],
    ) -> Found {
        match leaf.count() {
            0 => Found::NOTHING,
            _ => self.find_one_by_one(packed.list(leaf), start, point, x),
        }
    }

    /// Returns what a leaf tells of a start.
    #[inline(always)]
    fn found(
        &self,
        store: &Store,
        leaf: Leaf,
        asks: Asks,
        start: &ReceiverPoint,
        x: [f32; 3],
    ) -> Found {
        match leaf.link.answer() {
            Some(is_shadowed) => Found::by_value(is_shadowed),
            None if asks == Asks::Doubt => self.find_off_surface(start),
            None if leaf.link == Link::OUTSIDE => self.find_from_outside(start),
            None => self.find_in_list(store, leaf.link, start, start.point, x),
        }
    }

    #[inline(always)]
    fn finder<'s>(&self, store: &'s Store, class: ReceiverClass) -> Finder<'s> {
        let lattice = &self.values.lattices[class as usize];
        store.finder(class, lattice)
    }

    /// Returns the light.
    #[inline(always)]
    pub(super) fn light(&self) -> &LightShape {
        &self.values.lights[self.number].light
    }

    /// Returns how far a start may lie from its point, in world units.
    #[inline(always)]
    pub(super) fn room(&self) -> f64 {
        self.values.start_room
    }

    /// The start is not where its point is given, or is on a curved surface, or is none.
    #[cold]
    #[inline(never)]
    pub(super) fn find_off_surface(&self, start: &ReceiverPoint) -> Found {
        match self.move_onto_surface(start) {
            Moved::OwnShadow => Found::by_value(true),
            Moved::To(point, class) => self.find_at(start, point, class),
            Moved::Unknown => Found::NOTHING,
        }
    }

    /// A free start outside all cells answers as the point where its segment comes in: nothing blocks
    /// before that.
    #[cold]
    #[inline(never)]
    pub(super) fn find_from_outside(&self, start: &ReceiverPoint) -> Found {
        if start.surface.is_some() {
            return Found::NOTHING;
        }
        match self.entry(start.point) {
            Entry::Never => Found::by_value(false),
            Entry::Unknown => Found::NOTHING,
            Entry::At(point) => self.find_at(start, point, ReceiverClass::Free),
        }
    }

    /// Finds what is known of a start that answers as one within the room of a point does.
    #[inline(never)]
    fn find_at(&self, start: &ReceiverPoint, point: DVec3, class: ReceiverClass) -> Found {
        // What is not inlined has no wide registers of its own.
        self.simd.vectorize(
            #[inline(always)]
            || {
                let place = self.values.narrow(point);
                let code = self.values.lattices[class as usize].code_of(self.simd, place);
                match self.source {
                    Source::Nothing => Found::NOTHING,
                    Source::Growing(store) => {
                        let link = self.finder(store, class).find(code).link;
                        match link.answer() {
                            Some(is_shadowed) => Found::by_value(is_shadowed),
                            None => self.find_in_list(store, link, start, point, place),
                        }
                    }
                    Source::Packed(packed) => match packed.find(class, code) {
                        Ok(is_shadowed) => Found::by_value(is_shadowed),
                        Err(leaf) => self.find_in_packed(packed, leaf, start, point, place),
                    },
                }
            },
        )
    }

    /// Asks the blockers of a list about a start near `point`, which is `x` in the frame. Triangles of
    /// the start's own plane and its own sphere do not block it.
    #[inline(always)]
    fn find_in_list(
        &self,
        store: &Store,
        link: Link,
        start: &ReceiverPoint,
        point: DVec3,
        x: [f32; 3],
    ) -> Found {
        match link.list() {
            Some(list) => self.find_one_by_one(store.list(list), start, point, x),
            None => Found::NOTHING,
        }
    }

    /// Asks blockers one after the other.
    #[inline(always)]
    fn find_one_by_one(
        &self,
        entries: &[impl Listed],
        start: &ReceiverPoint,
        point: DVec3,
        x: [f32; 3],
    ) -> Found {
        let mut is_in_doubt = false;
        for entry in entries {
            let surface = entry.surface();
            let Some(forms) = self.tables.umbra_forms(surface.0 as usize) else {
                match self.curved_verdict(surface, start, point) {
                    Verdict::Outside => {}
                    Verdict::Inside => return Found::by_list(true),
                    Verdict::Doubt => is_in_doubt = true,
                }
                continue;
            };
            let verdict = forms.wide_verdict(self.simd, x);
            if verdict == Verdict::Outside {
                continue;
            }
            if start
                .surface
                .is_some_and(|own| self.tables.are_in_one_plane(own, surface))
            {
                continue;
            }
            if verdict == Verdict::Inside && self.occluders.is_opaque_everywhere(surface) {
                return Found::by_list(true);
            }
            is_in_doubt = true;
        }
        Found::by_list(is_in_doubt && self.is_blocked_exactly(entries, start, point, x))
    }

    /// Tells whether a listed surface that is no triangle blocks. The start's own solid does not: its own
    /// rule was asked before.
    #[inline(always)]
    pub(super) fn curved_verdict(
        &self,
        surface: SurfaceId,
        start: &ReceiverPoint,
        point: DVec3,
    ) -> Verdict {
        self.curved_verdict_within(surface, start, point, 0.0)
    }

    /// Tells the same of all starts that differ from one by at most so much in each coordinate.
    #[inline(always)]
    pub(super) fn curved_verdict_within(
        &self,
        surface: SurfaceId,
        start: &ReceiverPoint,
        point: DVec3,
        reach: f64,
    ) -> Verdict {
        let number = surface.0 as usize - self.tables.triangle_count();
        let ball = &self.tables.scene.balls[number];
        if start.surface == Some(surface) {
            return Verdict::Outside;
        }
        match ball.verdict(point, self.light(), self.room() + reach) {
            // Another one in the same place is its own, too.
            Verdict::Inside
                if start
                    .surface
                    .is_some_and(|own| self.occluders.have_one_own_rule(own, surface)) =>
            {
                Verdict::Outside
            }
            verdict => verdict,
        }
    }

    /// Asks the exact rule about what is in doubt.
    #[cold]
    #[inline(never)]
    pub(super) fn is_blocked_exactly(
        &self,
        entries: &[impl Listed],
        start: &ReceiverPoint,
        point: DVec3,
        x: [f32; 3],
    ) -> bool {
        let segment = self.occluders.segment(start, self.light());
        self.simd.vectorize(
            #[inline(always)]
            || {
                for entry in entries {
                    let surface = entry.surface();
                    let verdict = match self.tables.umbra_forms(surface.0 as usize) {
                        Some(forms) => forms.wide_verdict(self.simd, x),
                        None => self.curved_verdict(surface, start, point),
                    };
                    if verdict != Verdict::Outside && self.occluders.blocks(surface, &segment) {
                        return true;
                    }
                }
                false
            },
        )
    }
}
