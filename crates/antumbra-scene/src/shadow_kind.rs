//! How a material blocks light.

/// Effect of a surface on shadow rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ShadowKind {
    /// Blocks all of them.
    Opaque,
    /// Blocks those that meet it where its texture's alpha is not below the cutoff.
    AlphaTested,
    /// Blocks none.
    Transparent,
}
