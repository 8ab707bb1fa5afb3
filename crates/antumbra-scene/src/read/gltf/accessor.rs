//! Numbers behind an accessor.
//!
//! In: an accessor's index. Out: [`Accessor`], which returns elements as `f64` or `u32`, read by
//! their true component type, wherever they lie. Invariant: everything an element needs has been
//! found inside its buffer when the accessor is made; a count is believed only where bytes stand
//! behind it.

use std::{cell::RefCell, collections::HashSet};

use super::{
    Fault,
    buffers::{Buffers, slice},
    component::Component,
    document::{AccessorEntry, SparseEntry},
};

/// Elements that an accessor without bytes may have; glTF says they are zero.
const MAX_ZEROS: u64 = 1 << 22;
/// Replaced elements of all sparse accessors together; many accessors can share the same bytes.
const MAX_REPLACED: u64 = 1 << 28;

/// Elements of one type.
#[derive(Clone, Copy, Debug)]
pub(super) struct Accessor<'a> {
    /// Bytes from the first element to the last, and from one to the next; none means zeros.
    base: Option<(&'a [u8], usize)>,
    sparse: Option<Sparse<'a>>,
    count: usize,
    component: Component,
    is_normalized: bool,
    /// Numbers of an element.
    width: usize,
}

/// Elements that replace some of the base, packed.
#[derive(Clone, Copy, Debug)]
struct Sparse<'a> {
    /// Which ones, ascending.
    indices: &'a [u8],
    index_component: Component,
    values: &'a [u8],
}

impl<'a> Accessor<'a> {
    /// Elements that follow one another in bytes of their own.
    pub(super) fn packed(
        bytes: &'a [u8],
        count: usize,
        component: Component,
        width: usize,
        is_normalized: bool,
    ) -> Self {
        Self {
            base: Some((bytes, width * component.size())),
            sparse: None,
            count,
            component,
            is_normalized,
            width,
        }
    }
}

impl Accessor<'_> {
    /// Returns the number of elements.
    pub(super) fn len(&self) -> usize {
        self.count
    }

    /// Returns how many numbers an element has.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn component(&self) -> Component {
        self.component
    }

    /// Returns an element below [`len`](Self::len). Missing lanes are 0.
    pub(super) fn vector<const N: usize>(&self, element: usize) -> [f64; N] {
        let Some(bytes) = self.bytes(element) else {
            return [0.0; N];
        };
        let size = self.component.size();
        std::array::from_fn(|lane| {
            if lane < self.width {
                self.component
                    .read(&bytes[lane * size..], self.is_normalized)
            } else {
                0.0
            }
        })
    }

    /// Returns an element below [`len`](Self::len) as whole numbers.
    pub(super) fn whole<const N: usize>(&self, element: usize) -> [u32; N] {
        let Some(bytes) = self.bytes(element) else {
            return [0; N];
        };
        let size = self.component.size();
        std::array::from_fn(|lane| {
            if lane < self.width {
                self.component.read_whole(&bytes[lane * size..])
            } else {
                0
            }
        })
    }

    fn bytes(&self, element: usize) -> Option<&[u8]> {
        let size = self.width * self.component.size();
        if let Some(sparse) = &self.sparse
            && let Some(at) = sparse.find(element)
        {
            return Some(&sparse.values[at * size..][..size]);
        }
        let (bytes, stride) = self.base?;
        Some(&bytes[element * stride..][..size])
    }
}

impl Sparse<'_> {
    fn index(&self, at: usize) -> usize {
        let size = self.index_component.size();
        self.index_component.read_whole(&self.indices[at * size..]) as usize
    }

    fn len(&self) -> usize {
        self.indices.len() / self.index_component.size()
    }

    /// Finds where an element is among the replaced ones.
    fn find(&self, element: usize) -> Option<usize> {
        let (mut from, mut to) = (0, self.len());
        while from < to {
            let middle = from + (to - from) / 2;
            if self.index(middle) < element {
                from = middle + 1;
            } else {
                to = middle;
            }
        }
        (from < self.len() && self.index(from) == element).then_some(from)
    }
}

/// The accessors of a document.
pub(super) struct Accessors<'a> {
    buffers: &'a Buffers<'a>,
    /// Those whose replacements are known to ascend, and how many of these there are.
    checked: RefCell<(HashSet<usize>, u64)>,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(buffers: &'a Buffers<'a>) -> Self {
        Self {
            buffers,
            checked: RefCell::default(),
        }
    }

    pub(super) fn buffers(&self) -> &'a Buffers<'a> {
        self.buffers
    }

    /// Checks every accessor, used or not.
    pub(super) fn check_all(&self) -> Result<(), Fault> {
        for index in 0..self.buffers.document().accessors.len() {
            self.any(index, &String::new)?;
        }
        Ok(())
    }

    /// Returns accessor `index`, whose type must be one of `shapes`. `path` is who asks.
    pub(super) fn get(
        &self,
        index: usize,
        shapes: &[&str],
        path: impl Fn() -> String,
    ) -> Result<Accessor<'a>, Fault> {
        let accessor = self.any(index, &path)?;
        let entry = &self.buffers.document().accessors[index];
        if !shapes.contains(&&*entry.shape) {
            let problem = format!(
                "accessors[{index}] has the type {}; expected {}",
                entry.shape,
                shapes.join(" or ")
            );
            return Err(Fault::at(path(), problem, ""));
        }
        if entry.buffer_view.is_none() && entry.count > MAX_ZEROS {
            let problem = format!(
                "accessors[{index}] has {} elements and no bytes; at most {MAX_ZEROS} are read",
                entry.count
            );
            return Err(Fault::at(path(), problem, ""));
        }
        Ok(accessor)
    }

    /// The same for numbers that are used as indices.
    pub(super) fn get_whole(
        &self,
        index: usize,
        shapes: &[&str],
        path: impl Fn() -> String,
    ) -> Result<Accessor<'a>, Fault> {
        let accessor = self.get(index, shapes, &path)?;
        if accessor.component.is_unsigned() {
            return Ok(accessor);
        }
        let problem = format!("accessors[{index}] has no unsigned whole numbers");
        Err(Fault::at(path(), problem, ""))
    }

    /// Says where element `element` of accessor `index` is, for messages.
    pub(super) fn place(&self, index: usize, element: usize) -> String {
        let entry = self.buffers.document().accessors.get(index);
        let place = entry.and_then(|entry| {
            let view = entry.buffer_view?;
            let size = self.any(index, &String::new).ok()?.base?.1 as u64;
            let byte = entry.byte_offset.saturating_add(size * element as u64);
            Some(self.buffers.place(view, byte))
        });
        match place {
            Some(place) => format!("element {element} of accessors[{index}] ({place})"),
            None => format!("element {element} of accessors[{index}]"),
        }
    }

    fn any(&self, index: usize, path: &dyn Fn() -> String) -> Result<Accessor<'a>, Fault> {
        let entries = &self.buffers.document().accessors;
        let Some(entry) = entries.get(index) else {
            return Err(Fault::missing(path(), "accessors", index, entries.len()));
        };
        let here = |name: &str| format!("accessors[{index}]{name}");
        let Some(component) = Component::of(entry.component_type) else {
            let problem = format!("{} is no component type", entry.component_type);
            return Err(Fault::at(here(".componentType"), problem, ""));
        };
        let width = match &*entry.shape {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" | "MAT2" => 4,
            "MAT3" => 9,
            "MAT4" => 16,
            other => {
                let problem = format!("{} is no type", crate::error::quoted(other));
                return Err(Fault::at(here(".type"), problem, ""));
            }
        };
        let size = width * component.size();
        let base = self.base(index, entry, size)?;
        let Ok(count) = usize::try_from(entry.count) else {
            return Err(Fault::at(here(".count"), "the count is too large", ""));
        };
        let sparse = match &entry.sparse {
            Some(sparse) => Some(self.sparse(index, sparse, count, size)?),
            None => None,
        };
        Ok(Accessor {
            base,
            sparse,
            count,
            component,
            is_normalized: entry.normalized,
            width,
        })
    }

    /// Returns the bytes of all elements and the stride.
    fn base(
        &self,
        index: usize,
        entry: &AccessorEntry,
        size: usize,
    ) -> Result<Option<(&'a [u8], usize)>, Fault> {
        let Some(view) = entry.buffer_view else {
            return Ok(None);
        };
        let here = || format!("accessors[{index}].bufferView");
        let bytes = self.buffers.view(view, here)?;
        let stride = self.buffers.document().buffer_views[view].byte_stride;
        let stride = stride.unwrap_or(size as u64);
        if stride < size as u64 || stride > 1 << 16 {
            let problem = format!("a stride of {stride} bytes does not fit elements of {size}");
            return Err(Fault::at(
                format!("bufferViews[{view}].byteStride"),
                problem,
                "",
            ));
        }
        let needed = match entry.count {
            0 => Some(0),
            count => (count - 1)
                .checked_mul(stride)
                .and_then(|bytes| bytes.checked_add(size as u64)),
        };
        let found = needed.and_then(|needed| slice(bytes, entry.byte_offset, needed));
        let Some(found) = found else {
            let problem = format!(
                "{} elements of {size} bytes from byte {} on, {stride} bytes apart, are not inside \
                 bufferViews[{view}] of {} bytes",
                entry.count,
                entry.byte_offset,
                bytes.len()
            );
            return Err(Fault::at(format!("accessors[{index}]"), problem, ""));
        };
        Ok(Some((found, stride as usize)))
    }

    fn sparse(
        &self,
        index: usize,
        entry: &SparseEntry,
        count: usize,
        size: usize,
    ) -> Result<Sparse<'a>, Fault> {
        let here = |name: &str| format!("accessors[{index}].sparse{name}");
        let component = Component::of(entry.indices.component_type).filter(|c| c.is_unsigned());
        let Some(index_component) = component else {
            let problem = "expected unsigned whole numbers";
            return Err(Fault::at(here(".indices.componentType"), problem, ""));
        };
        let part = |view, offset, size: usize, name: &str| {
            let bytes = self.buffers.view(view, || here(name))?;
            let part = entry
                .count
                .checked_mul(size as u64)
                .and_then(|length| slice(bytes, offset, length));
            part.ok_or_else(|| {
                let problem = format!(
                    "{} elements of {size} bytes from byte {offset} on are not inside \
                     bufferViews[{view}] of {} bytes",
                    entry.count,
                    bytes.len()
                );
                Fault::at(here(name), problem, "")
            })
        };
        let sparse = Sparse {
            indices: part(
                entry.indices.buffer_view,
                entry.indices.byte_offset,
                index_component.size(),
                ".indices",
            )?,
            index_component,
            values: part(
                entry.values.buffer_view,
                entry.values.byte_offset,
                size,
                ".values",
            )?,
        };
        let (checked, replaced) = &mut *self.checked.borrow_mut();
        if checked.insert(index) {
            *replaced = replaced.saturating_add(entry.count);
            if *replaced > MAX_REPLACED {
                let problem = format!("sparse accessors replace more than {MAX_REPLACED} elements");
                return Err(Fault::at(here(".count"), problem, "split the scene"));
            }
            let mut last = None;
            for at in 0..sparse.len() {
                let element = sparse.index(at);
                if element >= count || last.is_some_and(|last| element <= last) {
                    let problem = format!(
                        "index {at} is {element}; expected ascending ones below {count} (the count)"
                    );
                    return Err(Fault::at(here(".indices"), problem, ""));
                }
                last = Some(element);
            }
        }
        Ok(sparse)
    }
}
