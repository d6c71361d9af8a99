//! The page: its files are part of the program.

use crate::server::Response;

const HTML: &str = "text/html; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const STYLE: &str = "text/css; charset=utf-8";
const ICON: &str = "image/svg+xml";
const TEXT: &str = "text/plain; charset=utf-8";

/// A table of files with their kinds, by their paths.
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

/// The file at a path below the token, if the page has it: only the table is looked at, never the file system.
pub(crate) fn asset(path: &str) -> Option<Response> {
    let name = match path {
        "" => "index.html",
        path => path,
    };
    let found = ASSETS.iter().find(|(path, ..)| *path == name);
    found.map(|(_, kind, bytes)| Response::text(kind, *bytes))
}

/// The `Content-Security-Policy`: the page loads its own files and nothing else, and no other page holds it in a frame, unless
/// pages of this machine may.
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
