//! Sensors by object, by material where there are too many objects, or all together.

use std::collections::HashMap;

use antumbra_geometry::SurfaceId;
use antumbra_sun::{Groups, Study};

use super::super::picture::Looked;

/// Most rows of a table.
const MOST: usize = 100;

/// Returns all sensors as one group.
pub(super) fn whole(study: &Study) -> Groups {
    Groups {
        names: vec!["all".to_owned()],
        of: vec![0; study.sensor_count()],
    }
}

/// Returns by what sensors are sorted, and the groups; objects of one name are one group, and so are materials.
pub(super) fn of(study: &Study, looked: Option<&Looked>) -> (&'static str, Groups) {
    let (Some(Looked { prepared, .. }), Some(surfaces)) = (looked, &study.surfaces) else {
        return ("", whole(study));
    };
    let (scene, gathered) = (prepared.scene(), prepared.gathered());
    let object = |surface: u32| gathered.place_of(SurfaceId(surface)).object as usize;
    let by_object = sorted(surfaces, |surface| {
        let number = object(surface);
        let object = &scene.objects[number];
        let material = scene.materials.get(object.material);
        // A material tells more than a number.
        match material.filter(|_| object.name.is_empty()) {
            Some(material) if !material.name.is_empty() => material.name.clone(),
            _ => named(&object.name, "object", number),
        }
    });
    if by_object.names.len() <= MOST {
        return ("object", by_object);
    }
    let by_material = sorted(surfaces, |surface| {
        let number = scene.objects[object(surface)].material;
        let material = scene.materials.get(number);
        named(
            material.map_or("", |material| &material.name),
            "material",
            number,
        )
    });
    if by_material.names.len() <= MOST {
        return ("material", by_material);
    }
    ("", whole(study))
}

fn named(name: &str, kind: &str, number: usize) -> String {
    match name {
        "" => format!("{kind} {number}, without a name"),
        name => name.to_owned(),
    }
}

/// Sorts sensors by names, in the order in which they come.
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
