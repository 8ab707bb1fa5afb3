//! Lists of answers, one for each of many questions, on all threads.
//!
//! In: how many questions, and what adds the answers of one. Out: all answers, question after question, and where those of
//! each end. Invariant: neither answers nor the error depend on threads.

use super::run::chunk_length;
use crate::threads::prelude::*;

/// Answers question after question, and where those of each end.
type Lists<T> = (Vec<T>, Vec<usize>);

/// Returns what `add` appends for each number below `count`, on all threads of the current pool; or the error of the
/// first number that has one.
pub(super) fn lists<T: Send, E: Send>(
    count: usize,
    add: impl Fn(usize, &mut Vec<T>) -> Result<(), E> + Sync,
) -> Result<Lists<T>, E> {
    let length = chunk_length(count);
    let task = antumbra_task::current();
    let chunk_of = |chunk: usize| -> Result<Lists<T>, E> {
        let (mut all, mut ends) = (Vec::new(), Vec::new());
        for number in chunk * length..count.min((chunk + 1) * length) {
            // Each may meet everything.
            antumbra_task::check();
            add(number, &mut all)?;
            ends.push(all.len());
        }
        Ok((all, ends))
    };
    let found: Vec<_> = (0..count.div_ceil(length))
        .into_par_iter()
        .map(|chunk| task.enter(|| chunk_of(chunk)))
        .collect();
    let (mut all, mut ends) = (Vec::new(), Vec::new());
    for chunk in found {
        let (more, more_ends) = chunk?;
        let before = all.len();
        all.extend(more);
        ends.extend(more_ends.iter().map(|end| before + end));
    }
    Ok((all, ends))
}
