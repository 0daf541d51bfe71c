//! By what binary glTF is known: its first bytes, and the types of its chunks.

/// Type of the chunk that holds the document: `JSON`.
pub(crate) const JSON_CHUNK: u32 = 0x4E4F_534A;
/// Type of the chunk that holds buffer 0: `BIN\0`.
pub(crate) const BIN_CHUNK: u32 = 0x004E_4942;
/// The first four bytes.
pub(crate) const MAGIC: &[u8; 4] = b"glTF";
