//! Who is right where answers differ: the exact rule, by testing every surface.

use antumbra::{LightId, Shadow, ShadowIndex};
use antumbra_baselines::Batch;
use rayon::prelude::*;
use serde::Serialize;

/// Verdicts on a rival's differences from us.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Verdicts {
    /// Answers that differ.
    pub(super) differences: usize,
    /// Of these, how many were judged, spread evenly.
    pub(super) judged: usize,
    /// Of the judged, where the rival is wrong.
    pub(super) rival_wrong: usize,
    /// Of the judged, where we are wrong.
    pub(super) ours_wrong: usize,
}

impl Verdicts {
    /// Adds those on other queries.
    pub(super) fn add(&mut self, other: &Self) {
        self.differences += other.differences;
        self.judged += other.judged;
        self.rival_wrong += other.rival_wrong;
        self.ours_wrong += other.ours_wrong;
    }

    pub(super) fn text(&self) -> String {
        format!(
            "{} different answers, {} judged: it is wrong in {}, we in {}",
            self.differences, self.judged, self.rival_wrong, self.ours_wrong
        )
    }
}

/// Judges at most `most` of the queries where the answers differ.
pub(super) fn judge(
    index: &ShadowIndex,
    batch: &Batch,
    ours: &[bool],
    rival: &[bool],
    most: usize,
) -> Verdicts {
    let different: Vec<usize> = (0..ours.len()).filter(|&i| ours[i] != rival[i]).collect();
    let judged = different.len().min(most);
    let ours_wrong = (0..judged)
        .into_par_iter()
        .filter(|number| {
            let query = different[number * different.len() / judged];
            let light = LightId::from_index(batch.light);
            let truth = index.shadow_by_reference(&batch.starts[query], light);
            ours[query] != (truth.expect("the query was answered before") == Shadow::Shadowed)
        })
        .count();
    Verdicts {
        differences: different.len(),
        judged,
        rival_wrong: judged - ours_wrong,
        ours_wrong,
    }
}
