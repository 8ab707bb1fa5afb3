//! The binary part of a GLB, and what the JSON says about it.
//!
//! In: lists of numbers, or bytes. Out: their indices as accessors or views. Invariant: each view
//! begins at a multiple of four bytes.

use serde_json::{Value, json};

/// `componentType` of 32-bit floating-point numbers.
const FLOAT: u32 = 5126;
/// `componentType` of 32-bit indices.
const UNSIGNED_INT: u32 = 5125;

/// The bytes so far.
#[derive(Default)]
pub(super) struct Buffer {
    pub(super) bytes: Vec<u8>,
    pub(super) views: Vec<Value>,
    pub(super) accessors: Vec<Value>,
}

impl Buffer {
    /// Adds bytes; returns their view.
    pub(super) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({
            "buffer": 0,
            "byteOffset": self.bytes.len(),
            "byteLength": bytes.len(),
        }));
        self.bytes.extend(bytes);
        self.views.len() - 1
    }

    /// Adds vectors of `N` numbers, with the bounds that positions need; returns their accessor.
    pub(super) fn vectors<const N: usize>(&mut self, vectors: &[[f32; N]]) -> usize {
        let mut least = [f32::INFINITY; N];
        let mut largest = [f32::NEG_INFINITY; N];
        for vector in vectors {
            for axis in 0..N {
                least[axis] = least[axis].min(vector[axis]);
                largest[axis] = largest[axis].max(vector[axis]);
            }
        }
        let bytes: Vec<u8> = vectors
            .iter()
            .flatten()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        let accessor = json!({
            "bufferView": self.view(&bytes),
            "componentType": FLOAT,
            "count": vectors.len(),
            "type": format!("VEC{N}"),
            "min": least.to_vec(),
            "max": largest.to_vec(),
        });
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Adds indices; returns their accessor.
    pub(super) fn indices(&mut self, indices: &[u32]) -> usize {
        let bytes: Vec<u8> = indices.iter().flat_map(|x| x.to_le_bytes()).collect();
        let accessor = json!({
            "bufferView": self.view(&bytes),
            "componentType": UNSIGNED_INT,
            "count": indices.len(),
            "type": "SCALAR",
        });
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }
}
