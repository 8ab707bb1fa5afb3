//! What a run was made with, at the top of every report.

use serde::Serialize;

/// The layout's number in the JSON; it grows when a name goes or changes its meaning.
const SCHEMA: u32 = 1;

/// How all figures of a run were taken.
#[derive(Debug, Serialize)]
pub(super) struct Head {
    schema: u32,
    command: Vec<String>,
    machine: Machine,
    /// What the times are.
    clock: &'static str,
    threads: usize,
    rounds: u32,
    size: [u32; 2],
    /// Where Embree is, or why there is none.
    embree: String,
}

/// What the times were taken on.
#[derive(Debug, Serialize)]
struct Machine {
    processor: Option<String>,
    processors: usize,
    /// Mean number of running processes over the last minute when the run began: figures of a busy
    /// machine are noisy.
    load: Option<f64>,
}

impl Machine {
    /// Asks the system; Linux says it, elsewhere much is unknown.
    fn now() -> Self {
        let read = |path| std::fs::read_to_string(path).ok();
        let processor = read("/proc/cpuinfo").and_then(|table| {
            let line = table.lines().find(|line| line.starts_with("model name"))?;
            Some(line.split_once(':')?.1.trim().to_owned())
        });
        Self {
            processor,
            processors: std::thread::available_parallelism().map_or(1, usize::from),
            load: read("/proc/loadavg")
                .and_then(|line| line.split_whitespace().next()?.parse().ok()),
        }
    }
}

impl Head {
    /// Looks at the machine as it is before anything is timed.
    pub(super) fn new(
        clock: &'static str,
        threads: usize,
        rounds: u32,
        size: [u32; 2],
        embree: String,
    ) -> Self {
        Self {
            schema: SCHEMA,
            command: std::env::args().collect(),
            machine: Machine::now(),
            clock,
            threads,
            rounds,
            size,
            embree,
        }
    }

    /// Returns it for people.
    pub(super) fn text(&self) -> String {
        let Machine {
            processor,
            processors,
            load,
        } = &self.machine;
        let load = load.map_or("unknown".into(), |load| format!("{load:.1}"));
        format!(
            "{}, {processors} processors, load {load}; {} threads, {} rounds, {}; {}x{}; Embree: {}",
            processor.as_deref().unwrap_or("unknown processor"),
            self.threads,
            self.rounds,
            self.clock,
            self.size[0],
            self.size[1],
            self.embree
        )
    }
}
