//! What a build has by its features, and what it says of those that it leaves out.

use crate::common::{ikiru, ikiru_in};

const MOTION: &str = "scenarios/motion/three_points.toml";

#[cfg(not(feature = "bench"))]
#[test]
fn bench_left_out_says_how_to_get_it() {
    let how = ["feature 'bench'", "cargo install --locked --path crates/ikiru-cli --features bench,plot"];
    for args in [&["bench"][..], &["bench", "paper"], &["bench", "paper", "--help"], &["bench", "--n", "3"]] {
        let run = ikiru(args);
        run.fails(2, &how);
        assert_eq!(run.stdout, "", "{args:?}");
    }
    let help = ikiru(&["bench", "--help"]);
    assert_eq!(help.code, 0);
    assert!(how.iter().all(|words| help.stdout.contains(words)), "{}", help.stdout);
}

#[cfg(not(feature = "plot"))]
#[test]
fn plot_left_out_says_how_to_get_it_before_anything_is_planned() {
    for scenario in [MOTION, "none.toml"] {
        let run = ikiru(&["plan", scenario, "--plot", "motion.svg"]);
        run.fails(2, &["'--plot'", "cargo install --locked --path crates/ikiru-cli --features plot"]);
        assert_eq!(run.stdout, "");
    }
}

#[cfg(not(feature = "ipopt"))]
#[test]
fn a_method_left_out_says_how_to_get_it() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("a.toml"),
        "version = 1\nmethod = \"ipopt\"\nrig = \"builtin:human\"\n",
    )
    .unwrap();
    let words =
        ["a.toml:2:10: ", "feature 'ipopt'", "coinor-libipopt-dev", "use 'lm', 'adam', 'ccd' or 'fabrik'"];
    ikiru_in(folder.path(), &["solve", "a.toml"]).fails(2, &words);
}

#[cfg(feature = "plot")]
#[test]
fn a_motion_is_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let scenario = crate::common::root().join(MOTION).display().to_string();
    for (file, holds) in [("motion.svg", &b"degrees from rest"[..]), ("motion.png", b"PNG")] {
        let run = ikiru_in(folder.path(), &["plan", &scenario, "--plot", file]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        let bytes = std::fs::read(folder.path().join(file)).unwrap();
        assert!(bytes.windows(holds.len()).any(|window| window == holds), "{file}");
    }
}

#[test]
fn help_tells_of_everything_in_every_build() {
    let help = ikiru(&["--help"]).stdout;
    assert!(help.contains("bench") && help.contains("feature 'bench'"), "{help}");
    let help = ikiru(&["plan", "--help"]).stdout;
    assert!(help.contains("--plot") && help.contains("feature 'plot'"), "{help}");
}
