//! Buffer views that meshopt has compressed (EXT_meshopt_compression, KHR_meshopt_compression).
//!
//! In: a view and the bytes that it is packed in. Out: the bytes that the view stands for. Invariant:
//! as many as the file's counts say, charged before they are taken; whatever the packed bytes are,
//! what comes out is that many bytes or an error. The codec is the crate `meshoptimizer-rs`, whose
//! bytes are those of meshoptimizer.

use meshoptimizer_rs::{
    Error, Limits, Workspace,
    codec::{
        decode_filter_color, decode_filter_exp, decode_filter_oct, decode_filter_quat,
        decode_index_buffer, decode_index_sequence, decode_vertex_buffer,
    },
};

use crate::{error::quoted, room::Room};

use super::{
    Fault,
    buffers::Buffers,
    document::{BufferView, Meshopt},
};

/// Decodes all compressed views of a document.
pub(super) fn decode_all(buffers: &mut Buffers<'_>, room: &mut Room) -> Result<(), Fault> {
    for (index, view) in buffers.document().buffer_views.iter().enumerate() {
        if let Some(packed) = view.extensions.meshopt() {
            let decoded = decode(buffers, index, view, packed, room)?;
            buffers.add_decoded(index, decoded);
        }
    }
    Ok(())
}

/// Decodes view `index`.
fn decode(
    buffers: &Buffers<'_>,
    index: usize,
    view: &BufferView,
    packed: &Meshopt,
    room: &mut Room,
) -> Result<Vec<u8>, Fault> {
    let here = || format!("bufferViews[{index}].extensions.meshopt_compression");
    let fail = |problem: String| Fault::at(here(), problem, "export the file again");
    let bytes = buffers.part(packed.buffer, packed.byte_offset, packed.byte_length, here)?;
    let Meshopt {
        count,
        byte_stride: stride,
        ..
    } = *packed;
    let length = count.checked_mul(stride);
    if length != Some(view.byte_length) || stride > 256 {
        return Err(fail(format!(
            "{count} elements of {stride} bytes do not make the view's {} bytes",
            view.byte_length
        )));
    }
    room.take(view.byte_length, here)
        .map_err(Fault::over_limit)?;
    if count == 0 {
        return Ok(Vec::new());
    }
    let (Ok(count), Ok(stride)) = (usize::try_from(count), usize::try_from(stride)) else {
        return Err(fail("the count is too large".into()));
    };
    let refuse = |error: Error| fail(format!("the data cannot be decoded: {error}"));
    // The room has been asked.
    let limits = Limits {
        max_bytes: usize::MAX,
        max_work: u64::MAX,
    };
    let workspace = &mut Workspace::new(limits);
    let decode = match &*packed.mode {
        "ATTRIBUTES" => decode_vertex_buffer,
        "TRIANGLES" => decode_index_buffer,
        "INDICES" => decode_index_sequence,
        other => return Err(fail(format!("{} is no mode", quoted(other)))),
    };
    let mut decoded = decode(count, stride, bytes, workspace).map_err(refuse)?;
    let filter = match packed.filter.as_deref() {
        None | Some("NONE") => return Ok(decoded),
        Some("OCTAHEDRAL") => decode_filter_oct,
        Some("QUATERNION") => decode_filter_quat,
        Some("EXPONENTIAL") => decode_filter_exp,
        Some("COLOR") => decode_filter_color,
        Some(other) => return Err(fail(format!("{} is no filter", quoted(other)))),
    };
    filter(&mut decoded, count, stride, workspace).map_err(refuse)?;
    Ok(decoded)
}
