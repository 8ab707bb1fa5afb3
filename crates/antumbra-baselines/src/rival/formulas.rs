//! Memory for one light as the paper counts it, to be set beside what is measured.
//!
//! In: a scene's surfaces and resolutions. Out: bytes. The paper gives orders of growth for both rivals (Paper 5.1,
//! 5.2): the number of entries if every object were listed everywhere. Each entry is counted with the bytes that
//! it takes here. Its own method has a plain formula (Paper 6.1).

use antumbra_geometry::{ElementKind, Occluders};

/// A formula and what it gives.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct PaperMemory {
    /// As the paper writes it.
    pub formula: &'static str,
    /// Bytes for one light.
    pub bytes: f64,
}

/// Voxel occlusion testing: two bits a voxel.
pub fn voxel_occlusion(resolution: [u32; 3]) -> PaperMemory {
    PaperMemory {
        formula: "2 N^3 bits",
        bytes: voxel_count(resolution) / 4.0,
    }
}

/// The light buffer of six planes of `side` times `side` cells: an object in every cell.
pub fn light_buffer(occluders: &Occluders, side: u32) -> PaperMemory {
    const ENTRY_BYTES: f64 = 8.0;
    let cells = 6.0 * f64::from(side) * f64::from(side);
    PaperMemory {
        formula: "O(N^2 n), six planes",
        bytes: ENTRY_BYTES * cells * occluders.elements().len() as f64,
    }
}

/// Hybrid shadow testing: the shadow polygons of all edges of all polygons in every voxel.
pub fn hybrid(occluders: &Occluders, resolution: [u32; 3]) -> PaperMemory {
    const ENTRY_BYTES: f64 = 4.0;
    let faces = occluders
        .elements()
        .iter()
        .filter(|element| element.kind == ElementKind::Face);
    // A polygon of k edges is k - 2 triangles. Their sum is E n.
    let edges: f64 = faces.map(|face| face.surfaces.len() as f64 + 2.0).sum();
    PaperMemory {
        formula: "O(E N^3 n)",
        bytes: ENTRY_BYTES * edges * voxel_count(resolution),
    }
}

fn voxel_count(resolution: [u32; 3]) -> f64 {
    resolution.iter().map(|&n| f64::from(n)).product()
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra_geometry::{DVec3, Opacity};

    #[test]
    fn formulas_are_those_of_the_paper() {
        assert_eq!(voxel_occlusion([40; 3]).bytes, 16_000.0);
        let mut builder = Occluders::builder();
        let square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let square = square.map(|(x, y)| DVec3::new(x, y, 0.0));
        builder.add_face(&square, Opacity::Opaque).unwrap();
        let occluders = builder.build();
        assert_eq!(light_buffer(&occluders, 10).bytes, 4800.0);
        // Four edges, one polygon.
        assert_eq!(hybrid(&occluders, [10, 10, 1]).bytes, 1600.0);
    }
}
