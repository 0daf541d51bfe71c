//! What reading may take, whatever comes in: memory and allocations are counted, and what never ends is ended.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use ikiru_testkit::allocations::{count, peak};

pub(crate) const MIB: usize = 1 << 20;

/// Long enough for any machine, however busy: who waits longer waits for ever. This says nothing of speed.
const HANGS: Duration = Duration::from_secs(900);

/// Reads a file of `length` bytes, of which `held` are held besides what reading allocates, and asserts what is promised:
/// at most 64 MiB and eight times the file in memory, and no more allocations than bytes and a million, which is what
/// can be said of the time that it takes without a clock.
#[track_caller]
pub(crate) fn bounded<R>(length: usize, held: usize, read: impl FnOnce() -> R) -> R {
    let (mut result, mut bytes) = (None, 0);
    let allocations = count(|| bytes = peak(|| result = Some(watched(read))));
    let (bytes, most) = (bytes + held, 64 * MIB + 8 * length);
    assert!(bytes <= most, "{bytes} of {most} bytes for a file of {length}");
    let most = 1_000_000 + length;
    assert!(allocations <= most, "{allocations} of {most} allocations for a file of {length}");
    result.unwrap()
}

/// Runs; a run that hangs ends the program with a word about which it was.
#[track_caller]
#[allow(clippy::print_stderr, reason = "nothing else is left to say before the program ends")]
fn watched<R>(run: impl FnOnce() -> R) -> R {
    let place = std::panic::Location::caller();
    let (done, waits) = channel::<()>();
    let test = std::thread::current().name().unwrap_or("a test").to_owned();
    let watch = std::thread::spawn(move || {
        // Ends when the run is done, or has panicked: the other end is gone then.
        if waits.recv_timeout(HANGS) == Err(RecvTimeoutError::Timeout) {
            eprintln!("{test} hangs at {place}");
            std::process::abort();
        }
    });
    let result = run();
    drop(done);
    watch.join().unwrap();
    result
}
