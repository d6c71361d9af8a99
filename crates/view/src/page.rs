//! Page of some items: its files, which are part of the program, and its interface.

use crate::api::Api;
use crate::item::Item;
use crate::server::{Request, Response};

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const ICON: &str = "image/svg+xml";
const TEXT: &str = "text/plain; charset=utf-8";

/// Makes a table of files with their media types, by their paths.
macro_rules! assets {
    ($($path:literal: $kind:ident),* $(,)?) => {
        &[$(($path, $kind, include_bytes!(concat!("../page/", $path)))),*]
    };
}

type Asset = (&'static str, &'static str, &'static [u8]);

const ASSETS: &[Asset] = assets![
    "index.html": HTML,
    "viewer.css": STYLE,
    "icon.svg": ICON,
    "api.js": SCRIPT,
    "app.js": SCRIPT,
    "axes.js": SCRIPT,
    "axes3d.js": SCRIPT,
    "canvas.js": SCRIPT,
    "colour.js": SCRIPT,
    "colourbar.js": SCRIPT,
    "controls.js": SCRIPT,
    "format.js": SCRIPT,
    "image.js": SCRIPT,
    "isolines.js": SCRIPT,
    "live.js": SCRIPT,
    "measures.js": SCRIPT,
    "plots.js": SCRIPT,
    "preview.js": SCRIPT,
    "quantities.js": SCRIPT,
    "scene.js": SCRIPT,
    "state.js": SCRIPT,
    "stage.js": SCRIPT,
    "volume.js": SCRIPT,
    "widget.js": SCRIPT,
    "vendor/three.js": SCRIPT,
    "vendor/uplot.js": SCRIPT,
    "vendor/uplot.css": STYLE,
    "vendor/LICENSES.txt": TEXT,
];

/// Page that shows some items. [`ViewServer`](crate::ViewServer) serves it over HTTP; a notebook's
/// kernel passes requests to [`Page::respond`].
#[derive(Debug)]
pub struct Page {
    api: Api,
}

/// Response to a request of the page.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageResponse {
    /// Status code of HTTP: 200 for a success.
    pub status: u16,
    /// Media type of the content.
    pub media_type: &'static str,
    /// Content; numbers are little-endian float32.
    pub content: Vec<u8>,
}

impl Page {
    /// Makes a page that shows `items` in this order.
    pub fn new(items: Vec<Item>) -> Self {
        Page {
            api: Api::new(items),
        }
    }

    /// Responds to a request that arrives without HTTP.
    ///
    /// `method` is `GET` or `POST`, `target` the path relative to the page with its query string,
    /// and `body` the JSON of a `POST`. Errors are responses with their status and a message.
    ///
    /// # Examples
    ///
    /// ```
    /// let page = view::Page::new(Vec::new());
    /// let response = page.respond("GET", "api/items", Vec::new());
    /// assert_eq!((response.status, &response.content[..]), (200, &b"[]"[..]));
    /// ```
    pub fn respond(&self, method: &str, target: &str, body: Vec<u8>) -> PageResponse {
        let response = match Request::local(method, target, body) {
            Ok(request) => self.answer(&request, &request.path),
            Err(status) => Response::refusal(status),
        };
        PageResponse {
            status: response.status.code(),
            media_type: response.kind,
            content: response.body.into_bytes(),
        }
    }

    pub(crate) fn answer(&self, request: &Request, path: &str) -> Response {
        asset(path).unwrap_or_else(|| self.api.answer(request, path))
    }
}

/// Returns the file at a path after the token, if the page has it. Only the table is searched,
/// never the file system.
fn asset(path: &str) -> Option<Response> {
    let name = match path {
        "" => "index.html",
        path => path,
    };
    let found = ASSETS.iter().find(|(path, ..)| *path == name);
    found.map(|(_, kind, bytes)| Response::text(kind, *bytes))
}

/// Returns the `Content-Security-Policy`: the page loads only its own files, and no other page may
/// show it in a frame, unless pages of this machine may.
pub(crate) fn policy(may_be_framed: bool) -> String {
    let frames = if may_be_framed {
        "http://localhost:* http://127.0.0.1:* vscode-webview:"
    } else {
        "'none'"
    };
    format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors {frames}"
    )
}
