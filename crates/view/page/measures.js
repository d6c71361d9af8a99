// The page of readings of meters and other arrays: planes, lines with bands of their errors, and volumes.

import * as api from './api.js';
import * as state from './state.js';
import { makeAxis } from './axes.js';
import { PictureCanvas } from './canvas.js';
import { SCALE_NAMES, encoder } from './colour.js';
import { ColourBar } from './colourbar.js';
import { button, choice, element, number, refill, refresh, say, settled, shownAs, table, text, toggle } from './controls.js';
import { plain, withError } from './format.js';
import { plotCurves } from './plots.js';
import { UNNAMED, aspects, firstPlane, isEven, longAxes, quantities, spaceOf, unitOf, unitOfValues } from './quantities.js';

/** Milliseconds between the frames of a film. */
const FRAME = 120;
/** Ratio of the largest to the median positive value from which colours are logarithmic unless they are chosen. */
const WIDE = 30;
/** Smallest ratio of a logarithmic scale's ends. */
const DECADES = 1e-6;
/** Ratio of the smaller to the larger side of a range that counts as signed. */
const SIGNED = 0.02;
/** Ratio of height to width of pictures whose axes have different units. */
const FLAT = 0.7;
const PLANES = [['plane', 'a plane'], ['planes', 'three planes']];
const VOLUMES = [['volume', 'a volume'], ['surface', 'a surface of equal values']];

/** Rows as columns. */
function transposed(values, [rows, columns]) {
    const turned = new Float32Array(values.length);
    for (let i = 0; i < rows; i += 1) for (let j = 0; j < columns; j += 1) turned[j * rows + i] = values[i * columns + j];
    return turned;
}

/** Rows from the last to the first. */
function upsideDown(values, columns) {
    const turned = new Float32Array(values.length);
    const rows = values.length / columns;
    for (let i = 0; i < rows; i += 1) turned.set(values.subarray(i * columns, (i + 1) * columns), (rows - 1 - i) * columns);
    return turned;
}

export class MeasurePage {
    constructor(stage, side, items, index) {
        Object.assign(this, { index, item: items[index], drawn: 0, canvases: [], ranges: new Map(), edges: new Map() });
        this.surfaces = element('div', { class: 'surfaces' });
        this.plot = element('div', { class: 'below', hidden: true });
        stage.append(this.surfaces, this.plot);
        this.controls = element('div');
        this.bar = new ColourBar();
        this.values = element('div', { 'aria-live': 'polite', id: 'values' });
        const { attributes } = this.item.about;
        const about = element('details', {}, element('summary', {}, 'About this file'),
            element('div', { class: 'scroll' }, table(['name', 'value'], attributes.map(([name, value]) => [name, typeof value === 'string' ? value : JSON.stringify(value)]), 'Attributes')));
        const missing = this.item.about.left_out.map(([name, reason]) => element('p', { class: 'warning' }, `Left out: ${name}: ${reason}`));
        side.append(this.controls, this.bar.element, this.values, ...missing, about);
        this.update();
    }

    /** The quantity that is shown. */
    array() {
        const { arrays } = this.item.about;
        return arrays.find(({ name }) => name === state.get('array')) ?? quantities(arrays)[0];
    }

    /** What is shown of the quantity: '' for its values. */
    aspect(array) {
        const wanted = state.get('quantity');
        return aspects(array, this.item.about.arrays).some(([name]) => name === wanted) ? wanted : '';
    }

    /** The edges of the bins along each axis; null along those without. */
    edgesOf(array) {
        const ask = (axis, i) => (array.has_edges[i] ? api.json(api.query(`${this.index}/edges`, { name: array.name, axis })) : null);
        return this.kept(this.edges, array.name, () => Promise.all(array.axes.map(ask)));
    }

    /** Where the values of an array are largest, and between which limits they lie. */
    rangeOf(name) {
        return this.kept(this.ranges, name, () => api.json(api.query(`${this.index}/range`, { name })));
    }

    kept(answers, name, ask) {
        if (!answers.has(name)) answers.set(name, ask());
        return answers.get(name);
    }

    /** How an array can be shown: as a volume if all cells have one size. */
    layouts({ array, edges }) {
        const space = spaceOf(array);
        if (!space) return PLANES.slice(0, 1);
        return space.every((i) => isEven(edges[i])) ? [...PLANES, ...VOLUMES] : PLANES;
    }

    layout(about) {
        const wanted = state.get('layout', 'plane');
        return this.layouts(about).some(([name]) => name === wanted) ? wanted : 'plane';
    }

    /** The axes that are shown, up (or down) and across. */
    shown({ array, edges }) {
        const long = longAxes(array);
        const wanted = [...new Set(state.get('axes').split(',').map(Number))].filter((i) => long.includes(i));
        return wanted.length === Math.min(long.length, 2) ? wanted : firstPlane(array, edges);
    }

    /** The name of an axis: of the file, or as the reader has named it if the file does not. */
    axis(array, i) {
        const given = state.get('names').split(/[\s,]+/)[i];
        return UNNAMED.test(array.axes[i]) && given ? given : array.axes[i];
    }

    label(array, i) {
        const unit = unitOf(array, array.axes[i], this.item.about.arrays);
        return unit ? `${this.axis(array, i)} (${unit})` : this.axis(array, i);
    }

    /** The element along each axis that is looked at: where the values are largest, unless it is chosen. */
    place({ array, range }) {
        const isFlat = range.least === range.most;
        return array.shape.map((n, i) => Math.min(Math.max(Math.round(state.number(`at${i}`, isFlat ? Math.floor(n / 2) : range.peak[i])), 0), n - 1));
    }

    /** What is taken of an array: all along the axes that are shown, one element or the sum of the others. */
    part(about, shown) {
        const { array, place } = about;
        return place.map((at, i) => (shown.includes(i) ? '*' : state.get(`sum${i}`) === '1' && array.shape[i] > 1 ? 'sum' : String(at)));
    }

    fill(about) {
        const { array } = about;
        const { arrays } = this.item.about;
        const listed = quantities(arrays);
        const parts = [element('h2', {}, 'Quantity'), ...shownAs(this.item)];
        const size = ({ shape }) => (shape.length === 0 ? 'a number' : shape.join(' × '));
        const options = listed.includes(array) ? listed : [...listed, array];
        if (options.length > 1) parts.push(choice('Quantity', 'array', options.map((one) => [one.name, `${one.name} (${size(one)})`]), array.name));
        else parts.push(element('p', { class: 'note' }, `${array.name}: ${size(array)}`));
        const shownOf = aspects(array, arrays);
        if (shownOf.length > 1) parts.push(choice('Shown', 'quantity', shownOf, ''));
        const layouts = this.layouts(about);
        if (layouts.length > 1) parts.push(choice('As', 'layout', layouts, 'plane'));
        const layout = this.layout(about);
        const long = longAxes(array);
        const name = (i) => this.axis(array, i);
        const shown = layout === 'plane' ? this.shown(about) : spaceOf(array);
        const pairs = long.flatMap((a) => long.filter((b) => b !== a).map((b) => [a, b])).sort(([a, b], [c, d]) => (a > b) - (c > d));
        const upwards = (i) => (array.has_edges[i] ? 'up' : 'down');
        if (layout === 'plane' && pairs.length > 1) parts.push(choice('Axes', 'axes', pairs.map(([a, b]) => [`${a},${b}`, `${name(a)} ${upwards(a)}, ${name(b)} across`]), shown.join(',')));
        if (array.axes.some((axis) => UNNAMED.test(axis))) parts.push(text('Names of axes', 'names', ['t', 'z', 'y', 'x'].slice(-array.axes.length).join(' ')));
        for (const i of long.filter((axis) => !shown.includes(axis))) parts.push(...this.across(about, i));
        if (shown.length > 1) {
            parts.push(choice('Colours', 'scale', SCALE_NAMES, about.standard.scale));
            if (layout === 'surface') parts.push(number('Equal value', 'level', { step: 'any', placeholder: 'automatic' }, ''));
            parts.push(number('From', 'low', { step: 'any', placeholder: 'automatic' }, ''), number('To', 'high', { step: 'any', placeholder: 'automatic' }, ''));
        }
        parts.push(toggle('Logarithmic', 'log', about.standard.isLogarithmic));
        if (shown.length > 1 && (layout === 'plane' || layout === 'planes')) parts.push(choice('Profile along', 'along', [...(layout === 'plane' ? [['', 'nothing']] : []), ...long.map((i) => [i, name(i)])], layout === 'plane' ? '' : shown[2]));
        refill(this.controls, ...parts);
    }

    /** Controls of an axis across what is shown: which element, or the sum, and a film along axes that are not of space. */
    across({ array, place }, i) {
        const name = this.axis(array, i);
        const slider = number(name, `at${i}`, { type: 'range', min: 0, max: array.shape[i] - 1, step: 1 }, place[i]);
        const where = element('p', { class: 'note', 'data-where': i }, this.whereText({ array }, i, place[i]));
        const isSpace = ['x', 'y', 'z'].includes(array.axes[i]);
        const film = () => {
            const isPlaying = this.playing?.axis === i;
            this.pause();
            if (!isPlaying) this.playing = { axis: i, timer: setInterval(() => this.step(i), FRAME) };
            this.key = '';
            this.update();
        };
        const play = isSpace ? [] : [element('div', { class: 'buttons' }, button(this.playing?.axis === i ? 'Pause film' : 'Play film', film))];
        return [slider, where, ...play, toggle(`Sum over ${name}`, `sum${i}`)];
    }

    pause() {
        clearInterval(this.playing?.timer);
        this.playing = null;
    }

    step(i) {
        if (!this.isBusy) state.set({ [`at${i}`]: (this.current.place[i] + 1) % this.current.array.shape[i] });
    }

    /** Which part of an axis an element is, in its unit. */
    whereText({ array }, i, at) {
        const edges = this.current?.array === array ? this.current.edges[i] : this.opened?.edges[i];
        const unit = unitOf(array, array.axes[i], this.item.about.arrays);
        return edges ? `${this.axis(array, i)} ${plain(edges[at], 4)} to ${plain(edges[at + 1], 4)} ${unit}`.trim() : `${this.axis(array, i)} ${at}`;
    }

    values_of(name, part) {
        return api.floats(api.query(`${this.index}/array`, { name, part: part.join(',') }));
    }

    /** Values, and their errors where they are known: those of sums are not, since cells may share particles. */
    async both({ array }, part) {
        const errors = aspects(array, this.item.about.arrays).some(([name]) => name === '_error') && !part.includes('sum');
        return Promise.all([this.values_of(array.name, part), errors ? this.values_of(`${array.name}_error`, part) : null]);
    }

    /** What is shown of a part: values, or what is known about them. */
    async aspectOf(about, part) {
        if (about.aspect === 'relative') {
            const [values, errors] = await this.both(about, part);
            return values.map((v, i) => (errors ? errors[i] / Math.abs(v) : NaN));
        }
        return this.values_of(about.array.name + about.aspect, part);
    }

    /** Limits and kind of the colours unless others are chosen, so that all slices have the same. */
    standard(range, aspect) {
        const [low, high] = range.nearly_all;
        if (low === null) return { range: [0, 1], isLogarithmic: false, scale: 'viridis' };
        const isSigned = Math.min(range.most, -range.least) > SIGNED * Math.max(range.most, -range.least);
        if (isSigned) {
            const most = Math.max(high, -low) || Math.max(range.most, -range.least);
            return { range: [-most, most], isLogarithmic: false, scale: 'diverging' };
        }
        const [dark, median] = range.positive;
        const isLogarithmic = aspect === '' && range.least >= 0 && range.most > WIDE * median;
        return { range: [range.least >= 0 ? 0 : low, high > Math.max(low, 0) ? high : range.most || 1], logarithmic: [Math.max(dark, range.most * DECADES), range.most], isLogarithmic, scale: 'viridis' };
    }

    colours({ standard }) {
        const isLogarithmic = state.get('log', standard.isLogarithmic ? '1' : '0') === '1';
        const automatic = (isLogarithmic && standard.logarithmic) || standard.range;
        let [low, high] = [state.number('low', automatic[0]), state.number('high', automatic[1])];
        if (!(high > low)) high = low + (Math.abs(low) || 1) * 1e-6;
        if (isLogarithmic && !(low > 0)) low = high > 0 ? high * 1e-4 : 1e-4;
        if (isLogarithmic && !(high > low)) high = 10 * low;
        return { range: [low, high], isLogarithmic, scale: state.get('scale', standard.scale) };
    }

    /** Everything that is to be known before a picture of an array is asked for. */
    async prepare() {
        const array = this.array();
        const aspect = this.aspect(array);
        const other = aspect === 'relative' ? array.name : array.name + aspect;
        const [edges, range, shownRange] = await Promise.all([this.edgesOf(array), this.rangeOf(array.name), this.rangeOf(other)]);
        const about = { array, aspect, edges, range };
        about.place = this.place(about);
        about.standard = aspect === 'relative' ? { range: [0, 1], logarithmic: [1e-4, 1], isLogarithmic: false, scale: 'viridis' } : this.standard(shownRange, aspect);
        return about;
    }

    async update() {
        const request = (this.drawn += 1);
        this.isBusy = true;
        try {
            if (this.array().shape.includes(0)) this.empty(this.array());
            else await this.show(await this.prepare(), request);
        } catch (error) {
            if (request === this.drawn) say(error.message, true);
        }
        if (request === this.drawn) this.isBusy = false;
        settled();
    }

    empty(array) {
        this.current = null;
        this.surfaces.hidden = this.bar.element.hidden = true;
        this.plot.hidden = false;
        this.plot.replaceChildren(element('p', {}, `${array.name} has no elements.`));
        this.values.replaceChildren();
    }

    async show(about, request) {
        if (request !== this.drawn) return;
        this.opened = about;
        const layout = this.layout(about);
        const shown = layout === 'plane' ? this.shown(about) : spaceOf(about.array);
        const key = [about.array.name, about.aspect, layout, shown, state.get('names'), this.playing?.axis].join('|');
        if (key !== this.key) this.fill(about);
        else refresh(this.controls);
        this.key = key;
        for (const where of this.controls.querySelectorAll('[data-where]')) where.textContent = this.whereText(about, Number(where.dataset.where), about.place[where.dataset.where]);
        for (const slider of this.controls.querySelectorAll('[type=range]')) {
            slider.value = about.place[slider.dataset.name.slice(2)];
            slider.parentElement.querySelector('output').textContent = slider.value;
        }
        const draw = { plane: shown.length === 2 ? this.planes : this.line, planes: this.planes, volume: this.volume, surface: this.volume }[layout];
        await draw.call(this, about, shown, request);
        if (request !== this.drawn) return;
        this.current = about;
        await this.read(about.place);
        const unit = unitOfValues(about.array);
        say(unit ? `${about.array.name} in ${unit}` : about.array.name);
    }

    /** The canvases of planes, as many as are needed. */
    canvasesFor(count) {
        if (this.canvases.length === count && !this.space) return this.canvases;
        this.space?.close();
        this.space = null;
        this.surfaces.replaceChildren();
        this.surfaces.classList.toggle('several', count > 1);
        // The profile stands beside three planes, and below one.
        this.surfaces.after(this.plot);
        this.canvases = Array.from({ length: count }, () => {
            const surface = element('div', { class: 'surface' });
            this.surfaces.append(surface);
            const canvas = new PictureCanvas(surface, {
                onCursor: (x, y, isSet) => this.point(canvas, [x, y], isSet),
                onView: () => {},
                onLine: () => {},
                onSplit: () => {},
            });
            return canvas;
        });
        if (count > 1) this.surfaces.append(this.plot);
        return this.canvases;
    }

    /** One plane, or the three through the place that is looked at. */
    async planes(about, shown, request) {
        const [x, y, z] = shown;
        about.part = this.part(about, shown);
        const wanted = shown.length === 3 ? [[z, x], [z, y], [y, x]] : [shown];
        const planes = await Promise.all(wanted.map((axes) => this.plane(about, axes)));
        if (request !== this.drawn) return;
        this.surfaces.hidden = false;
        const colours = this.colours(about);
        const encode = encoder(colours.scale, colours.range, colours.isLogarithmic);
        about.values = planes[0].values;
        this.canvasesFor(wanted.length).forEach((canvas, i) => {
            const { values, picture } = planes[i];
            Object.assign(canvas, { shownAxes: wanted[i], picture, isCrossed: wanted.length > 1 });
            canvas.cursor = this.cellOf(picture, about.place, wanted[i]);
            canvas.show([{ ...picture, planes: [values], encode }]);
        });
        this.bar.show(colours);
        await this.profile(about, shown, request);
    }

    /** The values of a plane as rows from the top, and the axes beside it. */
    async plane(about, [up, across]) {
        const { array, edges } = about;
        const [height, width] = [up, across].map((i) => array.shape[i]);
        const values = await this.aspectOf(about, this.part(about, [up, across]));
        const rows = up > across ? transposed(values, [width, height]) : values;
        const isUp = array.has_edges[up];
        const count = (n) => Array.from({ length: n + 1 }, (_, i) => i - 0.5);
        const [ex, ey] = [edges[across] ?? count(width), edges[up] ?? count(height)];
        const unit = (i) => `${unitOf(array, array.axes[i], this.item.about.arrays)} ${array.has_edges[i]}`;
        // Lengths beside lengths keep their proportions; other axes fill the window.
        const extent = (e) => e[e.length - 1] - e[0];
        const scale = unit(up) === unit(across) ? 1 : (FLAT * extent(ex)) / extent(ey);
        const axes = [makeAxis(ex, this.label(array, across)), makeAxis(ey, this.label(array, up), { isUp, scale })];
        return { values: isUp ? upsideDown(rows, width) : rows, picture: { width, height, axes, isUp } };
    }

    /** The cell of the canvas that shows a place, and the place along the axes of a cell. */
    cellOf({ height, isUp }, place, [up, across]) {
        return [place[across], isUp ? height - 1 - place[up] : place[up]];
    }

    point(canvas, [x, y], isSet) {
        const { height, isUp } = canvas.picture;
        const [up, across] = canvas.shownAxes;
        const row = isUp ? height - 1 - y : y;
        if (isSet) state.set({ [`at${across}`]: x, [`at${up}`]: row });
        else if (this.current) this.read(this.current.place.map((at, i) => (i === across ? x : i === up ? row : at)), [up, across]);
    }

    async volume(about, shown, request) {
        const { Volume } = await import('./volume.js');
        const [x, y, z] = shown;
        const values = await this.aspectOf(about, this.part(about, shown));
        if (request !== this.drawn) return;
        this.surfaces.hidden = false;
        this.plot.hidden = true;
        if (!this.space) {
            this.canvases = [];
            this.surfaces.replaceChildren();
            this.surfaces.classList.remove('several');
            this.surfaces.after(this.plot);
            const surface = element('div', { class: 'surface' });
            this.surfaces.append(surface);
            try {
                this.space = new Volume(surface, (view) => state.set({ camera: view }));
            } catch (error) {
                surface.append(element('p', { class: 'warning' }, `The volume cannot be drawn, because this browser does not offer WebGL 2 here (${error.message}). Planes show its values.`));
                return;
            }
        }
        const colours = this.colours(about);
        const order = [x, y, z].map((i) => [x, y, z].filter((j) => j > i).reduce((step, j) => step * about.array.shape[j], 1));
        const level = this.layout(about) === 'surface' ? state.number('level', this.middle(colours)) : null;
        const labels = shown.map((i) => this.label(about.array, i));
        this.space.show({ values, order, size: shown.map((i) => about.array.shape[i]), edges: shown.map((i) => about.edges[i]), labels, colours, level, view: state.numbers('camera', 6) });
        this.bar.show(colours);
        this.isoText = level === null ? '' : `surface of ${plain(level, 4)} ${unitOfValues(about.array)}`;
    }

    /** The value in the middle of the colours. */
    middle({ range: [low, high], isLogarithmic }) {
        return isLogarithmic ? Math.sqrt(low * high) : (low + high) / 2;
    }

    /** Plots the values along an axis through the place that is looked at. */
    async profile(about, shown, request) {
        const isBeside = shown.length === 3;
        const wanted = state.get('along', isBeside ? String(shown[2]) : '');
        const axis = Number(wanted);
        const isWanted = wanted !== '' && longAxes(about.array).includes(axis);
        this.plot.hidden = !isWanted;
        const height = isBeside ? Math.max(this.surfaces.clientHeight / 2 - 70, 120) : 170;
        if (isWanted) await this.curve(about, axis, request, { height });
    }

    async line(about, [axis], request) {
        if (axis === undefined) {
            const [[value], errors] = await this.both(about, this.part(about, []));
            if (request !== this.drawn) return;
            this.plot.replaceChildren(element('p', {}, `${about.array.name}: ${errors ? withError(value, errors[0]) : plain(value, 7)} ${unitOfValues(about.array)}`));
        } else await this.curve(about, axis, request, { height: Math.max(this.plot.parentElement.clientHeight - 90, 200) });
        this.surfaces.hidden = this.bar.element.hidden = true;
        this.plot.hidden = false;
    }

    async curve(about, axis, request, { height }) {
        const { array, edges, standard } = about;
        const part = this.part(about, [axis]);
        const [values, errors] = about.aspect === '' ? await this.both(about, part) : [await this.aspectOf(about, part), null];
        if (request !== this.drawn) return;
        if (!about.values) Object.assign(about, { part, values });
        const x = Array.from(values, (_, i) => (edges[axis] ? (edges[axis][i] + edges[axis][i + 1]) / 2 : i));
        const label = this.label(array, axis);
        const isValueLogarithmic = state.get('log', standard.isLogarithmic ? '1' : '0') === '1';
        const curves = [{ name: array.name, colour: '#ffd166', values, errors }];
        plotCurves(this.plot, x, curves, { xName: this.axis(array, axis), xLabel: label, yLabel: unitOfValues(array), height, isValueLogarithmic, title: `${array.name} along ${this.axis(array, axis)}` });
    }

    /** Lists the value at a place in the plane of two axes, with its error, and where it is. */
    async read(place, axes = this.canvases[0]?.shownAxes) {
        const about = this.current;
        if (this.space) return this.values.replaceChildren(this.isoText);
        if (this.surfaces.hidden || !axes) return this.values.replaceChildren();
        const { array } = about;
        const part = this.part(about, axes);
        const [a, b] = [Math.min(...axes), Math.max(...axes)];
        const at = place[a] * array.shape[b] + place[b];
        const reading = (this.reading = (this.reading ?? 0) + 1);
        const [[values, errors], few] = await Promise.all([this.both(about, part), this.few(array, part)]);
        if (reading !== this.reading) return null;
        const where = longAxes(array).map((i) => (part[i] === 'sum' ? `${this.axis(array, i)}: sum` : this.whereText(about, i, place[i])));
        const value = errors ? withError(values[at], errors[at]) : plain(values[at], 7);
        const parts = [element('p', { id: 'reading' }, `${value} ${unitOfValues(array)}`), element('div', { id: 'place' }, ...where.map((line) => element('p', { class: 'note' }, line)))];
        if (few?.[at] > 0) parts.push(element('p', { class: 'warning' }, 'few: the error is not to be trusted'));
        return this.values.replaceChildren(...parts);
    }

    /** Which cells of a part have errors that are not to be trusted; null if it is not known. */
    async few(array, part) {
        const has = aspects(array, this.item.about.arrays).some(([name]) => name === '_few');
        return has && !part.includes('sum') ? this.values_of(`${array.name}_few`, part) : null;
    }

    close() {
        this.pause();
        this.space?.close();
    }
}
