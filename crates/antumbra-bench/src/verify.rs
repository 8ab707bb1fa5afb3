//! `antumbra-bench verify`: rivals of the paper's time against the reference, as `antumbra verify` compares our methods.

use antumbra_baselines::RivalKind;
use antumbra_cli::commands::verify::{self, Other};
use antumbra_cli::failure::{Failure, Outcome};
use antumbra_cli::screen::Screen;

use crate::contender::{Contender, RivalStandIn};
use crate::methods::failure;
use crate::typed::Verify;

/// Asks the rivals that were typed the queries of `antumbra verify`, beside our methods.
pub(super) fn run(typed: &Verify, screen: &Screen) -> Result<Outcome, Failure> {
    let others = typed.rivals.iter().map(|&rival| Other {
        name: rival.name(),
        is_exact: rival != Contender::Rival(RivalKind::ShadowMap),
        method: rival.method(),
        build: Box::new(move |index, memory_limit| {
            let rival = rival.rival(index, None, memory_limit).map_err(failure)?;
            Ok(rival.map(|rival| Box::new(RivalStandIn(rival)) as _))
        }),
    });
    verify::run(&typed.ours, others.collect(), screen)
}
