//! Interface of the page: values as binary numbers, all other data as JSON.

mod arrays;
mod difference;
mod preview;
mod rays;
mod scene;

use crate::item::{Content, Item};
use crate::server::{Method, Request, Response, Status};
use difference::Differences;
use io::arrays::Arrays;
use io::image::exr;
use io::image::white::White;
use serde_json::{Value, json};
use std::sync::{Arc, PoisonError, RwLock, RwLockReadGuard};

/// Kinds of items that a page may choose.
const IMAGE: &str = "image";
const ARRAYS: &str = "arrays";

/// Responds to the page's requests for items.
#[derive(Debug)]
pub(crate) struct Api {
    /// Items, and the problems of files that have changed.
    items: Vec<RwLock<Shown>>,
    differences: Differences,
}

/// Item, and the problem of reading its file again after a change.
#[derive(Debug)]
struct Shown {
    item: Arc<Item>,
    note: Option<String>,
}

/// Status and message of a failed request.
type Failure = (Status, String);

fn not_found(what: &str) -> Failure {
    (Status::NotFound, format!("{what}: there is none"))
}

fn bad(message: impl ToString) -> Failure {
    (Status::BadRequest, message.to_string())
}

fn json_response(value: &Value) -> Response {
    Response::text("application/json", value.to_string().into_bytes())
}

impl Api {
    pub(crate) fn new(items: Vec<Item>) -> Self {
        let shown = |item| {
            let (item, note) = (Arc::new(item), None);
            RwLock::new(Shown { item, note })
        };
        Api {
            items: items.into_iter().map(shown).collect(),
            differences: Differences::default(),
        }
    }

    /// Responds to a request for `api/items`, `api/difference`, `api/white`, or `api/NUMBER/WHAT`.
    pub(crate) fn answer(&self, request: &Request, path: &str) -> Response {
        let path: Vec<&str> = path.split('/').collect();
        let answered = match (request.method, &path[..]) {
            (Method::Get, ["api", "items"]) => Ok(json_response(&self.list())),
            (Method::Get, ["api", "difference"]) => self.difference(request),
            (Method::Get, ["api", "white"]) => white(request),
            (method, ["api", number, what]) => match self.item(number) {
                Ok(item) if method == Method::Get => get(&item, what, request),
                Ok(item) => post(&item, what, &request.body),
                Err(failure) => Err(failure),
            },
            _ => Err(not_found("page")),
        };
        answered.unwrap_or_else(|(status, message)| Response::failure(status, message))
    }

    fn item(&self, number: &str) -> Result<Arc<Item>, Failure> {
        let shown = number.parse().ok().and_then(|i: usize| self.items.get(i));
        let shown = shown.ok_or_else(|| not_found("item"))?;
        Ok(read(shown).item.clone())
    }

    /// Lists all items for a new page, after reading changed files again.
    fn list(&self) -> Value {
        let list = self.items.iter().map(|shown| {
            renew(shown);
            let shown = read(shown);
            let mut about = describe(&shown.item, "");
            about["note"] = shown.note.clone().into();
            about
        });
        list.collect()
    }

    fn difference(&self, request: &Request) -> Result<Response, Failure> {
        let picture = |name| {
            let picture = self.item(request.parameter(name))?.picture();
            picture.ok_or_else(|| not_found("image"))
        };
        self.differences
            .answer([picture("a")?, picture("b")?], request)
    }
}

/// Responds with the factors of red, green and blue for the white `of`.
fn white(request: &Request) -> Result<Response, Failure> {
    let white: White = request.parameter("of").parse().map_err(bad)?;
    Ok(json_response(&json!(white.gains())))
}

fn read(shown: &RwLock<Shown>) -> RwLockReadGuard<'_, Shown> {
    shown.read().unwrap_or_else(PoisonError::into_inner)
}

/// Reads the file of an item again if it has changed. Other requests get responses meanwhile.
fn renew(shown: &RwLock<Shown>) {
    let item = read(shown).item.clone();
    let renewed = item.renewed();
    let mut shown = shown.write().unwrap_or_else(PoisonError::into_inner);
    match renewed {
        Ok(None) => shown.note = None,
        Ok(Some(item)) => (shown.item, shown.note) = (Arc::new(item), None),
        Err(error) => {
            let note =
                format!("The file has changed and cannot be read, this is what it was: {error}");
            shown.note = Some(note);
        }
    }
}

/// Describes an item. An item of two possible kinds is described as `wanted`, or as its probable
/// kind.
fn describe(item: &Item, wanted: &str) -> Value {
    let (kind, about) = match &item.content {
        Content::Image(picture) => (IMAGE, picture.json()),
        Content::Live(live) => ("live", live.picture().map_or(Value::Null, |p| p.json())),
        Content::Array(array) if array.is_wanted(wanted) => (IMAGE, array.picture().json()),
        Content::Array(array) => (ARRAYS, arrays::describe(&array.arrays)),
        Content::Arrays(arrays) => (ARRAYS, arrays::describe(arrays)),
        Content::Scene(scene) => ("scene", scene::describe(scene)),
    };
    let other = match &item.content {
        Content::Array(_) => Some(if kind == IMAGE { ARRAYS } else { IMAGE }),
        _ => None,
    };
    json!({ "name": item.name, "kind": kind, "about": about, "other": other })
}

fn get(item: &Item, what: &str, request: &Request) -> Result<Response, Failure> {
    match (what, &item.content) {
        ("about", _) => Ok(json_response(&describe(item, request.parameter("as")))),
        ("plane", _) => {
            let picture = item.picture().ok_or_else(|| not_found("image"))?;
            let plane = picture.plane(request.parameter("layer"), request.parameter("channel"));
            let plane = plane.ok_or_else(|| not_found("channel"))?;
            let all = 0..plane.len();
            Ok(Response::shared_floats(plane, all))
        }
        ("screen", _) => {
            let picture = item.picture().ok_or_else(|| not_found("image"))?;
            let layer = picture.focused(request.parameter("layer")).map_err(bad)?;
            let shown = layer.on_screen().ok_or_else(|| not_found("layer"))?;
            let planes = (0..3).flat_map(|c| shown.pixels.iter().map(move |p| p[c]));
            Ok(Response::floats(planes.collect()))
        }
        ("image.exr", _) => {
            let picture = item.picture().ok_or_else(|| not_found("image"))?;
            let bytes = exr::encode(&picture.whole()).map_err(bad)?;
            Ok(Response::text("image/x-exr", bytes))
        }
        ("status", Content::Live(live)) => Ok(json_response(&live.status())),
        ("array" | "edges" | "range", Content::Arrays(arrays)) => part(arrays, what, request),
        ("array" | "edges" | "range", Content::Array(array)) => part(&array.arrays, what, request),
        ("index", Content::Scene(scene)) => {
            scene::index(&scene.loaded, request.parameter("medium"))
        }
        ("mesh", Content::Scene(scene)) => scene::mesh(&scene.loaded, request.parameter("object")),
        _ => Err(not_found(what)),
    }
}

/// Responds with values, edges or the range of an array.
fn part(arrays: &Arrays, what: &str, request: &Request) -> Result<Response, Failure> {
    match what {
        "edges" => arrays::edges(arrays, request),
        "range" => arrays::range(arrays, request),
        _ => arrays::answer(arrays, request),
    }
}

fn post(item: &Item, what: &str, body: &[u8]) -> Result<Response, Failure> {
    let body: Value = serde_json::from_slice(body).map_err(bad)?;
    match (what, &item.content) {
        ("command", Content::Live(live)) => {
            let name = body["name"].as_str().unwrap_or_default();
            if live.command(name) {
                Ok(json_response(&live.status()))
            } else {
                Err(bad(format!(
                    "'{name}' is no command: stop, pause or continue"
                )))
            }
        }
        (_, Content::Scene(scene)) => {
            let question = match what {
                "trace" => rays::trace,
                "connect" => rays::connect,
                "picture" => preview::picture,
                _ => return Err(not_found(what)),
            };
            let changes = body["changes"].as_object().cloned().unwrap_or_default();
            question(&*scene.with(&changes).map_err(bad)?, &body)
        }
        _ => Err(not_found(what)),
    }
}
