//! Methods that are compared.

use antumbra::{Answer, Counters, LightId, Method, QueryError, ShadowIndex};
use antumbra_geometry::ReceiverPoint;
use antumbra_render::prepare::StandIn;

use crate::failure::Failure;

/// Makes a stand-in for an index, in so many bytes.
pub type BuildStandIn =
    dyn Fn(&ShadowIndex, u64) -> Result<Option<Box<dyn StandIn>>, Failure> + Send + Sync;

/// Another method to compare, which answers in the place of an index.
pub struct Other {
    /// Name.
    pub name: &'static str,
    /// Whether its answers have to be the judge's.
    pub is_exact: bool,
    /// The index that it is built for.
    pub method: Method,
    /// Makes it.
    pub build: Box<BuildStandIn>,
}

/// A method that is compared.
pub(super) struct Candidate {
    pub(super) name: &'static str,
    pub(super) is_exact: bool,
    pub(super) index: ShadowIndex,
    pub(super) stand_in: Option<Box<dyn StandIn>>,
}

impl Candidate {
    pub(super) fn shadow(
        &self,
        start: &ReceiverPoint,
        light: usize,
        counters: &mut Counters,
    ) -> Result<Answer, QueryError> {
        match &self.stand_in {
            Some(other) => other.shadow(&self.index, start, light, counters, &mut 0),
            None => self
                .index
                .shadow(start, LightId::from_index(light), counters),
        }
    }
}

/// Why every query has an answer.
pub(super) const VALID: &str = "starts are finite, surfaces exist";
