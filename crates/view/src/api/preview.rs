//! Previews of a scene: one sample of a small picture at a time, which the page averages.

use super::{Failure, bad};
use crate::picture::Picture;
use crate::server::{Response, Status};
use io::{Diagnostics, Loaded};
use serde::Deserialize;
use serde_json::Value;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use transport::Film;
use transport::film::{FilmSpec, FilmWindow};
use transport::render::{Handle, RenderOptions, render_watched};
use transport::scene::{Scene, SceneProblem};
use transport::sensor::Camera;

/// Largest number of pixels of a picture.
const MAX_PIXELS: usize = 1 << 18;
/// Time after which a sample ends without a result.
const TIME_LIMIT: Duration = Duration::from_secs(10);
/// Estimators in the order of preference, unless the page names one: a scene may rule out the first.
const ESTIMATORS: [&str; 2] = ["preview", "path"];

/// Request for a sample of a picture.
#[derive(Deserialize)]
struct PictureRequest {
    /// Name of the page.
    page: String,
    /// Width and height in pixels.
    size: [usize; 2],
    /// Number of the sample.
    number: u64,
    /// Place of the camera; `None` for the camera of the scene.
    camera: Option<CameraRequest>,
    /// Name of the estimator; `None` for previews.
    estimator: Option<String>,
}

/// Pinhole camera. `fov` is the full horizontal angle in degrees.
#[derive(Deserialize)]
struct CameraRequest {
    from: [f64; 3],
    to: [f64; 3],
    up: [f64; 3],
    fov: f64,
}

/// Picture that is being made: the name of its page, and its handle.
static RUNNING: Mutex<Option<(String, Arc<Handle>)>> = Mutex::new(None);

/// Turn to make a picture, one at a time, until it is dropped.
struct Turn(Arc<Handle>);

impl Turn {
    /// Takes the turn of a page, and ends the picture that the page wanted before. Returns `None`
    /// while a picture of another page is being made.
    fn take(page: &str) -> Option<Self> {
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        match &*running {
            Some((other, handle)) if other == page => handle.end_now(),
            Some(_) => return None,
            None => {}
        }
        let handle = Arc::new(Handle::default());
        *running = Some((page.to_owned(), handle.clone()));
        Some(Turn(handle))
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        let mut running = RUNNING.lock().unwrap_or_else(PoisonError::into_inner);
        let is_own = |(_, handle): &(String, Arc<Handle>)| Arc::ptr_eq(handle, &self.0);
        if running.as_ref().is_some_and(is_own) {
            *running = None;
        }
    }
}

/// Responds with a sample of a picture: the exposure in stops, then red, green and blue of each
/// pixel. The response is empty if the page wants another picture by now. A page asks again while
/// another page's picture is being made.
pub(super) fn picture(loaded: &Loaded, body: &Value) -> Result<Response, Failure> {
    let request = PictureRequest::deserialize(body).map_err(bad)?;
    let busy = || {
        let message = "another page's picture is being made";
        (Status::TooManyRequests, message.to_owned())
    };
    let turn = Turn::take(&request.page).ok_or_else(busy)?;
    let [width, height] = request.size;
    let pixels = width.checked_mul(height);
    if !pixels.is_some_and(|pixels| (1..=MAX_PIXELS).contains(&pixels)) {
        return Err(bad(format!("size: from 1 to {MAX_PIXELS} pixels")));
    }
    let groups = loaded.groups.iter().map(|scene| seen(scene, &request));
    let groups = groups.collect::<Result<Vec<Scene>, Failure>>()?;
    let Some(film) = sample(loaded, &groups, &request, &turn.0)? else {
        return Ok(Response::floats(Vec::new()));
    };
    let picture = Picture::of_film(&film, &loaded.channel_names);
    let shown = picture.focused("").map_err(bad)?.on_screen();
    let shown = shown.ok_or_else(|| bad("the picture has no colours"))?;
    let mut values = vec![picture.exposure() as f32];
    values.extend(shown.pixels.iter().flatten());
    Ok(Response::floats(values))
}

/// Returns a scene with the requested camera and size of the picture.
fn seen(scene: &Scene, request: &PictureRequest) -> Result<Scene, Failure> {
    let [width, height] = request.size;
    let film = scene.film();
    let (sensor, window) = match &request.camera {
        Some(view) => {
            let camera = Camera::perspective(view.from, view.to, view.fov).with_up(view.up);
            let sensor = camera.sensor(width as f64 / height as f64).map_err(bad)?;
            (sensor, None)
        }
        None => {
            let scale = [
                width as f64 / film.width as f64,
                height as f64 / film.height as f64,
            ];
            let window = film.window.map(|window| shrunk(&window, scale));
            (scene.sensor().clone(), window)
        }
    };
    let film = FilmSpec {
        width,
        height,
        window,
        ..*film
    };
    let refused = |problems: Vec<SceneProblem>| {
        let problem = problems.into_iter().next();
        bad(problem.map(|p| p.message).unwrap_or_default())
    };
    scene.seen_by(sensor, film).map_err(refused)
}

/// Returns the place of a picture on the image of its sensor, for a picture of another size.
fn shrunk(window: &FilmWindow, scale: [f64; 2]) -> FilmWindow {
    let image = [0, 1].map(|i| (window.image[i] as f64 * scale[i]).round().max(1.0) as usize);
    FilmWindow {
        image,
        corner: [0, 1].map(|i| window.corner[i] * scale[i]),
    }
}

/// Renders one sample. Returns `None` if the handle has ended it.
fn sample(
    loaded: &Loaded,
    groups: &[Scene],
    request: &PictureRequest,
    handle: &Handle,
) -> Result<Option<Film>, Failure> {
    let renderer = match &request.estimator {
        Some(name) => {
            let refused = |problems: Diagnostics| {
                let first = problems.first_error();
                bad(first.map(|one| one.message.as_str()).unwrap_or_default())
            };
            loaded.renderer_named(name).map_err(refused)?
        }
        None => {
            let named = |name: &&str| loaded.renderer_named(name).ok();
            let named = ESTIMATORS.iter().find_map(named);
            named.ok_or_else(|| bad("the scene shows quantities of rays, not light"))?
        }
    };
    let mut options = RenderOptions::new(renderer.renderer, 1, 0);
    options.first = request.number;
    options.hide_emitters = loaded.hide_emitters;
    let is_late = AtomicBool::new(false);
    let (done, ended) = channel::<()>();
    let rendering = std::thread::scope(|scope| {
        let is_late = &is_late;
        scope.spawn(move || {
            if ended.recv_timeout(TIME_LIMIT) == Err(RecvTimeoutError::Timeout) {
                is_late.store(true, Ordering::Relaxed);
                handle.end_now();
            }
        });
        let rendering = render_watched(groups, &options, handle, |_| {
            std::ops::ControlFlow::Continue(())
        });
        drop(done);
        rendering
    });
    if is_late.load(Ordering::Relaxed) {
        return Err(bad("a sample of this picture takes more than ten seconds"));
    }
    Ok((rendering.film.count(0) > 0).then_some(rendering.film))
}
