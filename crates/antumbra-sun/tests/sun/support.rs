//! Scenes, suns and studies of tests.

use std::sync::Arc;

use antumbra::{Method, ShadowIndex};
use antumbra_geometry::{DVec3, Occluders, Opacity};
use antumbra_sun::{
    About, Compass, Dates, Instant, Light, Location, Positions, Questions, Sensors, Study, SunKind,
    Suns, VERSION, answer,
};

/// The compass of scenes with z up, whose own north is true north.
pub(crate) const COMPASS: Compass = Compass {
    up: DVec3::Z,
    north: 0.0,
};

/// Makes an index of polygons.
pub(crate) fn index(faces: &[&[[f64; 3]]]) -> ShadowIndex {
    let mut builder = Occluders::builder();
    for face in faces {
        let corners: Vec<DVec3> = face
            .iter()
            .map(|&corner| DVec3::from_array(corner))
            .collect();
        builder.add_face(&corners, Opacity::Opaque).unwrap();
    }
    index_of(builder.build())
}

pub(crate) fn index_of(occluders: Occluders) -> ShadowIndex {
    let builder = ShadowIndex::builder(Arc::new(occluders), Vec::new());
    builder.method(Method::Bvh).build().unwrap()
}

/// Suns of a day of 2023 at a latitude on the meridian of Greenwich, every ten minutes.
pub(crate) fn day(latitude: f64, day: &str) -> Suns {
    let location = Location::new(latitude, 0.0, 0.0, 0.0).unwrap();
    let positions = Positions::new(location, None).unwrap();
    positions
        .year(2023, 10, Instant::Middle, Some(Dates::parse(day).unwrap()))
        .unwrap()
}

/// Answers a study of sensors and suns.
pub(crate) fn study(index: &ShadowIndex, sensors: Sensors, suns: &Suns) -> Study {
    study_of_light(index, sensors, suns, Light::default())
}

/// Answers a study of suns that reach sensors in part.
pub(crate) fn study_of_light(
    index: &ShadowIndex,
    sensors: Sensors,
    suns: &Suns,
    light: Light,
) -> Study {
    let directions: Vec<DVec3> = suns.list.iter().map(|sun| COMPASS.towards(sun)).collect();
    let questions = Questions {
        light,
        ..Questions::bits(&directions)
    };
    let answered = answer(index, &sensors, &questions, None).unwrap();
    Study {
        about: About {
            sun_diameter: light.sun_diameter,
            through_glass: light.through_glass,
            ..about(suns.kind)
        },
        normals: sensors.normals(index.occluders()),
        points: sensors.points,
        surfaces: sensors.surfaces,
        areas: sensors.areas,
        suns: suns.list.clone(),
        directions: directions.iter().map(|to| to.to_array()).collect(),
        bits: answered.bits,
        shares: answered.shares,
        sky_view_factor: None,
    }
}

pub(crate) fn about(kind: SunKind) -> About {
    About {
        antumbra_sun: VERSION,
        kind,
        source: "test".into(),
        location: None,
        refraction: None,
        instant: Instant::Middle,
        north: 0.0,
        up: [0.0, 0.0, 1.0],
        below_horizon: 0,
        has_weather: false,
        sun_diameter: None,
        through_glass: false,
        diffuse: None,
    }
}
