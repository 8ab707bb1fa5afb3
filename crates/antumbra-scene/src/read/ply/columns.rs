//! Which properties of a PLY file are used.
//!
//! In: the header. Out: where each number of a vertex goes, which list of a face names its corners,
//! and warnings about the rest. Invariant: whatever has elements and is not used is named.

use crate::{
    error::{Place, quoted},
    warning::WarningLog,
};

use super::header::{Element, Header, PropertyKind, is_index_list};

/// Names the elements and properties that are not used.
pub(super) fn warn_unused(header: &Header<'_>, warnings: &mut WarningLog) {
    for element in header.elements.iter().filter(|e| e.count > 0) {
        let place = Place::Line(element.line);
        let unused: Vec<_> = match element.name {
            "vertex" => {
                let slots = vertex_slots(element);
                let unused = element.properties.iter().zip(&slots);
                let unused = unused.filter(|(_, slot)| slot.is_none());
                unused.map(|(property, _)| property.name).collect()
            }
            "face" => {
                let used = index_list(element);
                let unused = element.properties.iter().enumerate();
                let unused = unused.filter(|(index, _)| Some(*index) != used);
                unused.map(|(_, property)| property.name).collect()
            }
            name => {
                let message = format!("element {} is not read", quoted(name));
                warnings.add(place, message);
                continue;
            }
        };
        if unused.is_empty() {
            continue;
        }
        const LISTED: usize = 8;
        let listed: Vec<_> = unused
            .iter()
            .take(LISTED)
            .map(|name| quoted(name))
            .collect();
        let more = match unused.len().saturating_sub(LISTED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let message = format!(
            "properties of `{}` that are not read: {}{more}",
            element.name,
            listed.join(", ")
        );
        warnings.add(place, message);
    }
}

/// Returns for each property of `vertex` where its number goes: 0 to 2 the position, 3 to 5 the
/// normal.
pub(super) fn vertex_slots(element: &Element<'_>) -> Vec<Option<usize>> {
    const NAMES: [&str; 6] = ["x", "y", "z", "nx", "ny", "nz"];
    let is_scalar = |name: &&str| {
        element
            .position(name)
            .is_some_and(|index| matches!(element.properties[index].kind, PropertyKind::Scalar(_)))
    };
    let names = if NAMES[3..].iter().all(is_scalar) {
        &NAMES[..]
    } else {
        &NAMES[..3]
    };
    let slot = |name| names.iter().position(|&n| n == name);
    element.properties.iter().map(|p| slot(p.name)).collect()
}

/// Returns which property of `face` lists the corners.
pub(super) fn index_list(element: &Element<'_>) -> Option<usize> {
    element
        .properties
        .iter()
        .position(|p| is_index_list(p.name))
}
