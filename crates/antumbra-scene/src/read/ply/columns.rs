//! Which properties of a PLY file are used.
//!
//! In: the header. Out: where each number of a vertex goes, which list of a face names its corners,
//! and warnings about the rest. Invariant: whatever has elements and is not used is named.

use std::ops::Range;

use crate::{
    error::{Place, quoted},
    warning::WarningLog,
};

use super::header::{Element, Header, PropertyKind, is_index_list};

/// Names the elements and properties that are not used.
pub(super) fn warn_unused(header: &Header<'_>, warnings: &mut WarningLog) {
    for &(line, name) in &header.doubled {
        let message = format!(
            "property {} is declared again: the first one counts",
            quoted(name)
        );
        warnings.add(Place::Line(line), message);
    }
    for element in header.elements.iter().filter(|e| e.count > 0) {
        let place = Place::Line(element.line);
        let unused: Vec<_> = match element.name {
            "vertex" => {
                let slots = vertex_slots(element);
                let unused = element.properties.iter().zip(&slots);
                let unused = unused.filter(|(_, slot)| slot.is_none());
                unused.map(|(property, _)| property.name).collect()
            }
            "face" | "tristrips" => {
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

/// Where the numbers of a vertex go: 0 to 2 the position, 3 to 5 the normal, 6 to 9 color and alpha.
const NAMES: [&str; 10] = [
    "x", "y", "z", "nx", "ny", "nz", "red", "green", "blue", "alpha",
];
/// The slots of a normal, and those of a color.
pub(super) const NORMAL: Range<usize> = 3..6;
pub(super) const COLOR: Range<usize> = 6..9;

/// Returns for each property of `vertex` where its number goes. A normal or a color counts if all of
/// it is there, alpha beside a color.
pub(super) fn vertex_slots(element: &Element<'_>) -> Vec<Option<usize>> {
    let is_scalar = |name: &&str| {
        element
            .position(name)
            .is_some_and(|index| matches!(element.properties[index].kind, PropertyKind::Scalar(_)))
    };
    let has_normal = NAMES[NORMAL].iter().all(is_scalar);
    let has_color = NAMES[COLOR].iter().all(is_scalar);
    let slot = |index: usize, name: &str| {
        let slot = NAMES.iter().position(|&n| n == name)?;
        let counts = match slot {
            0..3 => true,
            3..6 => has_normal,
            _ => has_color && is_scalar(&name),
        };
        // Of two properties of one name the first counts.
        (counts && element.position(name) == Some(index)).then_some(slot)
    };
    let properties = element.properties.iter().enumerate();
    properties.map(|(index, p)| slot(index, p.name)).collect()
}

/// Returns which property of `face` or `tristrips` lists the corners.
pub(super) fn index_list(element: &Element<'_>) -> Option<usize> {
    element
        .properties
        .iter()
        .position(|p| is_index_list(p.name))
}
