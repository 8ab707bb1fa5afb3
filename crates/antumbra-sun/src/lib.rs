//! Sun studies: which sensors of a scene the sun reaches, at which of a year's times.
//!
//! In: a place, a weather file or a list of suns; sensors on a scene's faces. Out: a bit a sensor and sun, exact as
//! every answer of `antumbra`, and what follows from bits: hours, first and last sun, irradiation. Absent here: printing,
//! what was typed, the surroundings of the process.
//!
//! | module | what |
//! |---|---|
//! | `calendar` | dates and times of a fixed offset from UTC |
//! | `positions` | solar positions (SPA) |
//! | `epw`, `wea`, `weather` | weather files |
//! | `sun_file`, `point_file` | lists of suns and of points in CSV files |
//! | `sky` | patches of the sky |
//! | `sensors`, `grid` | points of a study; grids of them on faces |
//! | `study` | sensors times suns, as bits and shares; stopped and resumed |
//! | `blockers` | which objects take the suns away |
//! | `groups` | totals and sunlit shares of groups of sensors |
//! | `nearest` | the sensor that stands for a place on a face |
//! | `record`, `sums` | a study that was answered, and what its bits amount to |
//! | `arrays`, `write`, `read` | files of a study |

mod arrays;
mod blockers;
mod calendar;
mod epw;
mod error;
mod grid;
mod groups;
mod nearest;
mod point_file;
mod positions;
mod read;
#[cfg(test)]
mod reader_tests;
mod record;
mod sensors;
mod sky;
mod study;
mod sums;
mod sun_file;
mod suns;
mod text;
mod wea;
mod weather;
mod write;

pub use blockers::{Blockers, write_blockers};
pub use calendar::{Dates, Time, YEARS};
pub use epw::read_epw;
pub use error::{BadSetting, FileError};
pub use grid::{GridSettings, grid_sensors};
pub use groups::{Groups, Spread, Total, sunlit_shares, totals};
pub use nearest::NearestSensors;
pub use point_file::{PointList, read_points};
pub use positions::{Instant, Location, Positions, Refraction};
pub use read::read_npz;
pub use record::{About, Compass, Diffuse, Study, VERSION};
pub use sensors::{Facing, Sensors};
pub use sky::{MOST_FACTOR, reinhart, tregenza};
#[doc(hidden)]
pub use study::answer_in_chunks;
pub use study::{
    Answered, Bits, Dome, LARGEST_SUN, Light, PartError, Parts, Questions, StudyError, answer,
    identity, parts_beside,
};
pub use sums::{Sums, sums};
pub use sun_file::read_suns;
pub use suns::{Sun, SunKind, Suns};
pub use wea::read_wea;
pub use weather::{Weather, WeatherRow};
pub use write::{
    check_energyplus, check_zarr, write_csv, write_energyplus, write_netcdf, write_npz, write_zarr,
};
