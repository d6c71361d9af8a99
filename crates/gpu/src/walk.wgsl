// Walks of particles through voxels (docs/theory.md#particles-on-a-device).
//
// Each iteration of the only loop follows one straight segment: to a face of the voxel, a collision,
// the end of a gate, or the end of a step along a curved ray. A dispatch runs a bounded number of
// iterations; the states of all threads then wait in a buffer for the next dispatch.

// True if the index varies from point to point and bends rays.
override CURVED: bool = false;

struct Params {
  size: vec3u,          // voxels along x, y, z
  rays: u32,            // number of particles
  per_length: vec3f,    // voxels per unit of length
  step: f32,            // length of a step along a curved ray
  spline_size: vec3u,   // coefficients along x, y, z
  n2_ref: f32,
  to_spline: mat4x4f,   // from positions in voxels to indices of coefficients
  gates: u32,
  gate_width: f32,
  exterior_n: f32,
  refracts: u32,
  max_depth: u32,
  rr_depth: u32,
  segments: u32,        // segments of a thread in one dispatch
  budget: u32,          // most segments of a particle
  slots: u32,           // slots of a batch: fluence, then TOTALS
  threads: u32,
}

struct Matter { n: f32, extinction: f32, albedo: f32, g: f32 }

struct Ray {
  place: vec3f, weight: f32,
  direction: vec3f, to_gate_end: f32,
  cell: vec3u, face: u32,
  key: vec2u, gate: i32, batch: u32,
}

struct State {
  place: vec3f, weight: f32,
  direction: vec3f, depth_left: f32,   // optical depth up to the collision
  cell: vec3u, is_alive: u32,
  key: vec2u, gate: i32, batch: u32,
  field: vec4f,                        // n² and its gradient along the edges of voxels
  velocity: vec3f, step_left: f32,     // velocity |v| = n after the first half of the kick
  step: f32, to_gate_end: f32, first_weight: f32, absorbed: f32,
  boosted: f32, depth: u32, events: u32, segments: u32,
}

@group(0) @binding(0) var<uniform> params: Params;
@group(0) @binding(1) var<storage, read> labels: array<u32>;      // four labels in a word
@group(0) @binding(2) var<storage, read> matter: array<Matter>;
@group(0) @binding(3) var<storage, read> spline: array<f32>;
@group(0) @binding(4) var<storage, read> rays: array<Ray>;
@group(0) @binding(5) var<storage, read_write> states: array<State>;
@group(0) @binding(6) var<storage, read_write> sums: array<atomic<u32>>;     // low and high words
@group(0) @binding(7) var<storage, read_write> counters: array<atomic<u32>>; // next particle, ended particles

const INSIDE = 6u;
const FAR = 1e30;
const ROULETTE_POWER = 0.1;
// Totals of a batch, after its fluence.
const ABSORBED = 0u;
const ESCAPED = 1u;
const CUT = 2u;
const LOST = 3u;
const ENDED = 4u;
const BOOSTED = 5u;
const LOST_PARTICLES = 6u;
const SEGMENTS = 7u;
const TOTALS = 8u;

// Random bits of an event: pcg4d (Jarzynski and Olano 2020).
fn pcg4d(a: vec4u) -> vec4u {
  var v = a * 1664525u + 1013904223u;
  v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
  v = v ^ (v >> vec4u(16u));
  v.x += v.y * v.w; v.y += v.z * v.x; v.z += v.x * v.y; v.w += v.y * v.z;
  return v;
}

// Four numbers uniform in (0, 1).
fn draw(s: ptr<function, State>) -> vec4f {
  let bits = pcg4d(vec4u((*s).key, (*s).events, 0x9e3779b9u));
  (*s).events += 1u;
  return (vec4f(bits >> vec4u(8u)) + 0.5) * (1.0 / 16777216.0);
}

fn add_words(slot: u32, low: u32, high: u32) {
  var carry = high;
  if (low != 0u) {
    let before = atomicAdd(&sums[2u * slot], low);
    carry += u32(before + low < before);
  }
  if (carry != 0u) { atomicAdd(&sums[2u * slot + 1u], carry); }
}

// Adds a value in units of 2⁻³⁰, as 64 bits in two words: the order of sums changes nothing.
fn add(slot: u32, value: f32) {
  let high = floor(value * 0.25);
  let low = (value - 4.0 * high) * 1073741824.0 + 0.5;
  add_words(slot, u32(low), u32(high));
}

fn add_total(s: ptr<function, State>, total: u32, value: f32) {
  if (value > 0.0) { add((*s).batch * params.slots + params.slots - TOTALS + total, value); }
}

fn count_total(s: ptr<function, State>, total: u32, count: u32) {
  add_words((*s).batch * params.slots + params.slots - TOTALS + total, count, 0u);
}

// Ends a particle: its remaining power goes to a total.
fn end(s: ptr<function, State>, total: u32) {
  add_total(s, total, (*s).weight);
  add_total(s, ABSORBED, (*s).absorbed);
  add_total(s, BOOSTED, (*s).boosted);
  count_total(s, SEGMENTS, (*s).segments);
  if (total == LOST) { count_total(s, LOST_PARTICLES, 1u); }
  (*s).is_alive = 0u;
  atomicAdd(&counters[1], 1u);
}

fn voxel(cell: vec3u) -> u32 {
  return cell.x + params.size.x * (cell.y + params.size.y * cell.z);
}

fn matter_of(cell: vec3u) -> Matter {
  let at = voxel(cell);
  return matter[(labels[at >> 2u] >> (8u * (at & 3u))) & 255u];
}

// n² and its gradient along the edges of voxels: a tricubic B-spline.
fn field(cell: vec3u, place: vec3f) -> vec4f {
  let at = (params.to_spline * vec4f(vec3f(cell) + place, 1.0)).xyz;
  let top = vec3f(params.spline_size) - 3.0;
  let first = clamp(floor(at), vec3f(1.0), max(top, vec3f(1.0)));
  let t = clamp(at - first, vec3f(0.0), vec3f(1.0));
  let s = 1.0 - t;
  let t2 = t * t;
  let s2 = s * s;
  let w0 = s2 * s / 6.0;
  let w1 = 2.0 / 3.0 - t2 * (1.0 - 0.5 * t);
  let w2 = 2.0 / 3.0 - s2 * (1.0 - 0.5 * s);
  let w3 = t2 * t / 6.0;
  let d0 = -0.5 * s2;
  let d1 = t * (1.5 * t - 2.0);
  let d2 = s * (2.0 - 1.5 * s);
  let d3 = 0.5 * t2;
  let wx = vec4f(w0.x, w1.x, w2.x, w3.x);
  let dx = vec4f(d0.x, d1.x, d2.x, d3.x);
  var wy = array<f32, 4>(w0.y, w1.y, w2.y, w3.y);
  var dy = array<f32, 4>(d0.y, d1.y, d2.y, d3.y);
  var wz = array<f32, 4>(w0.z, w1.z, w2.z, w3.z);
  var dz = array<f32, 4>(d0.z, d1.z, d2.z, d3.z);
  let i = vec3u(first) - 1u;
  var sum = vec4f(0.0);
  for (var k = 0u; k < 4u; k++) {
    var plane = vec3f(0.0); // value, derivatives along u and v
    for (var j = 0u; j < 4u; j++) {
      let o = i.x + params.spline_size.x * (i.y + j + params.spline_size.y * (i.z + k));
      let c = vec4f(spline[o], spline[o + 1u], spline[o + 2u], spline[o + 3u]);
      let v = dot(c, wx);
      plane += vec3f(v * wy[j], dot(c, dx) * wy[j], v * dy[j]);
    }
    sum += vec4f(plane * wz[k], plane.x * dz[k]);
  }
  let m = params.to_spline;
  let gradient = vec3f(dot(m[0].xyz, sum.yzw), dot(m[1].xyz, sum.yzw), dot(m[2].xyz, sum.yzw));
  return vec4f(params.n2_ref + sum.x, gradient * params.per_length);
}

// Cosine and sine of 2πu, without the hardware's, which may be wrong by 5e-4.
fn turn(u: f32) -> vec2f {
  let quarter = floor(4.0 * u + 0.5);
  let a = 1.5707963267948966 * (4.0 * u - quarter);
  let a2 = a * a;
  let c = 1.0 + a2 * (-0.5 + a2 * (0.041666667 + a2 * (-0.0013888889 + a2 * 2.4801587e-5)));
  let s = a * (1.0 + a2 * (-0.16666667 + a2 * (0.008333333 + a2 * (-1.9841270e-4 + a2 * 2.7557319e-6))));
  switch (u32(quarter) & 3u) {
    case 0u: { return vec2f(c, s); }
    case 1u: { return vec2f(-s, c); }
    case 2u: { return vec2f(-c, -s); }
    default: { return vec2f(s, -c); }
  }
}

// Scatters a unit direction by the Henyey–Greenstein phase function, without cancellation at small g.
fn scatter(d: vec3f, g: f32, u: vec2f) -> vec3f {
  let s = 2.0 * u.x - 1.0;
  let q = 1.0 + g * s;
  let c = clamp((s + g * (0.5 * (s * s + 3.0) + g * (s + 0.5 * g * (s * s - 1.0)))) / (q * q), -1.0, 1.0);
  let sine = sqrt(max(0.0, 1.0 - c * c));
  let sign_z = select(-1.0, 1.0, d.z >= 0.0);
  let a = -1.0 / (sign_z + d.z);
  let b = d.x * d.y * a;
  let e1 = vec3f(1.0 + sign_z * d.x * d.x * a, sign_z * b, -sign_z * d.x);
  let e2 = vec3f(b, sign_z + d.y * d.y * a, -d.y);
  let around = turn(u.y);
  return normalize(c * d + sine * (around.x * e1 + around.y * e2));
}

// Reflectance of a face for unpolarised light, and the cosine beyond it.
fn fresnel(cosine: f32, n: f32, n_far: f32) -> vec2f {
  let p = n * cosine;
  let q2 = (n_far - n) * (n_far + n) + p * p;
  if (q2 <= 0.0 || p <= 0.0) { return vec2f(1.0, 0.0); }
  let q = sqrt(q2);
  let a = n_far * n_far * p;
  let b = n * n * q;
  let r = vec2f((p - q) / (p + q), (a - b) / (a + b));
  return vec2f(0.5 * dot(r, r), min(q / n_far, 1.0));
}

// Reflects or refracts a ray at a face across an axis. Returns true if the ray passes the face.
fn passes(s: ptr<function, State>, axis: u32, n: f32, n_far: f32) -> bool {
  if (n == n_far || params.refracts == 0u) { return true; }
  (*s).depth += 1u;
  var d = (*s).direction;
  let cosine = d[axis];
  let face = fresnel(min(abs(cosine), 1.0), n, n_far);
  let is_through = draw(s).x >= face.x;
  if (is_through) {
    d *= n / n_far;
    d[axis] = select(-face.y, face.y, cosine > 0.0);
    d = normalize(d);
  } else {
    d[axis] = -cosine;
  }
  (*s).direction = d;
  (*s).step_left = 0.0;
  return is_through;
}

fn index(s: ptr<function, State>) -> f32 {
  if (CURVED) { return sqrt((*s).field.x); }
  return matter_of((*s).cell).n;
}

// Starts a particle. Returns false if there is none left.
fn start(s: ptr<function, State>) -> bool {
  let at = atomicAdd(&counters[0], 1u);
  if (at >= params.rays) { return false; }
  let ray = rays[at];
  (*s).place = ray.place;
  (*s).weight = ray.weight;
  (*s).first_weight = ray.weight;
  (*s).direction = ray.direction;
  (*s).cell = ray.cell;
  (*s).key = ray.key;
  (*s).gate = ray.gate;
  (*s).batch = ray.batch;
  (*s).to_gate_end = ray.to_gate_end;
  (*s).step_left = 0.0;
  (*s).absorbed = 0.0;
  (*s).boosted = 0.0;
  (*s).depth = 0u;
  (*s).events = 0u;
  (*s).segments = 0u;
  (*s).is_alive = 1u;
  (*s).depth_left = -log(draw(s).x);
  if (CURVED) { (*s).field = field(ray.cell, ray.place); }
  if (ray.face != INSIDE && !passes(s, ray.face / 2u, params.exterior_n, index(s))) { end(s, ESCAPED); }
  return true;
}

// Begins a step of the leapfrog: half of the kick dv/dσ = ∇n²/2, with dσ = ds/n.
fn begin_step(s: ptr<function, State>, extinction: f32) {
  let n = sqrt((*s).field.x);
  let free = select(FAR, (*s).depth_left / extinction, extinction > 0.0);
  (*s).step = min(params.step, free);
  (*s).step_left = (*s).step;
  // Planted error "kicks of curved rays on a GPU twice as strong", found by morgana-gpu/gpu::rays::they_take_the_same_voxels:
  // (*s).velocity = n * (*s).direction + (0.5 * (*s).step / n) * (*s).field.yzw;
  (*s).velocity = n * (*s).direction + (0.25 * (*s).step / n) * (*s).field.yzw;
  (*s).direction = normalize((*s).velocity);
}

// Ends a step, perhaps before its end: the rest of the kick for the length that was walked.
fn end_step(s: ptr<function, State>) {
  let n = sqrt((*s).field.x);
  let length = (*s).step - (*s).step_left;
  (*s).field = field((*s).cell, (*s).place);
  let v = (*s).velocity + (0.5 * (length - 0.5 * (*s).step) / n) * (*s).field.yzw;
  (*s).direction = normalize(v);
  (*s).step_left = 0.0;
}

// Absorbs and scatters a particle. May end it.
fn collide(s: ptr<function, State>, here: Matter) {
  let u = draw(s);
  (*s).depth += 1u;
  // Planted error "absorbed power on a GPU lost", found by morgana-gpu/gpu::fluence::cubes:
  // (no line)
  (*s).absorbed += (*s).weight * (1.0 - here.albedo);
  (*s).weight *= here.albedo;
  let worth = (*s).weight / (*s).first_weight;
  if ((*s).weight <= 0.0) { end(s, ENDED); return; }
  if ((*s).depth >= params.rr_depth && worth < ROULETTE_POWER) {
    if (u.z >= worth) { end(s, ENDED); return; }
    (*s).boosted += (*s).first_weight - (*s).weight;
    (*s).weight = (*s).first_weight;
  }
  (*s).direction = scatter((*s).direction, here.g, u.xy);
  (*s).depth_left = -log(u.w);
}

// Passes the face of a voxel, or is reflected. May end the particle.
fn cross_face(s: ptr<function, State>, axis: u32, here: Matter) {
  let is_upper = (*s).direction[axis] > 0.0;
  (*s).place[axis] = select(0.0, 1.0, is_upper);
  let is_last = (*s).cell[axis] == select(0u, params.size[axis] - 1u, is_upper);
  if (is_last) {
    if (CURVED) { end_step(s); }
    if (passes(s, axis, select(here.n, sqrt((*s).field.x), CURVED), params.exterior_n)) { end(s, ESCAPED); }
    return;
  }
  var next = (*s).cell;
  if (is_upper) { next[axis] += 1u; } else { next[axis] -= 1u; }
  if (!CURVED && !passes(s, axis, here.n, matter_of(next).n)) { return; }
  (*s).cell = next;
  // Planted error "voxels on a GPU entered through the wrong face", found by morgana-gpu/gpu::fluence::cubes:
  // (*s).place[axis] = select(0.0, 1.0, is_upper);
  (*s).place[axis] = select(1.0, 0.0, is_upper);
}

@compute @workgroup_size(64)
fn walk(@builtin(global_invocation_id) id: vec3u) {
  if (id.x >= params.threads) { return; }
  var s = states[id.x];
  for (var i = 0u; i < params.segments; i++) {
    if (s.is_alive == 0u) {
      if (!start(&s)) { break; }
      continue;
    }
    if (s.depth >= params.max_depth) { end(&s, CUT); continue; }
    if (s.segments >= params.budget) { end(&s, LOST); continue; }
    s.segments += 1u;
    let here = matter_of(s.cell);
    if (CURVED && s.step_left <= 0.0) { begin_step(&s, here.extinction); }
    let n = select(here.n, sqrt(s.field.x), CURVED);
    // Find the end of the segment.
    let speed = s.direction * params.per_length;
    let faces = select(-s.place, 1.0 - s.place, speed > vec3f(0.0)) / speed;
    let distances = max(select(vec3f(FAR), faces, speed != vec3f(0.0)), vec3f(0.0));
    let axis = select(select(2u, 1u, distances.y <= distances.z), 0u, distances.x <= min(distances.y, distances.z));
    let to_face = distances[axis];
    let to_collision = select(FAR, s.depth_left / here.extinction, here.extinction > 0.0);
    let to_gate_end = s.to_gate_end / n;
    let to_step_end = select(FAR, s.step_left, CURVED);
    let length = min(min(to_face, to_collision), min(to_gate_end, to_step_end));
    // Score it.
    if (s.gate >= 0 && s.gate < i32(params.gates)) {
      let slot = s.batch * params.slots + u32(s.gate) * (params.size.x * params.size.y * params.size.z) + voxel(s.cell);
      add(slot, s.weight * length);
    }
    s.place = clamp(s.place + speed * length, vec3f(0.0), vec3f(1.0));
    s.depth_left = max(s.depth_left - here.extinction * length, 0.0);
    s.to_gate_end = max(s.to_gate_end - n * length, 0.0);
    s.step_left -= length;
    // Handle the event at its end.
    if (length == to_collision) {
      if (CURVED) { end_step(&s); }
      collide(&s, here);
    } else if (length == to_face) {
      cross_face(&s, axis, here);
    } else if (length == to_gate_end) {
      s.gate += 1;
      s.to_gate_end = select(FAR, params.gate_width, s.gate < i32(params.gates));
    } else {
      end_step(&s);
    }
  }
  states[id.x] = s;
}
