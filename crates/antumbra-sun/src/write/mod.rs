//! Files of a study: NumPy's `.npz`, CSV, Zarr and netCDF.
//!
//! In: a [`Study`](crate::Study) and its [`Sums`](crate::Sums). Out: a file, whole or not at all.

mod csv;
mod energyplus;
mod netcdf;
pub(crate) mod npz;
mod zarr;
pub(crate) mod zip;

pub use csv::write_csv;
pub use energyplus::{check_energyplus, write_energyplus};
pub use netcdf::write_netcdf;
pub use npz::write_npz;
pub use zarr::{check_zarr, write_zarr};
