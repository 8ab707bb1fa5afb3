//! `antumbra bench`: antumbra against what people use instead.
//!
//! | step | module |
//! |---|---|
//! | what was typed | [`typed`] |
//! | a scene, its light, Embree | [`subject`] |
//! | queries as a frame asks them | [`record`] |
//! | our methods | [`methods`] |
//! | interleaved rounds | [`measure`] |
//! | who is right where Embree differs | [`judge`] |
//! | how much values could know at best | [`oracle`] |
//! | values that are made while they are measured | [`cold`] |
//! | the whole for one scene after the other | [`shadows`], [`report`], [`head`] |
//! | lights with a size, by samples | [`soft`] |
//! | series of frames, one scene after the other | [`frames`], [`frames_report`] |
//! | a second process with values from a file | [`kept`] |
//! | rays aimed at vertices and edges | [`watertight`], [`aims`] |
//! | the paper's scenes and tables | [`paper`] |

mod aims;
mod cold;
mod frames;
mod frames_report;
mod head;
mod judge;
mod kept;
mod measure;
mod methods;
mod oracle;
mod paper;
mod record;
mod report;
mod shadows;
mod soft;
mod subject;
pub(crate) mod typed;
mod watertight;

use crate::failure::{Failure, Outcome};
use crate::interrupt::Interrupt;
use crate::screen::Screen;

/// Runs the measurement that was typed.
pub(crate) fn run(
    typed: &typed::Bench,
    screen: &Screen,
    interrupt: &Interrupt,
) -> Result<Outcome, Failure> {
    match &typed.what {
        typed::What::Shadows(typed) => shadows::run(typed, screen),
        typed::What::Soft(typed) => soft::run(typed, screen),
        typed::What::Frames(typed) => frames::run(typed, screen),
        typed::What::Paper(typed) => paper::run(typed, screen, interrupt),
        typed::What::Kept(typed) => kept::run(typed, screen),
        typed::What::Watertight(typed) => watertight::run(typed, screen),
    }
}
