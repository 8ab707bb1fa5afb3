//! The node tree, flattened.
//!
//! In: the document's nodes. Out: for each node of the chosen scene, in depth-first order, the map
//! from its own space to world space. Invariant: every node has at most one parent and none is
//! its own ancestor, so the walk visits each at most once; it keeps its own stack, so depth costs
//! nothing. Maps are finite.

use glam::{DAffine3, DMat3, DQuat, DVec3};

use crate::{error::Place, warning::WarningLog};

use super::{
    Fault,
    document::{Document, Node},
};

/// Marks a node without a parent.
const NONE: usize = usize::MAX;

/// Nodes with their places in the world.
#[derive(Debug)]
pub(super) struct Hierarchy {
    /// For each node of the document: own space to world space.
    pub(super) world_from_node: Vec<DAffine3>,
    /// The nodes of the chosen scene, parents before children.
    pub(super) visible: Vec<usize>,
}

impl Hierarchy {
    pub(super) fn of(document: &Document, warnings: &mut WarningLog) -> Result<Self, Fault> {
        let nodes = &document.nodes;
        let parents = parents(document)?;
        let world_from_file = world_from_file(document)?;
        let mut world_from_node = vec![DAffine3::IDENTITY; nodes.len()];
        let mut is_reached = vec![false; nodes.len()];
        let roots: Vec<_> = (0..nodes.len()).filter(|&n| parents[n] == NONE).collect();
        walk(document, &roots, |node| {
            let path = || format!("nodes[{node}]");
            let local = local(&nodes[node], path, warnings)?;
            let world = match parents[node] {
                NONE => world_from_file * local,
                parent => world_from_node[parent] * local,
            };
            if !world.is_finite() {
                return Err(Fault::at(path(), "the transform is not finite", ""));
            }
            world_from_node[node] = world;
            is_reached[node] = true;
            Ok(())
        })?;
        // With one parent each, nodes that no root leads to are loops and what hangs on them.
        if let Some(node) = is_reached.iter().position(|&reached| !reached) {
            let problem = "the node is in a loop of children, or below one";
            return Err(Fault::at(format!("nodes[{node}]"), problem, ""));
        }
        let mut visible = Vec::new();
        walk(
            document,
            &scene_roots(document, &parents, warnings)?,
            |node| {
                visible.push(node);
                Ok(())
            },
        )?;
        Ok(Self {
            world_from_node,
            visible,
        })
    }
}

/// Returns where CESIUM_RTC moves everything.
fn world_from_file(document: &Document) -> Result<DAffine3, Fault> {
    let Some(relative) = &document.extensions.relative_to else {
        return Ok(DAffine3::IDENTITY);
    };
    let center = DVec3::from_array(relative.center);
    if !center.is_finite() {
        let path = "extensions.CESIUM_RTC.center";
        return Err(Fault::at(path, "expected finite numbers", ""));
    }
    Ok(DAffine3::from_translation(center))
}

/// Finds each node's parent.
fn parents(document: &Document) -> Result<Vec<usize>, Fault> {
    let nodes = &document.nodes;
    let mut parents = vec![NONE; nodes.len()];
    for (parent, node) in nodes.iter().enumerate() {
        for (at, &child) in node.children.iter().enumerate() {
            let path = || format!("nodes[{parent}].children[{at}]");
            let Some(slot) = parents.get_mut(child) else {
                return Err(Fault::missing(path(), "nodes", child, nodes.len()));
            };
            if *slot != NONE {
                let problem = format!("nodes[{child}] is a child of nodes[{slot}] already");
                return Err(Fault::at(path(), problem, ""));
            }
            *slot = parent;
        }
    }
    Ok(parents)
}

/// Returns the root nodes of the scene that is shown.
fn scene_roots(
    document: &Document,
    parents: &[usize],
    warnings: &mut WarningLog,
) -> Result<Vec<usize>, Fault> {
    let scenes = &document.scenes;
    if let Some(index) = document.scene
        && index >= scenes.len()
    {
        return Err(Fault::missing("scene", "scenes", index, scenes.len()));
    }
    let index = document.scene.unwrap_or(0);
    let Some(scene) = scenes.get(index) else {
        if !parents.is_empty() {
            warnings.add(Place::Whole, "no scene in the file: all nodes are read");
        }
        return Ok((0..parents.len()).filter(|&n| parents[n] == NONE).collect());
    };
    if scenes.len() > 1 {
        let message = format!("of {} scenes, number {index} is read", scenes.len());
        warnings.add(Place::Whole, message);
    }
    let mut is_named = vec![false; parents.len()];
    for (at, &root) in scene.nodes.iter().enumerate() {
        let path = || format!("scenes[{index}].nodes[{at}]");
        let problem = match parents.get(root) {
            None => return Err(Fault::missing(path(), "nodes", root, parents.len())),
            Some(&NONE) if !is_named[root] => {
                is_named[root] = true;
                continue;
            }
            Some(&NONE) => format!("nodes[{root}] is named twice"),
            Some(parent) => format!("nodes[{root}] is a child of nodes[{parent}], not a root"),
        };
        return Err(Fault::at(path(), problem, ""));
    }
    Ok(scene.nodes.to_vec())
}

/// Visits nodes depth first, parents before children, siblings in order.
fn walk(
    document: &Document,
    roots: &[usize],
    mut visit: impl FnMut(usize) -> Result<(), Fault>,
) -> Result<(), Fault> {
    let mut stack: Vec<usize> = roots.iter().rev().copied().collect();
    while let Some(node) = stack.pop() {
        visit(node)?;
        stack.extend(document.nodes[node].children.iter().rev());
    }
    Ok(())
}

/// Returns a node's own transform.
fn local(
    node: &Node,
    path: impl Fn() -> String,
    warnings: &mut WarningLog,
) -> Result<DAffine3, Fault> {
    let has_parts = node.translation.is_some() || node.rotation.is_some() || node.scale.is_some();
    let Some(matrix) = &node.matrix else {
        return Ok(compose(
            node.translation.unwrap_or([0.0; 3]),
            node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]),
            node.scale.unwrap_or([1.0; 3]),
        ));
    };
    if has_parts {
        let problem = "expected either `matrix` or translation, rotation and scale, not both";
        return Err(Fault::at(path(), problem, ""));
    }
    if [matrix[3], matrix[7], matrix[11], matrix[15]] != [0.0, 0.0, 0.0, 1.0] {
        let message = "a node's matrix does not end in 0 0 0 1: taken as if it did";
        warnings.add(Place::Whole, message);
    }
    Ok(affine(matrix))
}

/// Returns the upper three rows of a matrix, given column by column.
pub(super) fn affine(matrix: &[f64; 16]) -> DAffine3 {
    let column = |i: usize| DVec3::new(matrix[i], matrix[i + 1], matrix[i + 2]);
    DAffine3 {
        matrix3: DMat3::from_cols(column(0), column(4), column(8)),
        translation: column(12),
    }
}

/// Scales, then rotates, then moves. The rotation is a quaternion x, y, z, w; its length plays no
/// part (files round it to 32 bits), and where it has none, nothing is rotated.
pub(super) fn compose(translation: [f64; 3], rotation: [f64; 4], scale: [f64; 3]) -> DAffine3 {
    let largest = rotation.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    let rotation = if largest > 0.0 && largest.is_finite() {
        let scaled = DQuat::from_array(rotation.map(|x| x / largest));
        let length = scaled.length();
        DQuat::from_array(scaled.to_array().map(|x| x / length))
    } else {
        DQuat::IDENTITY
    };
    DAffine3::from_scale_rotation_translation(
        DVec3::from_array(scale),
        rotation,
        DVec3::from_array(translation),
    )
}
