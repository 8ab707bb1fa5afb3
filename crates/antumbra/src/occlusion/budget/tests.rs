use std::collections::HashMap;

use super::super::testing::Random;
use super::*;

/// Queries that are noted together, and blocks of them that are looked up or not.
const NOTED: usize = 2048;
const BLOCK: usize = 32;
/// A cell is bought when it has cost so much of its price.
const HASTE: u64 = 4;

/// What all costs, in nanoseconds of the machine that the costs above were measured on.
#[derive(Clone, Copy, Debug)]
struct Market {
    ray: u64,
    cell: u64,
    tables: u64,
    /// So many times longer everything takes here.
    slowness: f64,
    /// Whether what queries took is measured.
    is_measured: bool,
}

const USUAL: Market = Market {
    ray: 300,
    cell: 40_000,
    tables: 100_000,
    slowness: 1.0,
    is_measured: true,
};

/// What became of the queries of a market, on its own clock.
#[derive(Debug, Default)]
struct Outcome {
    by_rays: f64,
    took: f64,
    query_count: u64,
    known_count: u64,
    bought: u64,
    looked_count: u64,
}

/// Asks for cells, which are bought by the rule.
fn trade(market: Market, cells: impl IntoIterator<Item = u64>) -> Outcome {
    let Market { ray, slowness, .. } = market;
    let budget = Budget::default();
    let mut outcome = Outcome::default();
    let mut has_tables = false;
    // What a cell has cost, or nothing more once it is bought.
    let mut paid: HashMap<u64, Option<u64>> = HashMap::new();
    let mut cells = cells.into_iter().peekable();
    while cells.peek().is_some() {
        let chunk: Vec<u64> = cells.by_ref().take(NOTED).collect();
        let looks = match has_tables {
            true => budget.looks(),
            false => Looks::None,
        };
        let (mut took, mut made, mut looked, mut rays) = (0, 0, 0, 0);
        for (block, cells) in chunk.chunks(BLOCK).enumerate() {
            let weight = match looks {
                Looks::None | Looks::Rays => 0,
                Looks::Scouts if !(block as u64).is_multiple_of(SCOUTS) => 0,
                Looks::Scouts | Looks::Try(_) | Looks::All => looks.weight(),
            };
            for &cell in cells {
                if weight == 0 {
                    took += ray;
                    rays += 1;
                    continue;
                }
                looked += 1;
                let Some(cost) = paid.entry(cell).or_insert(Some(0)) else {
                    took += LOOKUP_NS;
                    outcome.known_count += 1;
                    continue;
                };
                took += MISS_NS + ray;
                rays += 1;
                *cost += ray * weight;
                if HASTE * *cost >= market.cell && budget.allows(market.cell) {
                    paid.insert(cell, None);
                    budget.spend((market.cell as f64 * slowness) as u64);
                    made += market.cell;
                    outcome.bought += 1;
                }
            }
        }
        budget.note(&Account {
            query_count: chunk.len() as u64,
            ray_count: rays,
            rays_ns: ray * rays,
            looked_count: looked,
            found_count: chunk.len() as u64 - rays,
            took: market
                .is_measured
                .then_some((took as f64 * slowness) as u64),
        });
        if !has_tables && budget.allows(market.tables) {
            has_tables = true;
            budget.spend((market.tables as f64 * slowness) as u64);
            made += market.tables;
        }
        outcome.by_rays += (ray * chunk.len() as u64) as f64 * slowness;
        outcome.took += (took + made) as f64 * slowness;
        outcome.query_count += chunk.len() as u64;
        outcome.looked_count += looked;
        // At any time: a share of what rays take, one purchase, and looks that were not noted yet.
        let one_purchase = market.cell.max(market.tables) as f64;
        let not_noted = NOTED as u64 * MISS_NS;
        let most =
            (1.0 + HOPE + 0.002) * outcome.by_rays + slowness * (one_purchase + not_noted as f64);
        assert!(outcome.took <= most, "{market:?} {outcome:?}");
    }
    outcome
}

/// Markets with all kinds of prices, and in ones that are not known beforehand.
fn markets() -> Vec<Market> {
    let mut markets = Vec::new();
    for ray in [70, 300, 3_000] {
        for cell in [5_000, 40_000, 1_000_000] {
            for slowness in [0.4, 1.0, 3.0] {
                markets.push(Market {
                    ray,
                    cell,
                    slowness,
                    ..USUAL
                });
            }
            markets.push(Market {
                ray,
                cell,
                is_measured: false,
                ..USUAL
            });
        }
    }
    markets
}

/// Cells that are asked until they are bought, and never again.
fn spiteful(market: Market, count: usize) -> impl Iterator<Item = u64> {
    let often = (market.cell / HASTE).div_ceil(market.ray);
    (0..count as u64).map(move |number| number / often)
}

const COUNT: usize = 120_000;

#[test]
fn queries_in_cells_that_are_never_asked_again_cost_little_more_than_rays() {
    for market in markets() {
        let outcome = trade(market, 0..COUNT as u64);
        assert_eq!(outcome.known_count, 0);
        // They are looked for all the same: others may come.
        assert!(outcome.looked_count > 0, "{outcome:?}");
        let outcome = trade(market, spiteful(market, COUNT));
        assert!(outcome.known_count < outcome.query_count / 2);
    }
}

#[test]
fn no_order_costs_much_more_than_rays() {
    let random = &mut Random(1);
    for market in markets() {
        let hot = |count: usize| (0..count).map(|number| number as u64 % 50);
        let cold = |count: usize| (1_000..).take(count);
        // One hot cell, hot ones and cold ones in turn, in long phases, and at random.
        trade(market, std::iter::repeat_n(7, COUNT));
        trade(
            market,
            hot(COUNT).zip(cold(COUNT)).flat_map(|(a, b)| [a, b]),
        );
        trade(market, hot(COUNT).chain(cold(COUNT)).chain(hot(COUNT)));
        trade(market, cold(COUNT).chain(spiteful(market, COUNT)));
        trade(market, hot(COUNT).chain(spiteful(market, COUNT)));
        let reach = [1, 100, 10_000, 1_000_000];
        let cells = (0..COUNT).map(|number| {
            let reach = reach[number / 7_000 % 4] * (1 + number / 40_000);
            random.below(reach) as u64
        });
        trade(market, cells);
    }
}

#[test]
fn what_is_asked_again_and_again_is_bought() {
    // The cheapest rays gain too little for what misses cost.
    let worthwhile = |market: &Market| market.ray > 4 * MISS_NS;
    for market in markets().into_iter().filter(worthwhile) {
        let cell_count = 10;
        let worth = market.cell * cell_count + market.tables;
        // Rays that cost many times what values do.
        let count = 50 * worth / market.ray + 40 * NOTED as u64;
        let outcome = trade(market, (0..count).map(|number| number % cell_count));
        assert_eq!(outcome.bought, cell_count, "{market:?} {outcome:?}");
        assert!(
            2 * outcome.known_count > outcome.query_count,
            "{market:?} {outcome:?}"
        );
        assert!(
            outcome.took < 0.8 * outcome.by_rays,
            "{market:?} {outcome:?}"
        );
    }
}

#[test]
fn nothing_is_bought_with_nothing() {
    let budget = Budget::default();
    assert!(!budget.allows(1));
    budget.note(&Account {
        query_count: 1_000,
        ray_count: 1_000,
        rays_ns: 160_000,
        took: Some(160_000),
        ..Account::default()
    });
    let hope = (160_000.0 * HOPE) as u64;
    assert!(budget.allows(hope) && !budget.allows(hope + 1));
    budget.spend(hope);
    assert!(!budget.allows(1));
    assert_ne!(budget.looks(), Looks::None);
    // One that took longer than it was allowed to.
    budget.spend(1);
    assert_eq!(budget.looks(), Looks::None);
}

#[test]
fn what_is_known_to_come_pays_beforehand() {
    let budget = Budget::default();
    assert!(!budget.allows_tables(1, 1_000_000));
    budget.note(&rays(1_000));
    let hope = HOPE_FOR_TABLES * 160_000.0;
    for ahead in [0, 1_000, 500_000] {
        let most = (hope + FORESIGHT * 160.0 * ahead as f64) as u64;
        assert!(budget.allows_tables(most, ahead), "{ahead}");
        assert!(!budget.allows_tables(most + 1, ahead), "{ahead}");
    }
}

fn rays(count: u64) -> Account {
    Account {
        query_count: count,
        ray_count: count,
        rays_ns: 160 * count,
        took: Some(160 * count),
        ..Account::default()
    }
}

#[test]
fn looks_that_cost_more_than_rays_are_few_until_they_do_not() {
    // All was there before the first query, and answers half of what is asked.
    let budget = Budget::default();
    budget.expect_answers();
    let all_looked_up = |each_ns: u64| {
        let mut count = 0;
        for _ in 0..1_000 {
            let looks = budget.looks();
            let looked_count = match looks {
                Looks::All => 1_000,
                Looks::Scouts => 1_000 / SCOUTS,
                Looks::Try(_) => 1_000,
                Looks::None | Looks::Rays => 0,
            };
            let found_count = looked_count / 2;
            let ray_count = 1_000 - found_count;
            count += u32::from(looks == Looks::All);
            budget.note(&Account {
                query_count: 1_000,
                ray_count,
                // What values leave is dear.
                rays_ns: 160 * (1_000 - looked_count) + 300 * (ray_count + looked_count - 1_000),
                looked_count,
                found_count,
                took: Some(160 * (1_000 - looked_count) + each_ns * looked_count),
            });
        }
        count
    };
    let tries = 1_000 / RAY_TRIES;
    assert!((1..=tries).contains(&all_looked_up(180)));
    assert!((900..1_000).contains(&all_looked_up(120)));
    assert!((1..200).contains(&all_looked_up(180)));
}

#[test]
fn slow_machines_are_told_by_what_rays_take_alone() {
    let budget = Budget::default();
    budget.note(&Account {
        query_count: 1_000,
        ray_count: 1_000,
        rays_ns: 160_000,
        took: Some(480_000),
        ..Account::default()
    });
    // What takes three times as long has cost as much as its parts say.
    let hope = (160_000.0 * HOPE) as u64;
    budget.spend(3 * hope);
    assert!(budget.allows(0) && !budget.allows(1));
    assert_ne!(budget.looks(), Looks::None);
}

#[test]
fn parts_of_rays_are_added() {
    let before = Counters {
        steps: 5,
        intersections: 7,
        ..Counters::default()
    };
    let mut after = before;
    assert_eq!(cost_of_rays(&before, &after, 0), 0);
    after.steps += 3;
    after.intersections += 2;
    let expected = 4 * RAY_NS + 3 * STEP_NS + 2 * TEST_NS;
    assert_eq!(cost_of_rays(&before, &after, 4), expected);
}
