//! What a person sees in a terminal: bars of progress while commands work, and none of them left behind.
#![cfg(unix)]

use std::fs::File;
use std::io::Read as _;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

use super::support::{Folder, antumbra, assert_code, text};

/// By then every machine has shown a bar.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs a command whose standard error is a terminal, presses Ctrl-C once a bar is seen, and returns the lines that
/// stay on the screen.
fn screen_after_ctrl_c(arguments: &[&str]) -> Vec<String> {
    let near = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&near).unwrap();
    unlockpt(&near).unwrap();
    let size = Winsize {
        ws_row: 24,
        ws_col: 100,
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    let name = ptsname(&near, Vec::new()).unwrap();
    let far = rustix::fs::open(name, OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).unwrap();
    tcsetwinsize(&far, size).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_antumbra"))
        .args(arguments)
        .env("TERM", "xterm")
        .stdout(Stdio::null())
        .stderr(File::from(far))
        .spawn()
        .unwrap();
    // Reading fails or ends when the last writer is gone.
    let (send, receive) = mpsc::channel();
    let mut near = File::from(near);
    let reader = std::thread::spawn(move || {
        let mut piece = [0; 4096];
        while let Ok(count @ 1..) = near.read(&mut piece) {
            if send.send(piece[..count].to_vec()).is_err() {
                break;
            }
        }
    });
    let mut terminal = vt100::Parser::new(24, 100, 0);
    let begin = Instant::now();
    while !terminal.screen().contents().contains(" left") {
        let left = PATIENCE.saturating_sub(begin.elapsed());
        let piece = receive.recv_timeout(left);
        let seen = terminal.screen().contents();
        terminal.process(&piece.unwrap_or_else(|_| panic!("{arguments:?} shows no bar: {seen}")));
    }
    let pid = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &pid])
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(child.wait().unwrap().code(), Some(130), "{arguments:?}");
    reader.join().unwrap();
    for piece in receive {
        terminal.process(&piece);
    }
    let seen = terminal.screen().contents();
    seen.lines().map(str::to_owned).collect()
}

#[test]
fn commands_that_take_long_show_a_bar_and_leave_none_after_ctrl_c() {
    let folder = Folder::new();
    let scene = folder.path("scene.nff");
    assert_code(
        &antumbra(&["scene", "tetra", "--size", "8", "-o", text(&scene)]),
        0,
    );
    let (out, picture) = (folder.path("out.antumbra"), folder.path("picture.png"));
    let (scene, out, picture) = (text(&scene), text(&out), text(&picture));
    let commands: [&[&str]; 4] = [
        &["bake", scene, "-o", out],
        &[
            "render",
            scene,
            "-o",
            picture,
            "--shadows",
            "voxel",
            "--refine",
            "eager",
        ],
        &[
            "render",
            scene,
            "-o",
            picture,
            "--size",
            "4000x4000",
            "--spp",
            "64",
        ],
        &[
            "verify",
            scene,
            "--queries",
            "1000000000",
            "--shadows",
            "bvh",
        ],
    ];
    for arguments in commands {
        let lines = screen_after_ctrl_c(arguments);
        let is_bar = |line: &String| line.contains(" left") || line.contains("[==");
        assert!(!lines.iter().any(is_bar), "{arguments:?} leaves {lines:#?}");
    }
}
