//! The buffers of a document: the BIN chunk, data inside the document, files in its folder.

use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::error::Fault;
use crate::gltf::document::BufferEntry;
use crate::gltf::uri::{self, Target};
use crate::warning::short;

/// Where a buffer's bytes are.
#[derive(Clone, Debug)]
pub(crate) enum Buffer {
    /// The BIN chunk, with padding: a part of the file itself.
    Bin(Range<usize>),
    /// Data inside the document.
    Inline(Arc<[u8]>),
    /// Another file.
    External(Arc<[u8]>),
    /// Not there, and why. That matters to who needs it alone.
    Missing(String),
}

impl Buffer {
    /// The bytes; `file` is the document's own.
    pub(crate) fn bytes<'b>(&'b self, file: &'b [u8]) -> Option<&'b [u8]> {
        match self {
            Self::Bin(range) => file.get(range.clone()),
            Self::Inline(bytes) | Self::External(bytes) => Some(bytes),
            Self::Missing(_) => None,
        }
    }
}

/// Finds all buffers. One that is missing is no error, one that leads out of the folder is.
pub(crate) fn resolve(
    entries: &[BufferEntry],
    bin: Option<Range<usize>>,
    folder: Option<&Path>,
) -> Result<Vec<Buffer>, Fault> {
    // A file that several buffers name is read once, as far as the longest of them goes.
    let mut lengths: HashMap<PathBuf, u64> = HashMap::new();
    for (idx, entry) in entries.iter().enumerate() {
        let Some(uri) = &entry.uri else { continue };
        let target = uri::target(uri).map_err(|kind| Fault::at(format!("/buffers/{idx}/uri"), kind))?;
        if let Target::File(file) = target {
            let length = lengths.entry(file).or_default();
            *length = entry.byte_length.max(*length);
        }
    }
    let mut files: HashMap<PathBuf, Buffer> = HashMap::new();
    let mut buffers = Vec::with_capacity(entries.len());
    for (idx, entry) in entries.iter().enumerate() {
        let buffer = match (&entry.uri, &bin) {
            (None, Some(range)) if idx == 0 => Buffer::Bin(range.clone()),
            (None, _) => Buffer::Missing("it has neither data nor a file".to_owned()),
            (Some(uri), _) => {
                let at = |kind| Fault::at(format!("/buffers/{idx}/uri"), kind);
                match uri::target(uri).map_err(at)? {
                    Target::Data(data) => uri::decode_data(data)
                        .map_or_else(Buffer::Missing, |bytes| Buffer::Inline(bytes.into())),
                    Target::File(file) => files
                        .entry(file)
                        .or_insert_with_key(|file| {
                            external(folder, file, lengths.get(file).copied().unwrap_or(0))
                        })
                        .clone(),
                }
            }
        };
        buffers.push(buffer);
    }
    Ok(buffers)
}

fn external(folder: Option<&Path>, file: &Path, length: u64) -> Buffer {
    let Some(folder) = folder else {
        return Buffer::Missing(format!(
            "'{}' is unknown: the document was read without its folder",
            short(&file.to_string_lossy())
        ));
    };
    match uri::read_file(folder, file, length) {
        Ok(bytes) => Buffer::External(bytes.into()),
        Err(reason) => Buffer::Missing(reason),
    }
}
