//! The members of a glTF document that a rig is made of, each list bounded while it is read.

use std::fmt;
use std::marker::PhantomData;

use ikiru_rig::RigBuilder;
use serde::Deserialize;
use serde::de::{Deserializer, Error as _, SeqAccess, Visitor};
use serde_json::value::RawValue;

use crate::error::{ErrorKind, Fault, Place};
use crate::warning::short;

/// The most elements of a list: as many nodes as a rig may have joints.
pub(crate) const MOST: usize = RigBuilder::MOST_JOINTS;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "a glTF document")]
pub(crate) struct Document<'a> {
    pub(crate) asset: Option<Asset>,
    pub(crate) scene: Option<u32>,
    #[serde(default)]
    pub(crate) scenes: Capped<Scene>,
    #[serde(default)]
    pub(crate) nodes: Capped<Node>,
    #[serde(default)]
    pub(crate) skins: Capped<Skin>,
    #[serde(default)]
    pub(crate) buffers: Capped<BufferEntry>,
    // Read later, as clips are, and only by what needs it: a fault in there does not keep a user from the rig.
    #[serde(borrow)]
    pub(crate) extensions: Option<&'a RawValue>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "an asset object")]
pub(crate) struct Asset {
    pub(crate) version: Option<String>,
    pub(crate) min_version: Option<String>,
}

#[derive(Deserialize)]
#[serde(expecting = "a scene object")]
pub(crate) struct Scene {
    #[serde(default)]
    pub(crate) nodes: Vec<u32>,
}

/// Boxed where a node seldom has it: ten bytes of text must not become hundreds in memory.
#[derive(Default, Deserialize)]
#[serde(expecting = "a node object")]
pub(crate) struct Node {
    #[serde(default)]
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) children: Vec<u32>,
    pub(crate) matrix: Option<Box<[f64; 16]>>,
    pub(crate) translation: Option<Box<[f64; 3]>>,
    pub(crate) rotation: Option<Box<[f64; 4]>>,
    pub(crate) scale: Option<Box<[f64; 3]>>,
}

#[derive(Deserialize)]
#[serde(expecting = "a skin object")]
pub(crate) struct Skin {
    pub(crate) joints: Vec<u32>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "a buffer object")]
pub(crate) struct BufferEntry {
    pub(crate) uri: Option<String>,
    pub(crate) byte_length: u64,
}

/// A list of at most [`MOST`] elements.
pub(crate) struct Capped<T>(pub(crate) Vec<T>);

impl<T> Default for Capped<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<T> std::ops::Deref for Capped<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.0
    }
}

/// What a longer list answers; recognised in [`fault`].
const TOO_LONG: &str = "too many elements";

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Capped<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct List<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for List<T> {
            type Value = Capped<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
                let mut list = Vec::new();
                while let Some(element) = seq.next_element()? {
                    if list.len() == MOST {
                        return Err(A::Error::custom(TOO_LONG));
                    }
                    list.push(element);
                }
                Ok(Capped(list))
            }
        }
        deserializer.deserialize_seq(List(PhantomData))
    }
}

impl<'a> Document<'a> {
    pub(crate) fn parse(text: &'a str) -> Result<Self, Fault> {
        serde_json::from_str(text).map_err(|error| {
            // Once more, slower, to learn which member it was.
            let mut again = serde_json::Deserializer::from_str(text);
            let pointer = serde_path_to_error::deserialize::<_, Document<'_>>(&mut again)
                .err()
                .map_or_else(String::new, |e| pointer(e.path()));
            fault(&error, pointer)
        })
    }
}

/// A part of the document, read by itself; what is wrong comes with the pointer below `at`.
pub(crate) fn parse_part<'a, T: Deserialize<'a>>(text: &'a str, at: &str) -> Result<T, (String, String)> {
    serde_json::from_str(text).map_err(|error| {
        let mut again = serde_json::Deserializer::from_str(text);
        let below = serde_path_to_error::deserialize::<_, T>(&mut again)
            .err()
            .map_or_else(String::new, |e| pointer(e.path()));
        (format!("{at}{below}"), without_place(&error))
    })
}

fn fault(error: &serde_json::Error, pointer: String) -> Fault {
    let message = without_place(error);
    let place = Place::Text { line: error.line(), column: error.column(), pointer };
    let kind = if !error.is_data() {
        ErrorKind::Syntax { message }
    } else if message == TOO_LONG {
        ErrorKind::TooMany { most: MOST }
    } else {
        ErrorKind::Shape { message }
    };
    Fault::new(place, kind)
}

/// The message without the place, which the error carries apart.
pub(crate) fn without_place(error: &serde_json::Error) -> String {
    let message = error.to_string();
    short(message.rfind(" at line ").and_then(|end| message.get(..end)).unwrap_or(&message))
}

/// A path as a JSON pointer.
pub(crate) fn pointer(path: &serde_path_to_error::Path) -> String {
    use serde_path_to_error::Segment;
    let mut pointer = String::new();
    for segment in path {
        match segment {
            Segment::Seq { index } => pointer.push_str(&format!("/{index}")),
            Segment::Map { key } => {
                pointer.push('/');
                pointer.push_str(&short(key).replace('~', "~0").replace('/', "~1"));
            }
            Segment::Enum { .. } | Segment::Unknown => {}
        }
    }
    pointer
}
