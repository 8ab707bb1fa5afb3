//! What this crate uses of rayon, on one thread.

/// Returns the number of threads.
pub(crate) fn count() -> usize {
    1
}

/// Does the work.
pub(crate) fn apart<T>(work: impl FnOnce() -> T) -> T {
    work()
}

/// Does one after the other.
pub(crate) fn join<A, B>(first: impl FnOnce() -> A, second: impl FnOnce() -> B) -> (A, B) {
    (first(), second())
}

/// What `rayon::prelude` brings.
pub(crate) mod prelude {
    pub(crate) use super::{IntoAlone as _, SliceAlone as _};
}

/// An iterator whose methods take the arguments of a parallel one's.
pub(crate) struct Alone<I>(I);

/// Stands for `IntoParallelIterator`.
pub(crate) trait IntoAlone: IntoIterator + Sized {
    fn into_par_iter(self) -> Alone<Self::IntoIter> {
        Alone(self.into_iter())
    }
}

impl<I: IntoIterator> IntoAlone for I {}

/// Stands for `ParallelSlice` and `ParallelSliceMut`.
pub(crate) trait SliceAlone<T> {
    fn par_chunks(&self, length: usize) -> Alone<std::slice::Chunks<'_, T>>;

    fn par_chunks_mut(&mut self, length: usize) -> Alone<std::slice::ChunksMut<'_, T>>;
}

impl<T> SliceAlone<T> for [T] {
    fn par_chunks(&self, length: usize) -> Alone<std::slice::Chunks<'_, T>> {
        Alone(self.chunks(length))
    }

    fn par_chunks_mut(&mut self, length: usize) -> Alone<std::slice::ChunksMut<'_, T>> {
        Alone(self.chunks_mut(length))
    }
}

impl<I: Iterator> Alone<I> {
    pub(crate) fn enumerate(self) -> Alone<std::iter::Enumerate<I>> {
        Alone(self.0.enumerate())
    }

    pub(crate) fn map<B>(self, f: impl FnMut(I::Item) -> B) -> Alone<impl Iterator<Item = B>> {
        Alone(self.0.map(f))
    }

    pub(crate) fn map_init<S, B>(
        self,
        init: impl FnOnce() -> S,
        mut f: impl FnMut(&mut S, I::Item) -> B,
    ) -> Alone<impl Iterator<Item = B>> {
        let mut state = init();
        Alone(self.0.map(move |item| f(&mut state, item)))
    }

    pub(crate) fn filter_map<B>(
        self,
        f: impl FnMut(I::Item) -> Option<B>,
    ) -> Alone<impl Iterator<Item = B>> {
        Alone(self.0.filter_map(f))
    }

    pub(crate) fn for_each(self, f: impl FnMut(I::Item)) {
        self.0.for_each(f);
    }

    pub(crate) fn reduce(
        self,
        identity: impl FnOnce() -> I::Item,
        f: impl FnMut(I::Item, I::Item) -> I::Item,
    ) -> I::Item {
        self.0.fold(identity(), f)
    }

    pub(crate) fn reduce_with(self, f: impl FnMut(I::Item, I::Item) -> I::Item) -> Option<I::Item> {
        self.0.reduce(f)
    }

    pub(crate) fn collect<C: FromIterator<I::Item>>(self) -> C {
        self.0.collect()
    }
}
