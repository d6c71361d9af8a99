// A scene in three dimensions, by three.js. Drawn when something changes, not all the time.

import * as three from './vendor/three.js';
import { AxesOverlay } from './axes3d.js';

const COLOURS = { opaque: 0x8f98a6, graded: 0x4f9dff, scattering: 0xe0a050, clear: 0x86c5da, emitter: 0xffe08a, camera: 0x7ddc7d };
/** Opacity of media, through which one looks. */
const MEDIUM = 0.16;
/** Angle between triangles whose common edge is drawn, in degrees. */
const EDGE = 25;
/** Triangles of a mesh whose edges are drawn, at most. */
const EDGED = 100000;
/** Thickness of rays in pixels; more segments than so many are one pixel wide, which is drawn ten times as fast without a graphics card. */
const THICKNESS = 2.5;
const THICK = 2000;
/** Triangles of a mesh in which the pointer searches, at most; beyond, its box has the name. */
const SEARCHED = 200000;
const HIGHLIGHT = 0xffffff;
/** Opacity of lines of equal index. */
const ISOLINE = 0.55;
/** Length of the barbs of arrows, relative to the scene. */
const BARB = 0.012;
/** Opacity of rays that something blocks. */
const FAINT = 0.4;

/** Rays as one object, each in its colour. */
function lines(rays, isFaint) {
    const [positions, colours] = [[], []];
    for (const { points, colour } of rays) {
        const { r, g, b } = new three.Color(colour);
        for (let i = 1; i < points.length; i += 1) {
            positions.push(...points[i - 1], ...points[i]);
            colours.push(r, g, b, r, g, b);
        }
    }
    const look = { vertexColors: true, transparent: isFaint, opacity: isFaint ? FAINT : 1 };
    if (positions.length <= 6 * THICK) {
        const geometry = new three.LineSegmentsGeometry().setPositions(positions).setColors(colours);
        return new three.LineSegments2(geometry, new three.LineMaterial({ ...look, linewidth: THICKNESS }));
    }
    const geometry = new three.BufferGeometry();
    for (const [name, values] of [['position', positions], ['color', colours]]) {
        geometry.setAttribute(name, new three.BufferAttribute(new Float32Array(values), 3));
    }
    return new three.LineSegments(geometry, new three.LineBasicMaterial(look));
}

export class Stage {
    /** `onView(text)`: after the view moved, with what `setView` takes; `onName(name)`: an object is pointed at, '' if none is. */
    constructor(parent, onView, onName) {
        this.renderer = new three.WebGLRenderer({ antialias: true });
        this.renderer.setClearColor(0x14171c);
        this.renderer.setPixelRatio(window.devicePixelRatio || 1);
        this.element = this.renderer.domElement;
        this.element.tabIndex = 0;
        this.element.setAttribute('role', 'application');
        this.element.setAttribute('aria-label', 'Scene in three dimensions. Arrow keys turn it, plus and minus move nearer and farther, o names one object after another.');
        parent.append(this.element);
        this.overlay = new AxesOverlay(parent);
        this.onName = onName;
        this.scene = new three.Scene();
        this.scene.add(new three.AmbientLight(0xffffff, 1.4));
        this.light = new three.DirectionalLight(0xffffff, 1.6);
        this.scene.add(this.light);
        this.camera = new three.PerspectiveCamera(40, 1, 0.01, 1000);
        this.controls = new three.OrbitControls(this.camera, this.element);
        this.controls.addEventListener('change', () => {
            this.draw();
            this.onMove?.();
        });
        this.controls.addEventListener('end', () => onView(this.view()));
        this.onView = onView;
        this.element.addEventListener('keydown', (event) => this.key(event));
        this.element.addEventListener('pointermove', (event) => event.buttons === 0 && this.hover(event));
        this.element.addEventListener('pointerleave', () => this.name(null));
        this.objects = new three.Group();
        this.rays = new three.Group();
        this.isolines = new three.Group();
        this.scene.add(this.objects, this.rays, this.isolines);
        this.parent = parent;
        new ResizeObserver(() => this.resize()).observe(parent);
        this.resize();
    }

    resize() {
        const [width, height] = [Math.max(this.parent.clientWidth, 1), Math.max(this.parent.clientHeight, 1)];
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
            this.light.position.copy(this.camera.position);
            this.renderer.render(this.scene, this.camera);
            this.overlay.draw(this.camera, this.controls.target);
        });
    }

    /** Names the object under the pointer. */
    hover(event) {
        if (this.isPointed) return;
        this.isPointed = true;
        requestAnimationFrame(() => {
            this.isPointed = false;
            const box = this.element.getBoundingClientRect();
            const at = new three.Vector2((event.clientX - box.left) / box.width * 2 - 1, 1 - (event.clientY - box.top) / box.height * 2);
            const ray = new three.Raycaster();
            ray.setFromCamera(at, this.camera);
            const distance = (group) => this.distance(ray, group);
            const found = this.objects.children.map((group) => [distance(group), group]).filter(([d]) => d < Infinity);
            // What is inside has the name, not the medium around it that one looks through.
            const size = (group) => group.userData.size ?? 0;
            const solid = found.filter(([, group]) => !group.userData.isMedium);
            const nearest = solid.reduce((a, b) => (b[0] < a[0] ? b : a), [Infinity, null]);
            const media = found.filter(([d, group]) => group.userData.isMedium && d < nearest[0]);
            const inner = media.reduce((a, b) => (!a || size(b[1]) < size(a) ? b[1] : a), null);
            this.name(inner ?? nearest[1]);
        });
    }

    /** How far a ray goes until it meets an object. */
    distance(ray, group) {
        const mesh = group.children?.find((child) => child.isMesh);
        if (!mesh) return ray.intersectObject(group, false)[0]?.distance ?? Infinity;
        if (mesh.geometry.index.count <= 3 * SEARCHED) return ray.intersectObject(mesh, false)[0]?.distance ?? Infinity;
        const place = ray.ray.intersectBox(new three.Box3().setFromObject(mesh), new three.Vector3());
        return place ? place.distanceTo(ray.ray.origin) : Infinity;
    }

    /** Emphasises an object, and says its name. */
    name(group) {
        if (group === this.named) return;
        const lines = (one) => (one?.isLineSegments ? one : one?.children?.find((child) => child.isLineSegments));
        const last = lines(this.named);
        if (last) last.material.color.set(this.namedColour);
        this.named = group;
        const next = lines(group);
        if (next) {
            this.namedColour = next.material.color.getHex();
            next.material.color.set(HIGHLIGHT);
        }
        this.onName(group?.name ?? '');
        this.draw();
    }

    /** Frames per second of `count` frames, each drawn to its end. */
    frameRate(count) {
        const gl = this.renderer.getContext();
        const pixel = new Uint8Array(4);
        const start = performance.now();
        for (let i = 0; i < count; i += 1) {
            this.renderer.render(this.scene, this.camera);
            // Waits until everything is drawn.
            gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
        }
        return 1000 * count / (performance.now() - start);
    }

    /** Shows what bounds are of: the box within which everything is. */
    setBounds([min, max]) {
        this.overlay.setBox([min, max], [0, 1, 2].map((axis) => [min[axis], max[axis]]), ['x', 'y', 'z']);
        this.center = new three.Vector3(...min).add(new three.Vector3(...max)).multiplyScalar(0.5);
        this.size = Math.max(new three.Vector3(...max).distanceTo(new three.Vector3(...min)), 1e-9);
        this.camera.near = this.size * 1e-4;
        this.camera.far = this.size * 100;
        this.controls.zoomSpeed = 1.2;
        this.look('corner');
    }

    /** Looks along an axis, or from a corner. */
    look(from) {
        const directions = { x: [1, 0, 0], y: [0.001, 1, 0.001], z: [0, 0, 1], corner: [0.6, 0.45, 0.75] };
        const direction = new three.Vector3(...directions[from]).normalize();
        this.controls.target.copy(this.center);
        this.camera.position.copy(this.center).addScaledVector(direction, this.size * 1.3);
        this.moved();
    }

    /** Looks as the scene's own camera does. */
    lookAs([, , , , middle], fov) {
        const origin = new three.Vector3(...middle.origin);
        this.camera.position.copy(origin);
        const distance = Math.max(origin.distanceTo(this.center), this.size * 0.1);
        this.controls.target.copy(origin).addScaledVector(new three.Vector3(...middle.direction), distance);
        this.camera.fov = fov;
        this.moved();
    }

    moved() {
        this.camera.updateProjectionMatrix();
        this.controls.update();
        this.onView(this.view());
        this.draw();
    }

    view() {
        return [...this.camera.position, ...this.controls.target].map((v) => Number(v.toPrecision(6))).join(',');
    }

    /** The camera of the view, as previews take it. */
    eye() {
        const { position, up, fov, aspect } = this.camera;
        const across = 2 * Math.atan(Math.tan(fov * Math.PI / 360) * aspect) * 180 / Math.PI;
        return { from: [...position], to: [...this.controls.target], up: [...up], fov: across };
    }

    setView(numbers) {
        this.camera.position.set(...numbers.slice(0, 3));
        this.controls.target.set(...numbers.slice(3));
        this.controls.update();
        this.draw();
    }

    /** A surface: its triangles, how it looks, and its name. */
    addSurface(name, positions, triangles, kind) {
        const geometry = new three.BufferGeometry();
        geometry.setAttribute('position', new three.BufferAttribute(positions, 3));
        geometry.setIndex(new three.BufferAttribute(triangles, 1));
        geometry.computeVertexNormals();
        const isMedium = kind === 'graded' || kind === 'scattering' || kind === 'clear';
        const material = new three.MeshLambertMaterial({
            color: COLOURS[kind],
            emissive: kind === 'emitter' ? 0xa08030 : 0,
            side: three.DoubleSide,
            transparent: isMedium,
            opacity: isMedium ? MEDIUM : 1,
            depthWrite: !isMedium,
            forceSinglePass: true,
        });
        const group = new three.Group();
        group.name = name;
        geometry.computeBoundingSphere();
        group.userData = { isMedium, size: geometry.boundingSphere.radius };
        group.add(new three.Mesh(geometry, material));
        if (triangles.length <= 3 * EDGED) {
            const edges = new three.EdgesGeometry(geometry, EDGE);
            group.add(new three.LineSegments(edges, new three.LineBasicMaterial({ color: COLOURS[kind], transparent: true, opacity: 0.7 })));
        }
        this.objects.add(group);
        this.draw();
        return group;
    }

    /** The edges of a box. */
    addBox(name, [min, max], colour = COLOURS.opaque) {
        const corner = (i) => [0, 1, 2].map((axis) => ((i >> axis) & 1 ? max : min)[axis]);
        const pairs = [];
        for (let i = 0; i < 8; i += 1) for (const axis of [1, 2, 4]) if (!(i & axis)) pairs.push([corner(i), corner(i | axis)]);
        return this.addLines(this.objects, name, pairs, colour);
    }

    addLines(group, name, pairs, colour) {
        const geometry = new three.BufferGeometry();
        geometry.setAttribute('position', new three.BufferAttribute(new Float32Array(pairs.flat(2)), 3));
        const lines = new three.LineSegments(geometry, new three.LineBasicMaterial({ color: colour }));
        lines.name = name;
        group.add(lines);
        this.draw();
        return lines;
    }

    /** A point, such as a small emitter. */
    addPoint(name, position, colour = COLOURS.emitter) {
        const geometry = new three.BufferGeometry();
        geometry.setAttribute('position', new three.BufferAttribute(new Float32Array(position), 3));
        const points = new three.Points(geometry, new three.PointsMaterial({ color: colour, size: 9, sizeAttenuation: false }));
        points.name = name;
        this.objects.add(points);
        return points;
    }

    /** What the camera sees: from the corners of its picture outwards. */
    addCamera(rays) {
        const length = this.size * 0.2;
        const ends = rays.map(({ origin, direction }) => [origin, origin.map((v, i) => v + length * direction[i])]);
        const around = [0, 1, 2, 3].flatMap((i) => [0, 1].map((end) => [ends[i][end], ends[(i + 1) % 4][end]]));
        return this.addLines(this.objects, 'camera', [...ends, ...around], COLOURS.camera);
    }

    /** Lines of equal index. */
    addIsolines(name, pairs) {
        const made = this.addLines(this.isolines, name, pairs, COLOURS.graded);
        Object.assign(made.material, { transparent: true, opacity: ISOLINE });
        this.draw();
    }

    setIsolines(isVisible) {
        this.isolines.visible = isVisible;
        this.draw();
    }

    /** Arrows along a ray, one each time that the optical length has grown by `between`: pairs of points of their barbs. */
    arrows({ points, times, between }) {
        const pairs = [];
        let next = between;
        for (let i = 1; i < points.length; i += 1) {
            const [a, b] = [points[i - 1], points[i]].map((p) => new three.Vector3(...p));
            const along = b.clone().sub(a).normalize();
            const side = new three.Vector3(-along.y, along.x, along.z * 0.3).cross(along).normalize();
            for (; next <= times[i]; next += between) {
                const tip = a.clone().lerp(b, (next - times[i - 1]) / (times[i] - times[i - 1] || 1));
                for (const sign of [-1, 1]) {
                    const barb = tip.clone().addScaledVector(along, -BARB * this.size).addScaledVector(side, sign * BARB * this.size / 2);
                    pairs.push([tip.toArray(), barb.toArray()]);
                }
            }
        }
        return pairs;
    }

    /** Shows rays, each { points, colour, isFaint }, in place of those before; those with `times` have arrows. */
    setRays(rays) {
        for (const child of this.rays.children) {
            child.geometry.dispose();
            child.material.dispose();
        }
        this.rays.clear();
        // Two objects at most, since each costs a call of its own to draw.
        for (const isFaint of [false, true]) {
            const alike = rays.filter((ray) => Boolean(ray.isFaint) === isFaint && ray.points.length > 1);
            const barbs = alike.filter(({ times }) => times).flatMap((ray) => this.arrows(ray).map((points) => ({ points, colour: ray.colour })));
            if (alike.length > 0) this.rays.add(lines([...alike, ...barbs], isFaint));
        }
        this.draw();
    }

    key(event) {
        if (event.key === 'o' || event.key === 'O') {
            const named = this.objects.children.filter(({ name }) => name);
            const step = event.key === 'o' ? 1 : -1;
            if (named.length > 0) this.name(named[(named.indexOf(this.named) + step + named.length + (this.named ? 0 : step < 0 ? 1 : 0)) % named.length]);
            return;
        }
        const turn = 0.1;
        const turns = { ArrowLeft: [-turn, 0], ArrowRight: [turn, 0], ArrowUp: [0, -turn], ArrowDown: [0, turn] };
        const offset = this.camera.position.clone().sub(this.controls.target);
        if (turns[event.key]) {
            const [around, up] = turns[event.key];
            const radius = offset.length();
            const theta = Math.atan2(offset.x, offset.z) + around;
            const phi = Math.min(Math.max(Math.acos(offset.y / radius) + up, 0.01), Math.PI - 0.01);
            offset.set(Math.sin(phi) * Math.sin(theta), Math.cos(phi), Math.sin(phi) * Math.cos(theta)).multiplyScalar(radius);
        } else if (event.key === '+' || event.key === '=') offset.multiplyScalar(1 / 1.15);
        else if (event.key === '-') offset.multiplyScalar(1.15);
        else return;
        event.preventDefault();
        this.camera.position.copy(this.controls.target).add(offset);
        this.moved();
    }

    close() {
        this.renderer.dispose();
        // Browsers allow few contexts, which live on until their canvas is forgotten.
        this.renderer.forceContextLoss();
    }
}
