//! Processes that read and write one file at once, or are killed meanwhile.

use std::fs;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use antumbra::{Refine, SavedLight};
use antumbra_geometry::{DVec3, LightShape};

use crate::common::Random;
use crate::world::{Folder, World};

/// What a child process does, and the file it does it to.
const CHILD: &str = "ANTUMBRA_TEST_CHILD";

/// Starts this test again, in another process, to do something to a file until it is killed.
fn start_child(does: &str, path: &Path) -> Child {
    Command::new(std::env::current_exe().expect("this program"))
        .args(["processes::child", "--exact", "--ignored", "--nocapture"])
        .env(CHILD, format!("{does}:{}", path.display()))
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("another process")
}

/// Worlds that differ by a light: a file of one is whole, of both it is not.
fn worlds() -> [World; 2] {
    let world = |x| World {
        lights: vec![LightShape::Point(DVec3::new(x, -1.0, 4.0)); 1],
        ..World::new(64, Refine::Eager)
    };
    [world(1.5), world(-1.5)]
}

#[test]
#[ignore = "other tests start it in processes of their own"]
fn child() {
    let Ok(task) = std::env::var(CHILD) else {
        return;
    };
    let (does, path) = task.split_once(':').expect("a task");
    let path = Path::new(path);
    let worlds = worlds();
    match does {
        "write" => {
            let indices = worlds.map(|world| world.index());
            for index in indices.iter().cycle() {
                index.save(path).expect("a file");
            }
        }
        "read" => loop {
            let taken = worlds.each_ref().map(|world| {
                let index = world.load(path).expect("a whole file");
                index.saved_lights()[0]
            });
            // Between two looks the writer may have written again.
            assert!(taken.iter().all(|saved| *saved != SavedLight::NoRoom));
        },
        other => panic!("{other}"),
    }
}

/// How often a file is replaced by another one within some time, by its number.
#[cfg(unix)]
fn changes_of(path: &Path, time: Duration) -> usize {
    use std::os::unix::fs::MetadataExt as _;
    let begin = Instant::now();
    let (mut last, mut changes) = (0, 0);
    while begin.elapsed() < time {
        let now = fs::metadata(path).expect("always a file").ino();
        changes += usize::from(now != last);
        last = now;
    }
    changes
}

#[test]
#[cfg(unix)]
fn a_writer_that_is_killed_leaves_a_whole_file() {
    let worlds = worlds();
    let folder = Folder::new();
    let path = folder.file("file");
    worlds[0].index().save(&path).expect("a file");
    let random = &mut Random(17);
    let starts = worlds[0].starts(500, 19);
    let expected = worlds.each_ref().map(|world| world.expected(&starts));
    let (mut partial_count, mut seen) = (0, [false; 2]);
    for _ in 0..12 {
        let mut child = start_child("write", &path);
        // Until it writes, and a little longer.
        while changes_of(&path, Duration::from_millis(20)) < 2 {
            assert!(child.try_wait().expect("a child").is_none(), "it ended");
        }
        std::thread::sleep(Duration::from_micros(random.below(8_000) as u64));
        child.kill().expect("it is killed");
        child.wait().expect("it has ended");
        partial_count += folder.names().len() - 1;
        for name in folder.names().iter().filter(|name| *name != "file") {
            fs::remove_file(folder.file(name)).expect("what was left is gone");
        }
        // Whole, with the one light or the other.
        for (number, world) in worlds.iter().enumerate() {
            let index = world.load(&path).expect("a whole file");
            seen[number] |= index.saved_lights() == [SavedLight::Loaded];
            world.assert_right(&index, &starts, &expected[number]);
        }
    }
    assert!(partial_count > 0, "it was never killed while it wrote");
    assert_eq!(seen, [true; 2]);
}

/// Without it, a page of a mapped file that is gone ended the process by a signal.
#[test]
fn a_file_that_is_cut_off_while_it_is_opened_is_an_error() {
    let worlds = worlds();
    let folder = Folder::new();
    let path = folder.file("file");
    worlds[0].index().save(&path).expect("a file");
    let whole = fs::read(&path).expect("a file");
    let is_done = std::sync::atomic::AtomicBool::new(false);
    let mut refusals = 0;
    std::thread::scope(|scope| {
        scope.spawn(|| {
            let random = &mut Random(23);
            while !is_done.load(std::sync::atomic::Ordering::Relaxed) {
                fs::write(&path, &whole).expect("a file");
                let pause = Duration::from_micros(random.below(300) as u64);
                std::thread::sleep(pause);
                let length = random.below(whole.len()) as u64;
                let file = fs::OpenOptions::new().write(true).open(&path);
                let cut = file.and_then(|file| file.set_len(length));
                cut.expect("it is cut off");
            }
        });
        let begin = Instant::now();
        for _ in 0..400 {
            let loaded = worlds[0].load(&path);
            refusals += usize::from(loaded.is_err());
            if begin.elapsed() > Duration::from_secs(60) {
                break;
            }
        }
        is_done.store(true, std::sync::atomic::Ordering::Relaxed);
    });
    assert!(refusals > 0, "it was never cut off");
}

#[test]
#[cfg(unix)]
fn two_processes_read_while_one_writes() {
    let folder = Folder::new();
    let path = folder.file("file");
    worlds()[0].index().save(&path).expect("a file");
    let mut readers = [(); 2].map(|()| start_child("read", &path));
    let mut writer = start_child("write", &path);
    let mut changes = 0;
    let begin = Instant::now();
    while changes < 20 {
        changes += changes_of(&path, Duration::from_millis(100)).saturating_sub(1);
        for child in readers.iter_mut().chain([&mut writer]) {
            assert!(child.try_wait().expect("a child").is_none(), "it ended");
        }
        assert!(
            begin.elapsed() < Duration::from_secs(300),
            "nothing is written"
        );
    }
    for child in readers.iter_mut().chain([&mut writer]) {
        child.kill().expect("it is killed");
        child.wait().expect("it has ended");
    }
}
