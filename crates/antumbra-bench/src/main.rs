//! `antumbra-bench`: antumbra against what people use instead.
//!
//! | step | module |
//! |---|---|
//! | what was typed | [`typed`] |
//! | our methods and the rivals, by name | [`contender`] |
//! | a scene, its light, Embree | [`subject`] |
//! | queries as a frame asks them | [`record`] |
//! | their indices | [`methods`] |
//! | interleaved rounds | [`measure`] |
//! | who is right where Embree differs | [`judge`] |
//! | how much values could know at best | [`oracle`] |
//! | values that are made while they are measured | [`cold`] |
//! | the whole for one scene after the other | [`shadows`], [`report`], [`head`] |
//! | lights with a size, by samples | [`soft`] |
//! | all lights of a point at once, in rooms | [`lights`] |
//! | view rays through the air, by intervals and by marches | [`fog`] |
//! | sensors and the suns of a year | [`sun`] |
//! | series of frames, one scene after the other | [`frames`], [`frames_report`] |
//! | a second process with values from a file | [`kept`] |
//! | rays aimed at vertices and edges | [`watertight`], [`aims`] |
//! | the paper's scenes and tables | [`paper`] |
//! | rivals of the paper's time against the reference | [`verify`] |

mod aims;
mod break_even;
mod cold;
mod contender;
mod fog;
mod frames;
mod frames_report;
mod head;
mod judge;
mod kept;
mod lights;
mod measure;
mod methods;
mod oracle;
mod paper;
mod record;
mod report;
mod shadows;
mod soft;
mod subject;
mod sun;
mod typed;
mod verify;
mod watertight;

use std::process::ExitCode;

use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::interrupt::Interrupt;
use antumbra_cli::screen::Screen;

fn main() -> ExitCode {
    let code = antumbra_cli::run_typed(
        std::env::args_os(),
        |typed: &typed::Bench| typed.verbosity,
        run,
    );
    ExitCode::from(code)
}

/// Runs the measurement that was typed.
fn run(typed: &typed::Bench, screen: &Screen, interrupt: &Interrupt) -> Result<Outcome, Failure> {
    match &typed.what {
        typed::What::Shadows(typed) => shadows::run(typed, screen),
        typed::What::Soft(typed) => soft::run(typed, screen),
        typed::What::Lights(typed) => lights::run(typed, screen),
        typed::What::Fog(typed) => fog::run(typed, screen),
        typed::What::Sun(typed) => sun::run(typed, screen),
        typed::What::Frames(typed) => frames::run(typed, screen),
        typed::What::Paper(typed) => paper::run(typed, screen, interrupt),
        typed::What::Kept(typed) => kept::run(typed, screen),
        typed::What::Watertight(typed) => watertight::run(typed, screen),
        typed::What::Verify(typed) => verify::run(typed, screen),
    }
}
