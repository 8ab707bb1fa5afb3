//! Small values of the command line: text in, checked numbers out.
//!
//! Every error text says what was expected. Invariant: what comes out is finite and in range.

use antumbra::GridResolution;
use antumbra_render::fog::Fog;
use antumbra_scene::model::{Bump, Color};

use antumbra_geometry::{DVec3, Short};

/// Most pixels along one side of a picture.
pub const MAX_SIDE: u32 = 16_384;
/// Most voxels along one axis.
const MAX_VOXELS: u32 = 2048;
/// Longest list of blockers.
const MAX_LIST: usize = 4096;

/// The parts of a camera that were typed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CameraParts {
    pub eye: Option<DVec3>,
    pub at: Option<DVec3>,
    pub up: Option<DVec3>,
    pub fov_degrees: Option<f64>,
}

/// A light as typed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointLight {
    pub position: DVec3,
    pub color: Color,
}

/// A sun as typed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    pub azimuth_degrees: f64,
    pub elevation_degrees: f64,
    /// The angular diameter, where one was typed.
    pub diameter_degrees: Option<f64>,
}

/// An exposure as typed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Measured.
    Auto,
    /// So many stops.
    Stops(f64),
}

/// Reads one finite number.
pub fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("expected a finite number, found `{text}`")),
    }
}

/// Reads so many finite numbers, separated by commas.
pub fn numbers<const N: usize>(text: &str, pattern: &str) -> Result<[f64; N], String> {
    let values = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    let found = values.len();
    values
        .try_into()
        .map_err(|_| format!("expected {pattern}, found {found} numbers in `{text}`"))
}

pub fn triple(text: &str) -> Result<DVec3, String> {
    numbers::<3>(text, "X,Y,Z").map(DVec3::from_array)
}

/// Reads `DENSITY[,ALBEDO[,G]]`.
pub fn fog(text: &str) -> Result<Fog, String> {
    let values = text.split(',').map(number).collect::<Result<Vec<_>, _>>()?;
    let [density, albedo, g] = match values[..] {
        [density] => [density, 1.0, 0.0],
        [density, albedo] => [density, albedo, 0.0],
        [density, albedo, g] => [density, albedo, g],
        _ => {
            let found = values.len();
            return Err(format!(
                "expected DENSITY[,ALBEDO[,G]], found {found} numbers in `{text}`"
            ));
        }
    };
    Fog::new(density, albedo, g).map_err(|error| error.to_string())
}

/// Reads `KIND:HEIGHT,SIZE`.
pub fn bump(text: &str) -> Result<Bump, String> {
    const PATTERN: &str = "noise:HEIGHT,SIZE or ripples:HEIGHT,SIZE";
    let (kind, numbers_of_it) = text
        .split_once(':')
        .ok_or_else(|| format!("expected {PATTERN}, found `{text}`"))?;
    let [height, size] = numbers::<2>(numbers_of_it, PATTERN)?;
    Bump::in_space(kind.trim(), height, size).map_err(|error| error.to_string())
}

/// Reads `WIDTHxHEIGHT`.
pub fn size(text: &str) -> Result<[u32; 2], String> {
    let expected =
        || format!("expected WIDTHxHEIGHT with 1 to {MAX_SIDE} pixels each, such as 640x480");
    let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
    let side = |text: &str| {
        text.trim()
            .parse::<u32>()
            .ok()
            .filter(|side| (1..=MAX_SIDE).contains(side))
            .ok_or_else(expected)
    };
    Ok([side(width)?, side(height)?])
}

/// Reads `N` or `NxNxN`.
pub fn grid(text: &str) -> Result<GridResolution, String> {
    let expected = || format!("expected N or NxNxN with 1 to {MAX_VOXELS} voxels each");
    let axes = text
        .split(['x', 'X'])
        .map(|axis| {
            axis.trim()
                .parse::<u32>()
                .ok()
                .filter(|n| (1..=MAX_VOXELS).contains(n))
        })
        .collect::<Option<Vec<_>>>()
        .ok_or_else(expected)?;
    match axes[..] {
        [n] => Ok(GridResolution::Fixed([n; 3])),
        [x, y, z] => Ok(GridResolution::Fixed([x, y, z])),
        _ => Err(expected()),
    }
}

/// Reads `SHORT,LONG`.
pub fn lists(text: &str) -> Result<[usize; 2], String> {
    let lengths = text
        .split(',')
        .map(|length| length.trim().parse().ok().filter(|&n| n <= MAX_LIST))
        .collect::<Option<Vec<_>>>();
    lengths
        .and_then(|lengths| lengths.try_into().ok())
        .ok_or_else(|| format!("expected SHORT,LONG with 0 to {MAX_LIST} blockers each"))
}

/// Reads a number of bytes, with a unit or without.
pub fn bytes(text: &str) -> Result<u64, String> {
    let expected = || {
        "expected a size such as 500MB, 2GiB or a number of bytes; units are B, kB, MB, GB, TB \
         (1000) and KiB, MiB, GiB, TiB (1024)"
            .to_owned()
    };
    let text = text.trim();
    let digits = text
        .find(|c: char| !(c.is_ascii_digit() || c == '.'))
        .unwrap_or(text.len());
    let (value, unit) = text.split_at(digits);
    let factor: u64 = match unit.trim().to_ascii_lowercase().as_str() {
        "" | "b" => 1,
        "kb" => 1000,
        "mb" => 1000 * 1000,
        "gb" => 1000 * 1000 * 1000,
        "tb" => 1000 * 1000 * 1000 * 1000,
        "k" | "kib" => 1 << 10,
        "m" | "mib" => 1 << 20,
        "g" | "gib" => 1 << 30,
        "t" | "tib" => 1 << 40,
        _ => return Err(expected()),
    };
    if let Ok(whole) = value.parse::<u64>() {
        return whole
            .checked_mul(factor)
            .filter(|&bytes| bytes > 0)
            .ok_or_else(expected);
    }
    let bytes = number(value).map_err(|_| expected())? * factor as f64;
    // 2^63: far beyond any machine, and below it the cast is exact in range.
    if (1.0..9.2e18).contains(&bytes) {
        Ok(bytes as u64)
    } else {
        Err(expected())
    }
}

/// Writes a number of bytes for people.
pub fn format_bytes(bytes: u64) -> String {
    let units = [("TiB", 40), ("GiB", 30), ("MiB", 20), ("KiB", 10)];
    for (unit, shift) in units {
        if bytes >> shift > 0 {
            return format!("{:.1} {unit}", bytes as f64 / (1u64 << shift) as f64);
        }
    }
    format!("{bytes} B")
}

/// Reads `eye:X,Y,Z/at:X,Y,Z/up:X,Y,Z/fov:DEGREES`, each part at most once, in any order.
pub fn camera(text: &str) -> Result<CameraParts, String> {
    let mut parts = CameraParts::default();
    for part in text.split('/') {
        let (key, value) = part.split_once(':').ok_or_else(|| {
            format!("expected eye:X,Y,Z, at:X,Y,Z, up:X,Y,Z or fov:DEGREES, found `{part}`")
        })?;
        let is_new = match key.trim() {
            "eye" => parts.eye.replace(triple(value)?).is_none(),
            "at" => parts.at.replace(triple(value)?).is_none(),
            "up" => parts.up.replace(triple(value)?).is_none(),
            "fov" => {
                let degrees = number(value)?;
                if !(degrees > 0.0 && degrees < 180.0) {
                    return Err(format!(
                        "fov is {} degrees; expected above 0, below 180",
                        Short(degrees)
                    ));
                }
                parts.fov_degrees.replace(degrees).is_none()
            }
            other => {
                return Err(format!(
                    "unknown part `{other}`; expected eye, at, up or fov"
                ));
            }
        };
        if !is_new {
            return Err(format!("`{key}` is given twice"));
        }
    }
    Ok(parts)
}

/// Reads `point:X,Y,Z` or `point:X,Y,Z/R,G,B`.
pub fn light(text: &str) -> Result<PointLight, String> {
    let expected = "expected point:X,Y,Z or point:X,Y,Z/R,G,B";
    let (kind, rest) = text.split_once(':').ok_or(expected)?;
    if kind.trim() != "point" {
        return Err(format!("unknown kind of light `{kind}`; {expected}"));
    }
    let (position, color) = match rest.split_once('/') {
        Some((position, color)) => (position, numbers::<3>(color, "R,G,B")?.into()),
        None => (rest, Color::ONE),
    };
    if color.min_element() < 0.0 {
        return Err("a light's color must not be negative".into());
    }
    Ok(PointLight {
        position: triple(position)?,
        color,
    })
}

/// Reads a distance that is not negative; `inf` is any distance, digits too large for a number are a slip.
pub fn distance(text: &str) -> Result<f64, String> {
    let digits = text.contains(|letter: char| letter.is_ascii_digit());
    let fits = |distance: &f64| *distance >= 0.0 && (distance.is_finite() || !digits);
    text.trim().parse().ok().filter(fits).ok_or_else(|| {
        format!("expected a distance, zero or more, or inf for any distance, found `{text}`")
    })
}

/// Reads `AZIMUTH,ELEVATION` or `AZIMUTH,ELEVATION,DIAMETER` in degrees.
pub fn sun_with_size(text: &str) -> Result<Sun, String> {
    let Some((place, diameter)) = text
        .rsplit_once(',')
        .filter(|(place, _)| place.contains(','))
    else {
        return sun(text).map_err(|error| error.replace("ELEVATION in", "ELEVATION[,DIAMETER] in"));
    };
    let degrees = number(diameter)?;
    if !(degrees > 0.0 && degrees < 180.0) {
        return Err(format!(
            "the sun's diameter is {}; expected above 0, below 180 degrees (0.53 seen from the Earth)",
            Short(degrees)
        ));
    }
    let sun = sun(place)?;
    Ok(Sun {
        diameter_degrees: Some(degrees),
        ..sun
    })
}

/// Reads `AZIMUTH,ELEVATION` in degrees.
pub fn sun(text: &str) -> Result<Sun, String> {
    let [azimuth_degrees, elevation_degrees] = numbers(text, "AZIMUTH,ELEVATION in degrees")?;
    if !(-90.0..=90.0).contains(&elevation_degrees) {
        return Err(format!(
            "the elevation is {}; expected -90 to 90 degrees",
            Short(elevation_degrees)
        ));
    }
    if azimuth_degrees.abs() > 3600.0 {
        return Err(format!(
            "the azimuth is {}; expected -3600 to 3600 degrees",
            Short(azimuth_degrees)
        ));
    }
    Ok(Sun {
        azimuth_degrees,
        elevation_degrees,
        diameter_degrees: None,
    })
}

/// Reads a color that is not negative.
pub fn background(text: &str) -> Result<Color, String> {
    let color = Color::from(numbers::<3>(text, "R,G,B")?);
    if color.min_element() < 0.0 {
        return Err("a background must not be negative".into());
    }
    Ok(color)
}

/// Reads `auto` or an exposure in stops.
pub fn exposure(text: &str) -> Result<Exposure, String> {
    if text.trim() == "auto" {
        return Ok(Exposure::Auto);
    }
    let stops = number(text).map_err(|error| format!("{error}; or give `auto`"))?;
    if stops.abs() <= 100.0 {
        Ok(Exposure::Stops(stops))
    } else {
        Err(format!(
            "the exposure is {}; expected -100 to 100 stops",
            Short(stops)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(size("640x480"), Ok([640, 480]));
        assert_eq!(size("1X16384"), Ok([1, 16_384]));
        for bad in [
            "", "640", "0x1", "1x0", "16385x1", "-1x5", "1x2x3", "ax5", "1.5x2", "1e2x5",
        ] {
            let error = size(bad).unwrap_err();
            assert_eq!(
                error, "expected WIDTHxHEIGHT with 1 to 16384 pixels each, such as 640x480",
                "{bad}"
            );
        }
    }

    #[test]
    fn fogs() {
        let made = |density, albedo, g| Ok(Fog::new(density, albedo, g).unwrap());
        assert_eq!(fog("0.5"), made(0.5, 1.0, 0.0));
        assert_eq!(fog("0,0.9"), made(0.0, 0.9, 0.0));
        assert_eq!(fog("1e-3, 1, -0.5"), made(1e-3, 1.0, -0.5));
        for (bad, message) in [
            ("", "expected a finite number, found ``"),
            ("inf", "expected a finite number, found `inf`"),
            (
                "-1",
                "the density is -1: expected a finite number, 0 or above",
            ),
            ("1,2", "the albedo is 2: expected 0 to 1"),
            ("1,1,1", "g is 1: expected above -1 and below 1"),
            (
                "1,1,0,0",
                "expected DENSITY[,ALBEDO[,G]], found 4 numbers in `1,1,0,0`",
            ),
        ] {
            assert_eq!(fog(bad), Err(message.to_owned()), "{bad}");
        }
    }

    #[test]
    fn grids() {
        assert_eq!(grid("20"), Ok(GridResolution::Fixed([20; 3])));
        assert_eq!(grid("1x2x2048"), Ok(GridResolution::Fixed([1, 2, 2048])));
        for bad in ["", "0", "2049", "1x2", "1x2x3x4", "-3", "a"] {
            let error = grid(bad).unwrap_err();
            assert_eq!(
                error, "expected N or NxNxN with 1 to 2048 voxels each",
                "{bad}"
            );
        }
    }

    #[test]
    fn list_lengths() {
        assert_eq!(lists("4,24"), Ok([4, 24]));
        assert_eq!(lists("0, 4096"), Ok([0, 4096]));
        for bad in ["", "4", "4,4097", "1,2,3", "-1,2", "a,b"] {
            let error = lists(bad).unwrap_err();
            assert_eq!(
                error, "expected SHORT,LONG with 0 to 4096 blockers each",
                "{bad}"
            );
        }
    }

    #[test]
    fn byte_sizes() {
        let cases = [
            ("123", 123),
            ("1kB", 1000),
            ("1 KiB", 1024),
            ("2GiB", 2 << 30),
            ("2g", 2 << 30),
            ("1.5MiB", 3 << 19),
            ("500MB", 500_000_000),
            ("18446744073709551615", u64::MAX),
        ];
        for (text, expected) in cases {
            assert_eq!(bytes(text), Ok(expected), "{text}");
        }
        for bad in [
            "",
            "GiB",
            "-1",
            "0",
            "0GiB",
            "1XB",
            "1e400GB",
            "99999999999TiB",
            "1..5k",
            "nan",
        ] {
            assert!(
                bytes(bad)
                    .unwrap_err()
                    .starts_with("expected a size such as"),
                "{bad}"
            );
        }
    }

    #[test]
    fn bytes_for_people() {
        assert_eq!(format_bytes(1023), "1023 B");
        assert_eq!(format_bytes(3 << 19), "1.5 MiB");
        assert_eq!(format_bytes(u64::MAX), "16777216.0 TiB");
    }

    #[test]
    fn cameras() {
        let all = camera("eye:1,2,3/at:0,0,0/up:0,0,1/fov:45").unwrap();
        assert_eq!(all.eye, Some(DVec3::new(1.0, 2.0, 3.0)));
        assert_eq!(all.fov_degrees, Some(45.0));
        let some = camera("fov:30").unwrap();
        assert_eq!(
            some,
            CameraParts {
                fov_degrees: Some(30.0),
                ..CameraParts::default()
            }
        );
        let errors = [
            (
                "",
                "expected eye:X,Y,Z, at:X,Y,Z, up:X,Y,Z or fov:DEGREES, found ``",
            ),
            ("eye:1,2", "expected X,Y,Z, found 2 numbers in `1,2`"),
            ("eye:1,2,x", "expected a finite number, found `x`"),
            ("eye:1,2,inf", "expected a finite number, found `inf`"),
            ("fov:180", "fov is 180 degrees; expected above 0, below 180"),
            ("fov:nan", "expected a finite number, found `nan`"),
            ("fov:30/fov:40", "`fov` is given twice"),
            ("roll:3", "unknown part `roll`; expected eye, at, up or fov"),
        ];
        for (text, expected) in errors {
            assert_eq!(camera(text).unwrap_err(), expected, "{text}");
        }
    }

    #[test]
    fn lights() {
        let white = light("point:1,-2,3e1").unwrap();
        assert_eq!(white.position, DVec3::new(1.0, -2.0, 30.0));
        assert_eq!(white.color, Color::ONE);
        assert_eq!(
            light("point:0,0,0/2,0,.5").unwrap().color,
            Color::new(2.0, 0.0, 0.5)
        );
        let errors = [
            ("1,2,3", "expected point:X,Y,Z or point:X,Y,Z/R,G,B"),
            (
                "spot:1,2,3",
                "unknown kind of light `spot`; expected point:X,Y,Z or point:X,Y,Z/R,G,B",
            ),
            ("point:1,2", "expected X,Y,Z, found 2 numbers in `1,2`"),
            ("point:1,2,3/1", "expected R,G,B, found 1 numbers in `1`"),
            ("point:1,2,3/-1,0,0", "a light's color must not be negative"),
            ("point:1,2,1e999", "expected a finite number, found `1e999`"),
        ];
        for (text, expected) in errors {
            assert_eq!(light(text).unwrap_err(), expected, "{text}");
        }
    }

    #[test]
    fn distances() {
        assert_eq!(distance("0"), Ok(0.0));
        assert_eq!(distance("1e-3"), Ok(1e-3));
        for any in ["inf", "Inf", "infinity", " inf "] {
            assert_eq!(distance(any), Ok(f64::INFINITY), "{any}");
        }
        for bad in ["-1", "nan", "-inf", "1e999", "far", ""] {
            let expected = format!(
                "expected a distance, zero or more, or inf for any distance, found `{bad}`"
            );
            assert_eq!(distance(bad).unwrap_err(), expected);
        }
    }

    #[test]
    fn backgrounds() {
        assert_eq!(background("0,.5,2"), Ok(Color::new(0.0, 0.5, 2.0)));
        assert_eq!(
            background("0,-1,2").unwrap_err(),
            "a background must not be negative"
        );
        assert!(background("1").is_err());
    }

    #[test]
    fn suns() {
        let south = sun("180,45").unwrap();
        assert_eq!(
            (south.azimuth_degrees, south.elevation_degrees),
            (180.0, 45.0)
        );
        assert!(sun("-90,-5").is_ok());
        let errors = [
            (
                "180",
                "expected AZIMUTH,ELEVATION in degrees, found 1 numbers in `180`",
            ),
            ("0,91", "the elevation is 91; expected -90 to 90 degrees"),
            (
                "1e9,0",
                "the azimuth is 1000000000; expected -3600 to 3600 degrees",
            ),
            ("a,b", "expected a finite number, found `a`"),
        ];
        for (text, expected) in errors {
            assert_eq!(sun(text).unwrap_err(), expected, "{text}");
        }
    }

    #[test]
    fn exposures() {
        assert_eq!(exposure("-1.5"), Ok(Exposure::Stops(-1.5)));
        assert_eq!(exposure("auto"), Ok(Exposure::Auto));
        assert_eq!(
            exposure("101").unwrap_err(),
            "the exposure is 101; expected -100 to 100 stops"
        );
        assert!(exposure("inf").is_err());
    }
}
