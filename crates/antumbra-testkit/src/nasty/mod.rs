//! Seeded random scenes that are full of ties and of rounding.
//!
//! In: a seed. Out: surfaces, lights and queries, the same on every machine. A scene is made of a
//! [`Family`], which says what is in it, and a [`Frame`], which says where in space and how large
//! it is; both are in its `Debug` and [`NastyScene::label`], so a message that holds them is
//! enough to repeat a failure.
//!
//! Triangles come before all other surfaces, each as a face of its own; closed cones are listed
//! tube, base cap, apex cap, without caps of radius zero. So an index here is the number the
//! library gives the surface when they are added in this order.

mod curved;
mod planar;
mod questions;

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::oracle::{OracleLight, OracleShape, OracleSurface};

/// Kind of shapes that a nasty scene is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Family {
    /// Triangles between the points of a small integer lattice: shared edges, coplanar,
    /// piercing and degenerate ones.
    LatticeSoup,
    /// Boxes standing in the middle of floor tiles, touching and stacked.
    BoxesOnFloor,
    /// Boxes turned by an arbitrary rotation, so that no plane is exact.
    TurnedBoxes,
    /// Triangles round one vertex.
    Fan,
    /// Two or more faces that meet in a crease, with a roof somewhere.
    Valley,
    /// A height field.
    HeightField,
    /// Spheres that touch, overlap, coincide and contain each other.
    TouchingSpheres,
    /// Open cones with spheres at their joints.
    JointedCones,
    /// Closed cylinders and cones on a floor, touching and coincident.
    ClosedCylinders,
    /// Open tubes, nested and coaxial.
    OpenTubes,
    /// Doubled faces and faces that overlap in one plane, disks among them.
    CoplanarLayers,
    /// Long thin triangles.
    Needles,
}

impl Family {
    /// All families.
    pub const ALL: [Self; 12] = [
        Self::LatticeSoup,
        Self::BoxesOnFloor,
        Self::TurnedBoxes,
        Self::Fan,
        Self::Valley,
        Self::HeightField,
        Self::TouchingSpheres,
        Self::JointedCones,
        Self::ClosedCylinders,
        Self::OpenTubes,
        Self::CoplanarLayers,
        Self::Needles,
    ];
}

/// Place and size of a nasty scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Frame {
    /// As made, about ten units large.
    Unit,
    /// Times `2^-70`: ties stay ties.
    Tiny,
    /// Times `2^-400`: ties stay ties, and products of three coordinates vanish in `f64`.
    Minute,
    /// Times `2^90`: ties stay ties, and products pass `2^512`.
    Huge,
    /// Times 0.1: lattice points are rounded.
    Tenth,
    /// Moved to map coordinates: almost all bits are spent on the offset.
    Map,
}

impl Frame {
    /// All frames.
    pub const ALL: [Self; 6] = [
        Self::Unit,
        Self::Tiny,
        Self::Minute,
        Self::Huge,
        Self::Tenth,
        Self::Map,
    ];

    fn scale(self) -> f64 {
        match self {
            Self::Unit | Self::Map => 1.0,
            Self::Tiny => 2f64.powi(-70),
            Self::Minute => 2f64.powi(-400),
            Self::Huge => 2f64.powi(90),
            Self::Tenth => 0.1,
        }
    }

    fn place(self, point: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Map => [point[0] + 5e5, point[1] + 5e6, point[2] + 100.0],
            _ => point.map(|x| x * self.scale()),
        }
    }

    fn place_shape(self, shape: OracleShape) -> OracleShape {
        let scale = self.scale();
        match shape {
            OracleShape::Triangle(corners) => {
                OracleShape::Triangle(corners.map(|corner| self.place(corner)))
            }
            OracleShape::Sphere { center, radius } => OracleShape::Sphere {
                center: self.place(center),
                radius: radius * scale,
            },
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => OracleShape::Tube {
                base: self.place(base),
                base_radius: base_radius * scale,
                apex: self.place(apex),
                apex_radius: apex_radius * scale,
            },
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => OracleShape::Disk {
                center: self.place(center),
                normal,
                radius: radius * scale,
            },
            OracleShape::Cap {
                base,
                apex,
                radius,
                at_apex,
            } => OracleShape::Cap {
                base: self.place(base),
                apex: self.place(apex),
                radius: radius * scale,
                at_apex,
            },
        }
    }
}

/// One question: asked of every light of the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NastyQuery {
    /// Position of the start.
    pub point: [f64; 3],
    /// The index of the surface it lies on, up to rounding; `None` for a free query.
    pub surface: Option<usize>,
}

/// A random scene with its lights and questions.
#[derive(Clone, Debug)]
pub struct NastyScene {
    /// The seed that makes it again.
    pub seed: u64,
    /// Kind of its shapes.
    pub family: Family,
    /// Place and size.
    pub frame: Frame,
    /// Triangles first, then the other shapes.
    pub surfaces: Vec<OracleSurface>,
    /// Every query is meant for every light.
    pub lights: Vec<OracleLight>,
    /// The questions.
    pub queries: Vec<NastyQuery>,
}

impl NastyScene {
    /// `seed 123 family Valley frame Tenth`, for failure messages.
    pub fn label(&self) -> String {
        format!(
            "seed {} family {:?} frame {:?}",
            self.seed, self.family, self.frame
        )
    }
}

/// Makes the scene of a seed. Consecutive seeds go through all families, and through all frames
/// for each family; within them everything is random.
pub fn scene(seed: u64) -> NastyScene {
    let families = Family::ALL.len() as u64;
    let family = Family::ALL[(seed % families) as usize];
    // Every other round is in the unit frame, where most ties are.
    let round = seed / families;
    let frame = if round.is_multiple_of(2) {
        Frame::Unit
    } else {
        Frame::ALL[(round / 2 % Frame::ALL.len() as u64) as usize]
    };
    scene_of(family, frame, seed)
}

/// Makes a scene of a given family and frame.
pub fn scene_of(family: Family, frame: Frame, seed: u64) -> NastyScene {
    let mut rng = Nasty(Pcg64Mcg::seed_from_u64(seed));
    let mut surfaces = match family {
        Family::LatticeSoup => rng.lattice_soup(),
        Family::BoxesOnFloor => rng.boxes_on_floor(),
        Family::TurnedBoxes => rng.turned_boxes(),
        Family::Fan => rng.fan(),
        Family::Valley => rng.valley(),
        Family::HeightField => rng.height_field(),
        Family::TouchingSpheres => rng.touching_spheres(),
        Family::JointedCones => rng.jointed_cones(),
        Family::ClosedCylinders => rng.closed_cylinders(),
        Family::OpenTubes => rng.open_tubes(),
        Family::CoplanarLayers => rng.coplanar_layers(),
        Family::Needles => rng.needles(),
    };
    surfaces.sort_by_key(|surface| !matches!(surface.shape, OracleShape::Triangle(_)));
    rng.sprinkle_glass(&mut surfaces);
    for surface in &mut surfaces {
        surface.shape = frame.place_shape(surface.shape);
    }
    let lights = (0..5).map(|i| rng.light(i, &surfaces, frame)).collect();
    let queries = (0..40).map(|_| rng.query(&surfaces, frame)).collect();
    NastyScene {
        seed,
        family,
        frame,
        surfaces,
        lights,
        queries,
    }
}

/// The generator, with the choices all families share.
struct Nasty(Pcg64Mcg);

impl Nasty {
    fn below(&mut self, count: usize) -> usize {
        self.0.random_range(0..count)
    }

    fn chance(&mut self, probability: f64) -> bool {
        self.0.random_bool(probability)
    }

    fn real(&mut self, low: f64, high: f64) -> f64 {
        self.0.random_range(low..high)
    }

    fn integer(&mut self, low: i32, high: i32) -> f64 {
        f64::from(self.0.random_range(low..=high))
    }

    fn lattice_point(&mut self, low: i32, high: i32) -> [f64; 3] {
        [0; 3].map(|_| self.integer(low, high))
    }

    fn any_point(&mut self, low: f64, high: f64) -> [f64; 3] {
        [0; 3].map(|_| self.real(low, high))
    }

    fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }

    /// Makes some surfaces transparent; a closed cone as a whole.
    fn sprinkle_glass(&mut self, surfaces: &mut [OracleSurface]) {
        let share = self.pick(&[0.0, 0.1, 0.3]);
        let glass_solids: Vec<bool> = surfaces.iter().map(|_| self.chance(share)).collect();
        for surface in surfaces {
            surface.opaque = match surface.solid {
                Some(solid) => !glass_solids[solid],
                None => !self.chance(share),
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::{BTreeMap, HashSet};

    use super::*;
    use crate::oracle::Oracle;

    #[test]
    fn every_family_and_frame_occurs_and_no_two_seeds_agree() {
        let mut kinds = HashSet::new();
        let mut seen = HashSet::new();
        for seed in 0..300 {
            let scene = scene(seed);
            kinds.insert((scene.family, scene.frame));
            let NastyScene {
                surfaces,
                lights,
                queries,
                ..
            } = &scene;
            assert!(
                seen.insert(format!("{surfaces:?}")),
                "{} is not new",
                scene.label()
            );
            assert!(
                seen.insert(format!("{lights:?}")),
                "{} is not new",
                scene.label()
            );
            assert!(
                seen.insert(format!("{queries:?}")),
                "{} is not new",
                scene.label()
            );
            // Nor does a scene ask the same over and over.
            let points: HashSet<_> = queries.iter().map(|q| q.point.map(f64::to_bits)).collect();
            assert!(points.len() * 2 > queries.len(), "{}", scene.label());
        }
        assert_eq!(kinds.len(), Family::ALL.len() * Frame::ALL.len());
    }

    #[test]
    fn a_seed_makes_the_same_scene_again() {
        for seed in 0..60 {
            assert_eq!(format!("{:?}", scene(seed)), format!("{:?}", scene(seed)));
        }
    }

    #[test]
    fn all_numbers_keep_the_contract() {
        for seed in 0..600 {
            let scene = scene(seed);
            let label = scene.label();
            let limit = 2f64.powi(100);
            // Debug output holds every number; "NaN" and "inf" would show.
            let text = format!("{scene:?}");
            assert!(!text.contains("NaN") && !text.contains("inf"), "{label}");
            for light in &scene.lights {
                let (OracleLight::Point(x) | OracleLight::Direction(x)) = light;
                assert!(x.iter().all(|c| c.abs() < limit), "{label}");
            }
            for query in &scene.queries {
                assert!(query.point.iter().all(|c| c.abs() < limit), "{label}");
            }
            assert!(scene.surfaces.is_sorted_by_key(|surface| {
                !matches!(surface.shape, OracleShape::Triangle(_))
            }));
            let _checks_solids = Oracle::new(scene.surfaces);
        }
    }

    #[test]
    fn answers_are_mixed() {
        let mut counts: BTreeMap<Family, [usize; 2]> = BTreeMap::new();
        for seed in 0..300 {
            let scene = scene(seed);
            let oracle = Oracle::new(scene.surfaces);
            for query in &scene.queries {
                for &light in &scene.lights {
                    let blocked = oracle.is_blocked(query.point, query.surface, light);
                    counts.entry(scene.family).or_default()[usize::from(blocked)] += 1;
                }
            }
        }
        for (family, [lit, blocked]) in counts {
            let share = blocked as f64 / (lit + blocked) as f64;
            assert!(
                (0.2..0.8).contains(&share),
                "{family:?}: {share:.2} of the answers blocked"
            );
        }
    }
}
