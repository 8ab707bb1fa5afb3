//! Tables of docs/performance.md, written from the raw runs in bench/runs.
//!
//! In: the page, in which a line `<!-- table NAME -->` begins each such table and `<!-- end -->` ends it; JSON as
//! `antumbra-bench` writes it. Out: the page with its tables made anew. Figures are rounded and nothing else.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Context as _, Result, bail};
use serde_json::Value;

use crate::run;

const PAGE: &str = "docs/performance.md";
const BEGIN: &str = "<!-- table ";
const END: &str = "<!-- end -->";

/// Scenes in the order of the tables: the name in the raw runs' files, and the one that is shown.
const SCENES: [(&str, &str); 10] = [
    ("tetra-6", "tetra 6"),
    ("tetra-8", "tetra 8"),
    ("sphereflake-3", "sphereflake 3"),
    ("sphereflake-4", "sphereflake 4"),
    ("city", "city"),
    ("gears", "gears"),
    ("lost-empire", "Lost Empire"),
    ("flight-helmet", "FlightHelmet"),
    ("teapot-floor", "teapot on a floor"),
    ("forest", "forest"),
];

/// Scenes of lights with size.
const SOFT: [(&str, &str); 6] = [
    ("sphereflake-4", "sphereflake 4"),
    ("city", "city"),
    ("heightfield", "heightfield"),
    ("lost-empire", "Lost Empire"),
    ("flight-helmet", "FlightHelmet"),
    ("forest", "forest"),
];

/// Scenes of the table of lit intervals.
const FOG: [(&str, &str); 7] = [
    ("city", "city"),
    ("sphereflake-3", "sphereflake 3"),
    ("heightfield", "heightfield"),
    ("lost-empire", "Lost Empire"),
    ("flight-helmet", "FlightHelmet"),
    ("forest", "forest"),
    ("rooms", "rooms"),
];

/// Steps of the marches of that table.
const STEPS: f64 = 256.0;

/// Writes the tables.
pub(crate) fn write() -> Result<()> {
    let (page, made) = pages()?;
    if page != made {
        std::fs::write(run::root().join(PAGE), made)?;
    }
    Ok(())
}

/// Checks that the tables are those of the raw runs.
pub(crate) fn check() -> Result<()> {
    let (page, made) = pages()?;
    if page != made {
        bail!("{PAGE} is not what the raw runs say: run `cargo xtask tables`");
    }
    Ok(())
}

/// Returns the page as it is, and as it should be.
fn pages() -> Result<(String, String)> {
    let page = std::fs::read_to_string(run::root().join(PAGE))?;
    let mut made = String::new();
    let mut rest = page.as_str();
    while let Some((before, table)) = rest.split_once(BEGIN) {
        let (name, old) = table
            .split_once(" -->\n")
            .context("a table without a name")?;
        let (_, after) = old
            .split_once(END)
            .with_context(|| format!("table {name} has no end"))?;
        let rows = match name {
            "map" => map()?,
            "soft" => soft()?,
            "lights" => lights()?,
            "fog" => fog()?,
            _ => bail!("{PAGE}: there is no table {name}"),
        };
        write!(made, "{before}{BEGIN}{name} -->\n{rows}{END}")?;
        rest = after;
    }
    made.push_str(rest);
    Ok((page, made))
}

/// Returns the JSON of the newest run of some measurement; names begin with dates.
fn raw(measurement: &str) -> Result<Option<Value>> {
    let mut found: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(run::root().join("bench/runs"))? {
        let path = entry?.path();
        let name = path
            .file_name()
            .and_then(|name| name.to_str())
            .unwrap_or("");
        if name.get(11..) == Some(&format!("{measurement}.json")) {
            found.push(path);
        }
    }
    found.sort();
    let Some(path) = found.last() else {
        return Ok(None);
    };
    let text = std::fs::read_to_string(path)?;
    serde_json::from_str(&text)
        .with_context(|| path.display().to_string())
        .map(Some)
}

fn number(value: &Value, path: &str) -> Result<f64> {
    let found = value.pointer(path).and_then(Value::as_f64);
    found.with_context(|| format!("a raw run has no number {path}"))
}

/// A geometric mean on the way.
#[derive(Clone, Copy, Default)]
struct Mean {
    logarithms: f64,
    count: u32,
}

impl Mean {
    fn add(&mut self, ratio: f64) {
        self.logarithms += ratio.ln();
        self.count += 1;
    }

    fn get(self) -> f64 {
        (self.logarithms / f64::from(self.count)).exp()
    }
}

/// Warm maps against Embree.
fn map() -> Result<String> {
    let mut rows = String::from(
        "| scene | coherent: ns | Embree / ours | shuffled: ns | Embree / ours | free: ns | Embree / ours | map, s | MB |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    let mut means = [[Mean::default(); 2]; 3];
    for (file, name) in SCENES {
        let raw = raw(&format!("map-{file}"))?.with_context(|| format!("no raw run of {file}"))?;
        write!(rows, "| {name} |")?;
        for (set, means) in ["coherent", "shuffled", "free"].iter().zip(&mut means) {
            let of = |path: &str| number(&raw, &format!("/scenes/0/{set}/{path}"));
            let ratios = [of("embree_by/auto_warm")?, of("embree_best_by/auto_warm")?];
            let [single, best] = ratios;
            write!(
                rows,
                " {:.0} | {single:.2}; {best:.2} |",
                of("auto_warm_ns")?
            )?;
            for (mean, ratio) in means.iter_mut().zip(ratios) {
                mean.add(ratio);
            }
        }
        let of = |path: &str| number(&raw, &format!("/scenes/0/preparation/auto_warm/{path}"));
        writeln!(
            rows,
            " {:.3} | {:.1} |",
            of("seconds")?,
            of("bytes_per_light")? / 1e6
        )?;
    }
    write!(rows, "| geometric mean |")?;
    for [single, best] in means {
        write!(rows, " | {:.2}; {:.2} |", single.get(), best.get())?;
    }
    rows.push_str(" | |\n| wanted | | 5; 3 | | 6; 5 | | 3 | 0.5 | 32 |\n");
    Ok(rows)
}

/// Lights with a size: by what is known of them, and first.
fn soft() -> Result<String> {
    let mut rows = String::from(
        "| scene | warm, ns a ray | first | points by value, % | Embree / warm | fastest / warm | Embree / first | fastest / first |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    let mut means = [Mean::default(); 4];
    for (file, name) in SOFT {
        let raw = raw(&format!("soft-{file}"))?.with_context(|| format!("no raw run of {file}"))?;
        let scenes = raw["scenes"]
            .as_array()
            .context("a raw run without scenes")?;
        let mut columns: [Vec<String>; 7] = Default::default();
        for scene in scenes {
            let of = |name: &str| number(scene, &format!("/{name}"));
            let (warm, first) = (of("ours_ns")?, of("cold_ns")?);
            let (single, best) = (of("embree_ns")?, of("embree_best_ns")?);
            columns[0].push(format!("{warm:.0}"));
            columns[1].push(format!("{first:.0}"));
            columns[2].push(format!("{:.0}", 100.0 * of("by_value_share")?));
            let ratios = [single / warm, best / warm, single / first, best / first];
            for ((ratio, column), mean) in ratios.iter().zip(&mut columns[3..]).zip(&mut means) {
                mean.add(*ratio);
                column.push(format!("{ratio:.2}"));
            }
        }
        let columns = columns.map(|column| column.join(", "));
        writeln!(rows, "| {name} | {} |", columns.join(" | "))?;
    }
    write!(rows, "| geometric mean | | | |")?;
    for mean in means {
        write!(rows, " {:.2} |", mean.get())?;
    }
    rows.push_str("\n| wanted | | | 75, 68, 52 | 10 | 3 | 4 | 1.2 |\n");
    Ok(rows)
}

/// All lights of a point.
fn lights() -> Result<String> {
    let mut rows = String::from(
        "| lights | ours, ns a pair | beam / ours | Embree / ours | fastest Embree / ours | known by rows | rows, MB | made in, s |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    let raw = raw("lights")?.context("no raw run of lights")?;
    for scene in raw["scenes"]
        .as_array()
        .context("a raw run without scenes")?
    {
        let of = |name: &str| number(scene, &format!("/{name}"));
        let ours = of("ours_ns")?;
        writeln!(
            rows,
            "| {} | {ours:.1} | {:.2} | {:.2} | {:.2} | {:.1} % | {:.1} | {:.1} |",
            of("count")?,
            of("beam_ns")? / ours,
            of("embree_ns")? / ours,
            of("embree_best_ns")? / ours,
            100.0 * of("known_share")?,
            of("bytes")? / 1e6,
            of("prepare_ms")? / 1e3,
        )?;
    }
    rows.push_str("| wanted, of 100 | | | 10 | 4 | | | |\n");
    Ok(rows)
}

/// Lit intervals of view rays against marches.
fn fog() -> Result<String> {
    let mut rows = String::from(
        "| scene | lit intervals a ray | ours, us a ray | our rays / ours | Embree / ours | fastest Embree / ours | shadow map / ours | error of ours; of the march |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    let mut means = [Mean::default(); 4];
    for (file, name) in FOG {
        let raw = raw(&format!("fog-{file}"))?.with_context(|| format!("no raw run of {file}"))?;
        let scenes = raw["scenes"].as_array();
        let scene = scenes
            .and_then(|scenes| scenes.iter().find(|scene| scene["steps"] == STEPS))
            .with_context(|| format!("no march of {STEPS} steps of {file}"))?;
        let of = |name: &str| number(scene, &format!("/{name}"));
        let ours = of("ours_ns")?;
        write!(
            rows,
            "| {name} | {:.2} | {:.2} |",
            of("intervals")?,
            ours / 1e3
        )?;
        let others = [
            "own_march_ns",
            "embree_march_ns",
            "embree_best_march_ns",
            "map_march_ns",
        ];
        for (other, mean) in others.iter().zip(&mut means) {
            let ratio = of(other)? / ours;
            mean.add(ratio);
            write!(rows, " {ratio:.2} |")?;
        }
        let [error, march] = [of("rms/ours")?, of("rms/march")?];
        let shown = |error: f64| match error {
            0.0 => "0".to_string(),
            _ => format!("{error:.0e}"),
        };
        writeln!(rows, " {}; {} |", shown(error), shown(march))?;
    }
    let [rays, single, best, map] = means.map(Mean::get);
    writeln!(
        rows,
        "| geometric mean | | | {rays:.2} | {single:.2} | {best:.2} | {map:.2} | |"
    )?;
    rows.push_str("| wanted | | | | 5 | 2 | | |\n");
    Ok(rows)
}
