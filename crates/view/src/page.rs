//! Files of the page, which are part of the program.

use crate::server::Response;

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
    "canvas.js": SCRIPT,
    "colour.js": SCRIPT,
    "controls.js": SCRIPT,
    "format.js": SCRIPT,
    "image.js": SCRIPT,
    "live.js": SCRIPT,
    "measures.js": SCRIPT,
    "plots.js": SCRIPT,
    "scene.js": SCRIPT,
    "state.js": SCRIPT,
    "stage.js": SCRIPT,
    "vendor/three.js": SCRIPT,
    "vendor/uplot.js": SCRIPT,
    "vendor/uplot.css": STYLE,
    "vendor/LICENSES.txt": TEXT,
];

/// Returns the file at a path after the token, if the page has it. Only the table is searched,
/// never the file system.
pub(crate) fn asset(path: &str) -> Option<Response> {
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
