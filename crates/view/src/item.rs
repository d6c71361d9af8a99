//! Items that a page shows.

use crate::described::DescribedScene;
use crate::live::Live;
use crate::picture::Picture;
use crate::source::Source;
use io::arrays::Arrays;
use io::image::ImageLayers;
use io::volume::Format;
use io::{Diagnostics, FileError, Limits, LoadOptions};
use std::fmt;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Returns true if a file is an image by its extension.
fn is_image(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str());
    let extension = extension.map(str::to_ascii_lowercase);
    matches!(extension.as_deref(), Some("exr" | "png"))
}

/// Item that a page shows.
#[derive(Debug)]
pub struct Item {
    pub(crate) name: String,
    pub(crate) content: Content,
    /// File from which the item was read.
    source: Option<Source>,
}

/// Content of an [`Item`].
#[derive(Debug)]
pub(crate) enum Content {
    /// An image of layers.
    Image(Arc<Picture>),
    /// Readings of meters, and other arrays.
    Arrays(Arrays),
    /// An array that may be an image.
    Array(Box<PictureArray>),
    /// A scene.
    Scene(Box<DescribedScene>),
    /// An image while it is rendered.
    Live(Arc<Live>),
}

impl Content {
    fn read(path: &Path, options: &ItemOptions) -> Result<Self, OpenError> {
        if is_image(path) {
            let image = ImageLayers::read_within(path, options.limits);
            let picture = Picture::of(image.map_err(OpenError::File)?);
            return Ok(Content::Image(Arc::new(picture)));
        }
        if let Some(format) = Format::of(path) {
            let arrays = Arrays::read(path, options.limits).map_err(OpenError::File)?;
            return Ok(match format {
                Format::Npy if PictureArray::may_be(&arrays) => {
                    let picture = OnceLock::new();
                    Content::Array(Box::new(PictureArray { arrays, picture }))
                }
                _ => Content::Arrays(arrays),
            });
        }
        let options = LoadOptions {
            defines: options.defines.clone(),
            limits: options.limits,
            ..LoadOptions::default()
        };
        let scene = DescribedScene::load(path, options).map_err(OpenError::Scene)?;
        Ok(Content::Scene(Box::new(scene)))
    }
}

/// Array of rows, columns and perhaps channels, or of other axes.
#[derive(Debug)]
pub(crate) struct PictureArray {
    pub(crate) arrays: Arrays,
    /// Image of the array, made on first access.
    picture: OnceLock<Arc<Picture>>,
}

impl PictureArray {
    /// Returns true if the arrays are an array of rows, columns and perhaps channels.
    fn may_be(arrays: &Arrays) -> bool {
        let shape = &arrays.list[0].shape;
        matches!(shape.len(), 2 | 3) && !shape.contains(&0)
    }

    /// Returns true to show the array as an image. The page may choose `image` or `arrays`;
    /// otherwise, the array must have two axes, or a third axis of 1, 3 or 4 channels.
    pub(crate) fn is_wanted(&self, kind: &str) -> bool {
        match kind {
            "image" => true,
            "arrays" => false,
            _ => matches!(self.arrays.list[0].shape[..], [_, _] | [_, _, 1 | 3 | 4]),
        }
    }

    pub(crate) fn picture(&self) -> Arc<Picture> {
        let made = || Arc::new(Picture::of_array(&self.arrays.list[0]));
        self.picture.get_or_init(made).clone()
    }
}

/// Options for reading files.
#[derive(Clone, Debug, Default)]
pub struct ItemOptions {
    /// Values of parameters that a scene declares.
    pub defines: Vec<(String, String)>,
    /// Limits of memory for files.
    pub limits: Limits,
}

/// Reason why a file cannot be shown.
#[derive(Debug)]
pub enum OpenError {
    /// The file cannot be read.
    File(FileError),
    /// The file is a scene with errors.
    Scene(Diagnostics),
}

impl fmt::Display for OpenError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            OpenError::File(error) => error.fmt(f),
            OpenError::Scene(diagnostics) => {
                f.write_str(&diagnostics.render(io::diagnostic::Style::detect(false)))
            }
        }
    }
}

impl std::error::Error for OpenError {}

impl Item {
    /// Reads a file by its extension: an image (`.exr`, `.png`), readings of meters and other
    /// arrays (`.npz`, `.h5`, `.mat`), volumes (`.nrrd`, `.vol`, `.vti`, `.vtk`, `.vdb`, `.nii`),
    /// or else a scene. A NumPy array (`.npy`) is an image if it has two axes, or a third axis of
    /// 1, 3 or 4 channels; pages can also show it as slices.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or is invalid.
    pub fn open(path: &Path, options: &ItemOptions) -> Result<Self, OpenError> {
        let name = path.file_name().unwrap_or(path.as_os_str());
        let source = Some(Source::new(path, options));
        Ok(Item {
            name: name.to_string_lossy().into_owned(),
            content: Content::read(path, options)?,
            source,
        })
    }

    /// Reads the item again, if its file has changed.
    ///
    /// # Errors
    ///
    /// A file that has changed and is no longer readable.
    pub(crate) fn renewed(&self) -> Result<Option<Self>, OpenError> {
        let Some(source) = self.source.as_ref().filter(|source| source.has_changed()) else {
            return Ok(None);
        };
        let item = Item::open(&source.path, &source.options)?;
        Ok(Some(item.named(&self.name)))
    }

    fn new(name: String, content: Content) -> Self {
        Item {
            name,
            content,
            source: None,
        }
    }

    /// Makes an item of an image.
    pub fn image(name: String, image: ImageLayers) -> Self {
        Item::new(name, Content::Image(Arc::new(Picture::of(image))))
    }

    /// Makes an item of readings of meters.
    pub fn arrays(name: String, arrays: Arrays) -> Self {
        Item::new(name, Content::Arrays(arrays))
    }

    /// Makes an item of an image that is being rendered.
    pub fn live(name: String, live: Arc<Live>) -> Self {
        Item::new(name, Content::Live(live))
    }

    /// Renames the item.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Item {
            name: name.to_owned(),
            ..self
        }
    }

    /// Returns the image of the item, if there is one yet.
    pub(crate) fn picture(&self) -> Option<Arc<Picture>> {
        match &self.content {
            Content::Image(picture) => Some(picture.clone()),
            Content::Live(live) => live.picture(),
            Content::Array(array) => Some(array.picture()),
            Content::Arrays(_) | Content::Scene(_) => None,
        }
    }
}
