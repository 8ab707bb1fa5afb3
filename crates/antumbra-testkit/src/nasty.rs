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

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::build::{cuboid, cuboid_of, floor, lerp, nudged, quad};
use crate::oracle::{OracleLight, OracleShape, OracleSurface};

/// What a nasty scene is made of.
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

/// Where in space a nasty scene is, and how large.
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
    /// Where the start is.
    pub point: [f64; 3],
    /// The index of the surface it lies on, up to rounding; `None` for a free query.
    pub surface: Option<usize>,
}

/// A random scene with its lights and questions.
#[derive(Clone, Debug)]
pub struct NastyScene {
    /// The seed that makes it again.
    pub seed: u64,
    /// What it is made of.
    pub family: Family,
    /// Where and how large it is.
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

    /// A floor of tiles from -6 to 6 at height 0.
    fn tiles(&mut self) -> Vec<OracleSurface> {
        let step = self.pick(&[3, 4, 6, 12]);
        let mut tiles = Vec::new();
        for x in (-6..6).step_by(step) {
            for y in (-6..6).step_by(step) {
                let (low, high) = (
                    [x, y].map(f64::from),
                    [x, y].map(|c| f64::from(c + step as i32)),
                );
                tiles.extend(floor(low, high, 0.0));
            }
        }
        tiles
    }

    fn lattice_soup(&mut self) -> Vec<OracleSurface> {
        let count = 6 + self.below(24);
        let mut soup: Vec<[[f64; 3]; 3]> = Vec::new();
        for _ in 0..count {
            // Most share an edge or a corner with one that is there.
            let mut corners = [0; 3].map(|_| self.lattice_point(-2, 2));
            if !soup.is_empty() {
                let other = soup[self.below(soup.len())];
                let shared = self.below(3);
                for corner in corners.iter_mut().take(shared) {
                    *corner = other[self.below(3)];
                }
            }
            soup.push(corners);
        }
        soup.into_iter().map(OracleSurface::triangle).collect()
    }

    fn boxes_on_floor(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = self.tiles();
        for _ in 0..2 + self.below(5) {
            let on_lattice = self.chance(0.6);
            let mut corner = || {
                if on_lattice {
                    self.integer(-4, 3)
                } else {
                    self.real(-4.0, 3.0)
                }
            };
            let (x, y) = (corner(), corner());
            let z = if self.chance(0.7) {
                0.0
            } else {
                self.integer(1, 3)
            };
            let [dx, dy, dz] = [0; 3].map(|_| {
                if on_lattice {
                    self.integer(1, 3)
                } else {
                    self.real(0.2, 3.0)
                }
            });
            surfaces.extend(cuboid([x, y, z], [x + dx, y + dy, z + dz]));
        }
        surfaces
    }

    fn turned_boxes(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = Vec::new();
        // One rotation for all: a floor and boxes on it, none of their planes exact.
        let axes = self.rotation();
        let turn = |p: [f64; 3]| {
            [0, 1, 2].map(|i| p[0] * axes[0][i] + p[1] * axes[1][i] + p[2] * axes[2][i])
        };
        surfaces.extend(quad(
            [
                [-6.0, -6.0, 0.0],
                [6.0, -6.0, 0.0],
                [6.0, 6.0, 0.0],
                [-6.0, 6.0, 0.0],
            ]
            .map(turn),
        ));
        for _ in 0..1 + self.below(4) {
            let [x, y] = [0; 2].map(|_| self.real(-4.0, 3.0));
            let [dx, dy, dz] = [0; 3].map(|_| self.real(0.3, 3.0));
            surfaces.extend(cuboid_of(|i, j, k| {
                turn([
                    if i { x + dx } else { x },
                    if j { y + dy } else { y },
                    if k { dz } else { 0.0 },
                ])
            }));
        }
        surfaces
    }

    /// Three nearly orthogonal unit vectors.
    fn rotation(&mut self) -> [[f64; 3]; 3] {
        loop {
            let [w, x, y, z] = [0; 4].map(|_| self.real(-1.0, 1.0));
            let length = (w * w + x * x + y * y + z * z).sqrt();
            if length < 0.1 {
                continue;
            }
            let [w, x, y, z] = [w, x, y, z].map(|c| c / length);
            return [
                [
                    1.0 - 2.0 * (y * y + z * z),
                    2.0 * (x * y + w * z),
                    2.0 * (x * z - w * y),
                ],
                [
                    2.0 * (x * y - w * z),
                    1.0 - 2.0 * (x * x + z * z),
                    2.0 * (y * z + w * x),
                ],
                [
                    2.0 * (x * z + w * y),
                    2.0 * (y * z - w * x),
                    1.0 - 2.0 * (x * x + y * y),
                ],
            ];
        }
    }

    fn fan(&mut self) -> Vec<OracleSurface> {
        let on_lattice = self.chance(0.5);
        let hub = if on_lattice {
            [0.0; 3]
        } else {
            self.any_point(-0.3, 0.3)
        };
        let count = 4 + self.below(8);
        let steep = self.pick(&[0.0, 0.5, 2.0, 4.0]);
        let rim: Vec<[f64; 3]> = (0..count)
            .map(|i| {
                let angle = i as f64 / count as f64 * 6.3;
                let [x, y] = [4.0 * cos(angle), 4.0 * cos(angle - 1.57)];
                let z = self.real(-1.0, 1.0) * steep;
                if on_lattice {
                    [x.round(), y.round(), z.round()]
                } else {
                    [x, y, z]
                }
            })
            .collect();
        let mut fan: Vec<_> = (0..count)
            .map(|i| OracleSurface::triangle([hub, rim[i], rim[(i + 1) % count]]))
            .collect();
        // Sometimes a second fan through the same hub, which pierces the first, and a lid.
        for _ in 0..1 + self.below(4) {
            let [a, b] = [0; 2].map(|_| self.lattice_point(-3, 3));
            let corner = if self.chance(0.7) {
                hub
            } else {
                self.lattice_point(-3, 3)
            };
            fan.push(OracleSurface::triangle([corner, a, b]));
        }
        if self.chance(0.5) {
            let [a, b, c] = [0; 3].map(|_| [self.real(-4.0, 4.0), self.real(-4.0, 4.0), 4.5]);
            fan.push(OracleSurface::triangle([a, b, c]));
        }
        fan
    }

    fn valley(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = Vec::new();
        for _ in 0..1 + self.below(3) {
            let [a, b] = [0; 2].map(|_| self.any_point(-3.0, 3.0));
            for _ in 0..2 + self.below(2) {
                // Steep, shallow and almost flat wings.
                let [x, y] = [0; 2].map(|_| self.real(-5.0, 5.0));
                let z = self.pick(&[4.0, 1.0, 1e-3, 1e-9, 0.0]);
                let wing = [x, y, lerp(a, b, 0.5)[2] + z];
                surfaces.push(OracleSurface::triangle([a, b, wing]));
                // a neighbour of the wing
                let outer = self.any_point(-4.0, 4.0);
                surfaces.push(OracleSurface::triangle([b, wing, outer]));
            }
        }
        let roof = self.real(3.0, 5.0);
        let [a, b, c] = [0; 3].map(|_| [self.real(-6.0, 6.0), self.real(-6.0, 6.0), roof]);
        surfaces.push(OracleSurface::triangle([a, b, c]));
        surfaces
    }

    fn height_field(&mut self) -> Vec<OracleSurface> {
        let size = 3 + self.below(3);
        let on_lattice = self.chance(0.5);
        let spread = self.pick(&[1.0, 2.0, 4.0]);
        let mut point = vec![vec![[0.0; 3]; size + 1]; size + 1];
        for (i, row) in point.iter_mut().enumerate() {
            for (j, corner) in row.iter_mut().enumerate() {
                let height = self.real(0.0, 1.0) * spread;
                let z = if on_lattice { height.round() } else { height };
                let step = 8.0 / size as f64;
                *corner = [i as f64 * step - 4.0, j as f64 * step - 4.0, z];
            }
        }
        let mut surfaces = Vec::new();
        for i in 0..size {
            for j in 0..size {
                let corners = [
                    point[i][j],
                    point[i + 1][j],
                    point[i + 1][j + 1],
                    point[i][j + 1],
                ];
                surfaces.extend(quad(corners));
            }
        }
        // Some towers make shadows long enough to matter.
        for _ in 0..2 {
            let [x, y] = [0; 2].map(|_| self.integer(-3, 2));
            surfaces.extend(cuboid([x, y, 0.0], [x + 1.0, y + 1.0, 6.0]));
        }
        surfaces
    }

    fn touching_spheres(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = if self.chance(0.6) {
            self.tiles()
        } else {
            Vec::new()
        };
        let mut spheres: Vec<([f64; 3], f64)> = vec![([0.0, 0.0, 1.0], 1.0)];
        for _ in 0..3 + self.below(8) {
            let (center, radius) = self.pick(&spheres);
            spheres.push(match self.below(6) {
                // on top of, or beside, another one, exactly touching
                0 | 1 => {
                    let other = self.pick(&[1.0, 0.5, 2.0]);
                    let mut at = center;
                    at[self.below(3)] +=
                        if self.chance(0.8) { 1.0 } else { -1.0 } * (radius + other);
                    (at, other)
                }
                // the same again
                2 => (center, radius),
                // inside, touching from within
                3 => (
                    [center[0] + radius / 2.0, center[1], center[2]],
                    radius / 2.0,
                ),
                // standing on the floor
                4 => {
                    let other = self.real(0.3, 2.0);
                    ([self.real(-5.0, 5.0), self.real(-5.0, 5.0), other], other)
                }
                // anywhere, sunk into the floor perhaps
                _ => (self.any_point(-4.0, 4.0), self.real(0.3, 1.5)),
            });
        }
        surfaces.extend(
            spheres
                .into_iter()
                .map(|(c, r)| OracleSurface::sphere(c, r)),
        );
        surfaces
    }

    fn jointed_cones(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = if self.chance(0.5) {
            self.tiles()
        } else {
            Vec::new()
        };
        let on_lattice = self.chance(0.5);
        let joint = |rng: &mut Self| {
            if on_lattice {
                rng.lattice_point(-3, 4)
            } else {
                rng.any_point(-3.0, 4.0)
            }
        };
        for _ in 0..1 + self.below(3) {
            let mut from = joint(self);
            let mut radius = self.pick(&[0.25, 0.5, 1.0]);
            surfaces.push(OracleSurface::sphere(from, radius));
            for _ in 0..1 + self.below(4) {
                let to = joint(self);
                let next = self.pick(&[0.25, 0.5, 0.7, 1.0, 0.0]);
                if radius != 0.0 || next != 0.0 {
                    surfaces.push(OracleSurface::open_tube(from, radius, to, next));
                }
                if next > 0.0 && self.chance(0.8) {
                    surfaces.push(OracleSurface::sphere(to, next));
                }
                (from, radius) = (to, next);
            }
        }
        surfaces
    }

    fn closed_cylinders(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = self.tiles();
        let mut cones: Vec<([f64; 3], f64, [f64; 3], f64)> = Vec::new();
        for _ in 0..2 + self.below(6) {
            let on_lattice = self.chance(0.7);
            let radius = if on_lattice {
                self.pick(&[0.5, 1.0, 2.0])
            } else {
                self.real(0.2, 2.0)
            };
            let end = if self.chance(0.6) {
                radius
            } else {
                self.pick(&[0.0, 0.5, 1.5])
            };
            let mut base = self.lattice_point(-4, 4);
            base[2] = 0.0;
            let mut apex = [base[0], base[1], self.integer(1, 4)];
            if !on_lattice {
                base[0] += self.real(-0.5, 0.5);
                if self.chance(0.5) {
                    apex = self.any_point(0.5, 3.0);
                }
            }
            // Some are doubled, and some stand on others.
            match (self.below(5), cones.last()) {
                (0, Some(&twin)) => cones.push(twin),
                (1, Some(&(_, _, below, r))) if r > 0.0 => {
                    cones.push((below, r, [below[0], below[1], below[2] + 1.0], end));
                }
                _ => cones.push((base, radius, apex, end)),
            }
        }
        for (solid, (base, base_radius, apex, apex_radius)) in cones.into_iter().enumerate() {
            surfaces.extend(OracleSurface::closed_cone(
                solid,
                base,
                base_radius,
                apex,
                apex_radius,
            ));
        }
        surfaces
    }

    fn open_tubes(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = if self.chance(0.5) {
            self.tiles()
        } else {
            Vec::new()
        };
        for _ in 0..2 + self.below(4) {
            let mut base = if self.chance(0.6) {
                self.lattice_point(-3, 3)
            } else {
                self.any_point(-3.0, 3.0)
            };
            let axis = match self.below(4) {
                0 => [0.0, 0.0, 3.0],
                1 => [0.0, -2.0, 0.0],
                2 => self.lattice_point(1, 3),
                _ => self.any_point(-3.0, 3.0),
            };
            if self.chance(0.3) {
                base[2] = 0.0;
            }
            let apex = [0, 1, 2].map(|i| base[i] + axis[i]);
            let radius = self.pick(&[1.0, 2.0, 0.7]);
            let end = self.pick(&[radius, radius, 0.0, 0.5]);
            surfaces.push(OracleSurface::open_tube(base, radius, apex, end));
            match self.below(4) {
                0 => surfaces.push(OracleSurface::open_tube(base, radius, apex, end)),
                1 => surfaces.push(OracleSurface::open_tube(
                    base,
                    radius / 2.0,
                    apex,
                    end / 2.0,
                )),
                2 if end > 0.0 => {
                    // a continuation that shares the rim
                    let further = [0, 1, 2].map(|i| apex[i] + axis[i]);
                    surfaces.push(OracleSurface::open_tube(apex, end, further, end));
                }
                _ => {}
            }
        }
        surfaces
    }

    fn coplanar_layers(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = Vec::new();
        for layer in 0..2 + self.below(2) {
            let height = layer as f64 * self.pick(&[1.0, 1.0, 0.3]);
            let axis = self.pick(&[2, 2, 2, 1, 0]);
            for _ in 0..2 + self.below(4) {
                let [a, b, c] = [0; 3].map(|_| {
                    let mut corner = if self.chance(0.7) {
                        self.lattice_point(-4, 4)
                    } else {
                        self.any_point(-4.0, 4.0)
                    };
                    corner[axis] = height;
                    corner
                });
                surfaces.push(OracleSurface::triangle([a, b, c]));
                match self.below(4) {
                    0 => surfaces.push(OracleSurface::triangle([c, b, a])),
                    1 => surfaces.push(OracleSurface::triangle([b, c, a])),
                    _ => {}
                }
            }
            if self.chance(0.7) {
                let mut center = self.lattice_point(-3, 3);
                center[axis] = height;
                let mut normal = [0.0; 3];
                normal[axis] = self.pick(&[1.0, -1.0, 0.3]);
                let radius = self.pick(&[1.0, 2.5, 5.0]);
                surfaces.push(OracleSurface::opaque(OracleShape::Disk {
                    center,
                    normal,
                    radius,
                }));
            }
        }
        let normal = self.any_point(-1.0, 1.0);
        let center = self.any_point(-2.0, 2.0);
        surfaces.push(OracleSurface::opaque(OracleShape::Disk {
            center,
            normal,
            radius: 1.5,
        }));
        surfaces
    }

    fn needles(&mut self) -> Vec<OracleSurface> {
        let mut surfaces = Vec::new();
        for _ in 0..8 + self.below(16) {
            let [a, b] = [0; 2].map(|_| self.any_point(-5.0, 5.0));
            let along = self.real(0.1, 0.9);
            let width = self.pick(&[1.0, 1.0, 1e-3, 1e-12]);
            let mut c = lerp(a, b, along);
            for x in &mut c {
                *x += self.real(-1.0, 1.0) * width;
            }
            surfaces.push(OracleSurface::triangle([a, b, c]));
        }
        // Broad ones, so that there is something to shade and be shaded.
        for z in [-3.0, 0.0, 1.0, 2.0, 4.0] {
            let [a, b, c] = [0; 3].map(|_| [self.real(-6.0, 6.0), self.real(-6.0, 6.0), z]);
            surfaces.push(OracleSurface::triangle([a, b, c]));
        }
        surfaces
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

    /// The `i`-th light of a scene: the kinds take turns, from a random one on.
    fn light(&mut self, i: usize, surfaces: &[OracleSurface], frame: Frame) -> OracleLight {
        let kind = (self.below(4) + 3 * i) % 12;
        let near = |rng: &mut Self| {
            let corner = rng.corner_of_any(surfaces);
            let reach = frame.scale();
            [0, 1, 2].map(|i| corner[i] + rng.real(-1.0, 1.0) * reach)
        };
        match kind {
            // above and outside
            0 | 1 => OracleLight::Point(frame.place([
                self.real(-9.0, 9.0),
                self.real(-9.0, 9.0),
                self.real(4.0, 20.0),
            ])),
            2 => {
                let point = self.lattice_point(-6, 6);
                OracleLight::Point(frame.place([point[0], point[1], point[2].abs() + 3.0]))
            }
            3 => OracleLight::Point(frame.place(self.lattice_point(-2, 4))),
            // directions
            4 => {
                let mut direction = [0.0; 3];
                let axis = self.pick(&[2, 2, 1, 0]);
                direction[axis] = self.pick(&[1.0, -1.0, 0.1]);
                OracleLight::Direction(direction)
            }
            5 => OracleLight::Direction([
                self.real(-1.0, 1.0),
                self.real(-1.0, 1.0),
                self.real(1e-3, 1.0),
            ]),
            6 => OracleLight::Direction([self.integer(-2, 2), self.integer(-2, 2), 1.0]),
            // inside the scene, next to something
            7 => OracleLight::Point(near(self)),
            // on a surface, or in its plane
            8 => OracleLight::Point(self.point_on(surfaces, true)),
            9 => OracleLight::Point(self.point_on(surfaces, false)),
            // on an edge or an axis, extended
            10 => {
                let (a, b) = self.line_of_any(surfaces);
                OracleLight::Point(lerp(a, b, self.pick(&[2.0, 3.0, -1.0, 1.5, 0.5])))
            }
            _ => {
                let (a, b) = self.line_of_any(surfaces);
                let direction = [0, 1, 2].map(|i| b[i] - a[i]);
                let usable = direction.iter().any(|&x| x != 0.0);
                OracleLight::Direction(if usable { direction } else { [0.0, 0.0, 1.0] })
            }
        }
    }

    /// Two points that span an edge, an axis, or a radius.
    fn line_of_any(&mut self, surfaces: &[OracleSurface]) -> ([f64; 3], [f64; 3]) {
        match self.pick(surfaces).shape {
            OracleShape::Triangle(corners) => {
                let i = self.below(3);
                (corners[i], corners[(i + 1) % 3])
            }
            OracleShape::Tube { base, apex, .. } | OracleShape::Cap { base, apex, .. } => {
                if self.chance(0.5) {
                    (base, apex)
                } else {
                    (apex, base)
                }
            }
            OracleShape::Sphere { center, radius } => {
                (center, [center[0], center[1], center[2] + radius])
            }
            OracleShape::Disk { center, normal, .. } => {
                (center, [0, 1, 2].map(|i| center[i] + normal[i]))
            }
        }
    }

    /// A point that the data of some surface names.
    fn corner_of_any(&mut self, surfaces: &[OracleSurface]) -> [f64; 3] {
        match self.pick(surfaces).shape {
            OracleShape::Triangle(corners) => self.pick(&corners),
            OracleShape::Tube { base, apex, .. } | OracleShape::Cap { base, apex, .. } => {
                self.pick(&[base, apex])
            }
            OracleShape::Sphere { center, .. } | OracleShape::Disk { center, .. } => center,
        }
    }

    fn point_on(&mut self, surfaces: &[OracleSurface], inside: bool) -> [f64; 3] {
        let surface = self.pick(surfaces);
        self.point_on_shape(&surface.shape, inside)
    }

    /// A point of a surface, rounded as a renderer rounds it; not `inside`, also one of the plane
    /// or quadric beyond the surface.
    fn point_on_shape(&mut self, shape: &OracleShape, inside: bool) -> [f64; 3] {
        let reach = if inside { 1.0 } else { 3.0 };
        // a point of the unit circle, often a rational one
        let (cosine, sine) = match self.below(4) {
            0 => self.pick(&[(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)]),
            1 => self.pick(&[(0.6, 0.8), (-0.8, 0.6)]),
            _ => {
                let t = self.real(-2.0, 2.0);
                ((1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t))
            }
        };
        match *shape {
            OracleShape::Triangle([a, b, c]) => {
                let (mut u, mut v) = match self.below(8) {
                    0 => (0.0, 0.0),                 // a corner
                    1 => (1.0, 0.0),                 // another
                    2 => (self.real(0.0, 1.0), 0.0), // an edge
                    3 => (0.0, self.real(0.0, 1.0)), // another
                    4 => (0.5, 0.5),                 // the middle of the third
                    5 => {
                        let u = self.real(0.0, 1.0);
                        (u, 1.0 - u) // the third, rounded
                    }
                    _ => (self.real(0.0, 1.0), self.real(0.0, 1.0)),
                };
                if u + v > 1.0 + 1e-9 {
                    (u, v) = (1.0 - u, 1.0 - v);
                }
                (u, v) = (u * reach, v * reach);
                [0, 1, 2].map(|i| a[i] * (1.0 - u - v) + b[i] * u + c[i] * v)
            }
            OracleShape::Sphere { center, radius } => {
                let z = self.pick(&[0.0, 1.0, -1.0, 0.6, 0.28]);
                let z = if self.chance(0.5) {
                    z
                } else {
                    self.real(-1.0, 1.0)
                };
                let ring = (1.0 - z * z).sqrt();
                let unit = [ring * cosine, ring * sine, z];
                [0, 1, 2].map(|i| center[i] + radius * unit[i] * reach)
            }
            OracleShape::Tube {
                base,
                base_radius,
                apex,
                apex_radius,
            } => {
                let t = if self.chance(0.3) {
                    self.pick(&[0.0, 1.0])
                } else {
                    self.real(0.0, 1.0)
                };
                let t = t * reach;
                let radius = base_radius + (apex_radius - base_radius) * t;
                on_circle(
                    lerp(base, apex, t),
                    base,
                    apex,
                    radius * cosine,
                    radius * sine,
                )
            }
            OracleShape::Cap {
                base,
                apex,
                radius,
                at_apex,
            } => {
                let center = if at_apex { apex } else { base };
                let r = self.pick(&[0.0, 0.5, 1.0, 1.0]);
                let r = radius
                    * reach
                    * if self.chance(0.5) {
                        r
                    } else {
                        self.real(0.0, 1.0)
                    };
                on_circle(center, base, apex, r * cosine, r * sine)
            }
            OracleShape::Disk {
                center,
                normal,
                radius,
            } => {
                let r = self.pick(&[0.0, 1.0]);
                let r = radius
                    * reach
                    * if self.chance(0.3) {
                        r
                    } else {
                        self.real(0.0, 1.0)
                    };
                on_circle(center, [0.0; 3], normal, r * cosine, r * sine)
            }
        }
    }

    fn query(&mut self, surfaces: &[OracleSurface], frame: Frame) -> NastyQuery {
        // Scenes of few shapes on many tiles would ask about tiles only.
        let triangle_count =
            surfaces.partition_point(|s| matches!(s.shape, OracleShape::Triangle(_)));
        let surface = if triangle_count < surfaces.len() && self.chance(0.6) {
            self.0.random_range(triangle_count..surfaces.len())
        } else {
            self.below(surfaces.len())
        };
        let mut point = self.point_on_shape(&surfaces[surface].shape, true);
        match self.below(8) {
            // one ulp off
            0 | 1 => {
                let axis = self.below(3);
                let up = self.chance(0.5);
                NastyQuery {
                    point: nudged(point, axis, up),
                    surface: Some(surface),
                }
            }
            // a point of space on or next to a surface
            2 => {
                if self.chance(0.5) {
                    point = nudged(point, self.below(3), self.chance(0.5));
                }
                NastyQuery {
                    point,
                    surface: None,
                }
            }
            // a point of space, also of the lattice
            3 => {
                let point = if self.chance(0.5) {
                    self.lattice_point(-3, 3)
                } else {
                    self.any_point(-5.0, 5.0)
                };
                NastyQuery {
                    point: frame.place(point),
                    surface: None,
                }
            }
            _ => NastyQuery {
                point,
                surface: Some(surface),
            },
        }
    }
}

/// The point `center + x u + y v` with `u`, `v` orthonormal to `to - from` up to rounding.
fn on_circle(center: [f64; 3], from: [f64; 3], to: [f64; 3], x: f64, y: f64) -> [f64; 3] {
    let axis = [0, 1, 2].map(|i| to[i] - from[i]);
    let largest = axis.iter().fold(0.0f64, |m, c| m.max(c.abs()));
    if largest == 0.0 {
        return center;
    }
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let unit = |a: [f64; 3]| {
        let length = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
        a.map(|c| c / length)
    };
    let axis = unit(axis.map(|c| c / largest));
    // The axis that is least like the tube's own; for an upright tube u, v are x, y.
    let helper = if axis[0].abs() <= axis[2].abs() {
        [1.0, 0.0, 0.0]
    } else {
        [0.0, 0.0, 1.0]
    };
    let v = unit(cross(axis, helper));
    let u = cross(v, axis);
    [0, 1, 2].map(|i| center[i] + x * u[i] + y * v[i])
}

/// A cosine good to some digits, the same on every platform: scenes must not depend on `libm`.
fn cos(angle: f64) -> f64 {
    // Fold into half a turn round zero, then a Taylor polynomial.
    let turn = std::f64::consts::TAU;
    let x = angle - turn * (angle / turn).round();
    let y = x * x;
    let mut term = 1.0;
    let mut sum = 1.0;
    for k in 1..12 {
        let k = f64::from(k);
        term *= -y / ((2.0 * k - 1.0) * (2.0 * k));
        sum += term;
    }
    sum
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
