//! A scene, its lights, and how they are known; files of that.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use antumbra::{BuildError, Counters, LightId, Method, Refine, Refinement, Refusal, ShadowIndex};
use antumbra_geometry::{DVec3, LightShape, Occluders, Opacity, ReceiverPoint, Sphere, SurfaceId};

use crate::common::Random;

/// Methods that keep what they know.
pub(crate) const METHODS: [Method; 2] = [Method::Voxel, Method::Auto];

/// A floor of many triangles, leaves over it, and a ball. `nudge` moves one corner of one leaf.
pub(crate) fn scene(edge: usize, leaf_count: usize, nudge: f64) -> Arc<Occluders> {
    let random = &mut Random(1);
    let mut builder = Occluders::builder();
    let corner = |x: usize, y: usize, random: &mut Random| {
        let at = |n: usize| 8.0 * n as f64 / edge as f64 - 4.0;
        DVec3::new(at(x), at(y), random.real(0.0, 0.2))
    };
    let mut corners = Vec::new();
    for number in 0..(edge + 1) * (edge + 1) {
        corners.push(corner(number % (edge + 1), number / (edge + 1), random));
    }
    for (x, y) in (0..edge * edge).map(|n| (n % edge, n / edge)) {
        let [a, b, c, d] = [(x, y), (x + 1, y), (x + 1, y + 1), (x, y + 1)]
            .map(|(x, y)| corners[y * (edge + 1) + x]);
        for corners in [[a, b, c], [a, c, d]] {
            builder.add_face(&corners, Opacity::Opaque).expect("a face");
        }
    }
    for number in 0..leaf_count {
        let middle = DVec3::new(0.0, 0.0, 1.5) + DVec3::new(3.5, 3.5, 1.0) * random.in_cube();
        let mut corners = [(); 3].map(|()| middle + 0.4 * random.in_cube());
        if number == 0 {
            corners[0].x += nudge;
        }
        builder.add_face(&corners, Opacity::Opaque).expect("a face");
    }
    let ball = Sphere {
        center: DVec3::new(0.0, 0.0, 1.2),
        radius: 0.6,
    };
    builder.add_sphere(ball, Opacity::Opaque).expect("a ball");
    Arc::new(builder.build())
}

pub(crate) fn lamps() -> Vec<LightShape> {
    vec![
        LightShape::Point(DVec3::new(1.5, -1.0, 4.0)),
        LightShape::Direction(DVec3::new(0.4, 0.3, 1.0)),
    ]
}

pub(crate) fn refinement(resolution: u32, refine: Refine) -> Refinement {
    Refinement {
        resolution,
        space_resolution: resolution / 2,
        refine,
        memory: 128 << 20,
        ..Refinement::default()
    }
}

pub(crate) struct World {
    pub(crate) occluders: Arc<Occluders>,
    pub(crate) lights: Vec<LightShape>,
    pub(crate) refinement: Refinement,
    pub(crate) method: Method,
}

impl World {
    pub(crate) fn new(resolution: u32, refine: Refine) -> Self {
        Self {
            occluders: scene(12, 60, 0.0),
            lights: lamps(),
            refinement: refinement(resolution, refine),
            method: Method::Voxel,
        }
    }

    /// The same by another method.
    pub(crate) fn by(self, method: Method) -> Self {
        Self { method, ..self }
    }

    pub(crate) fn tiny() -> Self {
        Self {
            occluders: scene(1, 2, 0.0),
            lights: lamps()[..1].to_vec(),
            refinement: refinement(8, Refine::Eager),
            method: Method::Voxel,
        }
    }

    pub(crate) fn builder(&self) -> antumbra::Builder {
        ShadowIndex::builder(Arc::clone(&self.occluders), self.lights.clone())
            .method(self.method)
            .refinement(self.refinement)
    }

    pub(crate) fn index(&self) -> ShadowIndex {
        self.builder().build().expect("an index")
    }

    pub(crate) fn load(&self, path: &Path) -> Result<ShadowIndex, BuildError> {
        self.builder().occlusion_file(path).build()
    }

    /// Returns why a file is refused.
    pub(crate) fn refusal(&self, path: &Path) -> Refusal {
        match self.load(path) {
            Err(BuildError::Occlusion(error)) => {
                assert_eq!(error.path, path);
                let text = error.to_string();
                assert!(text.starts_with(&path.display().to_string()), "{text}");
                error.reason
            }
            Err(other) => panic!("{other}"),
            Ok(_) => panic!("{} is taken", path.display()),
        }
    }

    /// Starts on surfaces and in space.
    pub(crate) fn starts(&self, count: usize, seed: u64) -> Vec<ReceiverPoint> {
        let random = &mut Random(seed);
        let occluders = &self.occluders;
        let start = |_| {
            let surface = SurfaceId(random.below(occluders.surface_count()) as u32);
            let point = match occluders.triangle_positions(surface) {
                Some([a, b, c]) => {
                    let (s, t) = (random.real(0.0, 1.0), random.real(0.0, 1.0));
                    let (s, t) = if s + t > 1.0 {
                        (1.0 - s, 1.0 - t)
                    } else {
                        (s, t)
                    };
                    a + s * (b - a) + t * (c - a)
                }
                None => {
                    let ball = occluders.sphere(surface).expect("a ball");
                    ball.center + ball.radius * random.in_cube().normalize()
                }
            };
            if random.below(4) == 0 {
                ReceiverPoint {
                    point: point + 0.2 * random.in_cube(),
                    surface: None,
                }
            } else {
                ReceiverPoint {
                    point,
                    surface: Some(surface),
                }
            }
        };
        (0..count).map(start).collect()
    }

    /// What rays say of starts, for each light.
    pub(crate) fn expected(&self, starts: &[ReceiverPoint]) -> Vec<Vec<bool>> {
        let index = self
            .builder()
            .method(Method::Bvh)
            .build()
            .expect("an index");
        (0..self.lights.len())
            .map(|light| ask(&index, starts, light).0)
            .collect()
    }

    pub(crate) fn assert_right(
        &self,
        index: &ShadowIndex,
        starts: &[ReceiverPoint],
        expected: &[Vec<bool>],
    ) {
        for (light, expected) in expected.iter().enumerate() {
            let (found, _) = ask(index, starts, light);
            let wrong = (0..starts.len()).find(|&n| found[n] != expected[n]);
            assert_eq!(wrong.map(|n| starts[n]), None, "light {light}");
        }
    }
}

pub(crate) fn ask(
    index: &ShadowIndex,
    starts: &[ReceiverPoint],
    light: usize,
) -> (Vec<bool>, Counters) {
    let mut found = vec![false; starts.len()];
    let mut counters = Counters::default();
    index
        .shadows(
            starts,
            LightId::from_index(light),
            &mut found,
            &mut counters,
        )
        .expect("fine queries");
    (found, counters)
}

pub(crate) struct Folder(pub(crate) tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    pub(crate) fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).expect("a folder");
        let name = |entry: std::io::Result<fs::DirEntry>| {
            let name = entry.expect("an entry").file_name();
            name.to_string_lossy().into_owned()
        };
        let mut names: Vec<String> = entries.map(name).collect();
        names.sort();
        names
    }
}
