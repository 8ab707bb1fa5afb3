//! Queries of lights with size, and what they took.

use antumbra::VisibleFraction;

/// Which part of a light with size reaches a hit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AreaQuery {
    /// All samples of the light; 0 where its exact visible fraction answered.
    pub samples: u32,
    /// Those that the light shines from to the point, above the point's own plane.
    pub asked: u32,
    /// Of `asked`, those that reach it.
    pub lit: u32,
    /// The exact visible fraction, where that was wanted and has a closed form.
    pub exact: Option<VisibleFraction>,
}

/// Region of a light's shadow that a point lies in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Region {
    /// No sample was asked: the point or the light faces away.
    FacingAway,
    /// No sample that was asked reaches the point.
    Umbra,
    /// Some do.
    Penumbra,
    /// All do.
    Lit,
}

impl AreaQuery {
    /// Returns the visible fraction, 0 to 1.
    pub fn visible_fraction(&self) -> f64 {
        if let Some(exact) = self.exact {
            return exact.fraction;
        }
        f64::from(self.lit) / f64::from(self.samples.max(1))
    }

    /// Returns the share of the light that is asked about, 0 to 1.
    pub fn asked_fraction(&self) -> f64 {
        if let Some(exact) = self.exact {
            return exact.queried;
        }
        f64::from(self.asked) / f64::from(self.samples.max(1))
    }

    /// Returns what the point is.
    pub fn region(&self) -> Region {
        if let Some(exact) = self.exact {
            return if exact.queried == 0.0 {
                Region::FacingAway
            } else if exact.fraction == 0.0 {
                Region::Umbra
            } else if exact.fraction < exact.queried {
                Region::Penumbra
            } else {
                Region::Lit
            };
        }
        match (self.asked, self.lit) {
            (0, _) => Region::FacingAway,
            (_, 0) => Region::Umbra,
            (asked, lit) if lit < asked => Region::Penumbra,
            _ => Region::Lit,
        }
    }
}

/// Counts of samples of lights with size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AreaTally {
    /// One per shaded hit and light with size.
    pub points: u64,
    /// Of `points`, those where no sample was asked.
    pub facing_away: u64,
    /// Of `points`, those that no sample reaches that was asked.
    pub umbra: u64,
    /// Of `points`, those that some samples reach that were asked.
    pub penumbra: u64,
    /// Of `points`, those that all samples reach that were asked.
    pub lit: u64,
    /// Samples of all points.
    pub samples: u64,
    /// Of `samples`, those that were asked.
    pub asked: u64,
    /// Of `asked`, those found blocked.
    pub blocked: u64,
    /// Of `points`, those that the exact visible fraction answered, without samples.
    pub exact: u64,
}

impl AreaTally {
    pub(super) fn add(&mut self, other: &Self) {
        self.points += other.points;
        self.facing_away += other.facing_away;
        self.umbra += other.umbra;
        self.penumbra += other.penumbra;
        self.lit += other.lit;
        self.samples += other.samples;
        self.asked += other.asked;
        self.blocked += other.blocked;
        self.exact += other.exact;
    }

    pub(super) fn count(&mut self, query: &AreaQuery) {
        self.points += 1;
        self.exact += u64::from(query.exact.is_some());
        match query.region() {
            Region::FacingAway => self.facing_away += 1,
            Region::Umbra => self.umbra += 1,
            Region::Penumbra => self.penumbra += 1,
            Region::Lit => self.lit += 1,
        }
        self.samples += u64::from(query.samples);
        self.asked += u64::from(query.asked);
        self.blocked += u64::from(query.asked - query.lit);
    }
}
