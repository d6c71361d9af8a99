//! Numbers of datasets.

use hdf5_reader::error::Error;
use hdf5_reader::{ByteOrder, Dataset, Datatype, H5Type, Hdf5File};

use crate::element::{Element, Encoding};
use crate::error::Problem;

/// Returns a dataset that is a finite number.
pub(super) fn number(file: &Hdf5File, name: &str) -> Option<f64> {
    numbers(file, name, 1).map(|numbers| numbers[0])
}

/// Returns the numbers of a dataset if there are `count` of them, all finite.
pub(super) fn numbers(file: &Hdf5File, name: &str, count: usize) -> Option<Vec<f64>> {
    let data = file.dataset(name).ok()?;
    let (encoding, complex) = encoding(&data).ok()?;
    if complex || data.num_elements().ok()? != count as u64 {
        return None;
    }
    let bytes = data.read_raw_bytes().ok()?;
    let mut numbers = Vec::with_capacity(count);
    let read = encoding.read(&mut &bytes[..], count, |v| numbers.push(v));
    read.ok()?;
    numbers.iter().all(|v| v.is_finite()).then_some(numbers)
}

/// Returns the encoding of a dataset's numbers, and true if each element is two of them: a complex
/// number, as h5py writes it.
pub(super) fn encoding(data: &Dataset) -> Result<(Encoding, bool), Problem> {
    if let Datatype::Compound { size, fields } = data.dtype()
        && let [re, im] = &fields[..]
        && re.datatype == im.datatype
        && let Ok(part) = real(&re.datatype)
        && [re.byte_offset as usize, im.byte_offset as usize] == [0, part.element.size()]
        && *size as usize == 2 * part.element.size()
    {
        return Ok((part, true));
    }
    Ok((real(data.dtype())?, false))
}

fn real(datatype: &Datatype) -> Result<Encoding, Problem> {
    let (element, order) = match datatype {
        Datatype::FloatingPoint { size, byte_order } => {
            let floats = [Element::F16, Element::F32, Element::F64];
            let same = |element: &Element| element.size() == usize::from(*size);
            (floats.into_iter().find(same), byte_order)
        }
        Datatype::FixedPoint {
            size,
            signed,
            byte_order,
        } => (Element::integer(usize::from(*size), *signed), byte_order),
        _ => (None, &ByteOrder::LittleEndian),
    };
    let big = matches!(order, ByteOrder::BigEndian);
    let encoding = element.map(|element| Encoding { element, big });
    encoding.ok_or_else(|| Problem::Mismatch {
        expected: "a dataset of numbers".into(),
        found: "other elements".into(),
    })
}

/// Number of any type.
#[derive(Clone)]
pub(super) struct Number(pub f64);

impl H5Type for Number {
    fn hdf5_type() -> Datatype {
        f64::hdf5_type()
    }

    fn from_bytes(bytes: &[u8], datatype: &Datatype) -> Result<Self, Error> {
        let numbers = Self::decode_vec(bytes, datatype, 1);
        let number = numbers.and_then(|numbers| numbers.ok()?.pop());
        number.ok_or_else(|| Error::InvalidData("not a number".into()))
    }

    fn element_size(datatype: &Datatype) -> usize {
        real(datatype).map_or(size_of::<f64>(), |encoding| encoding.element.size())
    }

    fn decode_vec(
        bytes: &[u8],
        datatype: &Datatype,
        count: usize,
    ) -> Option<Result<Vec<Self>, Error>> {
        let mut numbers = Vec::with_capacity(count);
        let encoding = real(datatype).ok()?;
        let read = encoding.read(&mut &bytes[..], count, |v| numbers.push(Number(v)));
        Some(
            read.map(|()| numbers)
                .map_err(|e| Error::InvalidData(e.to_string())),
        )
    }
}
