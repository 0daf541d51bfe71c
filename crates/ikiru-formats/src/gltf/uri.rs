//! References to other files: data inside the document, or a file in its folder and nowhere else.

use std::borrow::Cow;
use std::io::Read;
use std::path::{Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};

use crate::error::ErrorKind;
use crate::warning::short;

/// Padding may be missing, and stray bits in the last character do no harm.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::Indifferent)
        .with_decode_allow_trailing_bits(true),
);

/// What a reference leads to.
pub(crate) enum Target<'u> {
    /// Data inside the document: what follows `data:`.
    Data(&'u str),
    /// A file, relative to the document's folder.
    File(PathBuf),
}

/// Reads a reference, and refuses one that leads out of the document's folder.
pub(crate) fn target(uri: &str) -> Result<Target<'_>, ErrorKind> {
    if let Some(data) = scheme_data(uri) {
        return Ok(Target::Data(data));
    }
    let refuse = |reason| Err(ErrorKind::Uri { uri: short(uri), reason });
    // A scheme, or a drive letter.
    let head = uri.split(['/', '\\', '?', '#']).next().unwrap_or_default();
    if head.contains(':') {
        return refuse("names a scheme or a drive");
    }
    let path = uri.split(['?', '#']).next().unwrap_or_default();
    let Ok(path) = percent_encoding::percent_decode_str(path).decode_utf8() else {
        return refuse("is not UTF-8");
    };
    if path.contains(['\0', ':']) {
        return refuse("has characters that no file name has");
    }
    if path.starts_with(['/', '\\']) {
        return refuse("is absolute");
    }
    let mut file = PathBuf::new();
    for part in path.split(['/', '\\']) {
        match part {
            ".." => return refuse("leaves the folder"),
            "" | "." => {}
            part => file.push(part),
        }
    }
    if file.as_os_str().is_empty() {
        return refuse("names no file");
    }
    Ok(Target::File(file))
}

fn scheme_data(uri: &str) -> Option<&str> {
    let (scheme, rest) = uri.split_at_checked(5)?;
    scheme.eq_ignore_ascii_case("data:").then_some(rest)
}

/// The bytes of what follows `data:`.
pub(crate) fn decode_data(data: &str) -> Result<Vec<u8>, String> {
    let (kind, payload) = data.split_once(',').ok_or("the data: reference has no comma")?;
    let payload: Cow<'_, [u8]> = percent_encoding::percent_decode_str(payload).into();
    if kind.trim_end().to_ascii_lowercase().ends_with(";base64") {
        BASE64.decode(&*payload).map_err(|error| format!("the data: reference is not base64: {error}"))
    } else {
        Ok(payload.into_owned())
    }
}

/// `data:` reference for some bytes.
pub(crate) fn encode_data(mime: &str, bytes: &[u8]) -> String {
    let mut uri = format!("data:{mime};base64,");
    BASE64.encode_string(bytes, &mut uri);
    uri
}

/// Reads a file of the folder, at most `most` bytes of it.
pub(crate) fn read_file(folder: &Path, file: &Path, most: u64) -> Result<Vec<u8>, String> {
    let shown = short(&file.to_string_lossy());
    let io = |error: std::io::Error| format!("'{shown}' cannot be read: {error}");
    let (root, path) = (folder.canonicalize().map_err(io)?, folder.join(file).canonicalize().map_err(io)?);
    if !path.starts_with(&root) {
        return Err(format!("'{shown}' leads out of the folder by a link"));
    }
    if !path.metadata().map_err(io)?.is_file() {
        return Err(format!("'{shown}' is not a file"));
    }
    let mut bytes = Vec::new();
    std::fs::File::open(&path).and_then(|f| f.take(most).read_to_end(&mut bytes)).map_err(io)?;
    Ok(bytes)
}
