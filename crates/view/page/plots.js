// Plots, by uPlot.

import uPlot from './vendor/uplot.js';
import { plain } from './format.js';

const COLOURS = ['#ff8080', '#7ddc7d', '#80b4ff', '#ffd166', '#d19cff', '#6fe0d8'];

const AXIS = { stroke: '#aeb6c2', grid: { stroke: '#2b313b', width: 1 }, ticks: { stroke: '#3a414d' }, font: '12px system-ui, sans-serif' };

/** The colour of a curve: of a channel by its name, or by its number. */
export function colourOf(name, number) {
    const known = { R: 0, G: 1, B: 2, Y: 3 }[name];
    return COLOURS[(known ?? number) % COLOURS.length];
}

/**
 * Draws curves with bands of their errors into `parent`: `x` is an array, each curve { name, colour, values, errors, isDashed }.
 * `options`: height, xName (in the legend), xLabel, yLabel, isLogarithmic (both axes),
 * isValueLogarithmic (the vertical axis), steps (values are counts of bins).
 */
export function plotCurves(parent, x, curves, options = {}) {
    const isValueLogarithmic = Boolean(options.isLogarithmic || options.isValueLogarithmic);
    const drawn = (v) => (Number.isFinite(v) && (v > 0 || !isValueLogarithmic) ? v : null);
    const series = [{ label: options.xName ?? 'x', value: (_, v) => (v === null ? '' : plain(v)) }];
    const [data, bands] = [[x], []];
    const hidden = { stroke: 'transparent', points: { show: false }, legend: { show: false } };
    for (const { name, colour, values, errors, isDashed } of curves) {
        const shown = (_, v, __, i) => (v === null || i === null ? '' : errors ? `${plain(v)} ± ${plain(errors[i], 2)}` : plain(v));
        const paths = options.steps ? { paths: uPlot.paths.stepped({ align: 1 }), fill: `${colour}40` } : {};
        series.push({ label: name, stroke: colour, width: 1.5, dash: isDashed ? [5, 4] : [], points: { show: false }, value: shown, ...paths });
        data.push(Array.from(values, drawn));
        if (!errors) continue;
        const edge = (sign) => Array.from(values, (v, i) => drawn(v + sign * errors[i]));
        bands.push({ series: [series.length, series.length + 1], fill: `${colour}40` });
        series.push({ ...hidden, label: `${name} + error` }, { ...hidden, label: `${name} − error` });
        data.push(edge(1), edge(-1));
    }
    const logarithmic = (is) => (is ? { distr: 3 } : {});
    const values = (_, ticks) => ticks.map((v) => (v === null ? '' : plain(v, 3)));
    const plot = new uPlot({
        width: Math.max(parent.clientWidth, 200),
        height: options.height ?? 170,
        scales: { x: { time: false, ...logarithmic(options.isLogarithmic) }, y: logarithmic(isValueLogarithmic) },
        axes: [{ ...AXIS, values, label: options.xLabel, labelSize: 18, size: 34 }, { ...AXIS, values, size: 62, label: options.yLabel, labelSize: 16 }],
        series,
        bands,
        legend: { show: options.legend !== false },
    }, data, element(parent, options.title ?? 'Plot'));
    // The rows of edges of bands.
    plot.root.querySelectorAll('.u-legend .u-series').forEach((row, i) => {
        if (series[i]?.legend?.show === false) row.hidden = true;
    });
    return plot;
}

function element(parent, title) {
    const holder = document.createElement('div');
    holder.className = 'plot';
    holder.setAttribute('role', 'img');
    holder.setAttribute('aria-label', title);
    parent.replaceChildren(holder);
    return holder;
}

/** Counts of finite values in bins of a range. */
export function histogram(values, [low, high], bins = 128) {
    const counts = new Float64Array(bins);
    const scale = bins / (high - low || 1);
    for (const value of values) {
        const bin = Math.floor((value - low) * scale);
        if (bin >= 0 && bin < bins) counts[bin] += 1;
        else if (value === high) counts[bins - 1] += 1;
    }
    const x = Array.from(counts, (_, i) => low + (i + 0.5) * (high - low) / bins);
    return [x, counts];
}

/** Quantiles of the finite values, from at most `most` of them, evenly taken. */
export function quantiles(values, shares, most = 200000) {
    const step = Math.max(Math.floor(values.length / most), 1);
    const some = [];
    for (let i = 0; i < values.length; i += step) if (Number.isFinite(values[i])) some.push(values[i]);
    some.sort((a, b) => a - b);
    return shares.map((share) => (some.length === 0 ? NaN : some[Math.min(Math.floor(share * some.length), some.length - 1)]));
}
