//! When what lights know is computed.

/// When the values of [`Method::Voxel`](crate::Method::Voxel) and the maps of [`Method::Auto`](crate::Method::Auto) are computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum Refine {
    /// While queries are answered, where it is predicted to save time.
    #[default]
    Lazy,
    /// Before the first query, all of them.
    Eager,
    /// At the first queries of each voxel, whether it saves time or not: for tests and studies.
    Queried,
}
