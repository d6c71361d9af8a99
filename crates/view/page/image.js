// The page of images: of files, of renders under way, and of several compared.

import * as api from './api.js';
import * as state from './state.js';
import { PictureCanvas } from './canvas.js';
import { SCALE_NAMES, encoder, toneCurve } from './colour.js';
import { ColourBar } from './colourbar.js';
import { button, choice, element, number, refill, refresh, say, settled, shownAs, table, text, toggle } from './controls.js';
import { plain, withError } from './format.js';
import { colourOf, histogram, plotCurves, quantiles } from './plots.js';

const QUANTITIES = [['value', 'value'], ['error', 'standard error'], ['relative', 'relative error'], ['variance', 'variance']];
const COMPARISONS = [['', 'nothing'], ['slider', 'slider'], ['beside', 'side by side'], ['z', 'difference / standard error'], ['flip', 'FLIP']];
/** Range of differences in standard errors that colours show. */
const Z_RANGE = [-5, 5];
/** Values around the cursor that are listed, on each side. */
const AROUND = 2;
/** Stops by which a key changes the exposure. */
const STEP = 0.5;
/** Milliseconds between the frames of a film. */
const FRAME = 120;

/** Layers that tell something of others. */
const isAbout = (name) => /^(variance|few)(\.|$)/.test(name);
const varianceOf = (layer) => (layer === '' ? 'variance' : `variance.${layer}`);

/** A layer of light told apart by length or time: what comes before the number, the number, and what comes after. */
function bin(name) {
    const found = /^(.*?(?:length|time)\.)(\d+)(.*)$/.exec(name);
    return found && !isAbout(name) ? { before: found[1], number: Number(found[2]), digits: found[2].length, after: found[3] } : null;
}

export class ImagePage {
    constructor(stage, side, items, index) {
        Object.assign(this, { items, index, item: items[index], version: 0, drawn: 0 });
        const surface = element('div', { class: 'surface' });
        this.below = element('div', { class: 'below', hidden: true });
        stage.append(surface, this.below);
        this.canvas = new PictureCanvas(surface, {
            onCursor: (x, y, isSet) => this.point(x, y, isSet),
            onView: () => this.keepView(),
            onLine: (line) => state.set({ line: line.join(',') }),
            onSplit: (share) => state.set({ split: share.toFixed(4) }),
        });
        this.controls = element('div');
        this.values = element('div', { 'aria-live': 'polite', id: 'values' });
        this.bar = new ColourBar();
        this.histogram = element('div');
        this.about = element('details');
        side.append(this.controls, this.bar.element, element('h2', {}, 'Under the cursor'), this.values, element('h2', {}, 'Histogram'), this.histogram, this.about);
        this.canvas.view = state.numbers('view', 3) && (([x, y, zoom]) => ({ x, y, zoom }))(state.numbers('view', 3));
        this.canvas.cursor = state.numbers('cursor', 2);
        this.fill();
    }

    /** Other images. */
    others() {
        return this.items.map((item, i) => [item, i]).filter(([item, i]) => i !== this.index && item.about?.layers);
    }

    /** What is said of an image of another size; '' if both have one size. */
    overlap({ kind, item }) {
        const { width, height } = this.item.about;
        if (kind === '' || (item.about.width === width && item.about.height === height)) return '';
        return `The images have different sizes, ${width} × ${height} and ${item.about.width} × ${item.about.height} pixels: they are compared where they overlap if their top left corners do.`;
    }

    layer() {
        const names = this.item.about.layers.map((layer) => layer.name);
        const wanted = state.get('layer', names.includes('') ? '' : names[0]);
        return names.includes(wanted) ? wanted : names[0];
    }

    /** Names of channels: red, green and blue in this order, which files do not keep. */
    channels(item = this.item, layer = this.layer()) {
        const names = item.about.layers.find(({ name }) => name === layer)?.channels ?? [];
        const place = (name) => ['R', 'G', 'B'].indexOf(name);
        return [...names].sort((a, b) => (place(a) < 0 || place(b) < 0 ? 0 : place(a) - place(b)));
    }

    /** The channel that is shown; '' for colours. */
    channel() {
        const channels = this.channels();
        const wanted = state.get('channel');
        if (channels.includes(wanted)) return wanted;
        return channels.length > 1 && !isAbout(this.layer()) ? '' : channels[0];
    }

    variance(item = this.item) {
        return item.about.layers.some(({ name }) => name === varianceOf(this.layer()));
    }

    comparison() {
        const others = this.others();
        const wanted = state.get('compare');
        const other = others.find(([, i]) => i === state.number('with', others[0]?.[1])) ?? others[0];
        return other && COMPARISONS.some(([kind]) => kind === wanted) ? { kind: wanted, item: other[0], index: other[1] } : { kind: '' };
    }

    exposure() {
        return state.number('exposure', this.item.about.exposure);
    }

    /** What red, green and blue are multiplied by, so that a colour looks white. */
    async gains() {
        const white = state.get('white');
        return white ? api.json(api.query('white', { of: white })) : [1, 1, 1];
    }

    /** Makes the pixel of the cursor neutral. */
    async neutral() {
        const [x, y] = this.canvas.cursor ?? [];
        if (x === undefined) return say('Click a pixel that should look white or grey first', true);
        const colours = (await this.colours(this.index)).map((plane) => plane[y * this.item.about.width + x]);
        if (!colours.every((v) => v > 0)) return say('This pixel has no red, no green or no blue: choose another', true);
        return state.set({ white: colours.map((v) => v.toPrecision(4)).join(',') });
    }

    /** Keys of the whole page. */
    shortcut(key) {
        if (this.channel() !== '') return;
        if (key === 'e' || key === 'E') state.set({ exposure: this.exposure() + (key === 'e' ? STEP : -STEP) });
    }

    /** Fills in the controls. */
    fill() {
        const { about } = this.item;
        const channels = this.channels();
        const isColour = this.channel() === '';
        const parts = [element('h2', {}, 'Picture'), ...shownAs(this.item)];
        const layers = about.layers.map(({ name }) => [name, name === '' ? 'image' : name]);
        if (layers.length > 1) parts.push(choice('Layer', 'layer', layers, this.layer()));
        parts.push(...this.film());
        const options = channels.map((name) => [name, name]);
        if (channels.length > 1) options.unshift(['colours', 'colours']);
        parts.push(choice('Channel', 'channel', options, this.channel() || 'colours'));
        if (!isColour && this.variance()) parts.push(choice('Shown', 'quantity', QUANTITIES, 'value'));
        if (isColour) {
            parts.push(number('Exposure, stops', 'exposure', { step: 0.25, title: 'e: brighter, E: darker' }, about.exposure));
            parts.push(choice('Tone curve', 'curve', [['srgb', 'sRGB'], ['filmic', 'filmic']], 'srgb'));
            parts.push(text('White', 'white', 'kelvin, or red,green,blue'));
            parts.push(element('div', { class: 'buttons' }, button('Pixel is neutral', () => this.neutral(), { title: 'Makes the pixel of the cursor grey' })));
        } else {
            parts.push(choice('Colours', 'scale', SCALE_NAMES, 'viridis'), toggle('Logarithmic', 'log'));
            parts.push(number('From', 'low', { step: 'any', placeholder: 'automatic' }, ''), number('To', 'high', { step: 'any', placeholder: 'automatic' }, ''));
        }
        const others = this.others();
        if (others.length > 0) {
            parts.push(element('h2', {}, 'Compare'), choice('As', 'compare', COMPARISONS, ''));
            parts.push(choice('With', 'with', others.map(([item, i]) => [i, item.name]), others[0][1]));
            const overlap = this.overlap(this.comparison());
            if (overlap) parts.push(element('p', { class: 'warning', id: 'overlap' }, overlap));
            if (this.comparison().kind === 'slider') parts.push(number('Slider', 'split', { type: 'range', min: 0, max: 1, step: 0.001 }, 0.5));
        }
        const isDrawing = this.canvas.isDrawing;
        parts.push(element('div', { class: 'buttons' },
            button('Fit', () => this.canvas.fit()),
            button('1:1', () => this.canvas.setView({ ...this.canvas.view, zoom: 1 })),
            button('Profile', () => this.drawing(), { 'aria-pressed': String(isDrawing), title: 'Drag a line over the picture (or drag with the shift key)' }),
            button('Save PNG', () => this.savePng()),
            button('Save EXR', () => this.saveExr())));
        if (isDrawing || state.get('line')) parts.push(text('Line', 'line', 'x, y of both ends'));
        const scene = this.items.findIndex((item) => item.kind === 'scene' && item.about.film[0] === about.width && item.about.film[1] === about.height);
        if (scene >= 0) parts.push(element('div', { class: 'buttons' }, button('Follow the ray of this pixel', () => this.follow(scene))));
        refill(this.controls, ...parts);
        refill(this.about, element('summary', {}, 'About this image'), element('div', { class: 'scroll' }, table(['name', 'value'], about.attributes, 'Attributes')));
        return this.show();
    }

    /** Controls of a film of bins of length or time. */
    film() {
        const current = bin(this.layer());
        if (!current) return [];
        const bins = this.item.about.layers.map(({ name }) => bin(name)).filter((b) => b && b.before === current.before && b.after === current.after);
        const last = Math.max(...bins.map((b) => b.number));
        const name = (i) => `${current.before}${String(i).padStart(current.digits, '0')}${current.after}`;
        const slider = element('input', { type: 'range', min: 0, max: last, 'aria-label': 'Bin of the film', 'data-name': 'bin' });
        slider.value = current.number;
        slider.addEventListener('input', () => state.set({ layer: name(Number(slider.value)) }));
        const play = () => {
            clearInterval(this.playing);
            this.playing = this.playing ? 0 : setInterval(() => this.step(name, last), FRAME);
            this.fill();
        };
        return [element('div', { class: 'field' }, button(this.playing ? 'Pause film' : 'Play film', play), slider), element('p', { class: 'note', id: 'bin' }, this.binText(current.number))];
    }

    /** What a bin is of, if the file says so. */
    binText(i) {
        const text = this.item.about.attributes.find(([name]) => name === 'decomposition')?.[1];
        try {
            const axis = JSON.parse(text ?? '[]').find(({ bins }) => bins);
            const from = (k) => plain(axis.min + k * axis.width, 4);
            return `${axis.name} ${from(i)} to ${from(i + 1)}`;
        } catch {
            return `bin ${i}`;
        }
    }

    step(name, last) {
        const current = bin(this.layer());
        if (current && !this.isBusy) state.set({ layer: name((current.number + 1) % (last + 1)) });
    }

    path(index, layer, channel) {
        return api.query(`${index}/plane`, { layer, channel, version: index === this.index ? this.version : 0 });
    }

    plane(index, layer, channel) {
        return api.floats(this.path(index, layer, channel));
    }

    /** Planes of colours. */
    async colours(index) {
        const item = this.items[index];
        const channels = this.channels(item);
        const layer = this.layer();
        if (['R', 'G', 'B'].every((name) => channels.includes(name))) return Promise.all(['R', 'G', 'B'].map((name) => this.plane(index, layer, name)));
        const all = await api.floats(api.query(`${index}/screen`, { layer, version: this.version }));
        return [0, 1, 2].map((c) => all.subarray(c * all.length / 3, (c + 1) * all.length / 3));
    }

    /** The values of the channel that is shown, or their error. */
    async scalar(index) {
        const quantity = this.variance(this.items[index]) ? state.get('quantity', 'value') : 'value';
        const channel = this.channel();
        if (quantity === 'value') return this.plane(index, this.layer(), channel);
        const variance = await this.plane(index, varianceOf(this.layer()), channel);
        if (quantity === 'variance') return variance;
        if (quantity === 'error') return variance.map(Math.sqrt);
        const mean = await this.plane(index, this.layer(), channel);
        return variance.map((v, i) => Math.sqrt(v) / Math.abs(mean[i]));
    }

    /** Shows what the state says. */
    async show() {
        const request = (this.drawn += 1);
        this.isBusy = true;
        try {
            const shown = await this.pictures();
            if (request !== this.drawn) return;
            this.canvas.line = state.numbers('line', 4);
            this.canvas.show(shown.pictures, shown.split);
            this.bar.show(shown);
            this.showHistogram(shown);
            await Promise.all([this.read(), this.profile()]);
            say(`${this.item.about.width} × ${this.item.about.height}`);
        } catch (error) {
            if (request === this.drawn) say(error.message, true);
        }
        if (request === this.drawn) this.isBusy = false;
        settled();
    }

    async pictures() {
        const comparison = this.comparison();
        if (comparison.kind === 'z' || comparison.kind === 'flip') return this.difference(comparison);
        const indices = comparison.kind === 'beside' ? [this.index, ...this.others().map(([, i]) => i)] : comparison.kind ? [this.index, comparison.index] : [this.index];
        const isColour = this.channel() === '';
        const planes = await Promise.all(indices.map((i) => (isColour ? this.colours(i) : this.scalar(i).then((plane) => [plane]))));
        const split = comparison.kind === 'slider' ? state.number('split', 0.5) : null;
        let [encode, range] = [null, null];
        if (isColour) {
            const tone = toneCurve(this.exposure(), state.get('curve', 'srgb'), await this.gains());
            encode = (values, out, at) => {
                for (let c = 0; c < 3; c += 1) out[at + c] = tone(values[c], c);
            };
        } else {
            range = this.range(planes[0][0]);
            encode = encoder(state.get('scale', 'viridis'), range, state.get('log') === '1');
        }
        return { pictures: planes.map((p, i) => ({ width: this.items[indices[i]].about.width, height: this.items[indices[i]].about.height, planes: p, encode })), split, range, scale: state.get('scale', 'viridis'), isLogarithmic: state.get('log') === '1' };
    }

    async difference({ kind, index }) {
        const [width, height] = ['width', 'height'].map((side) => Math.min(this.item.about[side], this.items[index].about[side]));
        const channel = this.channel() || this.channels()[0];
        const question = { a: this.index, b: index, layer: this.layer(), reference_layer: this.layer(), kind, version: this.version };
        const plane = await api.floats(api.query('difference', kind === 'z' ? { ...question, channel } : { ...question, exposure: this.exposure() }));
        const [range, name] = kind === 'z' ? [Z_RANGE, 'diverging'] : [[0, 1], 'viridis'];
        return { pictures: [{ width, height, planes: [plane], encode: encoder(name, range, false) }], split: null, range, scale: name, isLogarithmic: false, isFixed: true };
    }

    /** The range of values that colours show: what is asked for, or nearly all. */
    range(values) {
        const isLogarithmic = state.get('log') === '1';
        // A small light in the dark is not cut off.
        const lit = values.filter((v) => v > 0);
        let [low, high] = [quantiles(isLogarithmic ? lit : values, [0.005])[0], quantiles(lit.length > 0 ? lit : values, [0.995])[0]];
        if (!(high > low)) [low, high] = [Math.min(low, 0) || 0, high > 0 ? high : 1];
        [low, high] = [state.number('low', low), state.number('high', high)];
        return isLogarithmic && !(low > 0) ? [high > 0 ? high * 1e-4 : 1e-4, high > 0 ? high : 1] : [low, high];
    }

    showHistogram({ pictures, range }) {
        const { planes } = pictures[0];
        const names = planes.length === 3 ? ['R', 'G', 'B'] : [this.channel() || 'value'];
        const [low, high] = range ?? [0, Math.max(...planes.map((plane) => quantiles(plane, [0.995])[0])) || 1];
        const counts = planes.map((plane) => histogram(plane, [low, high]));
        const curves = counts.map(([, values], i) => ({ name: names[i], colour: colourOf(names[i], i), values }));
        plotCurves(this.histogram, counts[0][0], curves, { height: 130, steps: true, legend: false, title: `Histogram of pixels from ${plain(low, 3)} to ${plain(high, 3)}` });
    }

    /** The cursor is somewhere else. */
    point(x, y, isSet) {
        if (isSet) state.set({ cursor: `${x},${y}` });
        else if (!this.canvas.cursor) this.read([x, y]);
    }

    /** Lists the values under the cursor: in each image, with errors, samples and neighbours. */
    async read(at = this.canvas.cursor) {
        if (!at) {
            this.values.replaceChildren(element('p', { class: 'note' }, 'Point at a pixel; click, or use the arrow keys, to keep it.'));
            return;
        }
        const [x, y] = at;
        const { width, height } = this.item.about;
        if (x >= width || y >= height) return;
        const comparison = this.comparison();
        const indices = comparison.kind ? [this.index, comparison.index] : [this.index];
        const parts = [element('p', { id: 'place' }, `x ${x}, y ${y}`)];
        for (const index of indices) {
            if (indices.length > 1) parts.push(element('p', { class: 'note' }, this.items[index].name));
            parts.push(await this.reading(index, x, y));
        }
        if (comparison.kind === 'z' || comparison.kind === 'flip') {
            const shown = this.canvas.pictures[0];
            const value = x < shown.width && y < shown.height ? shown.planes[0][y * shown.width + x] : NaN;
            parts.push(element('p', { id: 'difference' }, comparison.kind === 'z' ? `difference: ${plain(value, 4)} standard errors` : `FLIP ${plain(value, 4)}`));
        }
        parts.push(await this.neighbours(x, y));
        this.values.replaceChildren(...parts);
    }

    async reading(index, x, y) {
        const layer = this.layer();
        const item = this.items[index];
        if (x >= item.about.width || y >= item.about.height) return element('p', { class: 'note' }, 'outside of this image');
        const pixel = y * item.about.width + x;
        const channels = this.channels(item);
        const has = (name) => item.about.layers.some((l) => l.name === name);
        const rows = await Promise.all(channels.map(async (channel) => {
            const value = (await this.plane(index, layer, channel))[pixel];
            const variance = this.variance(item) ? (await this.plane(index, varianceOf(layer), channel))[pixel] : NaN;
            return [channel, this.variance(item) ? withError(value, Math.sqrt(variance)) : plain(value, 7)];
        }));
        if (has('samples') && layer !== 'samples') rows.push(['samples', plain((await this.plane(index, 'samples', 'N'))[pixel], 9)]);
        const few = layer === '' ? 'few' : `few.${layer}`;
        if (has(few) && channels.length > 0 && (await this.plane(index, few, channels[0]))[pixel] > 0) rows.push(['few', 'the error is not to be trusted']);
        return table(['channel', 'value ± error'], rows, `Values in ${item.name}`);
    }

    /** Values of the channel that is shown, or of the first, around a pixel. */
    async neighbours(x, y) {
        const { width, height } = this.item.about;
        const channel = this.channel() || this.channels()[0];
        const plane = await this.plane(this.index, this.layer(), channel);
        const steps = Array.from({ length: 2 * AROUND + 1 }, (_, i) => i - AROUND);
        const cell = (i, j) => (i < 0 || j < 0 || i >= width || j >= height ? '' : plain(plane[j * width + i], 3));
        const rows = steps.map((dy) => [String(y + dy), ...steps.map((dx) => cell(x + dx, y + dy))]);
        const shown = table([`${channel}: y \\ x`, ...steps.map((dx) => String(x + dx))], rows, `Values of ${channel} around the cursor`);
        return element('details', {}, element('summary', {}, 'Neighbours'), element('div', { class: 'scroll' }, shown));
    }

    drawing() {
        this.canvas.isDrawing = !this.canvas.isDrawing;
        if (!this.canvas.isDrawing) state.set({ line: null });
        this.fill();
    }

    /** Plots values along the line, with bands of their errors. */
    async profile() {
        const line = state.numbers('line', 4);
        this.below.hidden = state.get('line') === '';
        if (line === null) {
            this.below.replaceChildren(element('p', { class: 'warning' }, 'Line: type 4 numbers with commas between them: x and y of one end, then of the other, such as 10,20,80,20.'));
            return;
        }
        const { width, height } = this.item.about;
        const [x0, y0, x1, y1] = line;
        const count = Math.max(Math.abs(x1 - x0), Math.abs(y1 - y0)) + 1;
        const places = Array.from({ length: count }, (_, i) => {
            const t = count === 1 ? 0 : i / (count - 1);
            const at = [Math.round(x0 + t * (x1 - x0)), Math.round(y0 + t * (y1 - y0))];
            return [Math.min(Math.max(at[0], 0), width - 1), Math.min(Math.max(at[1], 0), height - 1)];
        });
        // Beyond an image of another size there is nothing.
        const along = (index, plane) => places.map(([px, py]) => (px < this.items[index].about.width && py < this.items[index].about.height ? plane[py * this.items[index].about.width + px] : NaN));
        const length = Math.hypot(x1 - x0, y1 - y0);
        const x = places.map((_, i) => (count === 1 ? 0 : i / (count - 1) * length));
        const comparison = this.comparison();
        const indices = comparison.kind ? [this.index, comparison.index] : [this.index];
        const channels = this.channel() === '' ? this.channels() : [this.channel()];
        const curves = await Promise.all(indices.flatMap((index, k) => channels.map(async (channel, i) => {
            const values = await this.plane(index, this.layer(), channel);
            const variance = this.variance(this.items[index]) ? await this.plane(index, varianceOf(this.layer()), channel) : null;
            const name = indices.length > 1 ? `${channel} of ${this.items[index].name}` : channel;
            const errors = variance && along(index, variance).map(Math.sqrt);
            return { name, colour: colourOf(channel, i), isDashed: k > 0, values: along(index, values), errors };
        })));
        plotCurves(this.below, x, curves, { xName: 'distance', xLabel: `pixels from (${x0}, ${y0}) to (${x1}, ${y1})`, height: 190, title: 'Profile along the line, with bands of one standard error' });
    }

    keepView() {
        const { x, y, zoom } = this.canvas.view;
        // A view that fits every window is none to keep.
        if (this.canvas.isFitted) state.set({ view: null });
        else state.set({ view: [x, y, zoom].map((v) => Number(v.toPrecision(6))).join(',') });
    }

    follow(scene) {
        const cursor = state.get('cursor');
        state.keep([]);
        state.set({ item: scene, pixel: cursor || `${Math.floor(this.item.about.width / 2)},${Math.floor(this.item.about.height / 2)}` });
    }

    /** The whole picture as it is shown, as a file. */
    savePng() {
        const { width, height, planes, encode } = this.canvas.pictures[0];
        const canvas = element('canvas', { width, height });
        const context = canvas.getContext('2d', { alpha: false });
        const image = context.createImageData(width, height);
        image.data.fill(255);
        const values = new Float64Array(planes.length);
        for (let i = 0; i < width * height; i += 1) {
            for (let c = 0; c < planes.length; c += 1) values[c] = planes[c][i];
            encode(values, image.data, 4 * i);
        }
        context.putImageData(image, 0, 0);
        canvas.toBlob((blob) => this.save(blob, 'png'));
    }

    /** The image with all its layers, as a file. */
    async saveExr() {
        this.save(new Blob([await api.bytes(`${this.index}/image.exr`)], { type: 'image/x-exr' }), 'exr');
    }

    save(blob, extension) {
        const link = element('a', { href: URL.createObjectURL(blob), download: `${this.item.name.replace(/\.[^.]*$/, '')}.${extension}` });
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    }

    /** A render has a new picture. Unless it is set, the exposure is that of the first, second, fourth picture, and so on. */
    async renew(version) {
        api.forget(`${this.index}/`);
        this.version = version;
        if (!Number.isInteger(Math.log2(version))) return this.show();
        const { about } = await api.json(`${this.index}/about`);
        this.item.about.exposure = about.exposure;
        return this.fill();
    }

    /** The state has changed: other layers have other controls. */
    update() {
        refresh(this.controls);
        this.canvas.cursor = state.numbers('cursor', 2);
        this.canvas.draw();
        const names = ['layer', 'channel', 'compare', 'with', 'quantity', 'exposure', 'curve', 'white', 'scale', 'log', 'low', 'high', 'split', 'line'];
        const key = names.map((name) => state.get(name)).join('\n');
        if (key !== this.key) {
            const kind = [...names.slice(0, 3).map((name) => state.get(name)), state.get('line') !== ''].join('\n');
            const isSame = kind === this.kind && !bin(this.layer());
            this.key = key;
            this.kind = kind;
            if (isSame) this.show();
            else this.fill();
        } else this.read();
    }

    close() {
        clearInterval(this.playing);
    }
}
