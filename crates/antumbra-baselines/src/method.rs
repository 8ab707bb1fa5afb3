//! The trait that every method stands behind.

use antumbra_geometry::{DVec3, LightShape, ReceiverPoint};

/// Shadow queries to one light, in the order in which they are asked.
#[derive(Clone, Debug)]
pub struct Batch {
    /// The light's number in the index that the queries are for.
    pub light: usize,
    /// Its shape.
    pub light_shape: LightShape,
    /// Starts of the queries.
    pub starts: Vec<ReceiverPoint>,
    /// For each start the unit normal of its surface on the light's side, for methods that lift
    /// starts off their surface; zero for free queries.
    pub normals: Vec<DVec3>,
    /// Whether neighbours in the order are neighbours in space; methods may use it.
    pub is_coherent: bool,
}

/// Shadow queries of starts that have targets of their own, in the order in which they are asked.
#[derive(Clone, Debug, Default)]
pub struct TargetBatch {
    /// Starts of the queries.
    pub starts: Vec<ReceiverPoint>,
    /// As [`Batch::normals`].
    pub normals: Vec<DVec3>,
    /// Those of a start lie together, start after start.
    pub targets: Vec<LightShape>,
    /// How many targets each start has.
    pub per_start: usize,
}

/// A way to answer shadow queries.
pub trait ShadowMethod {
    /// Returns the name for tables.
    fn name(&self) -> &str;

    /// Brings a batch into the form the method takes; not part of its time.
    fn load<'a>(&'a self, batch: &'a Batch) -> Box<dyn LoadedBatch + 'a>;
}

/// A batch in the form a method takes.
pub trait LoadedBatch: Sync {
    /// Answers as many queries as `is_shadowed` has places, the first of them number `first`, a
    /// multiple of 8.
    ///
    /// # Panics
    /// The batch ends before the places do, or `first` is no multiple of 8.
    fn answer(&self, first: usize, is_shadowed: &mut [bool]);
}
