//! How large a scene may become.
//!
//! In: what is about to be made, in triangles and in bytes. Out: leave, or a refusal. Invariant: what
//! all leaves together allow is bounded, whatever copies of copies a small file asks for.

use crate::room::Room;

use super::Fault;

/// The most triangles a scene may expand to, copies included: 2^26.
const MAX_TRIANGLES: u64 = 1 << 26;
/// What an object costs at least, in triangles.
const OBJECT_COST: u64 = 8;

/// What a scene may still expand to. A few bytes can ask for a million copies of a million
/// triangles; this is where that ends.
#[derive(Debug)]
pub(super) struct Budget<'r> {
    left: u64,
    room: &'r mut Room,
}

impl<'r> Budget<'r> {
    pub(super) fn new(room: &'r mut Room) -> Self {
        Self {
            left: MAX_TRIANGLES,
            room,
        }
    }

    /// Returns what may still be taken, for what is given back soon.
    pub(super) fn room(&self) -> Room {
        self.room.clone()
    }

    /// Takes bytes of the scene.
    pub(super) fn take(&mut self, bytes: u64, path: impl Fn() -> String) -> Result<(), Fault> {
        self.room.take(bytes, path).map_err(Fault::over_limit)
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
