//! Light in the air: single scattering in a homogeneous medium.
//!
//! In: a [`Fog`], a ray, a light without size, stretches of the ray that the light reaches. Out: the light that those
//! stretches scatter towards the ray's origin. Formulas and bounds are in `docs/fog.md`. Invariant: every bit is the same on
//! every machine: powers of e are libm's, sums have one order. Absent here: which stretches are lit, colors, the scene.
//!
//! | module | what |
//! |---|---|
//! | `airlight` | points, by quadrature |
//! | `emission` | which directions a point shines in, and where a ray enters and leaves its cone |
//! | `medium` | density, albedo, phase function; directions in closed form |
//! | `quadrature` | Gauss and Legendre's rule |

mod airlight;
mod emission;
mod medium;
mod quadrature;
#[cfg(test)]
mod tests;

pub use airlight::PointView;
pub use emission::{Beam, Shine};
pub use medium::{Fog, FogError};
