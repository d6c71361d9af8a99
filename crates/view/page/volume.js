// Readings over x, y and z as a volume that shines, or as a surface of equal values, by three.js.

import * as three from './vendor/three.js';
import { AxesOverlay } from './axes3d.js';
import { position, scale } from './colour.js';

/** Position of values below a logarithmic scale, which may be zero. */
const BELOW = -4;
/** Steps along a ray per cell, and at most. */
const [PER_CELL, STEPS] = [2, 512];
/** Number of halvings of the step in which a surface is met. */
const HALVINGS = 6;
/** Opacity of the brightest cells along the whole diagonal. */
const OPACITY = 20;
/** Resolution while the view moves. */
const COARSE = 0.5;

const VERTEX = `
out vec3 origin;
out vec3 toward;
void main() {
    origin = (inverse(modelMatrix) * vec4(cameraPosition, 1.0)).xyz;
    toward = position - origin;
    gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0);
}`;

const FRAGMENT = `
precision highp float;
precision highp sampler3D;
uniform sampler3D values;
uniform sampler2D colours;
uniform vec2 range;
uniform float level;
uniform float steps;
uniform bool isSurface;
uniform bool isSigned;
uniform vec3 extent;
in vec3 origin;
in vec3 toward;
out vec4 colour;

float valueAt(vec3 p) { return (texture(values, p + 0.5).r - range.x) / (range.y - range.x); }
vec3 colourOf(float t) { return texture(colours, vec2(clamp(t, 0.0, 1.0), 0.5)).rgb; }

vec4 surface(vec3 start, vec3 along, int count) {
    float before = valueAt(start);
    for (int i = 1; i <= count; i += 1) {
        vec3 p = start + float(i) * along;
        float here = valueAt(p);
        if ((before < level) != (here < level)) {
            vec3 a = p - along;
            vec3 b = p;
            for (int k = 0; k < ${HALVINGS}; k += 1) {
                vec3 m = 0.5 * (a + b);
                if ((valueAt(m) < level) == (before < level)) a = m; else b = m;
            }
            vec3 h = 1.0 / vec3(textureSize(values, 0));
            vec3 slope = vec3(
                valueAt(b + vec3(h.x, 0, 0)) - valueAt(b - vec3(h.x, 0, 0)),
                valueAt(b + vec3(0, h.y, 0)) - valueAt(b - vec3(0, h.y, 0)),
                valueAt(b + vec3(0, 0, h.z)) - valueAt(b - vec3(0, 0, h.z))) / (h * extent);
            float facing = abs(dot(normalize(slope + 1e-20), normalize(along * extent)));
            return vec4(colourOf(level) * (0.25 + 0.75 * facing), 1.0);
        }
        before = here;
    }
    return vec4(0.0);
}

vec4 shine(vec3 start, vec3 along, int count) {
    vec4 sum = vec4(0.0);
    float thickness = ${OPACITY.toFixed(1)} * length(along);
    for (int i = 0; i < count; i += 1) {
        float t = valueAt(start + (float(i) + 0.5) * along);
        float strength = isSigned ? abs(2.0 * t - 1.0) : t;
        float opacity = 1.0 - exp(-thickness * clamp(strength, 0.0, 1.0));
        sum += (1.0 - sum.a) * opacity * vec4(colourOf(t), 1.0);
        if (sum.a > 0.99) break;
    }
    return sum;
}

void main() {
    vec3 direction = normalize(toward);
    vec3 a = (-0.5 - origin) / direction;
    vec3 b = (0.5 - origin) / direction;
    vec3 near = min(a, b);
    vec3 far = max(a, b);
    float first = max(max(max(near.x, near.y), near.z), 0.0);
    float last = min(min(far.x, far.y), far.z);
    if (last <= first) discard;
    int count = max(int(ceil(steps * (last - first))), 2);
    vec3 along = direction * (last - first) / float(count);
    vec3 start = origin + first * direction;
    colour = isSurface ? surface(start, along, count) : shine(start, along, count);
}`;

/** Values as positions on a scale, x fastest, and the edges of cells of equal width. */
function texture(values, { order, size, range, isLogarithmic }) {
    const halves = new Uint16Array(values.length);
    let k = 0;
    for (let z = 0; z < size[2]; z += 1) for (let y = 0; y < size[1]; y += 1) for (let x = 0; x < size[0]; x += 1) {
        const value = values[x * order[0] + y * order[1] + z * order[2]];
        halves[k] = three.DataUtils.toHalfFloat(placed(value, range, isLogarithmic));
        k += 1;
    }
    const made = new three.Data3DTexture(halves, ...size);
    Object.assign(made, { format: three.RedFormat, type: three.HalfFloatType, minFilter: three.LinearFilter, magFilter: three.LinearFilter, unpackAlignment: 1, needsUpdate: true });
    return made;
}

/** The position of a value on a scale, beyond both ends, too. */
function placed(value, [low, high], isLogarithmic) {
    if (!Number.isFinite(value)) return BELOW;
    const t = isLogarithmic ? (value > 0 ? Math.log(value / low) / Math.log(high / low) : BELOW) : (value - low) / (high - low);
    return Math.min(Math.max(t, BELOW), 1e4);
}

export class Volume {
    /** `onView(text)`: after the view moved, with what `show` takes. */
    constructor(parent, onView) {
        this.parent = parent;
        this.renderer = new three.WebGLRenderer({ antialias: false });
        this.renderer.setClearColor(0x14171c);
        this.element = this.renderer.domElement;
        this.element.tabIndex = 0;
        this.element.setAttribute('role', 'application');
        this.element.setAttribute('aria-label', 'Volume in three dimensions. Arrow keys turn it, plus and minus move nearer and farther.');
        parent.append(this.element);
        this.camera = new three.PerspectiveCamera(35, 1, 0.01, 100);
        this.controls = new three.OrbitControls(this.camera, this.element);
        this.controls.addEventListener('change', () => this.draw());
        this.controls.addEventListener('start', () => { this.isMoving = true; });
        this.controls.addEventListener('end', () => this.rest());
        this.onView = onView;
        this.element.addEventListener('keydown', (event) => this.key(event));
        this.uniforms = Object.fromEntries(['values', 'colours', 'range', 'level', 'steps', 'isSurface', 'isSigned', 'extent'].map((name) => [name, { value: null }]));
        const material = new three.ShaderMaterial({ glslVersion: three.GLSL3, vertexShader: VERTEX, fragmentShader: FRAGMENT, uniforms: this.uniforms, side: three.BackSide, transparent: true, premultipliedAlpha: true });
        this.box = new three.Mesh(new three.BoxGeometry(1, 1, 1), material);
        this.scene = new three.Scene();
        this.scene.add(this.box);
        this.overlay = new AxesOverlay(parent);
        new ResizeObserver(() => this.resize()).observe(parent);
    }

    /** Shows values whose element along x, y and z is `order` elements from the next, in cells with `edges`. */
    show({ values, order, size, edges, labels, colours, level, view }) {
        const { range, isLogarithmic } = colours;
        if (values !== this.values || isLogarithmic !== this.isLogarithmic) {
            Object.assign(this, { values, isLogarithmic, stored: range });
            this.uniforms.values.value?.dispose();
            this.uniforms.values.value = texture(values, { order, size, range, isLogarithmic });
        }
        const extent = edges.map((e) => e[e.length - 1] - e[0]);
        const largest = Math.max(...extent);
        this.box.scale.set(...extent.map((length) => length / largest));
        this.overlay.setBox([0, 1].map((end) => extent.map((length) => (end - 0.5) * length / largest)), edges.map((e) => [e[0], e[e.length - 1]]), labels);
        const table = scale(colours.scale);
        const rgba = new Uint8Array(1024).map((_, i) => (i % 4 === 3 ? 255 : table[3 * (i >> 2) + (i % 4)]));
        this.uniforms.colours.value?.dispose();
        this.uniforms.colours.value = Object.assign(new three.DataTexture(rgba, 256, 1), { minFilter: three.LinearFilter, magFilter: three.LinearFilter, needsUpdate: true });
        const limits = range.map((limit) => placed(limit, this.stored, isLogarithmic));
        this.uniforms.range.value = new three.Vector2(...limits);
        this.uniforms.isSurface.value = level !== null;
        this.uniforms.level.value = level === null ? 0 : position(level, range, isLogarithmic);
        this.uniforms.isSigned.value = colours.scale === 'diverging';
        this.uniforms.extent.value = this.box.scale;
        this.uniforms.steps.value = Math.min(PER_CELL * Math.max(...size), STEPS);
        if (view) this.setView(view);
        else if (!this.isLookedAt) this.look();
        this.isLookedAt = true;
        this.resize();
    }

    look() {
        this.camera.up.set(0, 0, 1);
        this.controls.object.up.set(0, 0, 1);
        this.camera.position.set(1.6, -2.4, 1.25);
        this.controls.target.set(0, 0, 0);
        this.controls.update();
    }

    view() {
        return [...this.camera.position, ...this.controls.target].map((v) => Number(v.toPrecision(6))).join(',');
    }

    setView(numbers) {
        this.camera.up.set(0, 0, 1);
        this.camera.position.set(...numbers.slice(0, 3));
        this.controls.target.set(...numbers.slice(3));
        this.controls.update();
    }

    rest() {
        this.isMoving = false;
        this.onView(this.view());
        this.resize();
    }

    resize() {
        const [width, height] = [Math.max(this.parent.clientWidth, 1), Math.max(this.parent.clientHeight, 1)];
        this.renderer.setPixelRatio((window.devicePixelRatio || 1) * (this.isMoving ? COARSE : 1));
        this.renderer.setSize(width, height, false);
        this.camera.aspect = width / height;
        this.camera.updateProjectionMatrix();
        this.draw();
    }

    draw() {
        if (this.isDue) return;
        this.isDue = true;
        requestAnimationFrame(() => {
            this.isDue = false;
            if (!this.uniforms.values.value || this.isClosed) return;
            this.renderer.render(this.scene, this.camera);
            this.overlay.draw(this.camera);
        });
    }

    key(event) {
        const turns = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
        const offset = this.camera.position.clone().sub(this.controls.target);
        if (turns[event.key]) {
            const [around, up] = turns[event.key];
            const radius = offset.length();
            const angle = Math.atan2(offset.y, offset.x) + around;
            const height = Math.min(Math.max(Math.asin(offset.z / radius) + up, -1.5), 1.5);
            offset.set(Math.cos(height) * Math.cos(angle), Math.cos(height) * Math.sin(angle), Math.sin(height)).multiplyScalar(radius);
        } else if (event.key === '+' || event.key === '=') offset.multiplyScalar(1 / 1.15);
        else if (event.key === '-') offset.multiplyScalar(1.15);
        else return;
        event.preventDefault();
        this.camera.position.copy(this.controls.target).add(offset);
        this.controls.update();
        this.rest();
    }

    close() {
        this.isClosed = true;
        this.renderer.dispose();
        // Browsers allow few contexts, which live on until their canvas is forgotten.
        this.renderer.forceContextLoss();
    }
}
