//! An option file in the current folder, which Ipopt would read, changes nothing. Alone in its process: the current
//! folder is the process's.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use ikiru_ipopt::{Bounds, Function, Options, Status, minimise};

struct Bowl;

impl Function for Bowl {
    fn value(&mut self, x: &[f64]) -> Option<f64> {
        Some((x[0] - 3.0).powi(4))
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> bool {
        gradient[0] = 4.0 * (x[0] - 3.0).powi(3);
        true
    }
}

#[test]
fn an_option_file_is_not_read() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("ipopt.opt"), "max_iter 1\n").unwrap();
    std::env::set_current_dir(folder.path()).unwrap();
    let bounds = Bounds { lower: &[0.0], upper: &[9.0], ..Bounds::default() };
    let status = minimise(&mut Bowl, &bounds, &Options::default(), &mut [1.0]);
    assert_eq!(status, Ok(Status::Solved));
}
