// A scene in three dimensions, by three.js. Drawn when something changes, not all the time.

import * as three from './vendor/three.js';

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
    /** `onView(text)`: after the view moved, with what `setView` takes. */
    constructor(parent, onView) {
        this.renderer = new three.WebGLRenderer({ antialias: true });
        this.renderer.setClearColor(0x14171c);
        this.renderer.setPixelRatio(window.devicePixelRatio || 1);
        this.element = this.renderer.domElement;
        this.element.tabIndex = 0;
        this.element.setAttribute('role', 'application');
        this.element.setAttribute('aria-label', 'Scene in three dimensions. Arrow keys turn it, plus and minus move nearer and farther.');
        parent.append(this.element);
        this.scene = new three.Scene();
        this.scene.add(new three.AmbientLight(0xffffff, 1.4));
        this.light = new three.DirectionalLight(0xffffff, 1.6);
        this.scene.add(this.light);
        this.camera = new three.PerspectiveCamera(40, 1, 0.01, 1000);
        this.controls = new three.OrbitControls(this.camera, this.element);
        this.controls.addEventListener('change', () => this.draw());
        this.controls.addEventListener('end', () => onView(this.view()));
        this.onView = onView;
        this.element.addEventListener('keydown', (event) => this.key(event));
        this.objects = new three.Group();
        this.rays = new three.Group();
        this.scene.add(this.objects, this.rays);
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
        });
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

    /** Shows rays, each { points, colour, isFaint }, in place of those before. */
    setRays(rays) {
        for (const child of this.rays.children) {
            child.geometry.dispose();
            child.material.dispose();
        }
        this.rays.clear();
        // Two objects at most, since each costs a call of its own to draw.
        for (const isFaint of [false, true]) {
            const alike = rays.filter((ray) => Boolean(ray.isFaint) === isFaint && ray.points.length > 1);
            if (alike.length > 0) this.rays.add(lines(alike, isFaint));
        }
        this.draw();
    }

    key(event) {
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
