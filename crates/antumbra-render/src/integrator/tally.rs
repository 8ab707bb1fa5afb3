//! Counts of the work of following rays.

use antumbra::Counters;

use super::area_query::AreaTally;
use super::bump_tally::BumpTally;
use super::seen_air::AirTally;

/// Counts of rays and queries.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rays from the eye.
    pub primary: u64,
    /// Rays from the eye that hit something.
    pub primary_hits: u64,
    /// Mirrored rays.
    pub reflection: u64,
    /// Refracted rays.
    pub refraction: u64,
    /// Rays that go on straight behind a surface that does not cover everything.
    pub passed: u64,
    /// One per shaded hit and light, whatever became of it.
    pub queries: u64,
    /// Of `queries`, those not asked because the surface faces away from the light.
    pub facing_away: u64,
    /// Of `queries`, those not asked because the point is outside the spot's cone.
    pub out_of_cone: u64,
    /// Samples of lights with size, which do not count under `queries`.
    pub area: AreaTally,
    /// Queries where the surface has a relief, which count under `queries`, too.
    pub bumps: BumpTally,
    /// Segments of rays in fog.
    pub air: AirTally,
    /// Counts of the shadow index, or of its stand-in.
    pub counters: Counters,
    /// Number of candidates that a stand-in found listed where its queries looked; 0 without one.
    pub candidates: u64,
}

impl Tally {
    /// Adds another tally to this one.
    pub fn add(&mut self, other: &Self) {
        self.primary += other.primary;
        self.primary_hits += other.primary_hits;
        self.reflection += other.reflection;
        self.refraction += other.refraction;
        self.passed += other.passed;
        self.queries += other.queries;
        self.facing_away += other.facing_away;
        self.out_of_cone += other.out_of_cone;
        self.area.add(&other.area);
        self.bumps.add(&other.bumps);
        self.air.add(&other.air);
        self.counters.add(&other.counters);
        self.candidates += other.candidates;
    }
}
