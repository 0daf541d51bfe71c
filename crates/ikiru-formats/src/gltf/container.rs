//! The container of binary glTF: a header of 12 bytes, then chunks (JSON, BIN, others).

use std::ops::Range;

use crate::error::{ErrorKind, Fault, Place};
use crate::gltf::chunk::{BIN_CHUNK, JSON_CHUNK, MAGIC};

/// What a document is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Container {
    /// Binary: `.glb`.
    Binary,
    /// Binary, of a VRM avatar: `.vrm`.
    Vrm,
    /// Text alone: `.gltf`.
    Text,
}

/// Where the parts of a file lie in its bytes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parts {
    /// The JSON text, without padding.
    pub(crate) json: Range<usize>,
    /// Buffer 0, with padding.
    pub(crate) bin: Option<Range<usize>>,
    /// All that follows, chunk headers included.
    pub(crate) others: Range<usize>,
    /// Bytes after the end that the header claims.
    pub(crate) trailing: usize,
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    let four = bytes.get(at..at.checked_add(4)?)?;
    Some(u32::from_le_bytes(four.try_into().ok()?))
}

fn index(word: u32) -> usize {
    usize::try_from(word).unwrap_or(usize::MAX)
}

/// Takes a binary file apart.
pub(crate) fn split(bytes: &[u8]) -> Result<Parts, Fault> {
    let at = |byte: usize, kind| Fault::new(Place::Byte(byte as u64), kind);
    let magic = bytes.get(..4).unwrap_or(bytes);
    if magic != &MAGIC[..magic.len()] || (magic.is_empty() && !bytes.is_empty()) {
        return Err(at(0, ErrorKind::Magic { found: magic.to_vec() }));
    }
    let (Some(version), Some(length)) = (word(bytes, 4), word(bytes, 8)) else {
        let kind = ErrorKind::Truncated { what: "the header", found: bytes.len() as u64, expected: 12 };
        return Err(at(bytes.len(), kind));
    };
    if version != 2 {
        return Err(at(4, ErrorKind::Version { found: version.to_string() }));
    }
    let length = index(length);
    let Some(contents) = bytes.get(..length) else {
        let kind = ErrorKind::Truncated {
            what: "the length in the header",
            found: bytes.len() as u64,
            expected: length as u64,
        };
        return Err(at(bytes.len(), kind));
    };
    let (kind, json) = chunk(contents, 12, "the JSON chunk")?;
    if kind != JSON_CHUNK {
        return Err(at(16, ErrorKind::FirstChunk { found: kind }));
    }
    let mut parts = Parts { trailing: bytes.len() - length, ..Parts::default() };
    // Padding is spaces by the rules; zeros are seen as well.
    let text = contents.get(json.clone()).unwrap_or_default();
    let padding = text.iter().rev().take_while(|b| matches!(b, 0 | b' ')).count();
    parts.json = json.start..json.end.saturating_sub(padding);
    let mut next = json.end;
    parts.others = next..next;
    let mut first = true;
    while next < length {
        let (kind, range) = chunk(contents, next, if first { "the BIN chunk" } else { "a chunk" })?;
        next = range.end;
        if first && kind == BIN_CHUNK {
            parts.bin = Some(range);
            parts.others = next..next;
        }
        parts.others.end = next;
        first = false;
    }
    Ok(parts)
}

/// Type and contents of the chunk whose header is at `at`.
fn chunk(contents: &[u8], at: usize, what: &'static str) -> Result<(u32, Range<usize>), Fault> {
    let start = at.saturating_add(8);
    let (Some(claimed), Some(kind)) = (word(contents, at), word(contents, at.saturating_add(4))) else {
        let found = contents.len().saturating_sub(at) as u64;
        let kind = ErrorKind::Truncated { what: "the header of a chunk", found, expected: 8 };
        return Err(Fault::new(Place::Byte(at as u64), kind));
    };
    let available = contents.len().saturating_sub(start);
    if index(claimed) > available {
        let kind = ErrorKind::Length { what, claimed: u64::from(claimed), available: available as u64 };
        return Err(Fault::new(Place::Byte(at as u64), kind));
    }
    Ok((kind, start..start + index(claimed)))
}

/// Puts a binary file together. `others` are whole chunks with their headers.
pub(crate) fn join(json: &str, bin: Option<&[&[u8]]>, others: &[u8]) -> Result<Vec<u8>, Fault> {
    let padded = |n: u64| n.saturating_add(3) & !3;
    let json_length = padded(json.len() as u64);
    let bin_used = bin.map(|parts| parts.iter().map(|p| p.len() as u64).sum::<u64>());
    let bin_length = bin_used.map(padded);
    let total = 12 + 8 + json_length + bin_length.map_or(0, |n| n + 8) + others.len() as u64;
    let too_large = || Fault::from(ErrorKind::TooLarge { bytes: total });
    let length = u32::try_from(total).map_err(|_| too_large())?;
    let chunk_length = |n: u64| u32::try_from(n).map_err(|_| too_large());
    let mut out = Vec::with_capacity(index(length));
    out.extend_from_slice(MAGIC);
    out.extend_from_slice(&2u32.to_le_bytes());
    out.extend_from_slice(&length.to_le_bytes());
    out.extend_from_slice(&chunk_length(json_length)?.to_le_bytes());
    out.extend_from_slice(&JSON_CHUNK.to_le_bytes());
    out.extend_from_slice(json.as_bytes());
    pad(&mut out, b' ');
    if let (Some(parts), Some(bin_length)) = (bin, bin_length) {
        out.extend_from_slice(&chunk_length(bin_length)?.to_le_bytes());
        out.extend_from_slice(&BIN_CHUNK.to_le_bytes());
        for part in parts {
            out.extend_from_slice(part);
        }
        pad(&mut out, 0);
    }
    out.extend_from_slice(others);
    Ok(out)
}

/// Fills up to the next multiple of four.
pub(crate) fn pad(bytes: &mut Vec<u8>, with: u8) {
    while !bytes.len().is_multiple_of(4) {
        bytes.push(with);
    }
}
