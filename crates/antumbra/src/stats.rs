//! Counters of the work done, kept by the caller so that threads do not share them.

use crate::{Answer, Decided, Shadow};

/// Work of rays through the grid and the tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Voxels entered and nodes visited, all ray types; a node that rays of a batch visit together counts once.
    pub steps: u64,
    /// Surfaces tested, all ray types.
    pub intersections: u64,
    /// How shadow queries were decided.
    pub shadow: ShadowCounters,
}

/// How shadow queries were decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ShadowCounters {
    /// Decided by the value of the start's voxel.
    pub first_pass: u64,
    /// Decided by the value of a voxel on the way to the light.
    pub intermediate: u64,
    /// Decided by a list of the few possible blockers.
    pub blocker_list: u64,
    /// Decided by a full walk with intersections.
    pub rays: u64,
    /// Found blocked, however decided.
    pub shadowed: u64,
}

impl ShadowCounters {
    /// Adds another count to this one.
    pub fn add(&mut self, other: &Self) {
        self.first_pass += other.first_pass;
        self.intermediate += other.intermediate;
        self.blocker_list += other.blocker_list;
        self.rays += other.rays;
        self.shadowed += other.shadowed;
    }

    /// Counts one answer.
    #[inline]
    pub fn count(&mut self, answer: Answer) {
        match answer.decided {
            Decided::FirstPass => self.first_pass += 1,
            Decided::Intermediate => self.intermediate += 1,
            Decided::BlockerList => self.blocker_list += 1,
            Decided::Ray => self.rays += 1,
        }
        self.shadowed += u64::from(answer.shadow == Shadow::Shadowed);
    }
}

impl Counters {
    /// Adds another count to this one.
    pub fn add(&mut self, other: &Self) {
        self.steps += other.steps;
        self.intersections += other.intersections;
        self.shadow.add(&other.shadow);
    }
}

/// How the queries of a batch were decided.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BatchCounters {
    /// Those that were asked.
    pub counters: Counters,
    /// Those of [`BatchKind::Facing`](crate::BatchKind::Facing) that were shadowed without being asked.
    pub facing_away: u64,
}
