//! JNIfTI files (`.jnii`, `.bnii`): the header of NIfTI and an array, as JData. MCX writes them.
//! Other JData files (`.jdt`, `.jdat`, `.jdb`): arrays by name.
//!
//! <https://github.com/NeuroJSON/jnifti/blob/master/JNIfTI_specification.md>

use std::path::Path;

use glam::{DMat3, DVec3};

use super::layout::Layout;
use super::options::choose;
use super::{AxisOrder, Format, GridData, INFLATION, Options, Sample, Volume, VolumeFrame, nifti};
use crate::binary;
use crate::error::{FileError, Problem};
use crate::input;
use crate::jdata::{AnnotatedArray, JdataForm, JdataValue, PackedArray};

/// Reads a volume. An array of JNIfTI has x as the first index. Its position comes from `Affine` if
/// `SForm` is set, else from the quaternion if `QForm` is set, else from the sizes of voxels,
/// starting at the origin. Its fourth axis contains the channels. Other files need the order of
/// axes.
///
/// # Errors
///
/// A file that cannot be read or is not JData. An array that is missing, has more than four axes,
/// or is larger than the file can justify. NaN or infinite values.
pub fn read<T: Sample>(path: &Path, options: Options) -> Result<Volume<T>, FileError> {
    let bytes = input::read(path)?;
    let size = bytes.len() as u64;
    let parsed = JdataValue::parse(&bytes);
    drop(bytes);
    parsed
        .and_then(|root| volume(&root, size, options))
        .map_err(|problem| problem.at(path))
}

/// Reads a volume from the bytes of a file.
///
/// # Errors
///
/// The errors of [`read`].
pub fn parse<T: Sample>(bytes: &[u8], options: Options) -> Result<Volume<T>, Problem> {
    volume(&JdataValue::parse(bytes)?, bytes.len() as u64, options)
}

/// Returns the names of the arrays in a file.
///
/// # Errors
///
/// A file that cannot be read or is not JData.
pub fn names(path: &Path) -> Result<Vec<String>, FileError> {
    let root = JdataValue::parse(&input::read(path)?).map_err(|problem| problem.at(path))?;
    Ok(root.arrays().into_iter().map(|(name, _)| name).collect())
}

fn volume<T: Sample>(root: &JdataValue, size: u64, options: Options) -> Result<Volume<T>, Problem> {
    let Some(data) = root.get("NIFTIData") else {
        let value = chosen(root, options.dataset)?;
        return samples(&AnnotatedArray::of(value)?, options.axes()?, size, options);
    };
    let data = match data.get("Data") {
        Some(inner) if !AnnotatedArray::is_one(data) => inner,
        _ => data,
    };
    let mut array = AnnotatedArray::of(data)?;
    array.shape = spatial(&array.shape)?;
    let order: AxisOrder = "xyzc".parse().map_err(Problem::Malformed)?;
    let volume = samples::<T>(&array, order, size, options)?;
    let nothing = JdataValue::Object(Vec::new());
    let header = Header(root.get("NIFTIHeader").unwrap_or(&nothing));
    let volume = volume.with_frame(header.frame()?).with_unit(header.unit());
    match header.scaling() {
        Some([slope, offset]) => volume.scaled(slope, offset),
        None => Ok(volume),
    }
}

/// Reads the numbers of an array whose axes have an order.
fn samples<T: Sample>(
    array: &AnnotatedArray,
    order: AxisOrder,
    size: u64,
    options: Options,
) -> Result<Volume<T>, Problem> {
    let layout = Layout::new(&array.shape, array.column_major, order)?;
    let expected = layout.count() as u64 * array.element.size() as u64;
    let found = array.stored();
    if expected > found.saturating_mul(INFLATION) {
        return Err(Problem::Truncated { expected, found });
    }
    layout.check::<T>(options.limits, size)?;
    let mut data = layout.zeros();
    let mut targets = layout.targets();
    array.each(|v| {
        if let Some(target) = targets.next() {
            data[target] = T::nearest(v);
        }
    })?;
    let volume = Volume::new(layout.size, layout.channels, data)?;
    Ok(volume.with_element(array.element))
}

/// Returns the lengths of four axes; longer arrays must have a single long axis beyond the third.
fn spatial(shape: &[usize]) -> Result<Vec<usize>, Problem> {
    let axis = |i: usize| shape.get(i).copied().unwrap_or(1);
    let beyond = shape.iter().skip(3).copied().filter(|n| *n != 1);
    let beyond: Vec<usize> = beyond.collect();
    let channels = match beyond[..] {
        [] => 1,
        [channels] => channels,
        _ => {
            let found = format!(
                "JNIfTI with more than four axes: {}",
                binary::product(shape)
            );
            return Err(Problem::Unsupported(found));
        }
    };
    Ok(vec![axis(0), axis(1), axis(2), channels])
}

fn chosen<'a>(root: &'a JdataValue, name: Option<&str>) -> Result<&'a JdataValue, Problem> {
    let mut arrays = root.arrays();
    let names: Vec<&str> = arrays.iter().map(|(name, _)| name.as_str()).collect();
    let index = choose(&names, name)?;
    Ok(arrays.swap_remove(index).1)
}

/// Header of JNIfTI.
struct Header<'a>(&'a JdataValue);

impl Header<'_> {
    fn number(&self, key: &str) -> Option<f64> {
        self.0.get(key).and_then(JdataValue::number)
    }

    /// Returns true if a code is set: a number above 0, or a name.
    fn is_set(&self, key: &str) -> bool {
        match self.0.get(key) {
            Some(JdataValue::Text(name)) => !name.is_empty(),
            _ => self.number(key).is_some_and(|code| code > 0.0),
        }
    }

    /// Returns the slope and the offset of values, unless they change nothing.
    fn scaling(&self) -> Option<[f64; 2]> {
        let slope = self.number("ScaleSlope").unwrap_or(1.0);
        let offset = self.number("ScaleOffset").unwrap_or(0.0);
        let is_scaled = slope.is_finite() && slope != 0.0 && [slope, offset] != [1.0, 0.0];
        is_scaled.then_some([slope, offset])
    }

    fn unit(&self) -> Option<String> {
        let unit = self.0.get("Unit")?.get("L")?.text()?;
        (!unit.is_empty()).then(|| unit.to_owned())
    }

    fn spacing(&self) -> DVec3 {
        let sizes = self.0.get("VoxelSize").and_then(JdataValue::numbers);
        let sizes = sizes.unwrap_or_default();
        DVec3::from_array(
            [0, 1, 2].map(|i| match sizes.get(i).copied().unwrap_or(1.0).abs() {
                0.0 => 1.0,
                length => length,
            }),
        )
    }

    /// Returns three numbers of an object.
    fn triple(&self, key: &str, names: [&str; 3]) -> DVec3 {
        let object = self.0.get(key);
        let number = |name| {
            object
                .and_then(|o| o.get(name))
                .and_then(JdataValue::number)
        };
        DVec3::from_array(names.map(|name| number(name).unwrap_or(0.0)))
    }

    /// Returns the columns of `Affine`, which must have three or four rows of four numbers.
    fn affine(&self) -> Result<[DVec3; 4], Problem> {
        let malformed = || Problem::Malformed("its Affine is not a matrix of 3 x 4 numbers".into());
        let value = self.0.get("Affine").ok_or_else(malformed)?;
        let array = AnnotatedArray::of(value)?;
        if !matches!(array.shape[..], [3 | 4, 4]) {
            return Err(malformed());
        }
        let mut numbers = Vec::with_capacity(array.count());
        array.each(|v| numbers.push(v))?;
        let rows = array.shape[0];
        let at = |i: usize, k: usize| {
            if array.column_major {
                numbers[i + rows * k]
            } else {
                numbers[4 * i + k]
            }
        };
        Ok([0, 1, 2, 3].map(|k| DVec3::new(at(0, k), at(1, k), at(2, k))))
    }

    fn frame(&self) -> Result<VolumeFrame, Problem> {
        let spacing = self.spacing();
        let by_size = VolumeFrame {
            first: DVec3::ZERO,
            steps: DMat3::from_diagonal(spacing),
            nodes: false,
        };
        let frame = if self.is_set("SForm") && self.0.get("Affine").is_some() {
            let [x, y, z, first] = self.affine()?;
            let steps = DMat3::from_cols(x, y, z);
            // MCX writes the identity for voxels of any size.
            if steps == DMat3::IDENTITY && first == DVec3::ZERO {
                by_size
            } else {
                VolumeFrame {
                    first,
                    steps,
                    nodes: false,
                }
            }
        } else if self.is_set("QForm") {
            let left = self.number("NIIQfac_").is_some_and(|v| v < 0.0);
            VolumeFrame {
                first: self.triple("QuaternOffset", ["x", "y", "z"]),
                steps: nifti::turned(self.triple("Quatern", ["b", "c", "d"]), spacing, left),
                nodes: false,
            }
        } else {
            by_size
        };
        let sound = frame.is_sound().then_some(frame);
        sound.ok_or_else(|| Problem::Malformed("its voxels have no volume".into()))
    }
}

/// Header and values of a written file.
#[derive(Clone, Debug)]
pub struct JniftiImage<'a> {
    /// Values; the first three axes of the array are x, y and z.
    pub values: PackedArray,
    /// Position of the samples.
    pub frame: VolumeFrame,
    /// Step along each axis after the third, for example the width of a time gate in seconds.
    pub steps: &'a [f64],
    /// Unit of length, if known: `m`, `mm` or `um`.
    pub unit: Option<&'a str>,
    /// Name of the array.
    pub name: &'a str,
    /// Quantity with its unit.
    pub description: &'a str,
}

impl JniftiImage<'_> {
    /// Returns the tree of the file.
    pub fn into_value(self) -> JdataValue {
        let list = |numbers: Vec<f64>| JdataValue::Numbers(numbers);
        let text = |text: &str| JdataValue::Text(text.to_owned());
        let number = |v: usize| JdataValue::Number(v as f64);
        let steps = self.frame.steps;
        let rows = [0, 1, 2].map(|i| {
            let row = steps.row(i);
            list(vec![row.x, row.y, row.z, self.frame.first[i]])
        });
        let mut sizes = self.frame.spacing().to_array().to_vec();
        sizes.extend(self.steps);
        let shape = &self.values.shape;
        let element = self.values.element;
        let header = [
            ("NIIHeaderSize", number(348)),
            ("Dim", list(shape.iter().map(|n| *n as f64).collect())),
            ("DataType", text(crate::jdata::type_name(element))),
            ("BitDepth", number(8 * element.size())),
            ("VoxelSize", list(sizes)),
            (
                "Orientation",
                JdataValue::object(["x", "y", "z"].into_iter().zip(["r", "a", "s"].map(text))),
            ),
            ("ScaleSlope", number(1)),
            ("ScaleOffset", number(0)),
            (
                "Unit",
                JdataValue::object([("L", text(self.unit.unwrap_or(""))), ("T", text("s"))]),
            ),
            ("Description", text(self.description)),
            ("QForm", number(0)),
            ("SForm", number(1)),
            ("Affine", JdataValue::List(rows.to_vec())),
            ("Name", text(self.name)),
            ("NIIFormat", text("jnifti")),
        ];
        let info = [
            ("JNIFTIVersion", text("0.5")),
            (
                "AnnotationFormat",
                text("https://neurojson.org/jnifti/draft1"),
            ),
        ];
        JdataValue::object([
            ("_DataInfo_", JdataValue::object(info)),
            ("NIFTIHeader", JdataValue::object(header)),
            ("NIFTIData", JdataValue::Packed(self.values)),
        ])
    }
}

/// Writes the first array of a grid: as JNIfTI with its position for `.jnii` and `.bnii`, with the
/// axes and units of [`nifti::write`]; else as the array with its name, with x as the first index.
///
/// # Errors
///
/// The errors of [`nifti::write`].
pub fn write<T: Sample>(path: &Path, grid: &GridData<T>) -> Result<(), FileError> {
    let value = value(path, grid).map_err(|problem| problem.at(path))?;
    value.write(path, JdataForm::of(path))
}

fn value<T: Sample>(path: &Path, grid: &GridData<T>) -> Result<JdataValue, Problem> {
    let array = grid.arrays.first();
    let array = array.ok_or_else(|| Problem::Empty("a file without an array".into()))?;
    let element = Format::Jnifti.element(grid.element);
    if Format::of(path) != Some(Format::Jnifti) {
        let mut shape = grid.size.to_vec();
        shape.extend(array.axes.iter().map(|axis| axis.len));
        let values = PackedArray::new(element, shape, true, array.by_axis(grid.size))?;
        return Ok(JdataValue::object([(
            array.name,
            JdataValue::Packed(values),
        )]));
    }
    let placed = nifti::Placed::new(grid, array)?;
    let shape = placed.shape.clone();
    let mut steps = vec![1.0; shape.len() - 3];
    if let (Some(step), Some((_, width))) = (steps.first_mut(), placed.gates()) {
        *step = width;
    }
    let image = JniftiImage {
        values: PackedArray::new(element, shape, true, placed.array.by_axis(grid.size))?,
        frame: placed.frame,
        steps: &steps,
        unit: placed.unit(),
        name: array.name,
        description: &placed.description(),
    };
    Ok(image.into_value())
}
