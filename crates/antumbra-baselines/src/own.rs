//! antumbra itself, as one method among others.

use antumbra::{Counters, ShadowCounters, ShadowIndex};

use crate::{Batch, LoadedBatch, ShadowMethod};

/// Batches hold queries that have an answer.
const VALID: &str = "a batch's starts and light are the index's own";

/// A shadow index under a name.
#[derive(Debug)]
pub struct IndexMethod {
    name: String,
    index: ShadowIndex,
}

impl IndexMethod {
    /// Wraps an index.
    pub fn new(name: impl Into<String>, index: ShadowIndex) -> Self {
        Self {
            name: name.into(),
            index,
        }
    }

    /// Returns the index.
    pub fn index(&self) -> &ShadowIndex {
        &self.index
    }

    /// Answers a batch once and returns how its queries were decided.
    pub fn decisions(&self, batch: &Batch) -> ShadowCounters {
        let mut counters = Counters::default();
        for start in &batch.starts {
            self.index
                .shadow(start, batch.light, &mut counters)
                .expect(VALID);
        }
        counters.shadow
    }
}

impl ShadowMethod for IndexMethod {
    fn name(&self) -> &str {
        &self.name
    }

    fn load<'a>(&'a self, batch: &'a Batch) -> Box<dyn LoadedBatch + 'a> {
        Box::new(Loaded {
            index: &self.index,
            batch,
        })
    }
}

struct Loaded<'a> {
    index: &'a ShadowIndex,
    batch: &'a Batch,
}

impl LoadedBatch for Loaded<'_> {
    fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
        let mut counters = Counters::default();
        let starts = &self.batch.starts[first..first + is_shadowed.len()];
        self.index
            .shadows(starts, self.batch.light, is_shadowed, &mut counters)
            .expect(VALID);
    }
}
