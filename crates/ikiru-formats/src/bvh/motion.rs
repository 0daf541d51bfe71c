//! The `MOTION` of a file: a header and a table of numbers, which is read twice rather than kept.

use crate::bvh::hierarchy::Hierarchy;
use crate::bvh::scan::{Scanner, Word, number};
use crate::error::{ErrorKind, Fault};

/// What stands before the frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    pub(super) n_frames: u64,
    /// Seconds.
    pub(super) frame_time: f64,
}

const FRAMES: &str = "Frames:";
const FRAME_TIME: &str = "Frame Time:";
const COUNT: &str = "a number of frames, 0 or more";
const SECONDS: &str = "seconds from frame to frame, more than 0";

/// Reads the header.
pub(super) fn header(scanner: &mut Scanner<'_>) -> Result<Header, Fault> {
    let word = scanner.header_word();
    if !word.is("Frames") {
        return Err(scanner.unexpected(word, FRAMES));
    }
    let word = after_colon(scanner);
    let count = number(word).filter(|n| *n >= 0.0 && n.fract() == 0.0 && *n < 1e18);
    let n_frames = count.ok_or_else(|| scanner.unexpected(word, COUNT))? as u64;
    let word = scanner.header_word();
    if !word.is("FrameTime") {
        let time = if word.is("Frame") { scanner.header_word() } else { word };
        if !time.is("Time") {
            return Err(scanner.unexpected(time, FRAME_TIME));
        }
    }
    let word = after_colon(scanner);
    let seconds = number(word).filter(|secs| *secs > 0.0 && (secs * n_frames as f64).is_finite());
    let frame_time = seconds.ok_or_else(|| scanner.unexpected(word, SECONDS))?;
    Ok(Header { n_frames, frame_time })
}

/// The next word, behind a colon that may be missing.
fn after_colon<'t>(scanner: &mut Scanner<'t>) -> Word<'t> {
    let word = scanner.header_word();
    if word.is(":") { scanner.header_word() } else { word }
}

/// Smallest, largest and mean position of a joint over all frames, in the file's unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Positions {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
    pub(super) mean: [f64; 3],
}

/// What the frames are like: read before they are, since how a joint moves depends on it.
#[derive(Debug)]
pub(super) struct Survey {
    /// Of each joint with position channels, in the order of the joints.
    pub(super) positions: Vec<Positions>,
    /// Words behind the last frame.
    pub(super) n_extra: u64,
}

/// Checks that all frames are there, and surveys them. `scanner` stands before the first.
pub(super) fn survey(
    mut scanner: Scanner<'_>,
    hierarchy: &Hierarchy<'_>,
    header: &Header,
) -> Result<Survey, Fault> {
    let start = Positions { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3], mean: [0.0; 3] };
    let moving: Vec<_> = hierarchy.nodes.iter().filter(|n| n.channels.has_positions()).collect();
    let mut positions = vec![start; moving.len()];
    let mut frame = vec![0.0; hierarchy.n_channels as usize];
    // Frames without numbers need not be read, however many there are.
    let n_frames = if frame.is_empty() { 0 } else { header.n_frames };
    for idx in 0..n_frames {
        read_frame(&mut scanner, &mut frame).map_err(|stop| stop.fault(&scanner, idx, header))?;
        for (node, positions) in moving.iter().zip(&mut positions) {
            let numbers = frame.get(node.first_channel as usize..).unwrap_or_default();
            for (channel, value) in node.channels.as_slice().iter().zip(numbers) {
                if channel.is_position {
                    let axis = channel.axis();
                    positions.min[axis] = positions.min[axis].min(*value);
                    positions.max[axis] = positions.max[axis].max(*value);
                    positions.mean[axis] += value / n_frames as f64;
                }
            }
        }
    }
    Ok(Survey { positions, n_extra: scanner.count_rest() })
}

/// Why a frame could not be read.
pub(super) enum Stop<'t> {
    Word(Word<'t>),
    /// The file ends after so many of so many numbers.
    End(usize, usize, usize),
}

impl Stop<'_> {
    pub(super) fn fault(self, scanner: &Scanner<'_>, idx: u64, header: &Header) -> Fault {
        match self {
            Stop::Word(word) => scanner.unexpected(word, crate::bvh::scan::NUMBER),
            Stop::End(at, found, expected) => {
                let frames = header.n_frames;
                scanner.fault(at, ErrorKind::FewNumbers { frame: idx + 1, frames, found, expected })
            }
        }
    }
}

/// Reads the numbers of the next frame.
pub(super) fn read_frame<'t>(scanner: &mut Scanner<'t>, frame: &mut [f64]) -> Result<(), Stop<'t>> {
    let expected = frame.len();
    for (found, value) in frame.iter_mut().enumerate() {
        let word = scanner.word();
        if word.text.is_empty() {
            return Err(Stop::End(word.at, found, expected));
        }
        *value = number(word).ok_or(Stop::Word(word))?;
    }
    Ok(())
}
