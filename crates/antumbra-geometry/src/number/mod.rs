//! Numbers for predicates: written once, evaluated twice.
//!
//! Every predicate is a polynomial in the given `f64`s, written over [`Number`]. It is first
//! evaluated in [`Approximate`] (`f64` with a running error bound); where that cannot tell a
//! sign, in [`Exact`]. Invariant: a sign that is returned is the sign of the exact real value.

mod approximate;
mod exact;
mod mantissa;
mod sign;
mod space;
mod unrounded;

pub(crate) use approximate::{Approximate, UNIT_ROUNDOFF};
pub(crate) use exact::Exact;
pub(crate) use sign::{Number, Sign};
pub(crate) use space::{Point4, Vector};
pub(crate) use unrounded::Unrounded;

/// Returns what the filter says or else what exact arithmetic says.
pub(crate) fn decide<T>(filtered: Option<T>, exact: impl FnOnce() -> Option<T>) -> T {
    filtered
        .or_else(exact)
        .expect("exact arithmetic always knows the sign")
}
