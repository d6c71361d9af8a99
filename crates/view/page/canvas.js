// A canvas that shows pictures: zoom, a cursor, lines, pictures side by side or divided by a slider.
//
// A picture is { width, height, planes, encode, axes }: `encode(values, out, at)` writes the three bytes of a colour. Only what is
// in view is encoded. Pictures of cells have `axes`, the horizontal and the vertical one (axes.js); others have square pixels, and
// a pixel is the unit of the view.

import { MARGINS, drawAxes, edgeOf, indexAt } from './axes.js';

/** Limits of the zoom, in pixels of the screen per pixel of the picture. */
const [LEAST, MOST] = [1 / 64, 128];
/** Factor by which cells are zoomed beyond a view that fits. */
const BEYOND = 64;
/** Factor of a step of zoom. */
const STEP = 2 ** 0.25;
/** Pixels of the picture that are averaged for one of the screen, across, at most. */
const AVERAGED = 4;
/** Distance within which the slider is grasped, in pixels. */
const GRASP = 8;

/**
 * For each pixel of the screen from `from` to `to`, the `across` cells along an axis of some `length` that it shows, if `middle` shows
 * the place `at` of the picture: negative outside of it.
 */
function samples(at, from, to, middle, { zoom, across, length, axis }) {
    const found = new Int32Array((to - from) * across);
    const [first, last] = [edgeOf(axis, 0), edgeOf(axis, length)];
    for (let p = from; p < to; p += 1) {
        const center = at + (p + 0.5 - middle) / zoom;
        const isInside = center >= first && center < last;
        for (let i = 0; i < across; i += 1) {
            const place = center + ((i + 0.5) / across - 0.5) / zoom;
            found[(p - from) * across + i] = isInside ? Math.min(Math.max(indexAt(axis, place), 0), length - 1) : -1;
        }
    }
    return found;
}

export class PictureCanvas {
    /**
     * `hooks`: onCursor(x, y) after the cursor moved, onView() after the view moved, onLine([x0, y0, x1, y1]) after a line was
     * drawn, onSplit(share) after the slider moved.
     */
    constructor(parent, hooks) {
        this.element = document.createElement('canvas');
        this.element.tabIndex = 0;
        this.element.setAttribute('role', 'application');
        this.element.setAttribute('aria-label', 'Picture. Arrow keys move the cursor, plus and minus zoom, 0 fits the window, 1 shows pixels as they are.');
        parent.append(this.element);
        Object.assign(this, { hooks, pictures: [], cursor: null, line: null, split: null, isDrawing: false, isHeld: null, isCrossed: false });
        this.view = null;
        this.context = this.element.getContext('2d', { alpha: false });
        new ResizeObserver(() => this.resize()).observe(parent);
        this.element.addEventListener('wheel', (event) => this.wheel(event), { passive: false });
        this.element.addEventListener('pointerdown', (event) => this.press(event));
        this.element.addEventListener('pointermove', (event) => this.move(event));
        this.element.addEventListener('pointerup', (event) => this.release(event));
        this.element.addEventListener('keydown', (event) => this.key(event));
        this.resize();
    }

    /** Shows pictures of one size: the first, or all side by side; with `split` in [0, 1] the second right of the slider. */
    show(pictures, split = null) {
        const shape = ({ width, height, axes } = {}) => JSON.stringify([width, height, ...(axes ?? []).map((axis) => [axis.label, edgeOf(axis, 0)])]);
        const isOther = shape(this.pictures[0]) !== shape(pictures[0]);
        Object.assign(this, { pictures, split });
        if (isOther && pictures[0].axes) this.isFitted = true;
        if (isOther) this.isFitted ||= !this.view;
        if (this.isFitted) this.view = this.fitted();
        this.draw();
    }

    /** Edges of the first picture along both axes. */
    extent() {
        const { width, height, axes } = this.pictures[0];
        return [width, height].map((length, i) => [edgeOf(axes?.[i], 0), edgeOf(axes?.[i], length)]);
    }

    /** The part of a panel in which the picture is: axes take the rest. */
    inner(panel) {
        const ratio = window.devicePixelRatio || 1;
        const [left, right, top, bottom] = this.pictures[0]?.axes ? MARGINS.map((margin) => margin * ratio) : [0, 0, 0, 0];
        return {
            left: panel * this.panelWidth() + left,
            top,
            width: Math.max(this.panelWidth() - left - right, 1),
            height: Math.max(this.element.height - top - bottom, 1),
        };
    }

    /** A view of the whole picture. */
    fitted() {
        const [[x0, x1], [y0, y1]] = this.extent();
        const { width, height } = this.inner(0);
        const zoom = Math.min(width / (x1 - x0), height / (y1 - y0)) * (this.pictures[0].axes ? 1 : 0.98);
        const [least, most] = this.pictures[0].axes ? [0, Infinity] : [LEAST, MOST];
        return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, zoom: Math.min(Math.max(zoom, least), most) };
    }

    /** The smallest and the largest zoom. */
    limits() {
        if (!this.pictures[0].axes) return [LEAST, MOST];
        const { zoom } = this.fitted();
        return [zoom / BEYOND, zoom * BEYOND];
    }

    /** Shows the whole picture, also when the window changes. */
    fit() {
        this.setView(this.fitted(), true);
    }

    panels() {
        return this.split === null ? this.pictures.length : 1;
    }

    panelWidth() {
        return this.element.width / Math.max(this.panels(), 1);
    }

    resize() {
        const ratio = window.devicePixelRatio || 1;
        const [width, height] = [this.element.clientWidth, this.element.clientHeight].map((n) => Math.max(Math.round(n * ratio), 1));
        if (width === this.element.width && height === this.element.height) return;
        Object.assign(this.element, { width, height });
        if (this.isFitted && this.pictures.length > 0) this.view = this.fitted();
        this.draw();
    }

    /** The panel and the position on its picture of a place of the canvas. */
    place(event) {
        const box = this.element.getBoundingClientRect();
        const sx = (event.clientX - box.left) * this.element.width / box.width;
        const sy = (event.clientY - box.top) * this.element.height / box.height;
        const panel = Math.min(Math.floor(sx / this.panelWidth()), this.panels() - 1);
        const { x, y, zoom } = this.view;
        const { left, top, width, height } = this.inner(panel);
        return { x: x + (sx - left - width / 2) / zoom, y: y + (sy - top - height / 2) / zoom, sx, sy };
    }

    draw() {
        if (this.pictures.length === 0 || !this.view || this.isDue) return;
        this.isDue = true;
        requestAnimationFrame(() => {
            this.isDue = false;
            this.paint();
        });
    }

    paint() {
        const { width, height } = this.element;
        const image = this.context.createImageData(width, height);
        new Uint32Array(image.data.buffer).fill(0xff241f1b);
        const panels = this.panels();
        for (let panel = 0; panel < panels; panel += 1) {
            const inner = this.inner(panel);
            const [from, to] = [inner.left, inner.left + inner.width].map(Math.round);
            const border = this.split === null ? to : Math.round(width * this.split);
            this.fill(image, this.pictures[panel], [from, border], inner);
            if (this.split !== null) this.fill(image, this.pictures[1], [border, to], inner);
        }
        this.context.putImageData(image, 0, 0);
        for (let panel = 0; panel < panels; panel += 1) this.overlay(panel);
        if (this.split !== null) {
            this.context.fillStyle = '#ffffff';
            this.context.fillRect(Math.round(width * this.split) - 1, 0, 2, height);
        }
    }

    /** Encodes what columns `from` to `to` of the canvas show of a picture in the part `inner` of a panel. */
    fill(image, picture, [from, to], inner) {
        const { x, y, zoom } = this.view;
        const { width, height, planes, encode, axes } = picture;
        // Smaller pictures show averages.
        const cell = axes ? (edgeOf(axes[0], width) - edgeOf(axes[0], 0)) / width : 1;
        const across = zoom * cell >= 1 ? 1 : Math.min(Math.ceil(1 / (zoom * cell)), AVERAGED);
        const [top, bottom] = [inner.top, inner.top + inner.height].map(Math.round);
        const columns = samples(x, from, to, inner.left + inner.width / 2, { zoom, across, length: width, axis: axes?.[0] });
        const rows = samples(y, top, bottom, inner.top + inner.height / 2, { zoom, across, length: height, axis: axes?.[1] });
        const values = new Float64Array(planes.length);
        for (let py = top; py < bottom; py += 1) {
            if (rows[(py - top) * across] < 0) continue;
            for (let px = from; px < to; px += 1) {
                const first = (px - from) * across;
                if (columns[first] < 0) continue;
                for (let c = 0; c < planes.length; c += 1) {
                    const plane = planes[c];
                    let sum = 0;
                    for (let j = 0; j < across; j += 1) {
                        const row = rows[(py - top) * across + j] * width;
                        for (let i = 0; i < across; i += 1) sum += plane[row + columns[first + i]];
                    }
                    values[c] = sum / (across * across);
                }
                encode(values, image.data, 4 * (py * image.width + px));
            }
        }
    }

    /** The axes, the cursor and the line over a panel. */
    overlay(panel) {
        const { x, y, zoom } = this.view;
        const { left, top, width: across, height: down } = this.inner(panel);
        const screen = ([ix, iy]) => [left + across / 2 + (ix - x) * zoom, top + down / 2 + (iy - y) * zoom];
        const { axes } = this.pictures[panel] ?? this.pictures[0];
        if (axes) drawAxes(this.context, axes, { inner: { left, top, width: across, height: down }, view: this.view, extent: this.extent() });
        const twice = (path) => {
            for (const [style, thickness] of [['#000000', 3], ['#ffd166', 1.5]]) {
                this.context.strokeStyle = style;
                this.context.lineWidth = thickness;
                path();
            }
        };
        this.context.save();
        this.context.beginPath();
        this.context.rect(left, top, across, down);
        this.context.clip();
        if (this.line) {
            const [a, b] = [this.line.slice(0, 2), this.line.slice(2)].map(([u, v]) => screen([u + 0.5, v + 0.5]));
            twice(() => {
                this.context.beginPath();
                this.context.moveTo(...a);
                this.context.lineTo(...b);
                this.context.stroke();
            });
        }
        const { width, height } = this.pictures[0];
        if (this.cursor && this.cursor[0] < width && this.cursor[1] < height) {
            const corner = (k) => screen([0, 1].map((i) => edgeOf(axes?.[i], this.cursor[i] + k)));
            const [[u0, v0], [u1, v1]] = [corner(0), corner(1)];
            const [w, h] = [Math.max(u1 - u0, 5), Math.max(v1 - v0, 5)];
            twice(() => this.context.strokeRect((u0 + u1 - w) / 2, (v0 + v1 - h) / 2, w, h));
            if (this.isCrossed) this.cross([(u0 + u1) / 2, (v0 + v1) / 2], [w, h]);
        }
        this.context.restore();
    }

    /** Thin lines through the cell of the cursor, which leave the cell free. */
    cross([u, v], [w, h]) {
        this.context.strokeStyle = '#ffffff80';
        this.context.lineWidth = 1;
        this.context.beginPath();
        for (const sign of [-1, 1]) {
            this.context.moveTo(u + sign * w, v);
            this.context.lineTo(u + sign * 1e5, v);
            this.context.moveTo(u, v + sign * h);
            this.context.lineTo(u, v + sign * 1e5);
        }
        this.context.stroke();
    }

    setView(view, isFitted = false) {
        Object.assign(this, { view, isFitted });
        this.draw();
        this.hooks.onView();
    }

    /** Zooms by a factor about a place of the picture that stays where it is. */
    zoomBy(factor, about = this.view) {
        const [least, most] = this.limits();
        const zoom = Math.min(Math.max(this.view.zoom * factor, least), most);
        const keep = this.view.zoom / zoom;
        this.setView({ x: about.x + (this.view.x - about.x) * keep, y: about.y + (this.view.y - about.y) * keep, zoom });
    }

    wheel(event) {
        if (!this.view) return;
        event.preventDefault();
        this.zoomBy(2 ** (-event.deltaY / 400), this.place(event));
    }

    press(event) {
        if (!this.view || event.button !== 0) return;
        this.element.setPointerCapture(event.pointerId);
        const at = this.place(event);
        const isSlider = this.split !== null && Math.abs(at.sx - this.split * this.element.width) < GRASP;
        const kind = isSlider ? 'split' : this.isDrawing || event.shiftKey ? 'line' : 'pan';
        this.isHeld = { kind, start: at, view: this.view, hasMoved: false };
    }

    move(event) {
        if (!this.view) return;
        const at = this.place(event);
        const held = this.isHeld;
        if (!held) {
            this.setCursor(...this.cell(at), false);
            return;
        }
        held.hasMoved ||= Math.hypot(at.sx - held.start.sx, at.sy - held.start.sy) > 3;
        if (held.kind === 'split') {
            this.hooks.onSplit(Math.min(Math.max(at.sx / this.element.width, 0), 1));
        } else if (held.kind === 'line') {
            const { width, height } = this.pictures[0];
            const inside = (p) => this.cell(p).map((i, k) => Math.min(Math.max(i, 0), [width, height][k] - 1));
            this.line = [...inside(held.start), ...inside(at)];
            this.draw();
        } else if (held.hasMoved) {
            const { zoom } = held.view;
            this.setView({ x: held.view.x - (at.sx - held.start.sx) / zoom, y: held.view.y - (at.sy - held.start.sy) / zoom, zoom });
        }
    }

    release(event) {
        const held = this.isHeld;
        this.isHeld = null;
        if (!held) return;
        const at = this.place(event);
        if (held.kind === 'line' && this.line) this.hooks.onLine(this.line);
        else if (held.kind === 'pan' && !held.hasMoved) this.setCursor(...this.cell(at), true);
    }

    /** The cell at a place of the picture. */
    cell({ x, y }) {
        const { axes } = this.pictures[0];
        return [indexAt(axes?.[0], x), indexAt(axes?.[1], y)];
    }

    /** Moves the cursor; one that is `isSet` stays when the pointer moves on. */
    setCursor(x, y, isSet) {
        const { width, height } = this.pictures[0];
        if (x < 0 || y < 0 || x >= width || y >= height) return;
        if (isSet) {
            this.cursor = [x, y];
            this.draw();
        }
        this.hooks.onCursor(x, y, isSet);
    }

    key(event) {
        if (!this.view || event.ctrlKey || event.altKey || event.metaKey) return;
        const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
        const step = steps[event.key];
        if (step) {
            const far = event.shiftKey ? 10 : 1;
            const { width, height } = this.pictures[0];
            const [x, y] = this.cursor ?? [width, height].map((n) => Math.floor(n / 2));
            const next = this.cursor ? [x + far * step[0], y + far * step[1]] : [x, y];
            this.setCursor(Math.min(Math.max(next[0], 0), width - 1), Math.min(Math.max(next[1], 0), height - 1), true);
        } else if (event.key === '+' || event.key === '=') this.zoomBy(STEP, this.middle());
        else if (event.key === '-') this.zoomBy(1 / STEP, this.middle());
        else if (event.key === '0') this.fit();
        else if (event.key === '1' && !this.pictures[0].axes) this.setView({ ...this.view, zoom: 1 });
        else return;
        event.preventDefault();
    }

    /** What stays in place when keys zoom. */
    middle() {
        if (!this.cursor) return this.view;
        const [x, y] = this.cursor.map((cell, i) => [0, 1].reduce((sum, k) => sum + edgeOf(this.pictures[0].axes?.[i], cell + k) / 2, 0));
        return { x, y };
    }
}
