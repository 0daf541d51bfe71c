//! What a build may leave out, and how to get one that has it: measuring and drawing bring much to compile that
//! solving does not need.

use anyhow::anyhow;

use crate::failure::Failure;

/// The answer to someone who asks for what is not in this build.
pub(crate) fn left_out(asked: &str, feature: &str) -> Failure {
    Failure::input(anyhow!("'{asked}' is not in this build. {}", how_to_build(feature)))
}

/// The commands that build one that has a feature.
pub(crate) fn how_to_build(feature: &str) -> String {
    // Figures are what measurements are looked at by, so that who builds for the one mostly wants the other.
    let features = if feature == "bench" { "bench,plot" } else { feature };
    format!(
        "It comes with the feature '{feature}'. In Ikiru's folder:\n  \
         cargo install --locked --path crates/ikiru-cli --features {features}\n\
         or, without installing:\n  \
         cargo run --release --features {features} -- …"
    )
}

/// Whether figures can be drawn, before anything is computed for them.
pub(crate) fn require_plot(asked: &str) -> Result<(), Failure> {
    if cfg!(feature = "plot") { Ok(()) } else { Err(left_out(asked, "plot")) }
}
