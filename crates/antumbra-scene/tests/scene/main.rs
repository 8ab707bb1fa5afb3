//! Tests of the readers, the writer and the generators through the crate's public face.

mod freeform;
mod generated;
mod glb;
mod gltf;
mod gltf_looks;
mod gltf_nodes;
mod gltf_packed;
mod gltf_shared;
mod lenient;
mod malformed;
mod nff;
mod obj;
mod pictures;
mod ply;
mod ply_errors;
mod round_trip;
mod shared;
mod stl;
mod support;
mod twins;
mod writers;
