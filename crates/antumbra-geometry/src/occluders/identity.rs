//! What answers depend on, as bytes: for those who keep answers and must know whether they still hold.
//!
//! In: the surfaces. Out: bytes for a hash. Invariant: two collections that say the same bytes answer every
//! query alike and number their surfaces alike; numbers are said bit by bit. Absent here: the hash, colors,
//! texture coordinates of faces without holes.

use super::{AlphaTest, Curved, CurvedShape, Element, ElementKind, Occluders, Opacity, Triangle};
use crate::intersect::DiskPlane;
use crate::{Cone, CoverageId, Field, Implicit, LightShape, Sphere};

/// A coverage that does not say what it is ([`Coverage::identify`](crate::Coverage::identify)): what is
/// kept about faces with such holes could not be distinguished from what no longer holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the holes of alpha-tested faces, coverage {coverage}, do not say what they are")]
pub struct UnidentifiedCoverage {
    /// Its number, in the order of adding.
    pub coverage: usize,
}

impl Occluders {
    /// Says everything that answers depend on, piece after piece.
    ///
    /// # Errors
    /// A coverage does not say what it is.
    pub fn identify(&self, write: &mut dyn FnMut(&[u8])) -> Result<(), UnidentifiedCoverage> {
        let Self {
            positions,
            triangles,
            alpha_tests,
            coverages,
            // What is kept in files is about blocking.
            filters: _,
            filter_uvs: _,
            curved,
            // Follows from `curved`.
            solids: _,
            elements,
            // Follows from the rest.
            bounds: _,
            // What is left out is transparent.
            left_out: _,
            first_freeform: _,
        } = self;
        for (number, coverage) in coverages.iter().enumerate() {
            let mut said = Vec::new();
            if !coverage.identify(&mut |more| said.extend_from_slice(more)) {
                return Err(UnidentifiedCoverage { coverage: number });
            }
            write(&(said.len() as u64).to_le_bytes());
            write(&said);
        }
        let mut words = Words {
            write,
            buffer: Vec::with_capacity(BUFFER + LONGEST),
        };
        words.count(positions.len());
        for position in positions {
            words.numbers(&position.to_array());
        }
        words.count(triangles.len());
        for triangle in triangles {
            // The axis follows from the positions, and corners only name texture coordinates.
            let &Triangle {
                vertices,
                corners: _,
                element,
                axis: _,
                is_opaque,
                alpha_test,
            } = triangle;
            let [a, b, c] = vertices;
            words.words(&[a, b, c, element, u32::from(is_opaque), alpha_test]);
        }
        words.count(alpha_tests.len());
        for &AlphaTest { coverage, uvs } in alpha_tests {
            words.words(&[coverage.0]);
            words.numbers(uvs.as_flattened());
        }
        words.count(curved.len());
        for curved in curved {
            words.curved(curved);
        }
        words.count(elements.len());
        for element in elements {
            words.element(element);
        }
        words.flush();
        Ok(())
    }
}

impl LightShape {
    /// Returns everything about the light that answers depend on: its kind and its numbers, bit by bit.
    pub fn identity(&self) -> [u8; 25] {
        let (x, weight) = self.homogeneous();
        let mut bytes = [0; 25];
        bytes[0] = weight as u8;
        for (bytes, number) in bytes[1..].chunks_exact_mut(8).zip(x.to_array()) {
            bytes.copy_from_slice(&number.to_le_bytes());
        }
        bytes
    }
}

/// Bytes are handed on by so many, and no item has more than the other number.
const BUFFER: usize = 1 << 14;
const LONGEST: usize = 128;

/// Numbers as bytes, the lowest first.
struct Words<'a> {
    write: &'a mut dyn FnMut(&[u8]),
    buffer: Vec<u8>,
}

impl Words<'_> {
    fn flush(&mut self) {
        (self.write)(&self.buffer);
        self.buffer.clear();
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.buffer.extend_from_slice(bytes);
        if self.buffer.len() >= BUFFER {
            self.flush();
        }
    }

    fn count(&mut self, count: usize) {
        self.bytes(&(count as u64).to_le_bytes());
    }

    fn words(&mut self, words: &[u32]) {
        for word in words {
            self.bytes(&word.to_le_bytes());
        }
    }

    fn numbers(&mut self, numbers: &[f64]) {
        for number in numbers {
            self.bytes(&number.to_le_bytes());
        }
    }

    fn curved(&mut self, curved: &Curved) {
        let Curved {
            shape,
            element,
            solid,
            is_opaque,
        } = curved;
        let kind = match shape {
            CurvedShape::Sphere(_) => 0,
            CurvedShape::Tube(_) => 1,
            CurvedShape::Cap(..) => 2,
            CurvedShape::Disk(..) => 3,
            CurvedShape::Part(_) => 4,
            CurvedShape::Level(_) => 5,
        };
        self.words(&[kind, *element, *solid, u32::from(*is_opaque)]);
        match shape {
            CurvedShape::Sphere(Sphere { center, radius }) => {
                self.numbers(&center.to_array());
                self.numbers(&[*radius]);
            }
            CurvedShape::Tube(cone) => self.cone(cone),
            CurvedShape::Cap(disk, cone) => {
                self.disk(disk);
                self.cone(cone);
            }
            CurvedShape::Disk(disk, axis) => {
                self.disk(disk);
                self.words(&[u32::from(*axis)]);
            }
            CurvedShape::Part(part) => {
                let patch = part.patch();
                for point in patch.points() {
                    self.numbers(&point.to_array());
                }
                let [column, row] = part.first_cell();
                self.words(&[patch.level, column, row]);
            }
            CurvedShape::Level(level) => self.implicit(level.surface()),
        }
    }

    fn implicit(&mut self, Implicit { field, low, high }: &Implicit) {
        self.numbers(&low.to_array());
        self.numbers(&high.to_array());
        match field {
            Field::Torus {
                center,
                axis,
                major,
                minor,
            } => {
                self.words(&[0]);
                self.numbers(&center.to_array());
                self.numbers(&axis.to_array());
                self.numbers(&[*major, *minor]);
            }
            Field::Metaballs { balls, threshold } => {
                self.words(&[1]);
                self.count(balls.len());
                for ball in balls {
                    self.numbers(&ball.center.to_array());
                    self.numbers(&[ball.radius, ball.strength]);
                }
                self.numbers(&[*threshold]);
            }
            Field::Gyroid {
                center,
                period,
                level,
            } => {
                self.words(&[2]);
                self.numbers(&center.to_array());
                self.numbers(&[*period, *level]);
            }
            Field::Polynomial {
                center,
                unit,
                terms,
            } => {
                self.words(&[3]);
                self.count(terms.len());
                for term in terms {
                    self.numbers(&[term.factor]);
                    self.words(&term.exponents);
                }
                self.numbers(&center.to_array());
                self.numbers(&[*unit]);
            }
        }
    }

    fn cone(&mut self, cone: &Cone) {
        let &Cone {
            base,
            base_radius,
            apex,
            apex_radius,
            is_closed,
        } = cone;
        self.numbers(&base.to_array());
        self.numbers(&apex.to_array());
        self.numbers(&[base_radius, apex_radius]);
        self.words(&[u32::from(is_closed)]);
    }

    fn disk(&mut self, disk: &DiskPlane) {
        let &DiskPlane {
            center,
            normal_tip,
            normal_tail,
            radius,
        } = disk;
        for vector in [center, normal_tip, normal_tail] {
            self.numbers(&vector.to_array());
        }
        self.numbers(&[radius]);
    }

    fn element(&mut self, element: &Element) {
        let Element {
            kind,
            surfaces,
            opacity,
        } = element;
        let kind = match kind {
            ElementKind::Face => 0,
            ElementKind::Sphere => 1,
            ElementKind::OpenCone => 2,
            ElementKind::ClosedCone => 3,
            ElementKind::Disk => 4,
            ElementKind::Patch => 5,
            ElementKind::Implicit => 6,
        };
        let opacity = match *opacity {
            Opacity::Opaque => [0, 0],
            Opacity::Transparent | Opacity::Filtering(_) => [1, 0],
            Opacity::AlphaTested(CoverageId(coverage)) => [2, coverage],
        };
        self.words(&[kind, surfaces.start, surfaces.end]);
        self.words(&opacity);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Coverage, DVec3, Disk};
    use std::sync::Arc;

    fn said(occluders: &Occluders) -> Result<Vec<u8>, UnidentifiedCoverage> {
        let mut bytes = Vec::new();
        occluders.identify(&mut |more| bytes.extend_from_slice(more))?;
        Ok(bytes)
    }

    #[derive(Debug)]
    struct Holes(Option<u8>);

    impl Coverage for Holes {
        fn is_solid_at(&self, uv: [f64; 2]) -> bool {
            uv[0] > 0.5
        }

        fn identify(&self, write: &mut dyn FnMut(&[u8])) -> bool {
            if let Some(byte) = self.0 {
                write(&[byte]);
            }
            self.0.is_some()
        }
    }

    /// What the scenes differ by.
    #[derive(Clone, Copy)]
    struct Numbers {
        corner: f64,
        radius: f64,
        base_radius: f64,
        is_closed: bool,
        disk: f64,
        holes: Option<u8>,
        uv: f64,
        opacity: Opacity,
        is_turned: bool,
    }

    const USUAL: Numbers = Numbers {
        corner: 1.0,
        radius: 0.5,
        base_radius: 0.25,
        is_closed: false,
        disk: 0.75,
        holes: Some(1),
        uv: 0.5,
        opacity: Opacity::Opaque,
        is_turned: false,
    };

    fn scene(numbers: Numbers) -> Occluders {
        let mut builder = Occluders::builder();
        let v = DVec3::new;
        let corners = [DVec3::ZERO, v(numbers.corner, 0.0, 0.0), DVec3::Y];
        let mut other = corners.map(|corner| corner + DVec3::Z);
        if numbers.is_turned {
            other.reverse();
        }
        builder.add_face(&corners, numbers.opacity).unwrap();
        builder.add_face(&other, Opacity::Opaque).unwrap();
        let holes = builder.add_coverage(Arc::new(Holes(numbers.holes)));
        let uvs = [[0.0; 2], [numbers.uv, 0.0], [1.0; 2]];
        builder
            .add_alpha_tested_face(&corners, &uvs, holes)
            .unwrap();
        let (center, radius) = (v(0.1, 0.2, 0.3), numbers.radius);
        builder
            .add_sphere(Sphere { center, radius }, Opacity::Opaque)
            .unwrap();
        let cone = Cone {
            base: DVec3::ZERO,
            base_radius: numbers.base_radius,
            apex: DVec3::X,
            apex_radius: 0.0,
            is_closed: numbers.is_closed,
        };
        builder.add_cone(cone, Opacity::Opaque).unwrap();
        let disk = Disk {
            center,
            normal: DVec3::Z,
            radius: numbers.disk,
        };
        builder.add_disk(disk, Opacity::Opaque).unwrap();
        builder.build()
    }

    #[test]
    fn whatever_changes_an_answer_is_said() {
        let usual = said(&scene(USUAL)).unwrap();
        assert_eq!(said(&scene(USUAL)), Ok(usual.clone()));
        let mut all = vec![usual];
        for other in [
            Numbers {
                corner: 1.0_f64.next_up(),
                ..USUAL
            },
            Numbers {
                radius: 0.5_f64.next_up(),
                ..USUAL
            },
            Numbers {
                base_radius: 0.125,
                ..USUAL
            },
            Numbers {
                is_closed: true,
                ..USUAL
            },
            Numbers { disk: 0.5, ..USUAL },
            Numbers {
                holes: Some(2),
                ..USUAL
            },
            Numbers { uv: 0.25, ..USUAL },
            Numbers {
                opacity: Opacity::Transparent,
                ..USUAL
            },
            Numbers {
                is_turned: true,
                ..USUAL
            },
        ] {
            let other = said(&scene(other)).unwrap();
            assert!(!all.contains(&other));
            all.push(other);
        }
    }

    #[test]
    fn holes_that_say_nothing_are_named() {
        let numbers = Numbers {
            holes: None,
            ..USUAL
        };
        let error = said(&scene(numbers)).unwrap_err();
        assert_eq!(error, UnidentifiedCoverage { coverage: 0 });
    }

    #[test]
    fn lights_are_told_by_kind_and_bits() {
        let lights = [
            LightShape::Point(DVec3::ONE),
            LightShape::Direction(DVec3::ONE),
            LightShape::Point(DVec3::new(1.0, 1.0, 1.0_f64.next_up())),
        ];
        let said = lights.map(|light| light.identity());
        assert!(said[0] != said[1] && said[0] != said[2] && said[1] != said[2]);
        assert_eq!(said[0], LightShape::Point(DVec3::ONE).identity());
    }
}
