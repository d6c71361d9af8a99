//! What a page shows.

use crate::live::Live;
use crate::picture::Picture;
use io::arrays::Arrays;
use io::image::ImageLayers;
use io::volume::Format;
use io::{Diagnostics, FileError, Limits, LoadOptions, Loaded};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// Whether a file is an image by its extension; an array of NumPy is one.
fn is_image(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str());
    let extension = extension.map(str::to_ascii_lowercase);
    matches!(extension.as_deref(), Some("exr" | "png" | "npy"))
}

/// One thing that a page shows.
#[derive(Debug)]
pub struct Item {
    pub(crate) name: String,
    pub(crate) content: Content,
}

/// What an [`Item`] is.
#[derive(Debug)]
pub(crate) enum Content {
    /// An image of layers.
    Image(Arc<Picture>),
    /// Readings of meters.
    Arrays(Arrays),
    /// A scene.
    Scene(Box<Loaded>),
    /// An image while it is rendered.
    Live(Arc<Live>),
}

/// How files are read.
#[derive(Clone, Debug, Default)]
pub struct ItemOptions {
    /// Values of parameters that a scene declares.
    pub defines: Vec<(String, String)>,
    /// Memory that files may take.
    pub limits: Limits,
}

/// Why a file cannot be shown.
#[derive(Debug)]
pub enum OpenError {
    /// It cannot be read.
    File(FileError),
    /// It is a scene with mistakes.
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
    /// Reads a file by its extension: an image (`.exr`, `.png`, `.npy`), readings of meters and other arrays (`.npz`, `.h5`),
    /// a volume (`.nrrd`, `.vol`, `.vti`, `.vtk`, `.vdb`, `.nii`), or else a scene.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or is not valid.
    pub fn open(path: &Path, options: &ItemOptions) -> Result<Self, OpenError> {
        let name = path.file_name().unwrap_or(path.as_os_str());
        let name = name.to_string_lossy().into_owned();
        if is_image(path) {
            let image = ImageLayers::read_within(path, options.limits);
            Ok(Item::image(name, image.map_err(OpenError::File)?))
        } else if Format::of(path).is_some() {
            let arrays = Arrays::read(path, options.limits).map_err(OpenError::File)?;
            Ok(Item::arrays(name, arrays))
        } else {
            let options = LoadOptions {
                defines: options.defines.clone(),
                limits: options.limits,
                ..LoadOptions::default()
            };
            let loaded = io::load_scene(path, &options).map_err(OpenError::Scene)?;
            Ok(Item::scene(name, loaded))
        }
    }

    /// An image.
    pub fn image(name: String, image: ImageLayers) -> Self {
        let content = Content::Image(Arc::new(Picture::of(image)));
        Item { name, content }
    }

    /// Readings of meters.
    pub fn arrays(name: String, arrays: Arrays) -> Self {
        let content = Content::Arrays(arrays);
        Item { name, content }
    }

    /// A scene.
    pub fn scene(name: String, scene: Loaded) -> Self {
        let content = Content::Scene(Box::new(scene));
        Item { name, content }
    }

    /// An image while it is rendered.
    pub fn live(name: String, live: Arc<Live>) -> Self {
        let content = Content::Live(live);
        Item { name, content }
    }

    /// The same under another name.
    #[must_use]
    pub fn named(self, name: &str) -> Self {
        Item {
            name: name.to_owned(),
            ..self
        }
    }

    /// Its image, if it has one by now.
    pub(crate) fn picture(&self) -> Option<Arc<Picture>> {
        match &self.content {
            Content::Image(picture) => Some(picture.clone()),
            Content::Live(live) => live.picture(),
            Content::Arrays(_) | Content::Scene(_) => None,
        }
    }
}
