//! Numbers in buffers, read where they lie: accessors, buffer views, sparse ones too.

use std::cell::Cell;

use serde::Deserialize;

use crate::gltf::problem::DataProblem;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "a buffer view object")]
pub(crate) struct ViewEntry {
    buffer: u32,
    #[serde(default)]
    byte_offset: u64,
    byte_length: u64,
    byte_stride: Option<u64>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "an accessor object")]
pub(crate) struct AccessorEntry {
    buffer_view: Option<u32>,
    #[serde(default)]
    byte_offset: u64,
    component_type: u32,
    count: u64,
    #[serde(rename = "type")]
    kind: Kind,
    sparse: Option<Box<SparseEntry>>,
}

#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "UPPERCASE")]
pub(crate) enum Kind {
    Scalar,
    Vec2,
    Vec3,
    Vec4,
    Mat2,
    Mat3,
    Mat4,
}

#[derive(Deserialize)]
#[serde(expecting = "a sparse object")]
struct SparseEntry {
    count: u64,
    indices: SparseIndices,
    values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "an indices object")]
struct SparseIndices {
    buffer_view: u32,
    #[serde(default)]
    byte_offset: u64,
    component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
#[serde(expecting = "a values object")]
struct SparseValues {
    buffer_view: u32,
    #[serde(default)]
    byte_offset: u64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_code(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number at `at`, integers as they are. What is read lies inside by the checks before.
    fn read(self, bytes: &[u8], at: usize) -> f64 {
        fn array<const N: usize>(bytes: &[u8], at: usize) -> [u8; N] {
            at.checked_add(N)
                .and_then(|end| bytes.get(at..end))
                .and_then(|b| b.try_into().ok())
                .unwrap_or([0; N])
        }
        match self {
            Self::I8 => f64::from(i8::from_le_bytes(array(bytes, at))),
            Self::U8 => f64::from(u8::from_le_bytes(array(bytes, at))),
            Self::I16 => f64::from(i16::from_le_bytes(array(bytes, at))),
            Self::U16 => f64::from(u16::from_le_bytes(array(bytes, at))),
            Self::U32 => f64::from(u32::from_le_bytes(array(bytes, at))),
            Self::F32 => f64::from(f32::from_le_bytes(array(bytes, at))),
        }
    }

    /// A normalised integer as the number that it stands for.
    fn normalise(self, value: f64) -> f64 {
        match self {
            Self::I8 => (value / 127.0).max(-1.0),
            Self::U8 => value / 255.0,
            Self::I16 => (value / 32_767.0).max(-1.0),
            Self::U16 => value / 65_535.0,
            Self::U32 | Self::F32 => value,
        }
    }
}

/// Elements at equal distances.
#[derive(Clone, Copy)]
struct Strided<'b> {
    bytes: &'b [u8],
    stride: usize,
}

#[derive(Clone, Copy)]
struct Sparse<'b> {
    count: usize,
    indices: Strided<'b>,
    component: Component,
    values: Strided<'b>,
}

/// The elements of an accessor.
#[derive(Clone, Copy)]
pub(crate) struct Values<'b> {
    pub(crate) count: usize,
    component: Component,
    base: Option<Strided<'b>>,
    sparse: Option<Sparse<'b>>,
}

impl Values<'_> {
    /// One element, normalised where it is of integers.
    pub(crate) fn get<const N: usize>(&self, element: usize) -> [f64; N] {
        let replaced = self.sparse.and_then(|s| s.find(element).map(|at| (s.values, at)));
        let Some((strided, at)) = replaced.or(self.base.map(|base| (base, element))) else {
            return [0.0; N];
        };
        let start = at.saturating_mul(strided.stride);
        let mut out = [0.0; N];
        for (c, out) in out.iter_mut().enumerate() {
            let value = self.component.read(strided.bytes, start.saturating_add(c * self.component.size()));
            *out = self.component.normalise(value);
        }
        out
    }
}

impl Sparse<'_> {
    fn index(&self, at: usize) -> usize {
        // An index of at most 32 bits: exact as f64.
        self.component.read(self.indices.bytes, at.saturating_mul(self.indices.stride)) as usize
    }

    /// Where the replacement of an element stands.
    fn find(&self, element: usize) -> Option<usize> {
        let (mut low, mut high) = (0, self.count);
        while low < high {
            let middle = low + (high - low) / 2;
            match self.index(middle).cmp(&element) {
                std::cmp::Ordering::Equal => return Some(middle),
                std::cmp::Ordering::Less => low = middle + 1,
                std::cmp::Ordering::Greater => high = middle,
            }
        }
        None
    }
}

/// What accessors are read from.
pub(crate) struct Data<'b> {
    pub(crate) accessors: Vec<AccessorEntry>,
    pub(crate) views: Vec<ViewEntry>,
    /// Bytes of each buffer, or why there are none.
    pub(crate) buffers: Vec<Result<&'b [u8], String>>,
    /// No accessor holds more elements than this.
    pub(crate) most: u64,
    /// How many indices of sparse accessors may still be looked at: every channel checks those that it needs, and
    /// any number of channels may need the same ones.
    pub(crate) sparse_left: Cell<u64>,
}

/// What is wrong, with a JSON pointer.
pub(crate) type At<T> = Result<T, (String, DataProblem)>;

impl<'b> Data<'b> {
    /// The elements of an accessor of type `N` floats, or (but for times) of normalised integers.
    pub(crate) fn values(&self, index: u32, kind: Kind, integers: bool) -> At<Values<'b>> {
        let at = format!("/accessors/{index}");
        let fail = |problem| Err((at.clone(), problem));
        let Some(entry) = self.accessors.get(index as usize) else {
            let count = self.accessors.len();
            return fail(DataProblem::OutOfRange { what: "accessor", found: index, count });
        };
        let component = Component::from_code(entry.component_type)
            .filter(|c| *c == Component::F32 || integers && *c != Component::U32);
        let Some(component) = component.filter(|_| entry.kind == kind) else {
            let found = format!("{:?} of component type {}", entry.kind, entry.component_type);
            let expected = match kind {
                Kind::Scalar => "scalars of component type 5126 (float)",
                Kind::Vec3 => "3-vectors of component type 5126 (float)",
                _ => "4-vectors of component type 5126 (float) or a normalised integer",
            };
            return fail(DataProblem::Type { found, expected });
        };
        if entry.count == 0 {
            return fail(DataProblem::Count { found: 0, expected: 1 });
        }
        if entry.count > self.most {
            return fail(DataProblem::Claims(entry.count));
        }
        let width = match kind {
            Kind::Scalar => 1,
            Kind::Vec3 => 3,
            _ => 4,
        };
        let size = component.size() * width;
        let base = match entry.buffer_view {
            Some(view) => Some(self.strided(view, entry.byte_offset, size, entry.count)?),
            None => None,
        };
        let count = usize::try_from(entry.count).unwrap_or(usize::MAX);
        let sparse = match &entry.sparse {
            Some(sparse) => Some(self.sparse(sparse, size, count, &at)?),
            None => None,
        };
        Ok(Values { count, component, base, sparse })
    }

    fn sparse(&self, entry: &SparseEntry, size: usize, total: usize, at: &str) -> At<Sparse<'b>> {
        let place = || format!("{at}/sparse");
        let component = Component::from_code(entry.indices.component_type)
            .filter(|c| matches!(c, Component::U8 | Component::U16 | Component::U32));
        let Some(component) = component else {
            let found = format!("component type {}", entry.indices.component_type);
            return Err((place(), DataProblem::Type { found, expected: "5121, 5123 or 5125 (unsigned)" }));
        };
        if entry.count > total as u64 {
            return Err((place(), DataProblem::Count { found: entry.count, expected: total as u64 }));
        }
        let Some(left) = self.sparse_left.get().checked_sub(entry.count) else {
            return Err((place(), DataProblem::Claims(entry.count)));
        };
        self.sparse_left.set(left);
        let (indices, values) = (&entry.indices, &entry.values);
        let sparse = Sparse {
            count: usize::try_from(entry.count).unwrap_or(0),
            indices: self.strided(indices.buffer_view, indices.byte_offset, component.size(), entry.count)?,
            component,
            values: self.strided(values.buffer_view, values.byte_offset, size, entry.count)?,
        };
        let increases = (1..sparse.count).all(|i| sparse.index(i - 1) < sparse.index(i));
        let exists = sparse.count == 0 || sparse.index(sparse.count - 1) < total;
        if increases && exists { Ok(sparse) } else { Err((place(), DataProblem::SparseOrder)) }
    }

    /// The bytes from the first to the last of `count` elements.
    fn strided(&self, view: u32, offset: u64, size: usize, count: u64) -> At<Strided<'b>> {
        let at = format!("/bufferViews/{view}");
        let fail = |problem| Err((at.clone(), problem));
        let Some(entry) = self.views.get(view as usize) else {
            let count = self.views.len();
            return fail(DataProblem::OutOfRange { what: "buffer view", found: view, count });
        };
        let bytes = match self.buffers.get(entry.buffer as usize) {
            Some(Ok(bytes)) => *bytes,
            Some(Err(reason)) => {
                return fail(DataProblem::Buffer { index: entry.buffer, reason: reason.clone() });
            }
            None => {
                let count = self.buffers.len();
                return fail(DataProblem::OutOfRange { what: "buffer", found: entry.buffer, count });
            }
        };
        let stride = entry.byte_stride.unwrap_or(size as u64);
        if stride < size as u64 {
            return fail(DataProblem::Stride(stride));
        }
        // Saturated sums are larger than any buffer.
        let needed = match count {
            0 => 0,
            n => stride.saturating_mul(n - 1).saturating_add(size as u64),
        };
        let end_in_view = offset.saturating_add(needed);
        if end_in_view > entry.byte_length {
            return fail(DataProblem::Bounds { needed: end_in_view, available: entry.byte_length });
        }
        let start = entry.byte_offset.saturating_add(offset);
        let end = start.saturating_add(needed);
        let range = usize::try_from(start).ok().zip(usize::try_from(end).ok());
        match range.and_then(|(start, end)| bytes.get(start..end)) {
            Some(bytes) => Ok(Strided { bytes, stride: usize::try_from(stride).unwrap_or(usize::MAX) }),
            None => fail(DataProblem::Bounds { needed: end, available: bytes.len() as u64 }),
        }
    }
}
