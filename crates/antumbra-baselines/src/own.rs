//! antumbra itself, and the rivals that answer query by query, as methods among others.

use std::sync::{Mutex, MutexGuard, PoisonError};

use antumbra::{Answer, Counters, LightId, QueryError, Shadow, ShadowCounters, ShadowIndex};
use antumbra_geometry::ReceiverPoint;

use crate::{Batch, LoadedBatch, Rival, ShadowMethod, Work};

/// Batches hold queries that have an answer.
const VALID: &str = "a batch's starts and light are the index's own";

/// A shadow index under a name, perhaps with a rival that answers in its place.
#[derive(Debug)]
pub struct IndexMethod {
    name: String,
    index: ShadowIndex,
    rival: Option<Box<dyn Rival>>,
}

impl IndexMethod {
    /// Wraps an index.
    pub fn new(name: impl Into<String>, index: ShadowIndex) -> Self {
        Self {
            name: name.into(),
            index,
            rival: None,
        }
    }

    /// Wraps a rival and the index that it was built for.
    pub fn of_rival(rival: Box<dyn Rival>, index: ShadowIndex) -> Self {
        Self {
            name: rival.kind().name().to_owned(),
            index,
            rival: Some(rival),
        }
    }

    /// Returns the rival that answers, if one does.
    pub fn rival(&self) -> Option<&dyn Rival> {
        self.rival.as_deref()
    }

    /// Returns whether all answers are the reference's.
    pub fn is_exact(&self) -> bool {
        self.rival().is_none_or(|rival| rival.kind().is_exact())
    }

    /// Returns the bytes that are kept for shadow queries, mean over the lights: of a rival all that it
    /// keeps; of an index values and lists, not grid and tree.
    pub fn bytes_per_light(&self) -> f64 {
        let lights = 0..self.index.lights().len();
        let bytes = match self.rival() {
            Some(rival) => lights.clone().map(|light| rival.bytes(light)).sum(),
            None => self.index.occlusion_bytes() + self.index.table_bytes(),
        };
        bytes as f64 / lights.len().max(1) as f64
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
                method: self,
                batch,
            },
            counters: Mutex::default(),
        }
    }

    /// Answers a batch once and returns how its queries were decided.
    pub fn decisions(&self, batch: &Batch) -> ShadowCounters {
        self.work(batch).counters.shadow
    }

    /// Answers a batch once, query by query, and returns what that took.
    pub fn work(&self, batch: &Batch) -> Work {
        let mut work = Work::default();
        for start in &batch.starts {
            let (light, work) = (batch.light, &mut work);
            match &self.rival {
                Some(rival) => rival.shadow(&self.index, start, light, work),
                None => self
                    .index
                    .shadow(start, LightId::from_index(light), &mut work.counters),
            }
            .expect(VALID);
        }
        work
    }

    /// Answers one query.
    ///
    /// # Errors
    /// As [`ShadowIndex::shadow`].
    pub fn shadow(
        &self,
        start: &ReceiverPoint,
        light: usize,
        counters: &mut Counters,
    ) -> Result<Answer, QueryError> {
        let Some(rival) = &self.rival else {
            return self
                .index
                .shadow(start, LightId::from_index(light), counters);
        };
        let mut work = Work::default();
        let answer = rival.shadow(&self.index, start, light, &mut work);
        counters.add(&work.counters);
        answer
    }
}

impl ShadowMethod for IndexMethod {
    fn name(&self) -> &str {
        &self.name
    }

    fn load<'a>(&'a self, batch: &'a Batch) -> Box<dyn LoadedBatch + 'a> {
        Box::new(Loaded {
            method: self,
            batch,
        })
    }
}

#[derive(Debug)]
struct Loaded<'a> {
    method: &'a IndexMethod,
    batch: &'a Batch,
}

impl Loaded<'_> {
    fn answer_counted(&self, first: usize, is_shadowed: &mut [bool]) -> ShadowCounters {
        let starts = &self.batch.starts[first..first + is_shadowed.len()];
        let IndexMethod { index, rival, .. } = self.method;
        if let Some(rival) = rival {
            let mut work = Work::default();
            for (start, is_shadowed) in starts.iter().zip(is_shadowed) {
                let answer = rival.shadow(index, start, self.batch.light, &mut work);
                *is_shadowed = answer.expect(VALID).shadow == Shadow::Shadowed;
            }
            return work.counters.shadow;
        }
        let mut counters = Counters::default();
        index
            .shadows(
                starts,
                LightId::from_index(self.batch.light),
                is_shadowed,
                &mut counters,
            )
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
