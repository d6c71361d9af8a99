// The page of a scene: what is where, what the camera sees, and curved rays.

import * as api from './api.js';
import * as state from './state.js';
import { button, choice, element, number, refresh, say, settled, table, text, toggle } from './controls.js';
import { toneCurve } from './colour.js';
import { counted, plain } from './format.js';
import { roundBelow } from './axes.js';
import { isolines } from './isolines.js';
import { Preview, fill } from './preview.js';

const KEYS = [['camera', '#7ddc7d', 'what the camera sees'], ['emitter', '#ffe08a', 'emitter'], ['opaque', '#8f98a6', 'surface'], ['graded', '#4f9dff', 'medium with a varying index'], ['scattering', '#e0a050', 'medium that scatters'], ['clear', '#86c5da', 'clear medium']];
const TRACED = 0xffd166;
const BRANCHES = [0xff6b8b, 0x7ddc7d, 0x80b4ff, 0xd19cff, 0x6fe0d8, 0xffa860];

/** Media whose isolines are drawn, at most. */
const GRADED = 8;
/** Arrows along a ray, about. */
const ARROWS = 8;
/** What is typed, and how many numbers it is. */
const TYPED = [['pixel', 2, 'Pixel', '70,50'], ['from', 3, 'From', '0,0.5,-2'], ['direction', 3, 'Direction', '0,0,1'], ['to', 3, 'Point', '0,0.5,-2']];

/** Estimators of the picture. */
const ESTIMATORS = [['', 'preview'], ['path', 'path'], ['bdpt', 'bdpt'], ['particle', 'particle'], ['vcm', 'vcm']];

/** The state's name of a changed parameter. */
const changed = (name) => `set ${name}`;

/** A value of a parameter as typed: numbers with commas between them, `true` or `false`. */
function typedValue(words) {
    if (words === 'true' || words === 'false') return words === 'true';
    const parts = words.replaceAll('−', '-').split(',').map((part) => (part.trim() === '' ? Number.NaN : Number(part)));
    if (!parts.every(Number.isFinite)) return null;
    return parts.length === 1 ? parts[0] : parts;
}

const hex = (colour) => `#${colour.toString(16).padStart(6, '0')}`;
const point = (x) => x.map((v) => plain(v, 4)).join(', ');

export class ScenePage {
    constructor(stage, side, items, index) {
        Object.assign(this, { items, index, item: items[index], about: items[index].about, asked: 0, traced: null, connected: null });
        this.surface = element('div', { class: 'surface' });
        this.label = element('p', { class: 'name', 'aria-live': 'polite', hidden: true });
        this.surface.append(this.label);
        this.controls = element('div');
        this.rays = element('div', { class: 'below columns', 'aria-live': 'polite', id: 'rays', hidden: true });
        stage.append(this.surface, this.rays);
        this.parts = element('div');
        side.append(this.controls, this.parts);
        this.picture = new Preview(index, (picture, about) => this.showPicture(picture, about), (message) => say(message, true));
        this.fill();
        this.list();
        this.ready = this.build();
    }

    /** What an object looks like. */
    kind(object) {
        if (object.emitter !== null) return 'emitter';
        const medium = object.medium === null ? null : this.about.media[object.medium];
        if (!object.transparent || !medium) return object.transparent ? 'clear' : 'opaque';
        return medium.graded ? 'graded' : medium.scatters ? 'scattering' : 'clear';
    }

    async build() {
        const { objects, emitters, sensor } = this.about;
        try {
            const { Stage } = await import('./stage.js');
            if (this.isClosed) return;
            this.stage = new Stage(this.surface, (view) => state.set({ camera: view }), (name) => this.name(name));
        } catch (error) {
            // Values of rays are told all the same.
            this.surface.append(element('p', { class: 'warning' }, `The scene cannot be drawn, because this browser does not offer WebGL 2 here (${error.message}). Rays are followed all the same: their lengths and ends are listed below. Another browser, or graphics acceleration in the settings of this one, shows the picture.`));
        }
        if (this.stage) {
            await this.draw();
            this.canvas = element('canvas', { class: 'overlay picture', role: 'img', 'aria-label': 'Picture of this view', hidden: true });
            this.surface.append(this.canvas);
            this.stage.onMove = () => this.imagine();
            new ResizeObserver(() => this.imagine()).observe(this.surface);
        }
        this.isReady = true;
        await this.update();
        say([counted(objects.length, 'surface'), counted(this.about.media.length, 'medium', 'media'), counted(emitters.length, 'emitter')].join(', '));
        settled();
    }

    /** Says which object is pointed at. */
    name(name) {
        const object = this.about.objects.find((one, i) => (one.name || `object ${i}`) === name);
        const inside = object?.interior ? `, ${object.interior} inside` : '';
        this.label.textContent = name && `${name}${inside}`;
        this.label.hidden = name === '';
    }

    async draw() {
        const { objects, emitters, sensor } = this.about;
        const wanted = state.numbers('camera', 6);
        this.stage.setBounds(this.bounds());
        if (wanted) this.stage.setView(wanted);
        for (const emitter of emitters) if (emitter.position && !emitter.area) this.stage.addPoint(emitter.name ?? emitter.kind, emitter.position);
        if (sensor) this.stage.addCamera(sensor.rays);
        await Promise.all(objects.map((object, i) => this.add(object, i)));
        const graded = this.about.media.map((medium, i) => [medium, i]).filter(([{ graded, region }]) => graded && region);
        await Promise.all(graded.slice(0, GRADED).map(([medium, i]) => this.addIsolines(medium, i)));
    }

    /** Draws lines of equal index in three planes through the middle of a medium. */
    async addIsolines({ region, name }, i) {
        const planes = await api.floats(api.query(`${this.index}/index`, { medium: i }));
        const { pairs, low, high } = isolines(planes, region);
        if (pairs.length > 0) this.stage.addIsolines(`index of ${name || 'the surroundings'}: ${plain(low, 6)} to ${plain(high, 6)}`, pairs);
    }

    /** A box around everything. */
    bounds() {
        const { bounds, emitters, sensor } = this.about;
        const points = [...(bounds ?? []), ...emitters.map(({ position }) => position).filter(Boolean)];
        if (sensor) points.push(sensor.rays[4].origin);
        if (points.length === 0) points.push([-1, -1, -1], [1, 1, 1]);
        return [Math.min, Math.max].map((best) => [0, 1, 2].map((axis) => best(...points.map((p) => p[axis]))));
    }

    async add(object, i) {
        const name = object.name || `object ${i}`;
        if (object.box) {
            this.stage.addBox(name, object.bounds);
            return;
        }
        const buffer = await api.bytes(api.query(`${this.index}/mesh`, { object: i }));
        const [corners, triangles] = new Uint32Array(buffer, 0, 2);
        const positions = new Float32Array(buffer, 8, 3 * corners);
        this.stage.addSurface(name, positions, new Uint32Array(buffer, 8 + positions.byteLength, 3 * triangles), this.kind(object));
    }

    fill() {
        const { film, sensor, emitters } = this.about;
        const { parameters } = this.about;
        const looks = [['corner', 'corner'], ['x', 'along x'], ['y', 'along y'], ['z', 'along z']];
        const buttons = looks.map(([from, label]) => button(`From ${label}`.replace('From along', 'Along'), () => this.stage?.look(from)));
        if (sensor) buttons.push(button('As the camera', () => this.stage?.lookAs(sensor.rays, this.fieldOfView())));
        const parts = [element('h2', {}, 'View'), element('div', { class: 'buttons' }, ...buttons)];
        parts.push(toggle('Picture of this view', 'picture'), choice('Picture by', 'estimator', ESTIMATORS, ''));
        if (this.about.media.some(({ graded, region }) => graded && region)) parts.push(toggle('Lines of equal index', 'isolines', true));
        const hint = this.filmImage() < 0 ? [element('p', { class: 'note' }, 'Click in the film, or move through it by the arrow keys: the ray of that pixel is followed. The film shows a preview; an image of this size, opened together with the scene, takes its place.')] : [];
        if (sensor) parts.push(element('h2', {}, 'Ray of a pixel'), this.film(), ...hint, text('Pixel', 'pixel', `x,y below ${film.join(',')}`));
        if (parameters.length > 0) {
            const fields = parameters.map(({ name, value }) => text(name, changed(name), [value].flat().map((v) => (typeof v === 'number' ? plain(v, 6) : v)).join(', ')));
            const restore = button('As in the file', () => state.set(Object.fromEntries(parameters.map(({ name }) => [changed(name), '']))));
            const note = element('p', { class: 'note' }, 'Pictures and rays follow at once; the drawing shows the file. Three numbers of to_world are a place.');
            parts.push(element('details', { open: Object.keys(this.changes()).length > 0, id: 'parameters' }, element('summary', {}, `Parameters (${parameters.length})`), note, ...fields, restore));
        }
        parts.push(element('h2', {}, 'Ray from a point'), text('From', 'from', 'x,y,z'), text('Direction', 'direction', 'x,y,z'));
        parts.push(element('h2', {}, 'Rays to a point'));
        const targets = emitters.map((e, i) => [i, e]).filter(([, e]) => e.position).map(([i, e]) => [String(i), `emitter ${e.name ?? i} (${e.kind})`]);
        parts.push(choice('To', 'emitter', [['', 'nothing'], ...targets, ['point', 'a point']], ''), text('Point', 'to', 'x,y,z'));
        parts.push(number('Reflections', 'reflections', { min: 0, max: 4, step: 1 }, 0));
        parts.push(number('Start after', 'at', { min: 0, step: 'any', placeholder: 'its end' }, ''));
        parts.push(element('p', { class: 'note' }, 'Rays start on the ray of the pixel, where it ends or after this length; or else at the point above.'));
        this.controls.replaceChildren(...parts);
    }

    /** Parameters with values other than the file's. */
    changes() {
        const typed = this.about.parameters.map(({ name }) => [name, state.get(changed(name))]);
        return Object.fromEntries(typed.filter(([, words]) => words !== '').map(([name, words]) => [name, typedValue(words)]).filter(([, value]) => value !== null));
    }

    /** The vertical angle of the picture, in degrees. */
    fieldOfView() {
        const { rays } = this.about.sensor;
        const along = (a, b) => rays[a].direction.map((v, i) => (v + rays[b].direction[i]) / 2);
        const [top, bottom] = [along(0, 1), along(2, 3)];
        const dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
        const cosine = dot(top, bottom) / Math.sqrt(dot(top, top) * dot(bottom, bottom));
        const angle = Math.acos(Math.min(cosine, 1)) * 180 / Math.PI;
        return angle > 1 ? angle : 40;
    }

    /** The film, on which a click chooses a pixel: an image of its size, if one is there. */
    film() {
        const [width, height] = this.about.film;
        const canvas = element('canvas', { class: 'film', width, height, tabindex: 0, role: 'application', 'aria-label': 'Film: click chooses a pixel, arrow keys move it' });
        const choose = (x, y) => state.set({ pixel: `${Math.min(Math.max(x, 0), width - 1)},${Math.min(Math.max(y, 0), height - 1)}` });
        const at = (event) => {
            const box = canvas.getBoundingClientRect();
            choose(Math.floor((event.clientX - box.left) / box.width * width), Math.floor((event.clientY - box.top) / box.height * height));
        };
        canvas.addEventListener('pointerdown', (event) => {
            canvas.setPointerCapture(event.pointerId);
            at(event);
        });
        canvas.addEventListener('pointermove', (event) => event.buttons & 1 && at(event));
        canvas.addEventListener('keydown', (event) => {
            const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
            if (!step) return;
            event.preventDefault();
            const [x, y] = state.numbers('pixel', 2) ?? [Math.floor(width / 2), Math.floor(height / 2)];
            choose(x + step[0], y + step[1]);
        });
        this.filmCanvas = canvas;
        this.develop();
        return canvas;
    }

    /** Which of the things that are shown is an image of the film's size; -1 if none is. */
    filmImage() {
        const [width, height] = this.about.film;
        return this.items.findIndex(({ about }) => about?.layers && about.width === width && about.height === height);
    }

    /** Draws an image of the film's size, and the pixel. */
    async develop() {
        const [width, height] = this.about.film;
        const index = this.filmImage();
        const context = this.filmCanvas.getContext('2d');
        if (index >= 0 && !this.image) {
            const { about } = this.items[index];
            const { name: layer, channels } = about.layers.find(({ name }) => name === '') ?? about.layers[0];
            const names = ['R', 'G', 'B'].every((name) => channels.includes(name)) ? ['R', 'G', 'B'] : [channels[0], channels[0], channels[0]];
            const planes = await Promise.all(names.map((channel) => api.floats(api.query(`${index}/plane`, { layer, channel }))));
            const tone = toneCurve(about.exposure, 'srgb');
            this.image = context.createImageData(width, height);
            for (let i = 0; i < width * height; i += 1) this.image.data.set([tone(planes[0][i]), tone(planes[1][i]), tone(planes[2][i]), 255], 4 * i);
        }
        if (this.image) fill(this.filmCanvas, this.image);
        else context.clearRect(0, 0, width, height);
        const pixel = state.numbers('pixel', 2);
        if (!pixel) return;
        const size = Math.max(width / 40, 2);
        context.lineWidth = Math.max(width / 250, 1);
        context.strokeStyle = hex(TRACED);
        context.strokeRect(pixel[0] + 0.5 - size / 2, pixel[1] + 0.5 - size / 2, size, size);
    }

    /** Asks for a picture: of the view in three dimensions, or of the scene's camera, which the film shows. */
    imagine() {
        if (!this.isReady || this.isClosed) return;
        const isOfView = this.stage && state.get('picture') === '1';
        const { clientWidth, clientHeight } = this.surface;
        const needsFilm = this.about.sensor && this.filmImage() < 0;
        const view = { estimator: state.get('estimator') || null, changes: this.changes() };
        const wish = isOfView ? { ...view, camera: this.stage.eye(), size: [clientWidth, clientHeight] } : needsFilm ? { ...view, camera: null, size: this.about.film } : null;
        if (this.canvas) this.canvas.hidden = !isOfView;
        const key = JSON.stringify(wish);
        if (key === this.wish) return;
        this.wish = key;
        if (!wish) return this.picture.stop();
        const { size, ...wanted } = wish;
        this.picture.want(size, wanted);
    }

    showPicture(picture, about) {
        const isOfView = this.canvas && !this.canvas.hidden;
        if (isOfView) {
            const ratio = window.devicePixelRatio || 1;
            [this.canvas.width, this.canvas.height] = [this.surface.clientWidth * ratio, this.surface.clientHeight * ratio];
            fill(this.canvas, picture);
        } else {
            this.image = picture;
            this.develop();
        }
        document.body.dataset.picture = JSON.stringify({ ...about, isOfView });
    }

    list() {
        const { objects, media, emitters, warnings } = this.about;
        const key = (kind) => element('span', { class: 'key', style: null, 'data-kind': kind });
        const rows = objects.map((o) => [o.name, o.interior ?? '', this.kind(o)]);
        this.parts.replaceChildren(
            element('h2', {}, 'Colours'),
            ...KEYS.map(([kind, colour, label]) => {
                const swatch = key(kind);
                swatch.style.background = colour;
                return element('p', { class: 'note' }, swatch, label);
            }),
            ...warnings.map((line) => element('p', { class: 'warning' }, line)),
            element('details', {}, element('summary', {}, `${objects.length} surfaces`), element('div', { class: 'scroll' }, table(['name', 'inside', 'kind'], rows, 'Surfaces'))),
            element('details', {}, element('summary', {}, `${media.length} media`), table(['name', 'index', 'scatters'], media.map((m) => [m.name || (m.ambient ? 'ambient' : ''), m.graded ? 'varies' : 'constant', m.scatters ? 'yes' : 'no']), 'Media')),
            element('details', {}, element('summary', {}, `${emitters.length} emitters`), table(['name', 'kind', 'position'], emitters.map((e) => [e.name ?? '', e.kind, e.position ? point(e.position) : '']), 'Emitters')));
    }

    /** What the state asks of rays. */
    questions() {
        const pixel = state.numbers('pixel', 2);
        const [from, direction] = [state.numbers('from', 3), state.numbers('direction', 3)];
        const trace = pixel ? { pixel } : from && direction ? { from, direction } : null;
        const emitter = state.get('emitter');
        const to = emitter === 'point' ? { to: state.numbers('to', 3) } : emitter === '' ? null : { emitter: Number(emitter) };
        const at = state.number('at', null);
        const start = pixel ? { pixel, at } : from ? { from } : null;
        const connect = to && start && to.to !== null ? { ...start, ...to, reflections: state.number('reflections', 0) } : null;
        const changes = this.changes();
        return { trace: trace && { ...trace, changes }, connect: connect && { ...connect, changes }, wrong: this.wrong() };
    }

    /** What is wrong with what is typed. */
    wrong() {
        const wrong = TYPED.filter(([name, count]) => state.get(name) !== '' && !state.numbers(name, count));
        const words = wrong.map(([, count, label, example]) => `${label}: type ${count} numbers with commas between them, such as ${example}.`);
        for (const { name, value } of this.about.parameters) {
            const typed = state.get(changed(name));
            if (typed !== '' && typedValue(typed) === null) words.push(`${name}: type a value such as ${[value].flat().join(', ')}.`);
        }
        if (!state.get('pixel') && state.numbers('from', 3) && !state.get('direction') && state.get('emitter') === '') words.push('From: a ray needs a direction, too, or choose below where rays lead to.');
        if (state.get('emitter') === 'point' && state.get('to') === '') words.push('Point: type where rays lead to.');
        if (state.get('emitter') !== '' && !state.get('pixel') && !state.get('from')) words.push('To: choose a pixel or type a point at which rays start.');
        return words;
    }

    async update() {
        if (this.filmCanvas) this.develop();
        this.imagine();
        refresh(this.controls);
        this.stage?.setIsolines(state.get('isolines', '1') === '1');
        const questions = this.questions();
        const key = JSON.stringify(questions);
        if (key === this.key || !this.isReady) return;
        this.key = key;
        const request = (this.asked += 1);
        const ask = async (what, question) => {
            if (!question) return null;
            try {
                return await api.post(`${this.index}/${what}`, question);
            } catch (error) {
                return { error: error.message };
            }
        };
        const [traced, connected] = await Promise.all([ask('trace', questions.trace), ask('connect', questions.connect)]);
        if (request !== this.asked) return;
        this.show(traced, connected, questions.wrong);
        document.body.dataset.rays = String(request);
    }

    show(traced, connected, wrong) {
        const [lines, parts] = [[], []];
        const part = (title, ...content) => parts.push(element('div', {}, element('h2', {}, title), ...content));
        if (traced?.points) {
            const between = roundBelow(traced.optical_length / ARROWS);
            lines.push({ points: traced.points, colour: TRACED, times: traced.optical_lengths, between });
            const last = traced.points[traced.points.length - 1];
            const end = traced.surface ? `${traced.end} ${traced.surface}` : traced.end;
            const rows = [['end', end], ['at', point(last)], ['arc length', plain(traced.arc_length, 7)], ['optical length', plain(traced.optical_length, 7)], ['points', String(traced.points.length)], ['arrows', `every ${plain(between, 3)} of optical length`]];
            part('Ray', table(['quantity', 'value'], rows, 'Ray'));
        }
        if (connected?.branches) {
            const head = ['branch', 'arc length', 'optical', 'Jacobian', 'transmittance'];
            const rows = connected.branches.map((branch, i) => {
                const colour = BRANCHES[i % BRANCHES.length];
                lines.push({ points: branch.points, colour, isFaint: branch.occluded });
                const swatch = element('span', { class: 'key' });
                swatch.style.background = hex(colour);
                const name = element('span', {}, swatch, `${i + 1}${branch.occluded ? ' (blocked)' : ''}`);
                return [name, plain(branch.arc_length, 5), plain(branch.optical_length, 5), plain(branch.jacobian, 4), branch.transmittance.map((t) => plain(t, 3)).join(' ')];
            });
            const unique = connected.certified_unique ? ', certified to be the only one' : '';
            const failure = connected.failure ? [element('p', { class: 'warning' }, connected.failure)] : [];
            part(`${counted(rows.length, 'branch', 'branches')}${unique}`, element('div', { class: 'scroll' }, table(head, rows, 'Branches')), ...failure);
        }
        const messages = [...wrong, ...[traced, connected].map((answer) => answer?.error).filter(Boolean)];
        for (const message of new Set(messages)) parts.push(element('p', { class: 'warning' }, message));
        this.rays.hidden = parts.length === 0;
        this.rays.replaceChildren(...parts);
        this.stage?.setRays(lines);
    }

    close() {
        this.isClosed = true;
        this.picture.stop();
        this.stage?.close();
    }
}
