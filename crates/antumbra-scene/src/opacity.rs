//! Which surfaces block shadow rays: decided in one place for all formats, and by values.
//!
//! In: a scene whose materials hold what its file says. Out: the same scene, settled, and warnings
//! about surfaces that let light through. Invariant: the name of a mode decides nothing that its values
//! do not: what is blended with an alpha of 1 everywhere is opaque, and so is what transmits nothing.
//!
//! | the material | blocks |
//! |---|---|
//! | transmits more than nothing | no shadow ray |
//! | [`Alpha::Opaque`] | all, whatever its alpha |
//! | [`Alpha::Mask`] | those that meet it where alpha is not below the cutoff |
//! | [`Alpha::Blend`], alpha 1 everywhere | all |
//! | [`Alpha::Blend`], alpha below 1 somewhere | none |
//!
//! Alpha is the material's, times that of its texture, times (where it blends) that of the vertices.

use std::collections::{BTreeSet, HashMap};

pub use super::shadow_kind::ShadowKind;
use crate::{
    error::{Place, quoted},
    model::{Alpha, Color, Material, Object, Scene, Shape},
    warning::WarningLog,
};

impl Material {
    /// Returns what surfaces of this material do to shadow rays.
    ///
    /// Readers have settled what alphas of textures and vertices decide: where they return
    /// [`Alpha::Blend`], alpha is below 1 somewhere. A mask is decided here wherever no texture can
    /// change the outcome: without one, at a cutoff of 0, and where `opacity`, the largest alpha
    /// that can result, is below the cutoff.
    pub fn shadow_kind(&self) -> ShadowKind {
        if self.transmission != Color::ZERO {
            return ShadowKind::Transparent;
        }
        match self.alpha {
            Alpha::Opaque => ShadowKind::Opaque,
            Alpha::Blend => ShadowKind::Transparent,
            Alpha::Mask { cutoff } if self.opacity < cutoff => ShadowKind::Transparent,
            Alpha::Mask { cutoff } if self.diffuse_texture.is_none() || cutoff <= 0.0 => {
                ShadowKind::Opaque
            }
            Alpha::Mask { .. } => ShadowKind::AlphaTested,
        }
    }

    /// Returns whether surfaces of this material block shadow rays everywhere.
    pub fn is_opaque(&self) -> bool {
        self.shadow_kind() == ShadowKind::Opaque
    }

    /// Returns what the surface lets through straight on where its texture's alpha is `texture_alpha` (1 without a texture):
    /// shares of red, green and blue, each from 0 to 1. What it does not cover, and of the rest what it transmits.
    pub fn transmittance(&self, texture_alpha: f64) -> Color {
        let coverage = self.coverage(texture_alpha);
        let shares = Color::splat(1.0 - coverage) + coverage * self.transmission;
        shares.clamp(Color::ZERO, Color::ONE)
    }

    /// Returns how much the surface covers where its texture's alpha is `texture_alpha` (1 without
    /// a texture): 0, it is not there, to 1, it is whole. Only [`Alpha::Blend`] gives values in
    /// between. Transmission plays no part.
    pub fn coverage(&self, texture_alpha: f64) -> f64 {
        let alpha = self.opacity * texture_alpha;
        match self.alpha {
            Alpha::Opaque => 1.0,
            Alpha::Mask { cutoff } if alpha >= cutoff => 1.0,
            Alpha::Mask { .. } => 0.0,
            Alpha::Blend => alpha.clamp(0.0, 1.0),
        }
    }
}

/// Why surfaces of a material let light through, in the words of its format.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Cause {
    /// What the file says.
    pub(crate) what: String,
    /// What to do if it is not meant; may be empty.
    pub(crate) advice: &'static str,
}

/// Settles which surfaces block, and warns of those that do not. `cause` says why the material of
/// this index does not.
pub(crate) fn settle(
    scene: &mut Scene,
    cause: impl Fn(&Material, usize) -> Cause,
    warnings: &mut WarningLog,
) {
    settle_alpha(scene, warnings);
    report(scene, cause, warnings);
}

/// Turns alphas that are 1 everywhere into [`Alpha::Opaque`]. A material that blends for some of its
/// objects only becomes two.
fn settle_alpha(scene: &mut Scene, warnings: &mut WarningLog) {
    let is_whole_texture: Vec<bool> = scene
        .textures
        .iter()
        .map(|texture| texture.texels.iter().all(|texel| texel[3] == 255))
        .collect();
    for material in &mut scene.materials {
        // A mask whose picture has no holes needs no test at each hit.
        if let (Alpha::Mask { cutoff }, Some(texture)) = (material.alpha, material.diffuse_texture)
            && material.opacity >= cutoff
            && is_whole_texture.get(texture) == Some(&true)
        {
            material.alpha = Alpha::Opaque;
        }
    }
    // For each material: how many objects blend, how many are whole.
    let mut counts = vec![[0_usize; 2]; scene.materials.len()];
    let mut is_whole_object = Vec::with_capacity(scene.objects.len());
    for object in &scene.objects {
        let Some(material) = scene.materials.get(object.material) else {
            is_whole_object.push(false);
            continue;
        };
        let has_clear_vertex = has_clear_vertex(object);
        if has_clear_vertex && matches!(material.alpha, Alpha::Mask { .. }) {
            let message = "alpha of vertices plays no part in an alpha test: it is not used there";
            warnings.add(Place::Whole, message);
        }
        let is_whole_picture = match material.diffuse_texture {
            Some(texture) if has_uvs(object) => is_whole_texture.get(texture) == Some(&true),
            _ => true,
        };
        let is_whole = material.opacity >= 1.0 && is_whole_picture && !has_clear_vertex;
        is_whole_object.push(is_whole);
        counts[object.material][usize::from(is_whole)] += 1;
    }
    for (number, [blended, whole]) in counts.into_iter().enumerate() {
        if scene.materials[number].alpha != Alpha::Blend || whole == 0 {
            continue;
        }
        let mut target = number;
        if blended > 0 {
            target = scene.materials.len();
            let material = scene.materials[number].clone();
            scene.materials.push(material);
            let objects = scene.objects.iter_mut().zip(&is_whole_object);
            for (object, _) in objects.filter(|(o, is_whole)| o.material == number && **is_whole) {
                object.material = target;
            }
        }
        scene.materials[target].alpha = Alpha::Opaque;
    }
}

fn has_uvs(object: &Object) -> bool {
    object.shape.mesh().is_some_and(|mesh| !mesh.uvs.is_empty())
}

/// Returns whether a corner of a face has an alpha below 1.
fn has_clear_vertex(object: &Object) -> bool {
    let Some(mesh) = object.shape.mesh() else {
        return false;
    };
    let is_clear =
        |position: u32| matches!(mesh.colors.get(position as usize), Some(c) if c[3] < 1.0);
    mesh.corners.iter().any(|corner| is_clear(corner.position))
}

/// Surfaces that let light through for one reason.
struct Clear {
    cause: Cause,
    faces: usize,
    has_curved: bool,
    materials: BTreeSet<usize>,
}

/// Says how many surfaces let light through, and why.
fn report(scene: &Scene, cause: impl Fn(&Material, usize) -> Cause, warnings: &mut WarningLog) {
    /// More reasons than this are counted, not listed.
    const LISTED: usize = 8;
    let largest_alpha: Vec<u8> = scene
        .textures
        .iter()
        .map(|texture| {
            texture
                .texels
                .iter()
                .map(|texel| texel[3])
                .max()
                .unwrap_or(255)
        })
        .collect();
    let mut all = 0;
    let mut clear: Vec<Clear> = Vec::new();
    let mut known = HashMap::new();
    // The entry of each material in `clear`, once it has one.
    let mut entry_of = vec![None; scene.materials.len()];
    for object in &scene.objects {
        let (faces, is_curved) = match &object.shape {
            Shape::Mesh(mesh) => (mesh.face_ends.len(), false),
            Shape::Instance(instance) => (instance.mesh.face_ends.len(), false),
            Shape::Polygon(_) => (1, false),
            Shape::Sphere(_)
            | Shape::Cone(_)
            | Shape::Disk(_)
            | Shape::Patch(_)
            | Shape::Implicit(_) => (1, true),
        };
        all += faces;
        let Some(material) = scene.materials.get(object.material) else {
            continue;
        };
        let is_hole = is_hole(object, material, &largest_alpha);
        if material.shadow_kind() != ShadowKind::Transparent && !is_hole {
            continue;
        }
        let entry = *entry_of[object.material].get_or_insert_with(|| {
            let cause = if is_hole {
                Cause {
                    what: "the alpha of its picture is below the cutoff everywhere".into(),
                    advice: "",
                }
            } else {
                cause(material, object.material)
            };
            *known.entry(cause.clone()).or_insert_with(|| {
                clear.push(Clear {
                    cause,
                    faces: 0,
                    has_curved: false,
                    materials: BTreeSet::new(),
                });
                clear.len() - 1
            })
        });
        let entry = &mut clear[entry];
        entry.faces += faces;
        entry.has_curved |= is_curved;
        entry.materials.insert(object.material);
    }
    let clear_faces: usize = clear.iter().map(|entry| entry.faces).sum();
    if clear_faces == 0 {
        return;
    }
    if clear_faces == all {
        let has_curved = clear.iter().any(|entry| entry.has_curved);
        let surfaces = counted(all, has_curved);
        let message =
            format!("nothing in this scene casts a shadow: all of it ({surfaces}) is see-through");
        warnings.add(Place::Whole, message);
    }
    for entry in clear.iter().take(LISTED) {
        warnings.add(Place::Whole, entry.message(scene));
    }
    let more = clear.iter().skip(LISTED);
    let more_faces: usize = more.clone().map(|entry| entry.faces).sum();
    if more_faces > 0 {
        let surfaces = counted(more_faces, more.clone().any(|entry| entry.has_curved));
        let reasons = more.count();
        let message = format!("{surfaces} more let light through, for {reasons} more reasons");
        warnings.add(Place::Whole, message);
    }
}

/// Returns whether an alpha test finds nothing of an object, wherever it is asked.
fn is_hole(object: &Object, material: &Material, largest_alpha: &[u8]) -> bool {
    let (Alpha::Mask { cutoff }, Some(texture)) = (material.alpha, material.diffuse_texture) else {
        return false;
    };
    let largest = largest_alpha
        .get(texture)
        .map_or(1.0, |&alpha| f64::from(alpha) / 255.0);
    has_uvs(object) && material.opacity * largest < cutoff
}

impl Clear {
    fn message(&self, scene: &Scene) -> String {
        const LISTED: usize = 4;
        let Self {
            cause: Cause { what, advice },
            faces,
            has_curved,
            materials,
        } = self;
        let surfaces = counted(*faces, *has_curved);
        let of = match materials.len() {
            1 => String::new(),
            count => format!(" of {count} materials"),
        };
        let verb = if *faces == 1 { "lets" } else { "let" };
        let named = materials
            .iter()
            .map(|&number| &*scene.materials[number].name);
        let named: Vec<_> = named.filter(|name| !name.is_empty()).collect();
        let names: Vec<_> = named.iter().take(LISTED).map(|name| quoted(name)).collect();
        let more = match named.len().saturating_sub(LISTED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let names = match named.len() {
            0 => String::new(),
            1 => format!(" (material {})", names.join("")),
            _ => format!(" (materials {}{more})", names.join(", ")),
        };
        let advice = match *advice {
            "" => String::new(),
            advice => format!("; {advice}"),
        };
        format!("{surfaces}{of} {verb} light through: {what}{names}{advice}")
    }
}

fn counted(faces: usize, has_curved: bool) -> String {
    let word = if has_curved { "surface" } else { "face" };
    let plural = if faces == 1 { "" } else { "s" };
    format!("{faces} {word}{plural}")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use antumbra_geometry::DVec3;

    use crate::model::{Corner, Filter, Mesh, Texture, Wrap};

    use super::*;

    #[test]
    fn alpha_decides_about_shadows() {
        let kind = |alpha, opacity, diffuse_texture| {
            let material = Material {
                alpha,
                opacity,
                diffuse_texture,
                ..Material::default()
            };
            (material.shadow_kind(), material.coverage(1.0))
        };
        let half = Alpha::Mask { cutoff: 0.5 };
        let all = Alpha::Mask { cutoff: 0.0 };
        let none = Alpha::Mask { cutoff: 1.5 };
        use ShadowKind::{AlphaTested, Opaque, Transparent};
        assert_eq!(kind(Alpha::Opaque, 0.1, Some(0)), (Opaque, 1.0));
        assert_eq!(kind(Alpha::Blend, 0.25, None), (Transparent, 0.25));
        assert_eq!(kind(half, 0.5, None), (Opaque, 1.0));
        assert_eq!(kind(half, 0.4, None), (Transparent, 0.0));
        assert_eq!(kind(half, 1.0, Some(0)), (AlphaTested, 1.0));
        assert_eq!(kind(half, 0.4, Some(0)), (Transparent, 0.0));
        assert_eq!(kind(all, 0.0, Some(0)), (Opaque, 1.0));
        assert_eq!(kind(none, 1.0, Some(0)), (Transparent, 0.0));
        let glass = Material {
            transmission: Color::ONE,
            ..Material::default()
        };
        assert_eq!(glass.shadow_kind(), Transparent);
        assert!(Material::default().is_opaque() && !glass.is_opaque());
    }

    fn texture(alphas: [u8; 2]) -> Texture {
        Texture {
            name: String::new(),
            width: 2,
            height: 1,
            texels: alphas.map(|alpha| [255, 255, 255, alpha]).to_vec(),
            wrap: [Wrap::Repeat; 2],
            filter: Filter::Linear,
        }
    }

    /// A triangle with places in a texture, and one alpha for its vertices.
    fn triangle(material: usize, vertex_alpha: f32) -> Object {
        let corners = (0..3).map(|i| Corner {
            uv: i,
            ..Corner::at(i)
        });
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            uvs: vec![[0.0; 2]; 3],
            colors: vec![[1.0, 1.0, 1.0, vertex_alpha]; 3],
            corners: corners.collect(),
            face_ends: vec![3],
            ..Mesh::default()
        };
        Object {
            name: String::new(),
            shape: Shape::Mesh(mesh),
            material,
        }
    }

    fn blend(opacity: f64, diffuse_texture: Option<usize>) -> Material {
        Material {
            name: "sheet".into(),
            alpha: Alpha::Blend,
            opacity,
            diffuse_texture,
            ..Material::default()
        }
    }

    /// Settles a scene; returns what each object does to shadow rays, and the warnings.
    fn settled(materials: Vec<Material>, objects: Vec<Object>) -> (Vec<ShadowKind>, Vec<String>) {
        let mut scene = Scene {
            materials,
            textures: vec![texture([255, 255]), texture([255, 254])],
            objects,
            ..Scene::default()
        };
        let mut warnings = WarningLog::new(Path::new("a"));
        let cause = |material: &Material, _| Cause {
            what: format!("opacity {}", material.opacity),
            advice: "",
        };
        settle(&mut scene, cause, &mut warnings);
        let kind = |object: &Object| scene.materials[object.material].shadow_kind();
        let kinds = scene.objects.iter().map(kind).collect();
        let warnings = warnings.finish().into_iter().map(|w| w.message);
        (kinds, warnings.collect())
    }

    #[test]
    fn blending_is_decided_by_the_alpha_and_not_by_the_mode() {
        use ShadowKind::{Opaque, Transparent};
        for (opacity, picture, vertex_alpha, expected) in [
            (1.0, None, 1.0, Opaque),
            (1.0, Some(0), 1.0, Opaque),
            (1.0, Some(1), 1.0, Transparent),
            (0.99, None, 1.0, Transparent),
            (0.99, Some(0), 1.0, Transparent),
            (1.0, None, 0.5, Transparent),
            (1.0, Some(0), 0.5, Transparent),
        ] {
            let materials = vec![blend(opacity, picture)];
            let (kinds, warnings) = settled(materials, vec![triangle(0, vertex_alpha)]);
            assert_eq!(kinds, [expected], "{opacity} {picture:?} {vertex_alpha}");
            assert_eq!(warnings.is_empty(), expected == Opaque, "{warnings:?}");
        }
    }

    #[test]
    fn a_picture_counts_only_where_there_are_places_in_it() {
        let mut object = triangle(0, 1.0);
        let Shape::Mesh(mesh) = &mut object.shape else {
            panic!("a mesh");
        };
        mesh.uvs.clear();
        let (kinds, _) = settled(vec![blend(1.0, Some(1))], vec![object]);
        assert_eq!(kinds, [ShadowKind::Opaque]);
    }

    #[test]
    fn a_material_that_blends_for_some_objects_only_becomes_two() {
        use ShadowKind::{Opaque, Transparent};
        let objects = vec![triangle(0, 1.0), triangle(0, 0.5), triangle(0, 1.0)];
        let (kinds, warnings) = settled(vec![blend(1.0, None)], objects);
        assert_eq!(kinds, [Opaque, Transparent, Opaque]);
        assert_eq!(
            warnings,
            ["1 face lets light through: opacity 1 (material `sheet`)"]
        );
    }

    #[test]
    fn what_casts_no_shadow_is_counted_for_each_reason() {
        let glass = Material {
            transmission: Color::ONE,
            opacity: 0.25,
            ..blend(1.0, None)
        };
        let materials = vec![glass.clone(), Material::default(), glass, blend(0.5, None)];
        let objects = [0, 1, 2, 2, 3].map(|material| triangle(material, 1.0));
        let (_, warnings) = settled(materials.clone(), objects.to_vec());
        assert_eq!(
            warnings,
            [
                "3 faces of 2 materials let light through: opacity 0.25 (materials `sheet`, `sheet`)",
                "1 face lets light through: opacity 0.5 (material `sheet`)"
            ]
        );
        let (_, warnings) = settled(materials.clone(), vec![triangle(0, 1.0), triangle(3, 1.0)]);
        assert_eq!(
            warnings[0],
            "nothing in this scene casts a shadow: all of it (2 faces) is see-through"
        );
        assert_eq!(warnings.len(), 3);
        let (_, warnings) = settled(materials, vec![triangle(1, 1.0)]);
        assert_eq!(warnings, [""; 0]);
    }

    #[test]
    fn what_is_a_hole_everywhere_is_said() {
        let masked = |cutoff| Material {
            alpha: Alpha::Mask { cutoff },
            ..blend(1.0, Some(1))
        };
        let (kinds, warnings) = settled(vec![masked(0.5)], vec![triangle(0, 1.0)]);
        assert_eq!((kinds, warnings.len()), (vec![ShadowKind::AlphaTested], 0));
        let mut gone = masked(1.0);
        gone.opacity = 1.0;
        let mut scene = Scene {
            materials: vec![gone],
            textures: vec![texture([0, 0]), texture([100, 127])],
            objects: vec![triangle(0, 1.0)],
            ..Scene::default()
        };
        let mut warnings = WarningLog::new(Path::new("a"));
        settle(&mut scene, |_, _| Cause::default(), &mut warnings);
        let warnings: Vec<_> = warnings.finish().into_iter().map(|w| w.message).collect();
        assert_eq!(
            warnings,
            [
                "nothing in this scene casts a shadow: all of it (1 face) is see-through",
                "1 face lets light through: the alpha of its picture is below the cutoff everywhere \
                 (material `sheet`)"
            ]
        );
    }

    #[test]
    fn reasons_beyond_eight_are_counted() {
        let materials: Vec<_> = (1..=20).map(|i| blend(f64::from(i) / 50.0, None)).collect();
        let objects = (0..20).map(|material| triangle(material, 1.0)).collect();
        let (_, warnings) = settled(materials, objects);
        assert_eq!(warnings.len(), 10, "{warnings:?}");
        assert_eq!(
            warnings[9],
            "12 faces more let light through, for 12 more reasons"
        );
    }
}
