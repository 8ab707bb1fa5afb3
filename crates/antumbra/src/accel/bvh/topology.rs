//! The binary tree as words in a row, to be kept: building it is most of what the tree costs.
//!
//! In: surfaces, or words from anywhere. Out: words, or the tree, once it is asked for. From the root on, depth first, a word for each node:
//! a leaf's surface, or [`INNER`], and then its two sides. Boxes are made again. Any tree over the surfaces gives
//! the right answers, so words can make rays slow, never wrong. Invariant: whatever the words are, each surface
//! is in one leaf, or there is no tree.

use std::sync::OnceLock;

use antumbra_geometry::Occluders;

use super::binary::{Binary, BinaryNode};
use super::build::Held;
use super::data::Bvh;

/// In place of a surface.
const INNER: u32 = u32::MAX;

/// Words that are those of a binary tree over all surfaces.
#[derive(Debug)]
pub(crate) struct Topology(Vec<u32>);

/// A tree that may have to be built yet, which the first who asks for it does.
#[derive(Debug)]
pub(crate) struct Tree {
    built: OnceLock<Bvh>,
    topology: Option<Topology>,
}

impl Tree {
    /// A tree that is built from what was kept once somebody asks for it.
    pub(crate) fn later(topology: Topology) -> Self {
        Self {
            built: OnceLock::new(),
            topology: Some(topology),
        }
    }

    /// Builds the tree over the surfaces.
    pub(crate) fn now(occluders: &Occluders) -> Self {
        Self {
            built: Bvh::build(occluders).into(),
            topology: None,
        }
    }

    /// Returns the tree over the surfaces.
    #[inline(always)]
    pub(crate) fn get(&self, occluders: &Occluders) -> &Bvh {
        match self.built.get() {
            Some(bvh) => bvh,
            None => self.build(occluders),
        }
    }

    /// Returns the tree if it is built already.
    pub(crate) fn get_built(&self) -> Option<&Bvh> {
        self.built.get()
    }

    /// On one thread: one that waits for others may take up a query that waits for this tree.
    #[cold]
    #[inline(never)]
    fn build(&self, occluders: &Occluders) -> &Bvh {
        self.built.get_or_init(|| match &self.topology {
            Some(topology) => Bvh::of_topology(occluders, topology),
            None => Bvh::build(occluders),
        })
    }
}

impl Topology {
    /// Returns words as a tree's; `None` if they are not those of a binary tree over all surfaces that are not
    /// left out, at least one.
    pub(crate) fn new(words: Vec<u32>, occluders: &Occluders) -> Option<Self> {
        Self::over(words, occluders.present_surfaces().count())
    }

    fn over(words: Vec<u32>, surface_count: usize) -> Option<Self> {
        if words.len() != (2 * surface_count).checked_sub(1)? {
            return None;
        }
        let mut is_there = vec![false; surface_count];
        // How many nodes are due.
        let mut due = 1_usize;
        for &word in &words {
            due = due.checked_sub(1)?;
            if word == INNER {
                due += 2;
            } else {
                let is_there = is_there.get_mut(word as usize)?;
                if std::mem::replace(is_there, true) {
                    return None;
                }
            }
        }
        (due == 0).then_some(Self(words))
    }
}

impl Bvh {
    /// Returns the binary tree over all surfaces in words; none for an empty scene. Takes as long as building
    /// the tree.
    pub(crate) fn topology(occluders: &Occluders) -> Vec<u32> {
        let nodes = Binary::new(Held::all(occluders).boxes()).nodes;
        let word = |node: &BinaryNode| node.surface().unwrap_or(INNER);
        nodes.iter().map(word).collect()
    }

    /// Builds the tree over the surfaces that words were made of.
    fn of_topology(occluders: &Occluders, Topology(words): &Topology) -> Self {
        let held = Held::all(occluders);
        Self::of_binary(
            &held,
            &Binary::of_words(words, &held.boxes().collect::<Vec<_>>(), INNER),
        )
    }
}

#[cfg(test)]
mod tests {
    use antumbra_geometry::{DVec3, Opacity};

    use super::*;

    fn leaves(count: u32) -> Occluders {
        let mut builder = Occluders::builder();
        for number in 0..count {
            let at = f64::from(number * number % 61);
            let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
            let corners = corners.map(|corner| corner + DVec3::new(at, 0.3 * at, 0.0));
            builder.add_face(&corners, Opacity::Opaque).expect("a face");
        }
        builder.build()
    }

    #[test]
    fn the_same_tree_comes_back() {
        for count in [1, 2, 5, 100, 1000] {
            let occluders = leaves(count);
            let words = Bvh::topology(&occluders);
            let built = Bvh::build(&occluders);
            let topology = Topology::over(words, count as usize).expect("a tree");
            let tree = Tree::later(topology);
            assert!(tree.built.get().is_none());
            for tree in [tree, Tree::now(&occluders)] {
                let tree = tree.get(&occluders);
                assert_eq!(format!("{tree:?}"), format!("{built:?}"));
            }
        }
        assert!(Bvh::topology(&leaves(0)).is_empty());
        assert!(Topology::over(Vec::new(), 0).is_none());
    }

    #[test]
    fn words_that_are_no_tree_make_none() {
        let is_tree = |words: &[u32]| Topology::over(words.to_vec(), 4).is_some();
        assert!(is_tree(&[INNER, INNER, 0, 1, INNER, 2, 3]));
        assert!(is_tree(&[INNER, 3, INNER, 2, INNER, 1, 0]));
        for words in [
            &[][..],
            &[0],
            &[INNER, INNER, 0, 1, INNER, 2],
            &[INNER, INNER, 0, 1, INNER, 2, 3, 3],
            &[INNER, INNER, 0, 1, INNER, 2, 2],
            &[INNER, INNER, 0, 1, INNER, 2, 4],
            &[0, INNER, INNER, 1, INNER, 2, 3],
            &[INNER, 0, 1, INNER, INNER, 2, 3],
            &[INNER, INNER, INNER, INNER, 0, 1, 2],
            &[INNER; 7],
        ] {
            assert!(!is_tree(words), "{words:?}");
        }
        assert!(!is_tree(&vec![INNER; 1 << 20]));
    }
}
