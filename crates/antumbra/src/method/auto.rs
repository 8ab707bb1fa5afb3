//! The exact shadow map, and rays until it pays and where it does not know.

use std::array::from_fn;

use antumbra_geometry::{DVec3, ReceiverPoint};

use super::order::{self, Order, WINDOW};
use super::voxel::{ByVoxel, NOTED, Rays};
use crate::clock::Reading;
use crate::draw::{SAMPLED, TIMED, draw};
use crate::occlusion::{Found, Lists, MANY, Map, Spent};
use crate::{Answer, Counters, Decided, QueryError};

/// Queries that are asked of a map before what they have not found is made.
const TOGETHER: usize = 4 * NOTED;

impl<R: Rays> ByVoxel<'_, R> {
    /// Answers queries by the map, as far as there is one, and by rays.
    pub(super) fn answer_by_map(
        &self,
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&ReceiverPoint) -> Result<(), QueryError>,
    ) -> Result<(), QueryError> {
        let light = self.light_number;
        self.values.expect(light, starts.len() as u64);
        let is_refining = self.values.is_refining();
        let (mut left, mut left_answers) = (starts, is_shadowed);
        let mut is_first = true;
        let mut announced = None;
        let mut outcome = Ok(());
        // Once there is a map: whether starts are put in order.
        let mut order: Option<Option<Order>> = None;
        while !left.is_empty() {
            let known = self.values.known(light);
            let lists = known.as_deref().map(|known| &*known.lists);
            let map = lists.and_then(|lists| Some((lists, lists.map()?)));
            let map = map.filter(|_| self.values.is_map_worth_it(light, is_refining));
            if let (true, Some(map), None) = (is_refining, map, &announced) {
                let begin = Reading::now();
                announced = Some(self.values.announce(map, self.occluders, left, light));
                // That serves the whole call: charged to its first queries it would make the map look dear.
                let made = Spent::making(begin.elapsed_ns());
                self.values.spent(self.occluders, light, &made);
            }
            let begin = is_refining.then(Reading::now);
            // Rays are put in order together, once it is known what they cost.
            if map.is_some() {
                let is_scattered = || order::is_scattered(self.values, light, left);
                order.get_or_insert_with(|| is_scattered().then(Order::new));
            }
            let mut order = order.as_mut().and_then(Option::as_mut);
            let count = match map {
                Some(_) if order.is_none() => TOGETHER,
                Some(_) => WINDOW,
                None if is_first => NOTED,
                None => WINDOW,
            };
            is_first = false;
            let (starts, is_shadowed);
            (starts, left) = left.split_at(count.min(left.len()));
            (is_shadowed, left_answers) =
                std::mem::take(&mut left_answers).split_at_mut(starts.len());
            let rays_before = counters.shadow.rays;
            let answered = match (map, &mut order) {
                (Some(map), Some(order)) => {
                    let together = (self.values, TOGETHER);
                    let mut beside = Beside::default();
                    let ask = |starts: &[ReceiverPoint], found: &mut [bool]| {
                        beside.add(&self.ask_map(map, starts, found, counters, &check)?);
                        Ok(())
                    };
                    let answered = order.answer(together, starts, is_shadowed, &check, ask);
                    answered.map(|()| beside)
                }
                (Some(map), None) => self.ask_map(map, starts, is_shadowed, counters, &check),
                (None, _) => self
                    .answer_by_rays(starts, is_shadowed, counters, &check)
                    .map(|()| Beside::default()),
            };
            let beside = match answered {
                Ok(beside) => beside,
                Err(error) => {
                    outcome = Err(error);
                    break;
                }
            };
            if let Some(begin) = begin {
                let spent = Spent {
                    queries: starts.len() as u64,
                    ns: begin.elapsed_ns().saturating_sub(beside.made + beside.rays),
                    made: beside.made,
                    is_by_map: map.is_some(),
                    known: starts.len() as u64 - (counters.shadow.rays - rays_before),
                };
                self.values.spent(self.occluders, light, &spent);
            }
        }
        if let Some(announced) = announced {
            self.values.retract(light, &announced);
        }
        outcome
    }

    /// Answers queries by the map, makes those of its cells that pay, and answers the rest by rays. Returns what took time
    /// beside the map.
    fn ask_map(
        &self,
        (lists, map): (&Lists, &Map),
        starts: &[ReceiverPoint],
        is_shadowed: &mut [bool],
        counters: &mut Counters,
        check: impl Fn(&ReceiverPoint) -> Result<(), QueryError>,
    ) -> Result<Beside, QueryError> {
        let (occluders, light) = (self.occluders, self.light_number);
        let mut unknown = Unknown::default();
        let (mut list_count, mut shadowed_count) = (0, 0);
        let mut ask = |starts: &[ReceiverPoint], numbers: &[u32], is_shadowed: &mut [bool]| {
            let told = self
                .values
                .find_many_in_map((lists, map), occluders, starts, light);
            for (place, &number) in numbers.iter().enumerate().take(starts.len()) {
                is_shadowed[number as usize] = told.shadowed >> place & 1 != 0;
            }
            shadowed_count += u64::from((told.shadowed & !told.unknown).count_ones());
            list_count += u64::from((told.listed & !told.unknown).count_ones());
            unknown.add(starts, numbers, told.unknown);
        };
        let mut rest = Rest::new();
        let mut shadowed_faces = 0;
        for (block, begin) in starts.chunks(MANY).zip((0..).step_by(MANY)) {
            antumbra_task::check();
            let (known, shadowed) = map.faces_of(block);
            if known == 0 {
                let numbers: [u32; MANY] = from_fn(|place| (begin + place) as u32);
                ask(block, &numbers, is_shadowed);
                continue;
            }
            shadowed_faces += u64::from(shadowed.count_ones());
            for (number, start) in block.iter().enumerate() {
                is_shadowed[begin + number] = shadowed >> number & 1 != 0;
                rest.add_if(known >> number & 1 == 0, start, begin + number);
                if rest.count == MANY {
                    ask(&rest.starts, &rest.numbers, is_shadowed);
                    rest.count = 0;
                }
            }
        }
        if rest.count > 0 {
            let left = &rest.starts[..rest.count];
            ask(left, &rest.numbers, is_shadowed);
        }
        shadowed_count += shadowed_faces;
        let mut made = 0;
        if !unknown.starts.is_empty() {
            made = self
                .values
                .make_cells((lists, map), occluders, &unknown.starts, light);
        }
        if made > 0 {
            let before = std::mem::take(&mut unknown);
            let blocks = before.starts.chunks(MANY).zip(before.numbers.chunks(MANY));
            for (starts, numbers) in blocks {
                let told = self
                    .values
                    .find_many_in_map((lists, map), occluders, starts, light);
                for (place, &number) in numbers.iter().enumerate() {
                    if told.unknown >> place & 1 != 0 {
                        unknown.starts.push(starts[place]);
                        unknown.numbers.push(number);
                    } else {
                        is_shadowed[number as usize] = told.shadowed >> place & 1 != 0;
                    }
                }
                shadowed_count += u64::from((told.shadowed & !told.unknown).count_ones());
                list_count += u64::from((told.listed & !told.unknown).count_ones());
            }
        }
        counters.shadow.shadowed += shadowed_count;
        counters.shadow.blocker_list += list_count;
        counters.shadow.first_pass += (starts.len() - unknown.starts.len()) as u64 - list_count;
        let mut rays = 0;
        if !unknown.starts.is_empty() {
            let begin = self.values.is_refining().then(Reading::now);
            let mut blocked = vec![false; unknown.starts.len()];
            self.answer_by_rays(&unknown.starts, &mut blocked, counters, check)?;
            for (&number, &blocked) in unknown.numbers.iter().zip(&blocked) {
                is_shadowed[number as usize] = blocked;
            }
            rays = begin.map_or(0, |begin| begin.elapsed_ns());
        }
        Ok(Beside { made, rays })
    }

    /// Answers one query by the map, if there is one that is worth asking, or by a ray.
    #[inline]
    pub(super) fn answer_one_by_map(
        &self,
        start: &ReceiverPoint,
        counters: &mut Counters,
    ) -> Answer {
        let is_refining = self.values.is_refining();
        let is_one_in = |drawn: u64, count| {
            is_refining && (self.values.is_made_when_queried() || drawn.is_multiple_of(count))
        };
        let drawn = if is_refining { draw() } else { 0 };
        let (is_sampled, is_timed) = (is_one_in(drawn, SAMPLED), is_one_in(drawn, TIMED));
        if is_sampled || is_timed || self.values.is_map_worth_one(self.light_number, drawn) {
            self.ask_map_one(start, [is_sampled, is_timed], counters)
        } else {
            Answer::new(self.rays.is_blocked(start, counters), Decided::Ray)
        }
    }

    #[inline(never)]
    fn ask_map_one(
        &self,
        start: &ReceiverPoint,
        [is_sampled, is_timed]: [bool; 2],
        counters: &mut Counters,
    ) -> Answer {
        let light = self.light_number;
        // What reading the clock takes comes beside.
        let begin = is_timed.then(|| (Reading::now(), Reading::now()));
        let known = self.values.known(light);
        let lists = known.as_deref().map(|known| &*known.lists);
        let map = lists.and_then(|lists| Some((lists, lists.map()?)));
        let find = |map| {
            self.values
                .find_one_in_map(map, self.occluders, start, light)
        };
        let by_face = |(_, map): (_, &Map)| map.face_of(start);
        let mut found = map
            .and_then(by_face)
            .map_or_else(|| map.map_or(Found::NOTHING, find), Found::by_value);
        let mut made = 0;
        if let (true, Some(map), true) = (found.is_nothing(), map, is_sampled) {
            let asking = std::slice::from_ref(start);
            made = self.values.make_cells(map, self.occluders, asking, light);
            if made > 0 {
                found = find(map);
            }
        }
        let answer = if found.is_nothing() {
            Answer::new(self.rays.is_blocked(start, counters), Decided::Ray)
        } else {
            Answer::new(found.is_shadowed(), found.decided())
        };
        if let Some((first, second)) = begin {
            let reading = second.since_ns(first);
            let by_ray = match map.is_some() && found.is_nothing() {
                true => self.values.ray_ns(light),
                false => 0,
            };
            let took = second.elapsed_ns().saturating_sub(reading + made + by_ray);
            let spent = Spent {
                queries: TIMED,
                ns: TIMED * took,
                made,
                is_by_map: map.is_some(),
                known: TIMED * u64::from(!found.is_nothing()),
            };
            self.values.spent(self.occluders, light, &spent);
        } else if made > 0 {
            self.values
                .spent(self.occluders, light, &Spent::making(made));
        }
        answer
    }
}

/// What took time beside lookups, in nanoseconds.
#[derive(Default)]
struct Beside {
    made: u64,
    rays: u64,
}

impl Beside {
    fn add(&mut self, more: &Self) {
        self.made += more.made;
        self.rays += more.rays;
    }
}

/// Starts of a chunk that nothing is known of.
#[derive(Default)]
struct Unknown {
    starts: Vec<ReceiverPoint>,
    numbers: Vec<u32>,
}

impl Unknown {
    /// Adds those of a block, a bit each.
    #[inline]
    fn add(&mut self, block: &[ReceiverPoint], numbers: &[u32], mut places: u64) {
        while places != 0 {
            let place = places.trailing_zeros() as usize;
            places &= places - 1;
            if let Some(start) = block.get(place) {
                self.starts.push(*start);
                self.numbers.push(numbers[place]);
            }
        }
    }
}

/// Starts on faces of which nothing is known as a whole, until there are enough for a lookup.
struct Rest {
    starts: [ReceiverPoint; MANY],
    /// Their numbers in the chunk.
    numbers: [u32; MANY],
    count: usize,
}

/// In place of a start.
const NOWHERE: ReceiverPoint = ReceiverPoint {
    point: DVec3::ZERO,
    surface: None,
};

impl Rest {
    fn new() -> Self {
        Self {
            starts: [NOWHERE; MANY],
            numbers: [0; MANY],
            count: 0,
        }
    }

    /// Adds a start if that is wanted, without a branch.
    #[inline(always)]
    fn add_if(&mut self, is_wanted: bool, start: &ReceiverPoint, number: usize) {
        let at = self.count % MANY;
        self.starts[at] = *start;
        self.numbers[at] = number as u32;
        self.count = at + usize::from(is_wanted);
    }
}
