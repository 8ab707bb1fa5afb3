//! antumbra itself, as one method among others.

use std::sync::{Mutex, MutexGuard, PoisonError};

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

    /// Returns the index, to be changed.
    pub fn index_mut(&mut self) -> &mut ShadowIndex {
        &mut self.index
    }

    /// Brings a batch into the form that [`ShadowMethod::load`] does, which tells how its queries were
    /// decided besides.
    pub fn load_counted<'a>(&'a self, batch: &'a Batch) -> CountedBatch<'a> {
        CountedBatch {
            loaded: Loaded {
                index: &self.index,
                batch,
            },
            counters: Mutex::default(),
        }
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

#[derive(Debug)]
struct Loaded<'a> {
    index: &'a ShadowIndex,
    batch: &'a Batch,
}

impl Loaded<'_> {
    fn answer_counted(&self, first: usize, is_shadowed: &mut [bool]) -> ShadowCounters {
        let mut counters = Counters::default();
        let starts = &self.batch.starts[first..first + is_shadowed.len()];
        self.index
            .shadows(starts, self.batch.light, is_shadowed, &mut counters)
            .expect(VALID);
        counters.shadow
    }
}

impl LoadedBatch for Loaded<'_> {
    fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
        self.answer_counted(first, is_shadowed);
    }
}

/// A batch for an index, and how its queries were decided so far.
#[derive(Debug)]
pub struct CountedBatch<'a> {
    loaded: Loaded<'a>,
    counters: Mutex<ShadowCounters>,
}

impl CountedBatch<'_> {
    /// Returns how all queries were decided that were answered so far.
    pub fn decisions(&self) -> ShadowCounters {
        *self.lock()
    }

    fn lock(&self) -> MutexGuard<'_, ShadowCounters> {
        // Sums are whole whoever panicked elsewhere.
        self.counters.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl LoadedBatch for CountedBatch<'_> {
    fn answer(&self, first: usize, is_shadowed: &mut [bool]) {
        let counters = self.loaded.answer_counted(first, is_shadowed);
        // Once a call, which is for thousands of queries.
        self.lock().add(&counters);
    }
}
