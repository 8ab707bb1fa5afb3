//! How large a scene may become.
//!
//! In: what is about to be made, in triangles. Out: leave, or a refusal. Invariant: what all
//! leaves together allow is bounded, whatever copies of copies a small file asks for.

use super::Fault;

/// The most triangles a scene may expand to, copies included: 2^26, some 10 GB of model.
const MAX_TRIANGLES: u64 = 1 << 26;
/// What an object costs at least, in triangles.
const OBJECT_COST: u64 = 8;

/// What a scene may still expand to. A few bytes can ask for a million copies of a million
/// triangles; this is where that ends.
#[derive(Debug)]
pub(super) struct Budget {
    left: u64,
}

impl Budget {
    pub(super) fn new() -> Self {
        Self {
            left: MAX_TRIANGLES,
        }
    }

    /// Takes `passes` times as many triangles.
    pub(super) fn charge(
        &mut self,
        triangles: usize,
        passes: usize,
        path: impl Fn() -> String,
    ) -> Result<(), Fault> {
        let cost = (triangles as u64)
            .max(OBJECT_COST)
            .saturating_mul(passes as u64);
        match self.left.checked_sub(cost) {
            Some(left) => {
                self.left = left;
                Ok(())
            }
            None => {
                let problem = format!(
                    "with all copies and morph targets, the scene has more than {MAX_TRIANGLES} \
                     triangles"
                );
                Err(Fault::at(path(), problem, "split the scene"))
            }
        }
    }
}
