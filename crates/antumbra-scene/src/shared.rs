//! Objects for `serde`: a mesh that copies share is written once, and read once.

use std::{collections::HashMap, sync::Arc};

use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use crate::model::{Mesh, Object, Shape};

pub(crate) fn serialize<S: Serializer>(
    objects: &Vec<Object>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let mut number_of = HashMap::new();
    let mut meshes: Vec<&Mesh> = Vec::new();
    let mut numbers = Vec::new();
    for object in objects {
        if let Shape::Instance(instance) = &object.shape {
            let number = *number_of
                .entry(Arc::as_ptr(&instance.mesh))
                .or_insert_with(|| {
                    meshes.push(&instance.mesh);
                    meshes.len() - 1
                });
            numbers.push(number);
        }
    }
    (meshes, numbers, objects).serialize(serializer)
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>>(
    deserializer: D,
) -> Result<Vec<Object>, D::Error> {
    let (meshes, numbers, mut objects) =
        <(Vec<Mesh>, Vec<usize>, Vec<Object>)>::deserialize(deserializer)?;
    let meshes: Vec<_> = meshes.into_iter().map(Arc::new).collect();
    let mut numbers = numbers.into_iter();
    for object in &mut objects {
        if let Shape::Instance(instance) = &mut object.shape {
            let mesh = numbers.next().and_then(|number| meshes.get(number));
            instance.mesh = Arc::clone(mesh.ok_or_else(|| D::Error::custom("no mesh"))?);
        }
    }
    Ok(objects)
}
