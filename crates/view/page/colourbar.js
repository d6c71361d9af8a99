// The bar that says which colours show which values. Dragging its ends, or the whole, sets the limits.

import * as state from './state.js';
import { scale, valueAt } from './colour.js';
import { element } from './controls.js';
import { plain } from './format.js';

const WIDTH = 256;
/** Share of the bar at each end that moves this end; the middle moves both. */
const END = 0.25;

export class ColourBar {
    constructor() {
        this.canvas = element('canvas', { width: WIDTH, height: 1, title: 'Drag an end to move this limit, the middle to move both; double-click for automatic limits', 'aria-hidden': 'true' });
        this.labels = [0, 1, 2].map(() => element('span'));
        this.element = element('div', { class: 'scale' }, this.canvas, ...this.labels);
        this.canvas.addEventListener('pointerdown', (event) => this.press(event));
        this.canvas.addEventListener('pointermove', (event) => this.held && this.drag(event));
        for (const end of ['pointerup', 'pointercancel']) this.canvas.addEventListener(end, () => { this.held = null; });
        this.canvas.addEventListener('dblclick', () => state.set({ low: null, high: null }));
    }

    /** Shows a range of values; `isFixed` if nothing is to change it. A bar without a range is hidden. */
    show({ range, scale: name, isLogarithmic, isFixed = false }) {
        this.element.hidden = range === null;
        if (range === null) return;
        Object.assign(this, { range, isLogarithmic, isFixed });
        this.canvas.classList.toggle('fixed', isFixed);
        const colours = scale(name);
        const context = this.canvas.getContext('2d');
        const image = context.createImageData(WIDTH, 1);
        for (let i = 0; i < WIDTH; i += 1) image.data.set([...colours.subarray(3 * i, 3 * i + 3), 255], 4 * i);
        context.putImageData(image, 0, 0);
        [0, 0.5, 1].forEach((t, i) => { this.labels[i].textContent = plain(valueAt(t, range, isLogarithmic), 3); });
    }

    share(event) {
        const box = this.canvas.getBoundingClientRect();
        return (event.clientX - box.left) / box.width;
    }

    press(event) {
        if (this.isFixed || event.button !== 0) return;
        this.canvas.setPointerCapture(event.pointerId);
        const at = this.share(event);
        this.held = { at, range: this.range, moves: [at < 1 - END, at > END] };
    }

    /** An end becomes the value at the pointer; colours held in the middle follow the pointer. */
    drag(event) {
        const { at, range, moves } = this.held;
        const way = this.share(event) - at;
        if (way === 0) return;
        const moved = moves[0] && moves[1] ? -way : way;
        const [low, high] = [0, 1].map((t) => valueAt(moves[t] ? t + moved : t, range, this.isLogarithmic));
        if (!(high > low) || (this.isLogarithmic && !(low > 0))) return;
        state.set({ low: Number(low.toPrecision(4)), high: Number(high.toPrecision(4)) });
    }
}
