//! glTF 2.0, as JSON with files beside it (.gltf) or in one piece (.glb).
//!
//! In: the bytes of a file and a way to open the files it names. Out: a scene with one mesh for
//! each primitive and each node that shows it, world space, +y up. Invariant: accessors are read
//! by their true component type and never beyond their buffer view; nothing is allocated for a
//! count before bytes or the [`Budget`] stand behind it; errors name the place in the JSON.
//!
//! | step | file |
//! |---|---|
//! | GLB chunks or JSON text | `container` |
//! | JSON to data | `document` |
//! | `data:` and file names | `uri` |
//! | bytes of buffers and views | `buffers` |
//! | compressed views, compressed primitives | `meshopt`, `draco` |
//! | numbers of accessors | `accessor`, `component` |
//! | node tree, chosen scene | `nodes` |
//! | triangles in a mesh's space | `primitives` |
//! | copies in world space; skins and morph targets at rest | `instances` |
//! | looks | `materials`, `images`, `placing` |
//! | lights, camera | `views` |
//!
//! Animations are not played. Tangents and occlusion textures are not read. Extensions that are required and not in [`EXTENSIONS`] refuse the file.

mod accessor;
mod budget;
mod buffers;
mod component;
mod container;
mod document;
mod draco;
mod fault;
mod images;
mod instances;
mod materials;
mod meshopt;
mod nodes;
mod placing;
mod primitives;
mod uri;
mod views;

use std::{collections::HashMap, io, path::Path};

use antumbra_geometry::DVec3;

use crate::defaults::AMBIENT;
use crate::error::{Place, ReadError, ReadErrorKind, quoted};
use crate::model::{Color, Facing, Object, Scene};
use crate::opacity;
use crate::room::Room;
use crate::warning::WarningLog;

use super::{Loaded, ReadOptions};
use accessor::Accessors;
use budget::Budget;
use buffers::{Buffers, Open};
use container::Container;
use document::{Document, MaterialEntry};
use fault::{Fault, short_name};
use images::Images;
use instances::Stage;
use nodes::Hierarchy;
use primitives::{PartReader, Source};

/// Extensions that are read.
const EXTENSIONS: [&str; 14] = [
    "CESIUM_RTC",
    "EXT_mesh_gpu_instancing",
    "EXT_meshopt_compression",
    "KHR_draco_mesh_compression",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_meshopt_compression",
    "KHR_texture_transform",
];

/// Reads glTF or GLB from bytes; the content says which. `file` is only a name for messages;
/// `open` returns the bytes of a buffer or picture by the name the file gives it, percent signs
/// decoded, and has to refuse names that lead where they should not.
///
/// Memory is linear in the bytes of all files, the pictures' texels and the scene that results,
/// and together at most [`ReadOptions::memory_limit`]; the scene has at most 2^26 triangles. Time is linear in the same, times the logarithm of
/// sparse accessors' sizes.
///
/// # Errors
/// The file is cut off or no glTF 2.0, requires an extension that is not read, names what is not
/// there, or has a loop of nodes, a number that is not finite or a coordinate beyond 2^100; see
/// [`ReadErrorKind`]. A picture that cannot be read is a warning.
///
/// # Example
/// ```
/// use std::{io, path::Path};
/// let text = br#"{"asset": {"version": "2.0"}}"#;
/// let no_files = &mut |_: &str| Err(io::ErrorKind::NotFound.into());
/// let options = Default::default();
/// let loaded = antumbra_scene::read::read_gltf(Path::new("a.gltf"), text, &options, no_files)?;
/// assert!(loaded.scene.objects.is_empty());
/// # Ok::<(), antumbra_scene::ReadError>(())
/// ```
pub fn read_gltf(
    file: &Path,
    bytes: &[u8],
    options: &ReadOptions,
    open: &mut dyn FnMut(&str) -> io::Result<Vec<u8>>,
) -> Result<Loaded, ReadError> {
    let mut warnings = WarningLog::new(file);
    let room = Room::new(options.memory_limit);
    let scene = read(bytes, open, room, &mut warnings).map_err(|fault| ReadError {
        file: file.to_path_buf(),
        place: fault.place,
        kind: fault.kind,
    })?;
    Ok(Loaded {
        scene,
        warnings: warnings.finish(),
        files: Vec::new(),
        is_up_assumed: false,
    })
}

fn read(
    bytes: &[u8],
    open: &mut Open<'_>,
    mut room: Room,
    warnings: &mut WarningLog,
) -> Result<Scene, Fault> {
    room.take(bytes.len() as u64, || "the file".into())
        .map_err(Fault::over_limit)?;
    let container = container::open(bytes, warnings)?;
    let document = parse(&container)?;
    check_version_and_extensions(&document, warnings)?;
    let mut buffers = Buffers::load(&document, container.binary, open, &mut room)?;
    meshopt::decode_all(&mut buffers, &mut room)?;
    let accessors = Accessors::new(&buffers);
    accessors.check_all()?;
    let hierarchy = Hierarchy::of(&document, warnings)?;
    let mut scene = Scene {
        facing: Facing::Viewer,
        up: DVec3::Y,
        ..Scene::default()
    };
    views::add(&document, &hierarchy, &mut scene, warnings)?;
    // Lights in candela would drown this; without any, shapes in shadow should be seen.
    scene.ambient = if scene.is_photometric {
        Color::ZERO
    } else {
        AMBIENT
    };
    if !document.animations.is_empty() {
        warnings.add(Place::Whole, "animations are not played");
    }
    scene.objects = objects(&accessors, &hierarchy, &mut room, warnings)?;
    if scene.objects.is_empty() {
        warnings.add(Place::Whole, "no triangles in the file");
    }
    look(&buffers, open, room, &mut scene, warnings)?;
    opacity::settle(
        &mut scene,
        |material, _| materials::cause(material),
        warnings,
    );
    Ok(scene)
}

/// Parses the JSON; errors say where: by line, and by path for what has the wrong type.
fn parse(container: &Container<'_>) -> Result<Document, Fault> {
    let mut json = serde_json::Deserializer::from_slice(container.json);
    let (path, error) = match serde_path_to_error::deserialize(&mut json) {
        Ok(document) => match json.end() {
            Ok(()) => return Ok(document),
            Err(error) => (String::new(), error),
        },
        Err(error) => (error.path().to_string(), error.into_inner()),
    };
    let line = u32::try_from(error.line()).unwrap_or(u32::MAX);
    let column = error.column();
    let place = if container.is_binary && line <= 1 {
        Place::Byte(container.json_start + column.saturating_sub(1) as u64)
    } else {
        Place::Line(line)
    };
    let text = error.to_string();
    // The place is said already.
    let suffix = format!(" at line {} column {column}", error.line());
    let problem = text.strip_suffix(&suffix).unwrap_or(&text);
    let problem: String = problem.chars().take(200).collect();
    let kind = if path.is_empty() || path == "." {
        ReadErrorKind::Invalid {
            entity: "",
            problem: format!("this is no glTF: {}", problem.escape_debug()).into(),
            help: "export the file again",
        }
    } else {
        ReadErrorKind::Element {
            path: path.chars().take(200).collect::<String>().into(),
            problem: problem.escape_debug().to_string().into(),
            help: "export the file again",
        }
    };
    Err(Fault { place, kind })
}

/// Returns what to do about a required extension that is not read.
fn help_without(extension: &str) -> &'static str {
    let is_about = |words: &[&str]| words.iter().any(|word| extension.contains(word));
    if is_about(&["draco", "meshopt", "compression", "quantization"]) {
        "export the scene without compression: it is an option of most exporters"
    } else if is_about(&["texture", "image"]) {
        "export the scene with PNG or JPEG textures"
    } else {
        "export the scene without this extension"
    }
}

fn check_version_and_extensions(
    document: &Document,
    warnings: &mut WarningLog,
) -> Result<(), Fault> {
    let asset = &document.asset;
    let minimum = asset.min_version.as_deref();
    if !asset.version.starts_with("2.") || minimum.is_some_and(|version| version != "2.0") {
        let version = quoted(minimum.unwrap_or(&asset.version));
        let problem = format!("this is glTF {version}; expected 2.0");
        return Err(Fault::at("asset", problem, "convert the scene to glTF 2.0"));
    }
    let is_read = |name: &String| EXTENSIONS.contains(&name.as_str());
    let mut required = document.extensions_required.iter().enumerate();
    if let Some((at, name)) = required.find(|(_, name)| !is_read(name)) {
        let problem = format!("the extension {} is not read", quoted(name));
        let path = format!("extensionsRequired[{at}]");
        let help = help_without(name);
        return Err(Fault::at(path, problem, help));
    }
    for name in document
        .extensions_used
        .iter()
        .filter(|name| !is_read(name))
    {
        let message = format!("the extension {} is not read", quoted(name));
        warnings.add(Place::Whole, message);
    }
    Ok(())
}

/// Returns the objects of all visible nodes, in the order of the nodes. Their materials are
/// indices into the document's, one past the end for none.
fn objects(
    accessors: &Accessors<'_>,
    hierarchy: &Hierarchy,
    room: &mut Room,
    warnings: &mut WarningLog,
) -> Result<Vec<Object>, Fault> {
    let document = accessors.buffers().document();
    // Nodes by mesh, so that only one mesh at a time is there twice.
    let mut nodes_of = vec![Vec::new(); document.meshes.len()];
    for (order, &node) in hierarchy.visible.iter().enumerate() {
        let Some(mesh) = document.nodes[node].mesh else {
            continue;
        };
        match nodes_of.get_mut(mesh) {
            Some(nodes) => nodes.push((order, node)),
            None => {
                let path = format!("nodes[{node}].mesh");
                return Err(Fault::missing(path, "meshes", mesh, nodes_of.len()));
            }
        }
    }
    let mut budget = Budget::new(room);
    let mut skins = HashMap::new();
    let mut found = Vec::new();
    for (index, (mesh, nodes)) in document.meshes.iter().zip(nodes_of).enumerate() {
        let path = |at: usize| format!("meshes[{index}].primitives[{at}]");
        // What is decoded is given back after the mesh.
        let mut room = budget.room();
        let mut packed = Vec::new();
        for (at, primitive) in mesh.primitives.iter().enumerate() {
            let decoded = draco::decode(accessors.buffers(), primitive, &path(at), &mut room)?;
            packed.push(decoded);
        }
        let mut reader = PartReader {
            accessors,
            warnings,
            budget: &mut budget,
        };
        let mut parts = Vec::new();
        for (at, (primitive, draco)) in mesh.primitives.iter().zip(&packed).enumerate() {
            let source = Source {
                primitive,
                draco: draco.as_ref(),
            };
            let part = reader.read(source, path(at))?;
            parts.extend(part.map(|part| (part, HashMap::new())));
        }
        let mut stage = Stage {
            accessors,
            hierarchy,
            warnings,
            budget: &mut budget,
            skins,
        };
        let is_shared = nodes.len() > 1;
        for (order, node) in nodes {
            let mut objects = Vec::new();
            let no_material = document.materials.len();
            stage.show(node, &mut parts, is_shared, no_material, &mut objects)?;
            found.extend(objects.into_iter().map(|object| (order, object)));
        }
        skins = stage.skins;
    }
    found.sort_by_key(|&(order, _)| order);
    Ok(found.into_iter().map(|(_, object)| object).collect())
}

/// Reads the materials that objects use, and numbers them anew, in the order of first use.
fn look(
    buffers: &Buffers<'_>,
    open: &mut Open<'_>,
    room: Room,
    scene: &mut Scene,
    warnings: &mut WarningLog,
) -> Result<(), Fault> {
    let plain = MaterialEntry::default();
    let mut images = Images::new(buffers, open, room);
    let mut material_of = HashMap::new();
    for object in &mut scene.objects {
        let index = object.material;
        object.material = match material_of.get(&index) {
            Some(&known) => known,
            None => {
                let entry = buffers.document().materials.get(index).unwrap_or(&plain);
                let path = format!("materials[{index}]");
                let material = materials::convert(entry, &path, &mut images, warnings)?;
                scene.materials.push(material);
                material_of.insert(index, scene.materials.len() - 1);
                scene.materials.len() - 1
            }
        };
    }
    scene.textures = images.textures;
    Ok(())
}
