//! The protocol by which threads hand on what they found, in every order that the memory model allows (loom).
//!
//! The source of `links` is built here once more, with the model checker's atomics.

use std::sync::atomic::{AtomicBool, AtomicU32 as Outside};

use loom::sync::Arc;
use loom::thread;

#[path = "../src/occlusion/links.rs"]
mod links;

mod sync {
    pub(crate) use loom::sync::atomic::{AtomicU32, Ordering};
}

use links::{Link, charge, claim, publish, read};
use sync::{AtomicU32, Ordering};

const RELAXED: Ordering = Ordering::Relaxed;

/// A price of four.
const PRICE: u32 = 2;
/// Where the words of what a thread has made begin.
const PLACES: [usize; 2] = [1, 3];
const LENGTH: usize = 2;

/// A link and the memory that it may point into. What tells the test about threads lies outside the model:
/// it is as if it were seen at once.
struct Memory {
    words: [AtomicU32; 5],
    is_worked_on: AtomicBool,
    made_count: Outside,
}

impl Memory {
    fn new(link: Link) -> Arc<Self> {
        Arc::new(Self {
            words: std::array::from_fn(|at| AtomicU32::new(if at == 0 { link.0 } else { 0 })),
            is_worked_on: AtomicBool::new(false),
            made_count: Outside::new(0),
        })
    }

    fn link(&self) -> &AtomicU32 {
        &self.words[0]
    }

    fn claim(&self) -> Option<Link> {
        let claimed = claim(self.link());
        if claimed.is_some() {
            assert!(
                !self.is_worked_on.swap(true, RELAXED),
                "two threads at work"
            );
        }
        claimed
    }

    fn publish(&self, link: Link) {
        assert!(self.is_worked_on.swap(false, RELAXED), "nobody was at work");
        publish(self.link(), link);
    }

    /// Writes the words behind a link and publishes it.
    fn make(&self, place: usize) {
        for (at, word) in self.words[place..][..LENGTH].iter().enumerate() {
            word.store((10 * place + at) as u32, RELAXED);
        }
        self.made_count.fetch_add(1, RELAXED);
        self.publish(Link::to_brick(place as u32));
    }

    /// What a query does: it reads all that is there, or pays.
    fn query(&self, place: usize, cost: u32) {
        if let Some(found) = read(self.link()).brick() {
            self.check(found);
        } else if charge(self.link(), cost)
            && let Some(claimed) = self.claim()
        {
            assert_eq!(claimed.price(), PRICE);
            self.make(place);
        }
    }

    fn check(&self, place: usize) {
        for (at, word) in self.words[place..][..LENGTH].iter().enumerate() {
            assert_eq!(word.load(RELAXED) as usize, 10 * place + at, "not written");
        }
    }
}

fn in_all_orders(preemptions: Option<usize>, run: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = preemptions;
    builder.check(run);
}

#[test]
fn who_reads_a_link_sees_what_was_written_before() {
    let found_count = std::sync::Arc::new(Outside::new(0));
    let found = std::sync::Arc::clone(&found_count);
    in_all_orders(None, move || {
        let memory = Memory::new(Link::pending(PRICE));
        let other = Arc::clone(&memory);
        let reader = thread::spawn(move || {
            let link = read(other.link());
            if let Some(place) = link.brick() {
                other.check(place);
            }
            link.brick().is_some()
        });
        memory.query(PLACES[0], 4);
        found.fetch_add(reader.join().unwrap().into(), RELAXED);
        assert_eq!(read(memory.link()), Link::to_brick(PLACES[0] as u32));
    });
    assert!(found_count.load(RELAXED) > 0, "nobody read in time");
}

#[test]
fn one_of_several_threads_makes_what_all_pay_for() {
    // Two threads that pay, and one that reads.
    in_all_orders(Some(3), || {
        let memory = Memory::new(Link::pending(PRICE));
        let makers = PLACES.map(|place| {
            let memory = Arc::clone(&memory);
            thread::spawn(move || {
                memory.query(place, 2);
                memory.query(place, 2);
            })
        });
        if let Some(place) = read(memory.link()).brick() {
            memory.check(place);
        }
        for maker in makers {
            maker.join().unwrap();
        }
        let made = memory.made_count.load(RELAXED);
        assert_eq!(made, 1);
        let place = read(memory.link()).brick().expect("a brick");
        memory.check(place);
    });
}

#[test]
fn threads_that_give_up_leave_the_link_to_others() {
    in_all_orders(None, || {
        let memory = Memory::new(Link::pending(PRICE));
        let other = Arc::clone(&memory);
        let thread = thread::spawn(move || {
            if let Some(claimed) = other.claim() {
                other.publish(Link::pending(claimed.price()));
            }
        });
        if memory.claim().is_some() {
            memory.make(PLACES[0]);
        }
        thread.join().unwrap();
        let link = read(memory.link());
        match memory.made_count.load(RELAXED) {
            0 => {
                assert_eq!(link, Link::pending(PRICE));
                assert_eq!(claim(memory.link()), Some(link), "it is free again");
            }
            _ => assert_eq!(link, Link::to_brick(PLACES[0] as u32)),
        }
    });
}

#[test]
fn no_cost_is_lost() {
    in_all_orders(None, || {
        let memory = Memory::new(Link::pending(PRICE));
        let other = Arc::clone(&memory);
        let thread = thread::spawn(move || [charge(other.link(), 1), charge(other.link(), 1)]);
        let here = [charge(memory.link(), 1), charge(memory.link(), 1)];
        let there = thread.join().unwrap();
        // The cost stands in the lowest bits.
        assert_eq!(read(memory.link()).0, Link::pending(PRICE).0 + 4);
        let paid = [here, there].concat();
        assert_eq!(paid.iter().filter(|&&is_paid| is_paid).count(), 1);
    });
}

#[test]
fn costs_that_are_too_large_touch_neither_the_price_nor_the_kind() {
    in_all_orders(None, || {
        let memory = Memory::new(Link::pending(PRICE));
        let other = Arc::clone(&memory);
        let thread = thread::spawn(move || charge(other.link(), u32::MAX));
        let here = charge(memory.link(), u32::MAX - 1);
        assert!(here & thread.join().unwrap());
        let link = read(memory.link());
        assert!(link.is_pending() && link.price() == PRICE, "{link:?}");
        assert!(charge(memory.link(), 1));
        assert_eq!(read(memory.link()), link);
    });
}

#[test]
fn costs_leave_links_alone_that_say_something() {
    let links = [
        Link::to_brick(7),
        Link::to_list(8),
        Link::LIT,
        Link::SHADOWED,
        Link::RAY,
        Link::OUTSIDE,
    ];
    for known in links {
        in_all_orders(None, move || {
            let memory = Memory::new(Link::pending(PRICE));
            let other = Arc::clone(&memory);
            let thread = thread::spawn(move || {
                charge(other.link(), 3);
                charge(other.link(), 4)
            });
            assert!(memory.claim().is_some());
            memory.publish(known);
            assert!(!charge(memory.link(), u32::MAX));
            assert_eq!(claim(memory.link()), None);
            thread.join().unwrap();
            assert_eq!(read(memory.link()), known);
        });
    }
}

/// Costs are told to have paid a price when they reach it, and the largest prices when they are as large as
/// a link holds.
#[test]
fn a_price_is_paid_by_its_power_of_two() {
    in_all_orders(None, || {
        for price in 0..32 {
            let link = AtomicU32::new(Link::pending(price).0);
            let whole = 1 << price.min(23);
            if whole > 1 {
                assert!(!charge(&link, whole - 1), "{price}");
            }
            assert!(charge(&link, 1), "{price}");
        }
    });
}
