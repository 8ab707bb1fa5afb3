//! Drives `antumbra-bench paper`, and opens its report in a browser where there is one.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

use serde_json::Value;

const METHODS: [&str; 6] = [
    "grid",
    "voxel-1990",
    "voxel",
    "light-buffer",
    "hybrid",
    "shadow-volumes",
];

fn bench(folder: &Path, more: &[&str]) -> Output {
    let common = ["paper", "--size", "48x48", "--rounds", "1"];
    let files = ["--json", "paper.json", "--html", "report"];
    Command::new(env!("CARGO_BIN_EXE_antumbra-bench"))
        .current_dir(folder)
        .args(common)
        .args(files)
        .args(more)
        .output()
        .unwrap()
}

fn assert_success(output: &Output) {
    let error = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{error}");
}

#[test]
fn tables_figures_and_a_page_that_opens() {
    let folder = tempfile::tempdir().unwrap();
    let output = bench(folder.path(), &["--no-sweeps"]);
    assert_success(&output);
    let table = String::from_utf8_lossy(&output.stdout);
    for part in [
        "Table 1",
        "Table 2",
        "The quick check",
        "1518.2",
        "11 209 198",
    ] {
        assert!(table.contains(part), "{part} in {table}");
    }

    let json = std::fs::read_to_string(folder.path().join("paper.json")).unwrap();
    let figures: Value = serde_json::from_str(&json).unwrap();
    let scenes = figures["scenes"].as_array().unwrap();
    let names: Vec<_> = scenes.iter().map(|scene| &scene["name"]).collect();
    assert_eq!(
        names,
        ["graph", "quadric", "dgp", "bars", "flakes", "tetra"]
    );
    for scene in scenes {
        assert_eq!(scene["different_pictures"], 0);
        assert!(scene["quick_check"]["is_right"].is_boolean());
        for method in METHODS {
            let found = &scene["methods"][method];
            let number = |name: &str| {
                found[name]
                    .as_f64()
                    .unwrap_or_else(|| panic!("{name} in {found}"))
            };
            assert!(number("total_s") > 0.0);
            assert!(number("shadow_s") < number("total_s"));
            assert!((0.0..=1.0).contains(&number("known_share")));
            assert!(number("steps") > 0.0 && number("intersections") > 0.0);
            assert_eq!(
                number("bytes_per_light") > 0.0,
                method != "grid",
                "{method}"
            );
        }
        let voxel = &scene["methods"]["voxel"];
        assert!(voxel["second_render_s"].as_f64().unwrap() > 0.0);
        // Two bits a voxel.
        let bytes = scene["methods"]["voxel-1990"]["bytes_per_light"]
            .as_f64()
            .unwrap();
        let voxels = scene["grid"].as_f64().unwrap().powi(3);
        assert!((bytes - voxels / 4.0).abs() < 64.0, "{bytes}");
    }

    let report = folder.path().join("report");
    let page = std::fs::read_to_string(report.join("index.html")).unwrap();
    assert_eq!(page.matches("data:image/jpeg;base64,").count(), 18 + 3);
    assert!(!page.contains("http://") && !page.contains("https://"));
    let summary = std::fs::read_to_string(report.join("README.md")).unwrap();
    assert!(summary.contains("## Table 1") && summary.contains("index.html"));
    for section in ["6.3", "7.2", "9.1"] {
        assert!(summary.contains(&format!("* **{section}, ")), "{summary}");
    }
    open(&report.join("index.html"));
}

#[test]
fn sweeps_have_all_their_points() {
    let folder = tempfile::tempdir().unwrap();
    let more = ["--scene", "dgp", "--sweep-rounds", "1"];
    assert_success(&bench(folder.path(), &more));
    let json = std::fs::read_to_string(folder.path().join("paper.json")).unwrap();
    let figures: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(figures["scenes"].as_array().unwrap().len(), 1);
    let sweeps = figures["sweeps"].as_array().unwrap();
    let places = |sweep: &Value| -> Vec<u64> {
        let points = sweep["points"].as_array().unwrap();
        points
            .iter()
            .map(|point| point["at"].as_u64().unwrap())
            .collect()
    };
    let found: Vec<_> = sweeps
        .iter()
        .map(|sweep| (sweep["of"].as_str().unwrap(), places(sweep)))
        .collect();
    assert_eq!(
        found,
        [
            ("grid", vec![10, 20, 30, 40, 50, 60, 80, 100]),
            ("size", vec![6, 12, 24, 48, 96]),
            ("lights", vec![1, 2, 3, 4, 5]),
            ("rooms", vec![1, 10, 100]),
        ]
    );
    open(&folder.path().join("report/index.html"));
}

#[test]
fn scenes_that_are_not_the_papers_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(
        bench(folder.path(), &["--scene", "city"]).status.code(),
        Some(2)
    );
}

/// Opens a page and fails on anything that its console says. Says aloud when there is no browser.
fn open(page: &Path) {
    let Some(browser) = browser() else {
        let why = "no Chromium found, so the report was not opened";
        antumbra_testkit::absent::skip("browser", why);
        return;
    };
    let profile = tempfile::tempdir().unwrap();
    let mut data = OsString::from("--user-data-dir=");
    data.push(profile.path());
    let mut address = OsString::from("file://");
    address.push(page);
    let output = Command::new(&browser)
        .args([
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--enable-logging=stderr",
            "--dump-dom",
        ])
        .arg(data)
        .arg(address)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let log = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}: {log}", browser.display());
    let said: Vec<&str> = log
        .lines()
        .filter(|line| line.contains("CONSOLE"))
        .collect();
    assert!(said.is_empty(), "{said:#?}");
    // The script has run: it has set every slider.
    let dom = String::from_utf8_lossy(&output.stdout);
    let sliders = dom.matches("type=\"range\"").count();
    assert!(sliders > 0);
    assert_eq!(
        dom.matches("--cut: 50%").count(),
        sliders + 1,
        "one in the style"
    );
}

/// Returns a Chromium of the search path.
fn browser() -> Option<PathBuf> {
    let folders: Vec<PathBuf> = std::env::split_paths(&std::env::var_os("PATH")?).collect();
    let names = ["chromium", "chromium-browser", "google-chrome", "chrome"];
    let files = names
        .iter()
        .flat_map(|name| folders.iter().map(move |folder| folder.join(name)));
    files.into_iter().find(|file| file.is_file())
}
