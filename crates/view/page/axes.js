// Axes of pictures of cells: where cells are, and ticks in units around the picture.
//
// An axis is { edges, label, isUp }: the edges of its cells, ascending, and what is written beside it. Places on the canvas grow to
// the right and downwards; along an axis that grows upwards, they are the negative ones of its last cell first.

import { plain } from './format.js';

/** Room for the axes left, right, above and below a picture, in pixels. */
export const MARGINS = [72, 18, 12, 46];
/** Distance between ticks in pixels, at least. */
const BETWEEN = [70, 44];
const FONT = 12;

/** An axis of cells between `edges`. `scale` places a unit of the axis on the canvas, where axes of other units stand beside it. */
export function makeAxis(edges, label, { isUp = false, scale = 1 } = {}) {
    const places = Float64Array.from(edges, (edge) => edge * scale);
    return { label, isUp, scale, places: isUp ? places.map((v) => -v).reverse() : places };
}

/** The place of an edge; whole numbers without an axis. */
export function edgeOf(axis, i) {
    return axis ? axis.places[i] : i;
}

/** Number of the cell at a place; −1 before the first. */
export function indexAt(axis, place) {
    if (!axis) return Math.floor(place);
    let [low, high] = [0, axis.places.length];
    while (low < high) {
        const middle = (low + high) >> 1;
        if (axis.places[middle] <= place) low = middle + 1;
        else high = middle;
    }
    return low - 1;
}

/** The largest of 1, 2 and 5 times a power of ten that is at most `value`. */
export function roundBelow(value) {
    const power = 10 ** Math.floor(Math.log10(value));
    return [5, 2, 1].find((factor) => factor * power <= value) * power;
}

/** Round values, at most `count` of them, from `low` to `high`. */
export function ticks(low, high, count) {
    const rough = (high - low) / Math.max(count, 1);
    const power = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * power).find((size) => size >= rough * (1 - 1e-9));
    const first = Math.ceil(low / step - 1e-9);
    const last = Math.floor(high / step + 1e-9);
    return Array.from({ length: Math.max(last - first + 1, 0) }, (_, i) => Number(((first + i) * step).toPrecision(12)));
}

/** The ticks of an axis over what is seen of it: the value, and the pixel of the screen. */
function marks(axis, [from, to], screen, between) {
    const value = (place) => (axis.isUp ? -place : place) / axis.scale;
    const [low, high] = [value(from), value(to)].sort((a, b) => a - b);
    const place = (v) => (axis.isUp ? -v : v) * axis.scale;
    const pixels = Math.abs(screen(to) - screen(from));
    return ticks(low, high, Math.floor(pixels / between)).map((v) => [v, screen(place(v))]);
}

/** Draws both axes along the edges of what is seen of the picture. */
export function drawAxes(context, [horizontal, vertical], { inner, view, extent }) {
    const ratio = window.devicePixelRatio || 1;
    const across = (place) => inner.left + inner.width / 2 + (place - view.x) * view.zoom;
    const down = (place) => inner.top + inner.height / 2 + (place - view.y) * view.zoom;
    const seen = ([from, to], center, size) => [Math.max(from, center - size / 2 / view.zoom), Math.min(to, center + size / 2 / view.zoom)];
    const [x, y] = [seen(extent[0], view.x, inner.width), seen(extent[1], view.y, inner.height)];
    if (!(x[1] > x[0] && y[1] > y[0])) return;
    const [left, right, top, bottom] = [...x.map(across), ...y.map(down)];
    context.save();
    Object.assign(context, { font: `${FONT * ratio}px system-ui, sans-serif`, fillStyle: '#c9d0da', strokeStyle: '#6b7482', lineWidth: ratio });
    context.strokeRect(left, top, right - left, bottom - top);
    const length = 5 * ratio;
    context.textAlign = 'center';
    context.textBaseline = 'top';
    for (const [value, at] of marks(horizontal, x, across, BETWEEN[0] * ratio)) {
        line(context, [at, bottom], [at, bottom + length]);
        context.fillText(plain(value, 6), at, bottom + 1.6 * length);
    }
    context.fillText(horizontal.label, (left + right) / 2, bottom + (FONT + 12) * ratio);
    context.textAlign = 'right';
    context.textBaseline = 'middle';
    let widest = 0;
    for (const [value, at] of marks(vertical, y, down, BETWEEN[1] * ratio)) {
        line(context, [left - length, at], [left, at]);
        context.fillText(plain(value, 6), left - 1.6 * length, at);
        widest = Math.max(widest, context.measureText(plain(value, 6)).width);
    }
    context.textAlign = 'center';
    context.textBaseline = 'bottom';
    context.translate(Math.max(left - 2.6 * length - widest, FONT * 1.4 * ratio), (top + bottom) / 2);
    context.rotate(-Math.PI / 2);
    context.fillText(vertical.label, 0, 0);
    context.restore();
}

function line(context, from, to) {
    context.beginPath();
    context.moveTo(...from);
    context.lineTo(...to);
    context.stroke();
}
