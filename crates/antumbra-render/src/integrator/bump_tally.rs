//! Counts of queries where surfaces have a relief.

/// Counts of queries where the surface has a relief.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BumpTally {
    /// Queries of lights without size in front of the surface.
    pub queries: u64,
    /// Of `queries`, those whose start was not worked out: every one that there may be is lit.
    pub known_lit: u64,
    /// Of `queries`, those whose start was not worked out: every one that there may be is in shadow.
    pub known_shadowed: u64,
    /// Of `queries`, those that took the perturbed test.
    pub perturbed: u64,
}

impl BumpTally {
    /// Adds another tally to this one.
    pub fn add(&mut self, other: &Self) {
        self.queries += other.queries;
        self.known_lit += other.known_lit;
        self.known_shadowed += other.known_shadowed;
        self.perturbed += other.perturbed;
    }
}
