//! Numbers in glTF buffers.

use ::gltf::Accessor;
use ::gltf::accessor::{DataType, Dimensions};

use super::wrong;
use crate::error::Problem;

/// Vectors with at least `N` components, of which the first `N` are returned. Normalised integers are in [0, 1] or
/// [−1, 1].
pub(super) fn vectors<const N: usize>(
    accessor: &Accessor,
    buffers: &[Vec<u8>],
) -> Result<Vec<[f64; N]>, Problem> {
    let components = match accessor.dimensions() {
        Dimensions::Vec2 => 2,
        Dimensions::Vec3 => 3,
        Dimensions::Vec4 => 4,
        _ => 1,
    };
    if components < N {
        return Err(wrong(format!("{components} components in place of {N}")));
    }
    let (kind, normalized) = (accessor.data_type(), accessor.normalized());
    let size = kind.size();
    let vector = |bytes: &[u8]| {
        std::array::from_fn(|i| number(kind, normalized, &bytes[i * size..(i + 1) * size]))
    };
    Ok(elements(accessor, components * size, buffers)?
        .map(vector)
        .collect())
}

/// Indices of vertices.
pub(super) fn indices(accessor: &Accessor, buffers: &[Vec<u8>]) -> Result<Vec<u32>, Problem> {
    let kind = accessor.data_type();
    let whole = matches!(kind, DataType::U8 | DataType::U16 | DataType::U32);
    if !whole || accessor.dimensions() != Dimensions::Scalar {
        return Err(wrong("indices are not whole numbers"));
    }
    let index = |bytes: &[u8]| number(kind, false, bytes) as u32;
    Ok(elements(accessor, kind.size(), buffers)?
        .map(index)
        .collect())
}

/// The bytes of each element of `size` bytes, checked to be there.
fn elements<'b>(
    accessor: &Accessor,
    size: usize,
    buffers: &'b [Vec<u8>],
) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, Problem> {
    let view = accessor.view().filter(|_| accessor.sparse().is_none());
    let view = view.ok_or_else(|| wrong("sparse data are not read"))?;
    let (count, stride) = (accessor.count(), view.stride().unwrap_or(size));
    let end = count.checked_sub(1).and_then(|n| n.checked_mul(stride));
    let end = end
        .and_then(|n| n.checked_add(size))
        .filter(|_| stride >= size);
    let start = view.offset().checked_add(accessor.offset());
    let all = buffers.get(view.buffer().index()).zip(start.zip(end));
    let bytes = all.and_then(|(buffer, (start, end))| buffer.get(start..start.checked_add(end)?));
    let bytes = bytes.ok_or_else(|| wrong("numbers lie beyond the end of their buffer"))?;
    Ok((0..count).map(move |i| &bytes[i * stride..i * stride + size]))
}

fn number(kind: DataType, normalized: bool, bytes: &[u8]) -> f64 {
    let at = |i: usize| bytes.get(i).copied().unwrap_or(0);
    let (value, most) = match kind {
        DataType::I8 => (f64::from(at(0) as i8), f64::from(i8::MAX)),
        DataType::U8 => (f64::from(at(0)), f64::from(u8::MAX)),
        DataType::I16 => (
            f64::from(i16::from_le_bytes([at(0), at(1)])),
            f64::from(i16::MAX),
        ),
        DataType::U16 => (
            f64::from(u16::from_le_bytes([at(0), at(1)])),
            f64::from(u16::MAX),
        ),
        DataType::U32 => {
            let value = u32::from_le_bytes([at(0), at(1), at(2), at(3)]);
            (f64::from(value), f64::from(u32::MAX))
        }
        DataType::F32 => return f64::from(f32::from_le_bytes([at(0), at(1), at(2), at(3)])),
    };
    match normalized {
        true => (value / most).max(-1.0),
        false => value,
    }
}
