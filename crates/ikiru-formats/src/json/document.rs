//! The members of a motion's JSON text, straight into lists of numbers.

use std::fmt;
use std::marker::PhantomData;

use ikiru_rig::RigBuilder;
use serde::Deserialize;
use serde::de::{Deserializer, Error as _, IgnoredAny, MapAccess, SeqAccess, Visitor};

use crate::error::{ErrorKind, Fault, Place};
use crate::gltf::document::{pointer, without_place};

/// The members that are read, straight into numbers: a tree of values would take many times the file's size.
#[derive(Deserialize)]
#[serde(expecting = "a motion object")]
pub(super) struct Document {
    pub(super) times: List<f64>,
    pub(super) root_translation: List<Numbers<3>>,
    pub(super) joints: Named<List<Numbers<4>>>,
    #[serde(default)]
    pub(super) angles: Named<Angles>,
    #[serde(default)]
    pub(super) translations: Named<List<Numbers<3>>>,
}

#[derive(Deserialize)]
#[serde(expecting = "an object of \"euler_deg\", \"angle_deg\" or \"offset\"", deny_unknown_fields)]
pub(super) struct Angles {
    pub(super) euler_deg: Option<List<Numbers<3>>>,
    pub(super) angle_deg: Option<List<f64>>,
    pub(super) offset: Option<List<f64>>,
}

/// Parses a text; an error knows line, column and member.
pub(super) fn parse<'de, T: Deserialize<'de>>(bytes: &'de [u8]) -> Result<T, Fault> {
    serde_json::from_slice(bytes).map_err(|error| {
        // Once more, slower, to learn which member it was.
        let mut again = serde_json::Deserializer::from_slice(bytes);
        let pointer = serde_path_to_error::deserialize::<_, T>(&mut again)
            .err()
            .map_or_else(String::new, |e| pointer(e.path()));
        let message = without_place(&error);
        let place = Place::Text { line: error.line(), column: error.column(), pointer };
        let kind =
            if error.is_data() { ErrorKind::MotionShape { message } } else { ErrorKind::Syntax { message } };
        Fault::new(place, kind)
    })
}

/// The members of an object, in order.
pub(super) struct Named<T>(pub(super) Vec<(String, T)>);

impl<T> Default for Named<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Named<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Members<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Members<T> {
            type Value = Named<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object with the names of joints")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut members = Vec::new();
                while let Some(member) = map.next_entry()? {
                    // A few bytes of text would become a hundred in memory, and no rig has more joints.
                    if members.len() == RigBuilder::MOST_JOINTS {
                        return Err(A::Error::invalid_length(members.len() + 1, &self));
                    }
                    members.push(member);
                }
                Ok(Named(members))
            }
        }
        deserializer.deserialize_map(Members(PhantomData))
    }
}

/// A list, one entry a frame.
pub(super) struct List<T>(pub(super) Vec<T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for List<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Entries<T>(PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Entries<T> {
            type Value = List<T>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a list with one entry a frame")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
                let mut list = Vec::new();
                while let Some(entry) = seq.next_element()? {
                    if list.len() == list.capacity() {
                        // Doubling would hold three times the list while it moves.
                        list.reserve_exact((list.len() / 16).max(4));
                    }
                    list.push(entry);
                }
                Ok(List(list))
            }
        }
        deserializer.deserialize_seq(Entries(PhantomData))
    }
}

/// Exactly so many numbers.
pub(super) struct Numbers<const N: usize>(pub(super) [f64; N]);

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Tuple<const N: usize>;
        impl<'de, const N: usize> Visitor<'de> for Tuple<N> {
            type Value = Numbers<N>;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "a list of {N} numbers")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Self::Value, A::Error> {
                let mut numbers = [0.0; N];
                for (idx, number) in numbers.iter_mut().enumerate() {
                    *number = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(idx, &self))?;
                }
                let mut found = N;
                while seq.next_element::<IgnoredAny>()?.is_some() {
                    found += 1;
                }
                if found == N { Ok(Numbers(numbers)) } else { Err(A::Error::invalid_length(found, &self)) }
            }
        }
        deserializer.deserialize_seq(Tuple)
    }
}
