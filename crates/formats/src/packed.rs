//! Serialisation of results for another process of the same version of the program.

use crate::error::Problem;
use serde::Serialize;
use serde::de::DeserializeOwned;

/// Type that can be packed and unpacked.
pub trait Packed: Serialize + DeserializeOwned {}

impl<T: Serialize + DeserializeOwned> Packed for T {}

/// Serialises a value.
///
/// # Errors
/// A value of a type that cannot be stored, such as a sequence of unknown length.
///
/// ```
/// let bytes = morgana_formats::packed::pack(&vec![1.5, 2.5]).unwrap();
/// assert_eq!(morgana_formats::packed::unpack::<Vec<f64>>(&bytes).unwrap(), [1.5, 2.5]);
/// assert!(morgana_formats::packed::unpack::<Vec<f64>>(&bytes[1..]).is_err());
/// ```
pub fn pack<T: Serialize>(value: &T) -> Result<Vec<u8>, Problem> {
    postcard::to_stdvec(value).map_err(|e| Problem::Malformed(format!("not storable: {e}")))
}

/// Restores a packed value.
///
/// # Errors
/// Bytes that are not a value of this type.
pub fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, Problem> {
    let (value, rest) = postcard::take_from_bytes(bytes)
        .map_err(|e| Problem::Malformed(format!("not readable: {e}")))?;
    match rest.len() {
        0 => Ok(value),
        n => Err(Problem::TrailingBytes { extra: n as u64 }),
    }
}
