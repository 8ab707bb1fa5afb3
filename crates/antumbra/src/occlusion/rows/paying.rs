//! Makes the rows that pay: one thread at a time, while others answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use antumbra_geometry::{LightShape, ReceiverPoint};

use super::super::adaptive::Scene;
use super::ledger::Asked;
use super::light_rows::LightRows;
use super::table::{Key, Place, ROW_BLOCK, RowTable};

impl LightRows {
    /// Notes what some starts asked for and how long they took.
    pub(crate) fn note(&self, asked: &Asked, ns: u64) {
        self.ledger().note(asked, ns);
    }

    /// Makes the rows that pay, if `more` times as many starts as were noted since the last rows are known to come.
    /// Returns whether there are new ones. Who finds another thread at it goes on.
    pub(crate) fn make_what_pays(
        &self,
        scene: &Scene<'_>,
        lights: &[LightShape],
        more: f64,
    ) -> bool {
        let Some(_making) = self.begin_making() else {
            return false;
        };
        let counts = [lights.len(), scene.occluders.triangle_count()];
        let keys = self.ledger().worth_it(counts, more);
        self.make_noted(scene, lights, keys).is_some()
    }

    /// Makes the rows of all starts that have none, as far as there is room, whether they pay or not. Returns how many.
    pub(crate) fn make_for(
        &self,
        scene: &Scene<'_>,
        lights: &[LightShape],
        starts: &[ReceiverPoint],
    ) -> usize {
        let Some(_making) = self.begin_making() else {
            return 0;
        };
        let before = self.table();
        let mut keys = Vec::new();
        for starts in starts.chunks(ROW_BLOCK) {
            let places = self.find(scene.occluders, before.as_deref(), starts);
            let missing = places.iter().filter_map(|place| match place {
                Place::Missing(key) => Some(*key),
                Place::Row(_) | Place::Nowhere => None,
            });
            for key in missing {
                if keys.last() != Some(&key) {
                    keys.push(key);
                }
            }
        }
        let rows_of = |table: Option<Arc<RowTable>>| table.map_or(0, |table| table.row_count());
        let count = rows_of(before);
        self.make_noted(scene, lights, keys);
        rows_of(self.table()) - count
    }

    /// Returns the right to make rows, unless another thread has it. Nobody waits for it, and the ledger is free
    /// meanwhile: a thread that waits for others of its pool may take up a query.
    fn begin_making(&self) -> Option<Turn<'_>> {
        let is_free = !self.is_making.swap(true, Ordering::Acquire);
        is_free.then_some(Turn(&self.is_making))
    }

    /// Makes rows and notes what they took. The caller has the right to.
    fn make_noted(
        &self,
        scene: &Scene<'_>,
        lights: &[LightShape],
        mut keys: Vec<Key>,
    ) -> Option<Arc<RowTable>> {
        keys.sort_unstable();
        keys.dedup();
        if keys.is_empty() || lights.is_empty() {
            return None;
        }
        // All threads work on it: the time on the wall, for each of them.
        let begin = std::time::Instant::now();
        let made = self.make(scene, lights, &keys);
        let ns = begin.elapsed().as_nanos() as f64 * crate::threads::count() as f64;
        let counts = [lights.len(), scene.occluders.triangle_count()];
        self.ledger().pay(&keys, counts, ns, made.is_some());
        made
    }
}

/// The right to make rows, which goes back when it is dropped.
struct Turn<'a>(&'a AtomicBool);

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}
