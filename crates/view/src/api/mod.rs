//! What the page asks for: values as binary numbers, all else as JSON.

mod arrays;
mod difference;
mod rays;
mod scene;

use crate::item::{Content, Item};
use crate::server::{Method, Request, Response, Status};
use difference::Differences;
use io::image::exr;
use serde_json::{Value, json};

/// Answers the page's requests about what it shows.
#[derive(Debug)]
pub(crate) struct Api {
    items: Vec<Item>,
    differences: Differences,
}

/// Why a request has no answer, in words.
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
        Api {
            items,
            differences: Differences::default(),
        }
    }

    /// Answers a request for `api/items`, `api/difference`, or `api/NUMBER/WHAT`.
    pub(crate) fn answer(&self, request: &Request, path: &str) -> Response {
        let path: Vec<&str> = path.split('/').collect();
        let answered = match (request.method, &path[..]) {
            (Method::Get, ["api", "items"]) => Ok(json_response(&self.list())),
            (Method::Get, ["api", "difference"]) => self.difference(request),
            (method, ["api", number, what]) => match self.item(number) {
                Ok(item) if method == Method::Get => get(item, what, request),
                Ok(item) => post(item, what, &request.body),
                Err(failure) => Err(failure),
            },
            _ => Err(not_found("page")),
        };
        answered.unwrap_or_else(|(status, message)| Response::failure(status, message))
    }

    fn item(&self, number: &str) -> Result<&Item, Failure> {
        let item = number.parse().ok().and_then(|i: usize| self.items.get(i));
        item.ok_or_else(|| not_found("item"))
    }

    fn list(&self) -> Value {
        self.items.iter().map(describe).collect()
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

/// What there is of an item.
fn describe(item: &Item) -> Value {
    let (kind, about) = match &item.content {
        Content::Image(picture) => ("image", picture.json()),
        Content::Live(live) => ("live", live.picture().map_or(Value::Null, |p| p.json())),
        Content::Arrays(arrays) => ("arrays", arrays::describe(arrays)),
        Content::Scene(loaded) => ("scene", scene::describe(loaded)),
    };
    json!({ "name": item.name, "kind": kind, "about": about })
}

fn get(item: &Item, what: &str, request: &Request) -> Result<Response, Failure> {
    match (what, &item.content) {
        ("about", _) => Ok(json_response(&describe(item))),
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
        ("array", Content::Arrays(arrays)) => arrays::answer(arrays, request),
        ("mesh", Content::Scene(loaded)) => scene::mesh(loaded, request.parameter("object")),
        _ => Err(not_found(what)),
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
        ("trace", Content::Scene(loaded)) => rays::trace(loaded, &body),
        ("connect", Content::Scene(loaded)) => rays::connect(loaded, &body),
        _ => Err(not_found(what)),
    }
}
