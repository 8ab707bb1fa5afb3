//! Sensors by object, by material where there are too many objects, or all together.

use std::collections::HashMap;

use antumbra_geometry::SurfaceId;
use antumbra_scene::model::Scene;
use antumbra_sun::{Groups, Study};

use super::picture::Looked;

/// Most rows of a table.
const MOST: usize = 100;

/// Returns all sensors as one group.
pub(super) fn whole(study: &Study) -> Groups {
    Groups {
        names: vec!["all".to_owned()],
        of: vec![0; study.sensor_count()],
    }
}

/// Returns by what sensors are sorted, and the groups.
pub(super) fn of(study: &Study, looked: Option<&Looked>) -> (&'static str, Groups) {
    let (Some(looked), Some(surfaces)) = (looked, &study.surfaces) else {
        return ("", whole(study));
    };
    let objects = by_object(surfaces, looked);
    if objects.names.len() <= MOST {
        return ("object", objects);
    }
    let materials = by_material(surfaces, looked);
    if materials.names.len() <= MOST {
        return ("material", materials);
    }
    ("", whole(study))
}

/// Returns sensors on surfaces by object. Those of one name are one group; an object without a name has that of its
/// material, which tells more than a number.
pub(super) fn by_object(surfaces: &[u32], Looked { prepared, .. }: &Looked) -> Groups {
    sorted(surfaces, |surface| {
        let number = prepared.gathered().place_of(SurfaceId(surface)).object;
        name_of(prepared.scene(), number as usize)
    })
}

/// Returns all objects of a scene as groups: those of one name are one.
pub(super) fn objects(scene: &Scene) -> Groups {
    let numbers: Vec<u32> = (0..scene.objects.len() as u32).collect();
    sorted(&numbers, |number| name_of(scene, number as usize))
}

fn name_of(scene: &Scene, number: usize) -> String {
    let object = &scene.objects[number];
    let material = scene.materials.get(object.material);
    match material.filter(|_| object.name.is_empty()) {
        Some(material) if !material.name.is_empty() => material.name.clone(),
        _ => named(&object.name, "object", number),
    }
}

fn by_material(surfaces: &[u32], Looked { prepared, .. }: &Looked) -> Groups {
    let scene = prepared.scene();
    sorted(surfaces, |surface| {
        let place = prepared.gathered().place_of(SurfaceId(surface));
        let number = scene.objects[place.object as usize].material;
        let material = scene.materials.get(number);
        named(
            material.map_or("", |material| &material.name),
            "material",
            number,
        )
    })
}

fn named(name: &str, kind: &str, number: usize) -> String {
    match name {
        "" => format!("{kind} {number}, without a name"),
        name => name.to_owned(),
    }
}

/// Sorts sensors, or whatever has a number, by names, in the order in which they come.
fn sorted(surfaces: &[u32], name_of: impl Fn(u32) -> String) -> Groups {
    let mut names = Vec::new();
    let mut places: HashMap<String, u32> = HashMap::new();
    let mut last = None;
    let of = antumbra_task::checked(surfaces)
        .map(|&surface| {
            // Sensors of a surface follow each other.
            if let Some((before, group)) = last
                && before == surface
            {
                return group;
            }
            let name = name_of(surface);
            let group = *places.entry(name).or_insert_with_key(|name| {
                names.push(name.clone());
                (names.len() - 1) as u32
            });
            last = Some((surface, group));
            group
        })
        .collect();
    Groups { names, of }
}
