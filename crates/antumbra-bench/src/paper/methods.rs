//! The methods that the paper's tables compare.

use antumbra_baselines::RivalKind;
use antumbra_cli::methods::Shadows;

use super::super::contender::Contender;

/// Plain traversal: what all are measured by.
pub(super) const GRID: Contender = Contender::Ours(Shadows::Grid);

/// The paper's own method.
pub(super) const VOXEL_1990: Contender = Contender::Ours(Shadows::Voxel1990);

/// Ours.
pub(super) const VOXEL: Contender = Contender::Ours(Shadows::Voxel);

/// The methods that are compared.
pub(super) const METHODS: [Contender; 6] = [
    GRID,
    VOXEL_1990,
    VOXEL,
    Contender::Rival(RivalKind::LightBuffer),
    Contender::Rival(RivalKind::Hybrid),
    Contender::Rival(RivalKind::ShadowVolumes),
];
