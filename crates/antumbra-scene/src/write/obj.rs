//! Writes OBJ and its material library.
//!
//! In: a scene of polygons and meshes. Out: the text of an OBJ, the text of an MTL. Invariants:
//! with exact numbers, what is written reads back with the same faces, normals and materials;
//! names stay as they are where OBJ can say them and no other has them.

use std::{
    collections::{BTreeSet, HashSet},
    io::Write,
};

use antumbra_geometry::DVec3;

use crate::{
    error::quoted,
    model::{Alpha, Color, Corner, Material, Scene},
};

use super::{
    Precision, WriteError,
    mesh::{Keeps, left_out, meshes},
};

/// First line of every material library that is written, so that one written by somebody else is known.
pub const LIBRARY_MARK: &str = "# written by antumbra";

/// Writes a scene as OBJ to `out` and its materials as MTL to `library_out`. `library` is the name
/// of the latter for `mtllib`. Returns what OBJ has no place for, or what had to be changed, one
/// sentence each.
///
/// With [`Precision::Exact`], a scene that was read from OBJ is read back equal, except for
/// [`Scene::up`] and materials without a name. Objects of one name and material become one when
/// read. Buffer the outputs: many small pieces are written.
///
/// # Errors
/// An output refuses; an object is curved (nothing is tessellated).
///
/// # Example
/// ```
/// use antumbra_scene::{generate::tetra, write::{Precision, write_obj}};
/// let (mut obj, mut mtl) = (Vec::new(), Vec::new());
/// let scene = tetra(1).unwrap();
/// let notes = write_obj(&scene, Precision::Exact, "tetra.mtl", &mut obj, &mut mtl).unwrap();
/// assert!(String::from_utf8(obj).unwrap().starts_with("mtllib tetra.mtl\no\nv "));
/// assert!(notes.contains(&"the camera is not written".to_owned()));
/// ```
pub fn write_obj(
    scene: &Scene,
    precision: Precision,
    library: &str,
    out: &mut impl Write,
    library_out: &mut impl Write,
) -> Result<Vec<String>, WriteError> {
    let keeps = Keeps {
        objects: true,
        materials: true,
        up: DVec3::Y,
        ..Keeps::NOTHING
    };
    let mut notes = left_out(scene, keeps);
    let meshes = meshes(scene, "OBJ")?;
    let names = material_names(scene, &mut notes);
    writeln!(library_out, "{LIBRARY_MARK}")?;
    for (material, name) in scene.materials.iter().zip(&names) {
        write_material(material, name, precision, library_out, &mut notes)?;
    }

    writeln!(out, "mtllib {library}")?;
    let line = |out: &mut dyn Write, keyword: &str, point: DVec3| {
        let [x, y, z] = point.to_array().map(|number| precision.text(number));
        writeln!(out, "{keyword} {x} {y} {z}")
    };
    let mut name_in_force = None;
    let mut material_in_force = None;
    let mut written = HashSet::new();
    let (mut renamed, mut joined) = (0, 0);
    // Indices count from 1 over the whole file.
    let (mut first_position, mut first_normal) = (1_u64, 1_u64);
    for (object, mesh) in scene.objects.iter().zip(&meshes) {
        let name = plain_name(&object.name);
        renamed += usize::from(name != object.name);
        joined += usize::from(!written.insert((name.clone(), object.material)));
        if name_in_force.as_ref() != Some(&name) {
            writeln!(out, "{}", format!("o {name}").trim_end())?;
            name_in_force = Some(name);
        }
        for &position in &mesh.positions {
            line(out, "v", position)?;
        }
        for &normal in &mesh.normals {
            line(out, "vn", normal)?;
        }
        if material_in_force != Some(object.material) {
            writeln!(out, "usemtl {}", names[object.material])?;
            material_in_force = Some(object.material);
        }
        for face in mesh.faces() {
            write!(out, "f")?;
            for corner in face {
                write!(out, " {}", first_position + u64::from(corner.position))?;
                if corner.normal != Corner::NONE {
                    write!(out, "//{}", first_normal + u64::from(corner.normal))?;
                }
            }
            writeln!(out)?;
        }
        first_position += mesh.positions.len() as u64;
        first_normal += mesh.normals.len() as u64;
    }
    if renamed > 0 {
        notes.push(format!(
            "OBJ cannot say the names of {renamed} objects: they are changed"
        ));
    }
    if joined > 0 {
        notes.push(format!(
            "{joined} objects have the name and material of another: readers join them"
        ));
    }
    Ok(notes)
}

/// Returns a name that reads back as it is: one line of text, no white space around it, no `#` that
/// would begin a comment, no `\` that would continue the line.
fn plain_name(name: &str) -> String {
    let mut plain = String::with_capacity(name.len());
    let mut begins_word = true;
    for c in name.trim_ascii().chars() {
        let is_bad = matches!(c, '\n' | '\r' | '\0') || (c == '#' && begins_word);
        plain.push(if is_bad { '_' } else { c });
        begins_word = c.is_ascii_whitespace();
    }
    if plain.ends_with('\\') {
        plain.replace_range(plain.len() - 1.., "_");
    }
    plain
}

/// Returns a name of a file that reads back as it is, also where readers take `\` for a separator, and a name with `:`
/// for one that leads elsewhere.
pub(super) fn library_name(name: &str) -> String {
    plain_name(name).replace(['\\', ':'], "_")
}

/// Returns a name for each material, all different, none empty.
fn material_names(scene: &Scene, notes: &mut Vec<String>) -> Vec<String> {
    let mut taken = BTreeSet::new();
    let mut changed = 0;
    let mut next = 0;
    let mut names = Vec::with_capacity(scene.materials.len());
    for material in &scene.materials {
        let mut name = plain_name(&material.name);
        while name.is_empty() || taken.contains(&name) {
            next += 1;
            name = format!("material_{next}");
        }
        changed += usize::from(name != material.name);
        taken.insert(name.clone());
        names.push(name);
    }
    if changed > 0 {
        notes.push(format!(
            "names of {changed} materials are empty, taken, or OBJ cannot say them: others are made up"
        ));
    }
    names
}

/// Writes one material so that our reader makes the same of it; see there for what MTL means.
fn write_material(
    material: &Material,
    name: &str,
    precision: Precision,
    out: &mut impl Write,
    notes: &mut Vec<String>,
) -> Result<(), WriteError> {
    let mut note = |what: &str| notes.push(format!("material {}: {what}", quoted(name)));
    let color = |out: &mut dyn Write, keyword: &str, color: Color| {
        let [r, g, b] = color.to_array().map(|number| precision.text(number));
        writeln!(out, "{keyword} {r} {g} {b}")
    };
    let is_mirror = material.reflection != Color::ZERO;
    let is_glass = material.transmission != Color::ZERO;
    if is_mirror && material.reflection != material.specular {
        note("MTL has one weight for highlight and mirror: the mirror's is written");
    }
    match material.alpha {
        Alpha::Opaque => {}
        Alpha::Blend if is_glass => note("its opacity is not written"),
        Alpha::Blend => note("its opacity is written as `d`, which readers may take for glass"),
        Alpha::Mask { .. } => note("its cut-outs are not written: it becomes whole"),
    }
    if !material.is_double_sided {
        note("MTL has no one-sided surfaces: the back is seen too");
    }
    writeln!(out, "newmtl {name}")?;
    color(out, "Kd", material.diffuse)?;
    let specular = if is_mirror {
        material.reflection
    } else {
        material.specular
    };
    color(out, "Ks", specular)?;
    writeln!(out, "Ns {}", precision.text(material.shininess))?;
    if material.emission != Color::ZERO {
        color(out, "Ke", material.emission)?;
    }
    if is_glass {
        color(out, "Tf", material.transmission)?;
        writeln!(out, "Ni {}", precision.text(material.ior))?;
        if material.transmission == Color::ONE && material.ior == 1.0 {
            // Without it readers could not tell it from what is opaque, as Maya writes that.
            writeln!(out, "d 0")?;
        }
    } else if material.alpha == Alpha::Blend {
        writeln!(out, "d {}", precision.text(material.opacity))?;
    }
    let model = match (is_mirror, is_glass) {
        (false, false) => 2,
        (true, false) => 3,
        (false, true) => 4,
        (true, true) => 7,
    };
    Ok(writeln!(out, "illum {model}")?)
}
