// The page of readings of meters: lines with bands of their errors, slices and projections.

import * as api from './api.js';
import * as state from './state.js';
import { PictureCanvas } from './canvas.js';
import { SCALE_NAMES, position, scale, valueAt } from './colour.js';
import { choice, element, number, refill, refresh, say, settled, shownAs, table, text, toggle } from './controls.js';
import { plain, withError } from './format.js';
import { plotCurves, quantiles } from './plots.js';

const UNKNOWN = [110, 110, 110];
/** Axes that a file does not name. */
const UNNAMED = /^(axis|dimension) \d+$/;

/** Axes of more than one element. */
function longAxes(array) {
    return array.shape.map((n, i) => [n, i]).filter(([n]) => n > 1).map(([, i]) => i);
}

/** Rows as columns. */
function transposed(values, [rows, columns]) {
    const turned = new Float32Array(values.length);
    for (let i = 0; i < rows; i += 1) for (let j = 0; j < columns; j += 1) turned[j * rows + i] = values[i * columns + j];
    return turned;
}

export class MeasurePage {
    constructor(stage, side, items, index) {
        Object.assign(this, { index, item: items[index], drawn: 0 });
        this.surface = element('div', { class: 'surface' });
        this.plot = element('div', { class: 'below', hidden: true });
        stage.append(this.surface, this.plot);
        this.canvas = new PictureCanvas(this.surface, {
            onCursor: (x, y, isSet) => (isSet ? state.set({ cursor: `${x},${y}` }) : this.canvas.cursor || this.read([x, y])),
            onView: () => {},
            onLine: () => {},
            onSplit: () => {},
        });
        this.controls = element('div');
        this.scale = element('div', { class: 'scale' });
        this.values = element('div', { 'aria-live': 'polite', id: 'values' });
        const { attributes } = this.item.about;
        const about = element('details', {}, element('summary', {}, 'About this file'),
            element('div', { class: 'scroll' }, table(['name', 'value'], attributes.map(([name, value]) => [name, typeof value === 'string' ? value : JSON.stringify(value)]), 'Attributes')));
        const missing = this.item.about.left_out.map(([name, reason]) => element('p', { class: 'warning' }, `Left out: ${name}: ${reason}`));
        side.append(this.controls, this.scale, this.values, ...missing, about);
        this.canvas.cursor = state.numbers('cursor', 2);
        this.update();
    }

    array(name = state.get('array')) {
        const { arrays } = this.item.about;
        const size = (array) => array.shape.reduce((a, b) => a * b, 1);
        const most = arrays.filter((array) => !/_(error|effective|few)/.test(array.name)).sort((a, b) => b.shape.length - a.shape.length || size(b) - size(a));
        return arrays.find((array) => array.name === name) ?? most[0] ?? arrays[0];
    }

    /** The axes that are shown, down and across: the last two that have more than one element, or those that are asked for. */
    shown(array) {
        const long = longAxes(array);
        const wanted = [...new Set(state.get('axes').split(',').map(Number))].filter((i) => long.includes(i));
        return wanted.length === Math.min(long.length, 2) ? wanted : long.slice(-2);
    }

    /** The name of an axis: of the file, or as the reader has named it if the file does not. */
    axis(array, i) {
        const given = state.get('names').split(/[\s,]+/)[i];
        return UNNAMED.test(array.axes[i]) && given ? given : array.axes[i];
    }

    /** What is taken of an array: all of the axes that are shown, one element or the sum of the others. */
    part(array) {
        const shown = this.shown(array);
        return array.shape.map((n, i) => {
            if (shown.includes(i)) return '*';
            if (state.get(`sum${i}`) === '1') return 'sum';
            return String(Math.min(Math.max(Math.round(state.number(`at${i}`, Math.floor(n / 2))), 0), n - 1));
        });
    }

    fill(array) {
        const { arrays } = this.item.about;
        const parts = [element('h2', {}, 'Array'), ...shownAs(this.item)];
        const size = ({ shape }) => (shape.length === 0 ? 'a number' : shape.join(' × '));
        if (arrays.length > 1) parts.push(choice('Array', 'array', arrays.map((one) => [one.name, `${one.name} (${size(one)})`]), array.name));
        else parts.push(element('p', { class: 'note' }, `${array.name}: ${size(array)}`));
        const long = longAxes(array);
        const name = (i) => this.axis(array, i);
        const pairs = long.flatMap((a) => long.filter((b) => b !== a).map((b) => [a, b])).sort(([a, b], [c, d]) => (a > b) - (c > d));
        if (pairs.length > 1) parts.push(choice('Axes', 'axes', pairs.map(([a, b]) => [`${a},${b}`, `${name(a)} down, ${name(b)} across`]), this.shown(array).join(',')));
        if (array.axes.some((axis) => UNNAMED.test(axis))) parts.push(text('Names of axes', 'names', ['t', 'z', 'y', 'x'].slice(-array.axes.length).join(' ')));
        const shown = this.shown(array);
        for (const i of long.filter((axis) => !shown.includes(axis))) {
            parts.push(number(name(i), `at${i}`, { type: 'range', min: 0, max: array.shape[i] - 1, step: 1 }, Math.floor(array.shape[i] / 2)));
            parts.push(toggle(`Sum over ${name(i)}`, `sum${i}`));
        }
        if (shown.length === 2) {
            parts.push(choice('Colours', 'scale', SCALE_NAMES, 'dusk'));
            parts.push(number('From', 'low', { step: 'any', placeholder: 'automatic' }, ''), number('To', 'high', { step: 'any', placeholder: 'automatic' }, ''));
        }
        parts.push(toggle('Logarithmic', 'log'));
        refill(this.controls, ...parts);
    }

    values_of(array, part) {
        return api.floats(api.query(`${this.index}/array`, { name: array.name, part: part.join(',') }));
    }

    /** The errors of readings, where they are known: those of sums are not, since cells may share particles. */
    errors(array, part) {
        const errors = this.item.about.arrays.find(({ name, shape }) => name === `${array.name}_error` && String(shape) === String(array.shape));
        return errors && !part.includes('sum') ? this.values_of(errors, part) : null;
    }

    async update() {
        const request = (this.drawn += 1);
        const array = this.array();
        const key = [array.name, this.shown(array), state.get('names')].join('|');
        if (key !== this.key) this.fill(array);
        else refresh(this.controls);
        this.key = key;
        this.canvas.cursor = state.numbers('cursor', 2);
        if (array.shape.includes(0)) {
            this.current = null;
            this.surface.hidden = this.scale.hidden = true;
            this.plot.hidden = false;
            this.plot.replaceChildren(element('p', {}, `${array.name} has no elements.`));
            this.values.replaceChildren();
            settled();
            return;
        }
        try {
            const part = this.part(array);
            const [values, errors] = await Promise.all([this.values_of(array, part), this.errors(array, part)]);
            if (request !== this.drawn) return;
            const shown = this.shown(array);
            const isPicture = shown.length === 2;
            const turn = (plane) => (plane && isPicture && shown[0] > shown[1] ? transposed(plane, [array.shape[shown[1]], array.shape[shown[0]]]) : plane);
            this.current = { array, part, values: turn(values), errors: turn(errors) };
            this.surface.hidden = this.scale.hidden = !isPicture;
            this.plot.hidden = isPicture;
            if (isPicture) this.picture();
            else this.line();
            this.read();
            say(array.unit ? `${array.name} in ${array.unit}` : array.name);
        } catch (error) {
            if (request === this.drawn) say(error.message, true);
        }
        settled();
    }

    picture() {
        const { array, values } = this.current;
        const [height, width] = this.shown(array).map((i) => array.shape[i]);
        const isLogarithmic = state.get('log') === '1';
        let [low, high] = quantiles(isLogarithmic ? values.filter((v) => v > 0) : values, [0.002, 0.998]);
        if (!(high > low)) [low, high] = [0, high > 0 ? high : 1];
        const range = [state.number('low', low), state.number('high', high)];
        const colours = scale(state.get('scale', 'dusk'));
        const encode = (v, out, at) => {
            const t = position(v[0], range, isLogarithmic);
            for (let c = 0; c < 3; c += 1) out[at + c] = Number.isNaN(t) ? UNKNOWN[c] : colours[3 * Math.min(Math.floor(256 * t), 255) + c];
        };
        const isOther = this.canvas.pictures[0]?.width !== width || this.canvas.pictures[0]?.height !== height;
        if (isOther) this.canvas.isFitted = true;
        this.canvas.show([{ width, height, planes: [values], encode }]);
        const bar = element('canvas', { width: 256, height: 1, 'aria-hidden': 'true' });
        const context = bar.getContext('2d');
        const image = context.createImageData(256, 1);
        for (let i = 0; i < 256; i += 1) image.data.set([...colours.subarray(3 * i, 3 * i + 3), 255], 4 * i);
        context.putImageData(image, 0, 0);
        this.scale.replaceChildren(bar, ...[0, 0.5, 1].map((t) => element('span', {}, plain(valueAt(t, range, isLogarithmic), 3))));
    }

    async line() {
        const { array, values, errors } = this.current;
        const [axis] = this.shown(array);
        if (axis === undefined) {
            this.plot.replaceChildren(element('p', {}, `${array.name}: ${errors ? withError(values[0], errors[0]) : plain(values[0], 7)} ${array.unit}`));
            return;
        }
        const x = await this.middles(array, axis);
        const curves = [{ name: array.name, colour: '#ffd166', values, errors }];
        const height = Math.max(this.plot.parentElement.clientHeight - 90, 200);
        const name = this.axis(array, axis);
        plotCurves(this.plot, x, curves, { xName: name, xLabel: name, yLabel: array.unit, height, isValueLogarithmic: state.get('log') === '1', title: `${array.name} along ${name}` });
    }

    /** Middles of the bins of an axis, if its edges are in the file; else numbers of its elements. */
    async middles(array, axis) {
        const meter = array.name.includes('.') ? `${array.name.split('.')[0]}.` : '';
        const count = array.shape[axis];
        const edges = this.item.about.arrays.find(({ name, shape }) => name === `${meter}${array.axes[axis]}_edges` && shape.length === 1 && shape[0] === count + 1);
        if (!edges) return Array.from({ length: count }, (_, i) => i);
        const values = await this.values_of(edges, ['*']);
        return Array.from({ length: count }, (_, i) => (values[i] + values[i + 1]) / 2);
    }

    read(at = this.canvas.cursor) {
        const { array, values, errors } = this.current ?? {};
        if (!array || this.shown(array).length < 2) return this.values.replaceChildren();
        const axes = this.shown(array);
        const [height, width] = axes.map((i) => array.shape[i]);
        if (!at || at[0] >= width || at[1] >= height) return this.values.replaceChildren(element('p', { class: 'note' }, 'Point at a cell; click, or use the arrow keys, to keep it.'));
        const i = at[1] * width + at[0];
        const place = element('p', { id: 'place' }, `${this.axis(array, axes[0])} ${at[1]}, ${this.axis(array, axes[1])} ${at[0]}`);
        const value = element('p', { id: 'reading' }, `${errors ? withError(values[i], errors[i]) : plain(values[i], 7)} ${array.unit}`);
        return this.values.replaceChildren(place, value);
    }

    close() {}
}
