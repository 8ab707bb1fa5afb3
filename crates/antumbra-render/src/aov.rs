//! Layers beside the picture: who sees which light, and how that was decided.
//!
//! In: what each eye ray saw first ([`Seen`]). Out: planes of numbers from 0 to 1, one a channel.
//! A pixel is the mean of its samples, so every number is a share of samples:
//!
//! - `shadow.<light>`: samples that the light reaches. A sample that faces away from the light or
//!   is outside the spot's cone counts as not reached; one that hits nothing counts as reached, so
//!   that the picture's background stays when it is multiplied by the mask.
//!   A light with size has such a layer, too: the mean of its visible fractions.
//! - `decided-by`: for each [`DecidedBy`] the share of shadow questions that ended so, all lights
//!   together; a sample that hits nothing counts for `no_hit`. Of a light with size, the share of it
//!   that was asked about counts for `ray`, the rest for `facing_away`. The sum is 1.
//! - `fog`: the light that the air scatters towards the eye, linear RGB, and `transmittance`: the share of the light from
//!   behind that it leaves, up to what is seen first. Black and 1 in clear air.
//!
//! Invariant: asking costs nothing: the layers use the answers that the picture uses.

use std::collections::{HashMap, HashSet};

use antumbra::{Decided, Shadow};
use antumbra_scene::model::{Light, Scene};

use crate::integrator::{Air, AreaQuery, LightQuery, Seen};

/// Returns how many lights have a shadow layer.
pub fn light_count(scene: &Scene) -> usize {
    scene.lights.len() + scene.area_lights.len()
}

/// Which layers to make.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Aovs {
    /// A mask a light.
    pub shadow: bool,
    /// How questions were decided.
    pub decided: bool,
    /// Light that the air adds, and the share that it leaves.
    pub fog: bool,
}

/// Outcome of a query about a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecidedBy {
    /// A blocker list answered.
    BlockerList,
    /// Not asked: the surface faces away.
    FacingAway,
    /// The value of the start's voxel answered.
    FirstPass,
    /// The value of a voxel on the way answered.
    Intermediate,
    /// The eye ray hits nothing.
    NoHit,
    /// Not asked: the spot does not shine here.
    OutOfCone,
    /// A full walk answered.
    Ray,
}

impl DecidedBy {
    /// All of them, by channel name.
    pub const ALL: [Self; 7] = [
        Self::BlockerList,
        Self::FacingAway,
        Self::FirstPass,
        Self::Intermediate,
        Self::NoHit,
        Self::OutOfCone,
        Self::Ray,
    ];

    /// Returns the name of the channel, as in the figures of `--stats-json`.
    pub fn channel_name(self) -> &'static str {
        match self {
            Self::BlockerList => "blocker_list",
            Self::FacingAway => "facing_away",
            Self::FirstPass => "first_pass",
            Self::Intermediate => "intermediate",
            Self::NoHit => "no_hit",
            Self::OutOfCone => "out_of_cone",
            Self::Ray => "ray",
        }
    }
}

impl From<&LightQuery> for DecidedBy {
    fn from(query: &LightQuery) -> Self {
        match query {
            LightQuery::FacingAway => Self::FacingAway,
            LightQuery::OutOfCone => Self::OutOfCone,
            LightQuery::Asked { answer, .. } => match answer.decided {
                Decided::FirstPass => Self::FirstPass,
                Decided::Intermediate => Self::Intermediate,
                Decided::BlockerList => Self::BlockerList,
                Decided::Ray => Self::Ray,
            },
        }
    }
}

/// The name of the layer that `decided` makes.
pub const DECIDED_LAYER: &str = "decided-by";

/// The name of the layer of what the air adds, which `fog` makes.
pub const FOG_LAYER: &str = "fog";

/// The name of the layer of what the air leaves, which `fog` makes.
pub const TRANSMITTANCE_LAYER: &str = "transmittance";

/// Channels of both.
const FOG_CHANNELS: usize = 4;

/// One layer of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Its name, unlike every other layer's.
    pub name: String,
    /// Channels by name, each `width * height` numbers, rows from the top.
    pub channels: Vec<(&'static str, Vec<f32>)>,
}

impl Aovs {
    /// Returns how many channels there are in all layers.
    pub fn channel_count(self, light_count: usize) -> usize {
        let shadow = if self.shadow { light_count } else { 0 };
        let decided = if self.decided {
            DecidedBy::ALL.len()
        } else {
            0
        };
        let fog = if self.fog { FOG_CHANNELS } else { 0 };
        shadow + decided + fog
    }

    /// Adds a sample to the sums of a pixel: one a light, then one a way to decide, then the air.
    /// `counts` are those of the lights without size and with.
    pub(crate) fn add_sample(
        self,
        seen: &Seen,
        counts @ [plain, area]: [usize; 2],
        sums: &mut [f64],
    ) {
        let counts = if self.shadow { counts } else { [0; 2] };
        let (masks, rest) = sums.split_at_mut(counts[0]);
        let (areas, rest) = rest.split_at_mut(counts[1]);
        let ways = if self.decided {
            DecidedBy::ALL.len()
        } else {
            0
        };
        let (decided, air) = rest.split_at_mut(ways);
        if self.fog {
            let Air {
                light,
                transmittance,
            } = seen.air;
            let values = light.to_array().into_iter().chain([transmittance]);
            for (sum, value) in air.iter_mut().zip(values) {
                *sum += value;
            }
        }
        for (light, sum) in areas.iter_mut().enumerate() {
            *sum += seen
                .areas
                .get(light)
                .map_or(1.0, AreaQuery::visible_fraction);
        }
        let light_count = plain + area;
        for (light, sum) in masks.iter_mut().enumerate() {
            let is_reached = match seen.queries.get(light) {
                Some(LightQuery::Asked { answer, .. }) => answer.shadow == Shadow::Lit,
                Some(LightQuery::FacingAway | LightQuery::OutOfCone) => false,
                None => true,
            };
            *sum += f64::from(u8::from(is_reached));
        }
        if !self.decided {
            return;
        }
        if !seen.is_surface {
            decided[DecidedBy::NoHit as usize] += 1.0;
        }
        for query in &seen.queries {
            decided[DecidedBy::from(query) as usize] += 1.0 / light_count as f64;
        }
        for query in &seen.areas {
            let asked = query.asked_fraction();
            decided[DecidedBy::Ray as usize] += asked / light_count as f64;
            decided[DecidedBy::FacingAway as usize] += (1.0 - asked) / light_count as f64;
        }
    }

    /// Sorts numbers that lie pixel after pixel into layers.
    pub(crate) fn layers(self, scene: &Scene, values: &[f32]) -> Vec<Layer> {
        let stride = self.channel_count(light_count(scene));
        let plane = |channel: usize| values.iter().skip(channel).step_by(stride).copied();
        let mut first = 0;
        let layer = |name: String| {
            let channels: Vec<&'static str> = match name.as_str() {
                DECIDED_LAYER => DecidedBy::ALL.map(DecidedBy::channel_name).into(),
                FOG_LAYER => vec!["R", "G", "B"],
                _ => vec!["Y"],
            };
            let numbers = first..;
            first += channels.len();
            let planes = channels.into_iter().zip(numbers);
            let channels = planes.map(|(channel, number)| (channel, plane(number).collect()));
            Layer {
                channels: channels.collect(),
                name,
            }
        };
        self.layer_names(scene).into_iter().map(layer).collect()
    }

    /// Returns the names of the layers, in their order: those of the lights, then of the lights with size, then that of
    /// all ways, then those of the air.
    pub fn layer_names(self, scene: &Scene) -> Vec<String> {
        let of_lights = self.shadow.then(|| all_light_names(scene));
        let of_lights = of_lights.unwrap_or_default().into_iter();
        let decided = self.decided.then(|| DECIDED_LAYER.to_owned());
        let shadow = of_lights.map(|name| format!("shadow.{name}"));
        let fog = [FOG_LAYER, TRANSMITTANCE_LAYER].map(str::to_owned);
        let fog = fog.into_iter().filter(|_| self.fog);
        shadow.chain(decided).chain(fog).collect()
    }
}

/// Returns a name for each light that is good for layers and for files: ASCII letters, digits, `-` and
/// `_`, 64 of them at most, all different also where case does not count. Blanks become `-`, other
/// characters `_`. A light without a name
/// gets its number, from 1; of lights with one name the later ones get a number behind it.
pub fn light_names(lights: &[Light]) -> Vec<String> {
    good_names(lights.iter().map(|light| light.name.as_str()))
}

/// Returns such names for all lights of a scene: for those without size the same, then for those with size.
pub fn all_light_names(scene: &Scene) -> Vec<String> {
    let plain = scene.lights.iter().map(|light| light.name.as_str());
    let area = scene.area_lights.iter().map(|light| light.name.as_str());
    good_names(plain.chain(area))
}

fn good_names<'a>(given: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut taken = HashSet::new();
    let mut copies: HashMap<String, u32> = HashMap::new();
    let mut names = Vec::new();
    for (number, given) in (1..).zip(given) {
        let fit = |c: char| match c {
            _ if c.is_ascii_alphanumeric() || c == '-' => c,
            _ if c.is_whitespace() => '-',
            _ => '_',
        };
        let kept: String = given.trim().chars().take(64).map(fit).collect();
        let base = if kept.is_empty() {
            format!("light-{number}")
        } else {
            kept
        };
        let mut name = base.clone();
        // Thousands may have one name: go on where the last one ended.
        let copy = copies.entry(base.to_lowercase()).or_insert(2);
        while !taken.insert(name.to_lowercase()) {
            name = format!("{base}-{copy}");
            *copy += 1;
        }
        names.push(name);
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use antumbra_geometry::DVec3;
    use antumbra_scene::model::{Color, LightKind};

    #[test]
    fn names_are_all_different_and_fit_for_files() {
        let light = |name: &str| Light {
            name: name.into(),
            kind: LightKind::Directional {
                towards_light: DVec3::Z,
            },
            color: Color::ONE,
            falls_off: false,
        };
        let names = [
            "Lamp",
            "",
            "lamp",
            "a/b",
            "lamp-2",
            "Sonne über",
            "light-2",
            "..",
        ];
        assert_eq!(
            light_names(&names.map(light)),
            [
                "Lamp",
                "light-2",
                "lamp-2",
                "a_b",
                "lamp-2-2",
                "Sonne-_ber",
                "light-2-2",
                "__"
            ]
        );
        assert_eq!(light_names(&[light(&"x".repeat(999))])[0].len(), 64);
    }

    #[test]
    fn ways_are_in_the_order_of_their_channels() {
        let names = DecidedBy::ALL.map(DecidedBy::channel_name);
        assert!(names.is_sorted());
        for (number, way) in DecidedBy::ALL.into_iter().enumerate() {
            assert_eq!(way as usize, number);
        }
    }

    #[test]
    fn a_sample_that_hits_nothing_is_lit_and_one_that_faces_away_is_not() {
        let aovs = Aovs {
            shadow: true,
            decided: true,
            fog: false,
        };
        let mut sums = [0.0; 9];
        aovs.add_sample(&Seen::default(), [2, 0], &mut sums);
        let mut expected = [0.0; 9];
        [expected[0], expected[1], expected[6]] = [1.0; 3];
        assert_eq!(sums, expected);
        let away = Seen {
            is_surface: true,
            queries: vec![LightQuery::FacingAway, LightQuery::OutOfCone],
            ..Seen::default()
        };
        aovs.add_sample(&away, [2, 0], &mut sums);
        [expected[3], expected[7]] = [0.5; 2];
        assert_eq!(sums, expected);
    }

    #[test]
    fn a_light_with_size_has_its_visible_fraction_for_a_mask() {
        let aovs = Aovs {
            shadow: true,
            decided: true,
            fog: false,
        };
        let mut sums = [0.0; 8];
        let seen = Seen {
            is_surface: true,
            queries: Vec::new(),
            areas: vec![AreaQuery {
                samples: 16,
                asked: 12,
                lit: 4,
                exact: None,
            }],
            ..Seen::default()
        };
        aovs.add_sample(&seen, [0, 1], &mut sums);
        let mut expected = [0.0; 8];
        [expected[0], expected[2], expected[7]] = [0.25, 0.25, 0.75];
        assert_eq!(sums, expected);
    }

    #[test]
    fn the_air_has_its_own_layers_behind_the_others() {
        let aovs = Aovs {
            fog: true,
            ..Aovs::default()
        };
        let mut sums = [0.0; 4];
        let seen = Seen {
            air: Air {
                light: Color::new(1.0, 2.0, 3.0),
                transmittance: 0.25,
            },
            ..Seen::default()
        };
        aovs.add_sample(&seen, [5, 1], &mut sums);
        assert_eq!(sums, [1.0, 2.0, 3.0, 0.25]);
        let values = sums.map(|sum| sum as f32);
        let layers = aovs.layers(&Scene::default(), &values);
        let plane = |value| vec![value];
        let channels = [("R", plane(1.0)), ("G", plane(2.0)), ("B", plane(3.0))];
        assert_eq!(layers[0].name, FOG_LAYER);
        assert_eq!(layers[0].channels, channels);
        assert_eq!(layers[1].name, TRANSMITTANCE_LAYER);
        assert_eq!(layers[1].channels, [("Y", plane(0.25))]);
        assert_eq!(layers.len(), 2);
    }
}
