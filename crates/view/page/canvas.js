// A canvas that shows pictures: zoom, a cursor, lines, pictures side by side or divided by a slider.
//
// A picture is { width, height, planes, encode }: `encode(values, out, at)` writes the three bytes of a colour. Only what is in
// view is encoded.

const [LEAST, MOST] = [1 / 64, 128];
/** Factor of a step of zoom. */
const STEP = 2 ** 0.25;
/** Pixels of the picture that are averaged for one of the screen, across, at most. */
const AVERAGED = 4;
/** Distance within which the slider is grasped, in pixels. */
const GRASP = 8;

/**
 * For each pixel of the screen from `from` to `to`, the `across` pixels of a picture of some `length` that it shows, if `middle` shows
 * the place `at` of the picture: negative outside of it.
 */
function samples(at, from, to, middle, { zoom, across, length }) {
    const found = new Int32Array((to - from) * across);
    for (let p = from; p < to; p += 1) {
        const center = at + (p + 0.5 - middle) / zoom;
        for (let i = 0; i < across; i += 1) {
            const pixel = Math.floor(center + ((i + 0.5) / across - 0.5) / zoom);
            const isInside = center >= 0 && center < length;
            found[(p - from) * across + i] = isInside ? Math.min(Math.max(pixel, 0), length - 1) : -1;
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
        Object.assign(this, { hooks, pictures: [], cursor: null, line: null, split: null, isDrawing: false, isHeld: null });
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
        const isOther = this.pictures[0]?.width !== pictures[0].width || this.pictures[0]?.height !== pictures[0].height;
        Object.assign(this, { pictures, split });
        if (isOther) this.isFitted ||= !this.view;
        if (this.isFitted) this.view = this.fitted();
        this.draw();
    }

    /** A view of the whole picture. */
    fitted() {
        const { width, height } = this.pictures[0];
        const zoom = Math.min(this.panelWidth() / width, this.element.height / height) * 0.98;
        return { x: width / 2, y: height / 2, zoom: Math.min(Math.max(zoom, LEAST), MOST) };
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
        const left = panel * this.panelWidth() + this.panelWidth() / 2;
        return { x: x + (sx - left) / zoom, y: y + (sy - this.element.height / 2) / zoom, sx, sy };
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
            const [from, to] = [panel, panel + 1].map((i) => Math.round(i * this.panelWidth()));
            const border = this.split === null ? to : Math.round(width * this.split);
            this.fill(image, this.pictures[panel], [from, border], (from + to) / 2);
            if (this.split !== null) this.fill(image, this.pictures[1], [border, to], (from + to) / 2);
        }
        this.context.putImageData(image, 0, 0);
        for (let panel = 0; panel < panels; panel += 1) this.overlay(panel);
        if (this.split !== null) {
            this.context.fillStyle = '#ffffff';
            this.context.fillRect(Math.round(width * this.split) - 1, 0, 2, height);
        }
    }

    /** Encodes what columns `from` to `to` of the canvas show of a picture whose view is centred at `middle`. */
    fill(image, picture, [from, to], middle) {
        const { x, y, zoom } = this.view;
        const { width, height, planes, encode } = picture;
        // Smaller pictures show averages.
        const across = zoom >= 1 ? 1 : Math.min(Math.ceil(1 / zoom), AVERAGED);
        const columns = samples(x, from, to, middle, { zoom, across, length: width });
        const rows = samples(y, 0, image.height, image.height / 2, { zoom, across, length: height });
        const values = new Float64Array(planes.length);
        for (let py = 0; py < image.height; py += 1) {
            if (rows[py * across] < 0) continue;
            for (let px = from; px < to; px += 1) {
                const first = (px - from) * across;
                if (columns[first] < 0) continue;
                for (let c = 0; c < planes.length; c += 1) {
                    const plane = planes[c];
                    let sum = 0;
                    for (let j = 0; j < across; j += 1) {
                        const row = rows[py * across + j] * width;
                        for (let i = 0; i < across; i += 1) sum += plane[row + columns[first + i]];
                    }
                    values[c] = sum / (across * across);
                }
                encode(values, image.data, 4 * (py * image.width + px));
            }
        }
    }

    /** The cursor and the line over a panel. */
    overlay(panel) {
        const { x, y, zoom } = this.view;
        const left = panel * this.panelWidth();
        const screen = ([ix, iy]) => [left + this.panelWidth() / 2 + (ix - x) * zoom, this.element.height / 2 + (iy - y) * zoom];
        const twice = (path) => {
            for (const [style, thickness] of [['#000000', 3], ['#ffd166', 1.5]]) {
                this.context.strokeStyle = style;
                this.context.lineWidth = thickness;
                path();
            }
        };
        this.context.save();
        this.context.beginPath();
        this.context.rect(left, 0, this.panelWidth(), this.element.height);
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
            const [u, v] = screen(this.cursor);
            const size = Math.max(zoom, 5);
            twice(() => this.context.strokeRect(u + (zoom - size) / 2, v + (zoom - size) / 2, size, size));
        }
        this.context.restore();
    }

    setView(view, isFitted = false) {
        Object.assign(this, { view, isFitted });
        this.draw();
        this.hooks.onView();
    }

    /** Zooms by a factor about a place of the picture that stays where it is. */
    zoomBy(factor, about = this.view) {
        const zoom = Math.min(Math.max(this.view.zoom * factor, LEAST), MOST);
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
            this.setCursor(Math.floor(at.x), Math.floor(at.y), false);
            return;
        }
        held.hasMoved ||= Math.hypot(at.sx - held.start.sx, at.sy - held.start.sy) > 3;
        if (held.kind === 'split') {
            this.hooks.onSplit(Math.min(Math.max(at.sx / this.element.width, 0), 1));
        } else if (held.kind === 'line') {
            const inside = (p) => [Math.min(Math.max(Math.floor(p.x), 0), this.pictures[0].width - 1), Math.min(Math.max(Math.floor(p.y), 0), this.pictures[0].height - 1)];
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
        else if (held.kind === 'pan' && !held.hasMoved) this.setCursor(Math.floor(at.x), Math.floor(at.y), true);
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
            const [x, y] = this.cursor ?? [Math.floor(width / 2), Math.floor(height / 2)];
            const next = this.cursor ? [x + far * step[0], y + far * step[1]] : [x, y];
            this.setCursor(Math.min(Math.max(next[0], 0), width - 1), Math.min(Math.max(next[1], 0), height - 1), true);
        } else if (event.key === '+' || event.key === '=') this.zoomBy(STEP, this.middle());
        else if (event.key === '-') this.zoomBy(1 / STEP, this.middle());
        else if (event.key === '0') this.fit();
        else if (event.key === '1') this.setView({ ...this.view, zoom: 1 });
        else return;
        event.preventDefault();
    }

    /** What stays in place when keys zoom. */
    middle() {
        return this.cursor ? { x: this.cursor[0] + 0.5, y: this.cursor[1] + 0.5 } : this.view;
    }
}
