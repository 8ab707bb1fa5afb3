use std::collections::HashMap;

use super::super::testing::Random;
use super::*;

const MS: f64 = 1e6;

/// The decision alone: state, price, and whether to buy.
#[test]
fn something_is_made_when_its_price_is_within_an_eighth_of_rays_and_half_of_the_gain() {
    for (alone, saved, made, coming, price, is_made) in [
        // Nothing was asked, nothing comes.
        (0.0, 0.0, 0.0, 0.0, 0.0, true),
        (0.0, 0.0, 0.0, 0.0, 1.0, false),
        // An eighth of what rays took.
        (400.0, 0.0, 0.0, 0.0, 50.0, true),
        (399.0, 0.0, 0.0, 0.0, 50.0, false),
        // An eighth of what they would take for what comes.
        (0.0, 0.0, 0.0, 400.0, 50.0, true),
        (200.0, 0.0, 0.0, 200.0, 50.0, true),
        (200.0, 0.0, 0.0, 199.0, 50.0, false),
        // What was made before counts.
        (400.0, 0.0, 1.0, 0.0, 50.0, false),
        (400.0, 0.0, 25.0, 0.0, 25.0, true),
        // Half of the gain, and all of a loss.
        (400.0, 100.0, 50.0, 0.0, 50.0, true),
        (400.0, 100.0, 50.0, 0.0, 51.0, false),
        (400.0, -20.0, 0.0, 0.0, 30.0, true),
        (400.0, -20.0, 0.0, 0.0, 31.0, false),
    ] {
        let [alone, saved, made, coming] = [alone, saved, made, coming].map(|ms: f64| MS * ms);
        let sums = Sums {
            alone,
            saved,
            made,
            coming,
        };
        assert_eq!(sums.pays(MS * price), is_made, "{sums:?} {price}");
    }
}

#[test]
fn values_are_looked_up_while_the_loss_is_within_an_eighth_of_rays() {
    for (alone, saved, made, is_looked_up) in [
        (0.0, 0.0, 0.0, true),
        (0.0, 0.0, 1.0, false),
        (800.0, 0.0, 100.0, true),
        (800.0, 0.0, 101.0, false),
        (800.0, -50.0, 50.0, true),
        (800.0, -50.0, 51.0, false),
        (800.0, 300.0, 400.0, true),
        (800.0, 300.0, 401.0, false),
        // Lookups alone took longer than rays, by up to half of that eighth.
        (800.0, -50.0, 0.0, true),
        (800.0, -51.0, 0.0, false),
    ] {
        let sums = Sums {
            alone,
            saved,
            made,
            // Allows no loss.
            coming: 1e9,
        };
        assert_eq!(sums.is_worth_looking(), is_looked_up, "{sums:?}");
    }
}

#[test]
fn what_values_answer_is_worth_the_cheaper_of_recent_rays_and_all_rays() {
    let budget = Budget::default();
    let rays = |rays, each| Account {
        queries: rays,
        rays,
        rays_ns: rays * each,
        lookups_ns: 0,
    };
    budget.note(&rays(1_000, 100));
    assert_eq!(budget.sums(0).alone, 100_000.0);
    assert_eq!(budget.sums(3).coming, 300.0);
    let found = Account {
        queries: 1_000,
        lookups_ns: 20_000,
        ..Account::default()
    };
    budget.note(&found);
    let sums = budget.sums(0);
    assert_eq!((sums.alone, sums.saved), (200_000.0, 80_000.0));
    // Few dear rays are left: the mean of all is 190, the recent one a fifth of 10 000.
    budget.note(&rays(10, 10_000));
    let mean = 200_000.0 / 1_010.0;
    budget.note(&found);
    let more = budget.sums(0).saved - sums.saved;
    assert!((more - (1_000.0 * mean - 20_000.0)).abs() < 2.0, "{more}");
    // Rays got cheaper: the mean of recent ones counts.
    (0..40).for_each(|_| budget.note(&rays(10, 10)));
    let before = budget.sums(0).saved;
    budget.note(&found);
    let more = budget.sums(0).saved - before;
    assert!(more < 0.0, "{more}");
}

#[test]
fn bricks_are_bought_at_the_mean_price_of_those_before() {
    let budget = Budget::default();
    let rays = |ns| Account {
        queries: 1,
        rays: 1,
        rays_ns: ns,
        lookups_ns: 0,
    };
    assert!(!budget.allows_brick());
    budget.note(&rays(8 * USUAL_BRICK));
    assert!(budget.allows_brick());
    budget.add_brick(USUAL_BRICK / 2);
    // Half of the price is left, and they cost half as much.
    assert!(budget.allows_brick());
    budget.add_made(1);
    assert!(!budget.allows_brick());
}

/// Queries that are noted together.
const NOTED: usize = 2048;
/// Rays to a cell before it is bought.
const ASKS: u64 = 256;

/// What all costs, in nanoseconds.
#[derive(Clone, Copy, Debug)]
struct Market {
    ray: u64,
    /// A lookup that finds an answer, and one that does not.
    lookup: u64,
    miss: u64,
    cell: u64,
    tables: u64,
}

/// What became of the queries of a market.
#[derive(Debug, Default)]
struct Outcome {
    alone: f64,
    took: f64,
    queries: u64,
    known: u64,
    bought: u64,
    looked_up: u64,
}

/// Asks for cells, which are bought by the rule.
fn trade(market: Market, cells: impl IntoIterator<Item = u64>) -> Outcome {
    let Market { ray, .. } = market;
    let budget = Budget::default();
    let mut outcome = Outcome::default();
    let mut has_tables = false;
    // How often a cell was asked, or nothing more once it is bought.
    let mut asked: HashMap<u64, Option<u64>> = HashMap::new();
    let mut cells = cells.into_iter().peekable();
    while cells.peek().is_some() {
        let chunk: Vec<u64> = cells.by_ref().take(NOTED).collect();
        let is_looked_up = has_tables && budget.sums(0).is_worth_looking();
        let (mut lookups_ns, mut made, mut rays) = (0, 0, 0);
        for &cell in &chunk {
            if !is_looked_up {
                rays += 1;
                continue;
            }
            outcome.looked_up += 1;
            let Some(asks) = asked.entry(cell).or_insert(Some(0)) else {
                lookups_ns += market.lookup;
                outcome.known += 1;
                continue;
            };
            lookups_ns += market.miss;
            rays += 1;
            *asks += 1;
            if *asks >= ASKS && budget.allows_brick() {
                asked.insert(cell, None);
                budget.add_brick(market.cell);
                made += market.cell;
                outcome.bought += 1;
            }
        }
        budget.note(&Account {
            queries: chunk.len() as u64,
            rays,
            rays_ns: ray * rays,
            lookups_ns,
        });
        if !has_tables && budget.sums(0).pays(market.tables as f64) {
            has_tables = true;
            budget.add_made(market.tables);
            made += market.tables;
        }
        outcome.alone += (ray * chunk.len() as u64) as f64;
        outcome.took += (ray * rays + lookups_ns + made) as f64;
        outcome.queries += chunk.len() as u64;
        // At any time: a share of what rays take, one purchase, and one chunk of lookups.
        let one_purchase = market.cell.max(USUAL_BRICK).max(market.tables);
        let one_chunk = NOTED as u64 * market.miss.max(market.lookup);
        let most = (1.0 + LOSS) * outcome.alone + (one_purchase + one_chunk) as f64 + 1.0;
        assert!(outcome.took <= most, "{market:?} {outcome:?}");
    }
    outcome
}

/// Markets with all kinds of prices.
fn markets() -> Vec<Market> {
    let mut markets = Vec::new();
    for ray in [15, 70, 300, 3_000] {
        for cell in [5_000, 40_000, 1_000_000] {
            for (lookup, miss) in [(6, 12), (15, 30), (90, 100)] {
                markets.push(Market {
                    ray,
                    lookup,
                    miss,
                    cell,
                    tables: 100_000,
                });
            }
        }
    }
    markets
}

const COUNT: usize = 120_000;

#[test]
fn queries_in_cells_that_are_never_asked_again_cost_little_more_than_rays() {
    for market in markets() {
        let outcome = trade(market, 0..COUNT as u64);
        assert_eq!(outcome.known, 0);
        // They are looked for all the same: others may come.
        assert!(outcome.looked_up > 0 || market.ray == 15, "{outcome:?}");
        // Cells that are asked until they are bought, and never again.
        let spiteful = (0..COUNT as u64).map(|number| number / ASKS);
        let outcome = trade(market, spiteful);
        assert!(outcome.known < outcome.queries / 100, "{outcome:?}");
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
    let worthwhile = |market: &Market| market.ray >= 4 * market.miss;
    for market in markets().into_iter().filter(worthwhile) {
        let cell_count = 10;
        let worth = market.cell * cell_count + market.tables;
        let count = 80 * worth / market.ray + 80 * NOTED as u64;
        let outcome = trade(market, (0..count).map(|number| number % cell_count));
        assert_eq!(outcome.bought, cell_count, "{market:?} {outcome:?}");
        assert!(2 * outcome.known > outcome.queries, "{outcome:?}");
        assert!(outcome.took < 0.8 * outcome.alone, "{market:?} {outcome:?}");
    }
}
