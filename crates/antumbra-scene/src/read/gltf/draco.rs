//! Primitives that Draco has compressed (KHR_draco_mesh_compression).
//!
//! In: a buffer view of Draco data and the attributes that are in it. Out: triangles and attributes
//! as packed numbers, which accessors are read from. Invariant: no more triangles than the file's
//! accessors say and no more bytes than there is room for, both asked before they are taken. The
//! codec is the crate `draco-core`; what it makes of bad data is an error.

use std::collections::BTreeMap;

use draco_core::{
    DataType, DecodeLimits, DecoderBuffer, ErrorKind, Mesh, MeshDecoder, PointAttribute, PointIndex,
};

use crate::room::Room;

use super::{
    Fault,
    accessor::Accessor,
    buffers::Buffers,
    component::Component,
    document::{Document, Primitive},
};

/// Bytes that decoding takes for each triangle besides the attributes: how they hang together.
const BYTES_A_TRIANGLE: u64 = 64;

/// What a Draco buffer holds.
#[derive(Debug)]
pub(super) struct Decoded {
    /// Corners of all triangles, 32 bits each.
    indices: Vec<u8>,
    attributes: BTreeMap<String, Attribute>,
    vertex_count: usize,
}

#[derive(Debug)]
struct Attribute {
    bytes: Vec<u8>,
    component: Component,
    width: usize,
    is_normalized: bool,
}

impl Decoded {
    pub(super) fn indices(&self) -> Accessor<'_> {
        let count = self.indices.len() / 4;
        Accessor::packed(&self.indices, count, Component::U32, 1, false)
    }

    pub(super) fn attribute(&self, name: &str) -> Option<Accessor<'_>> {
        let Attribute {
            bytes,
            component,
            width,
            is_normalized,
        } = self.attributes.get(name)?;
        let count = self.vertex_count;
        Some(Accessor::packed(
            bytes,
            count,
            *component,
            *width,
            *is_normalized,
        ))
    }
}

/// Decodes what `primitive` is packed in, if it is; `path` is the primitive's.
pub(super) fn decode(
    buffers: &Buffers<'_>,
    primitive: &Primitive,
    path: &str,
    room: &mut Room,
) -> Result<Option<Decoded>, Fault> {
    let Some(packed) = &primitive.extensions.draco else {
        return Ok(None);
    };
    let here = || format!("{path}.extensions.KHR_draco_mesh_compression");
    let fail = |problem: String| Fault::at(here(), problem, "export the file again");
    let document = buffers.document();
    let bytes = buffers.view(packed.buffer_view, here)?;
    let index_count = primitive
        .indices
        .and_then(|index| document.accessors.get(index))
        .ok_or_else(|| fail("expected `indices` with the number of corners".into()))?
        .count;
    let limits = DecodeLimits::default()
        .with_max_faces((index_count / 3).min(room.left() / BYTES_A_TRIANGLE))
        .with_max_points(index_count)
        .with_max_decoded_bytes(room.left());
    let mut mesh = Mesh::new();
    let mut source = DecoderBuffer::new(bytes).with_limits(limits);
    MeshDecoder::new()
        .decode(&mut source, &mut mesh)
        .map_err(|error| {
            let problem = match error.kind() {
                ErrorKind::LimitExceeded => {
                    "the data holds more than `indices` or the memory limit allow".to_owned()
                }
                _ => error.to_string().chars().take(200).collect(),
            };
            fail(format!("the data cannot be decoded: {problem}"))
        })?;
    let indices: Vec<u8> = mesh
        .faces()
        .iter()
        .flatten()
        .flat_map(|point| point.0.to_le_bytes())
        .collect();
    room.take(indices.len() as u64, here)
        .map_err(Fault::over_limit)?;
    let mut attributes = BTreeMap::new();
    for (name, &id) in &packed.attributes {
        let attribute = mesh
            .attribute_by_unique_id(id)
            .ok_or_else(|| fail(format!("the data holds no attribute {id} (`{name}`)")))?;
        let is_normalized = is_normalized(document, primitive, name);
        let attribute = unpacked(&mesh, attribute, is_normalized)
            .ok_or_else(|| fail(format!("`{name}` has a type or a size that is not read")))?;
        room.take(attribute.bytes.len() as u64, here)
            .map_err(Fault::over_limit)?;
        attributes.insert(name.clone(), attribute);
    }
    Ok(Some(Decoded {
        indices,
        attributes,
        vertex_count: mesh.num_points(),
    }))
}

fn is_normalized(document: &Document, primitive: &Primitive, name: &str) -> bool {
    let accessor = primitive.attributes.get(name);
    accessor
        .and_then(|&index| document.accessors.get(index))
        .is_some_and(|a| a.normalized)
}

/// Returns an attribute's values, point after point.
fn unpacked(mesh: &Mesh, attribute: &PointAttribute, is_normalized: bool) -> Option<Attribute> {
    let component = match attribute.data_type() {
        DataType::Int8 => Component::I8,
        DataType::Uint8 => Component::U8,
        DataType::Int16 => Component::I16,
        DataType::Uint16 => Component::U16,
        // Signed ones are refused as indices, not here: nothing else is a whole number of 32 bits.
        DataType::Uint32 => Component::U32,
        DataType::Float32 => Component::F32,
        _ => return None,
    };
    let width = usize::from(attribute.num_components());
    let size = width * component.size();
    let stride = usize::try_from(attribute.byte_stride()).ok()?;
    let data = attribute.buffer().data();
    let mut bytes = Vec::with_capacity(mesh.num_points().checked_mul(size)?);
    for point in 0..mesh.num_points() {
        let value = attribute.mapped_index(PointIndex(u32::try_from(point).ok()?));
        let start = (value.0 as usize).checked_mul(stride)?;
        bytes.extend_from_slice(data.get(start..start.checked_add(size)?)?);
    }
    Some(Attribute {
        bytes,
        component,
        width,
        is_normalized,
    })
}
