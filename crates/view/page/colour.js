// From values to what a screen shows.

/** Entries of tables of encoded values. */
const ENTRIES = 65536;
/** Linear value that becomes white under the filmic curve. */
const WHITE = 5.6;

function srgb(value) {
    return value <= 0.0031308 ? 12.92 * value : 1.055 * value ** (1 / 2.4) - 0.055;
}

/** The curve of J. Hable, "Uncharted 2: HDR Lighting", Game Developers Conference 2010, as `morgana tonemap` has it. */
function filmic(value) {
    const hable = (x) => (x * (0.15 * x + 0.1 * 0.5) + 0.2 * 0.02) / (x * (0.15 * x + 0.5) + 0.2 * 0.3) - 0.02 / 0.3;
    return hable(2 * value) / hable(2 * WHITE);
}

/**
 * A function from the linear value of a channel (0 to 2) to a byte: after a gain of so many stops and those of the channels, cut off
 * at white or compressed.
 */
export function toneCurve(stops, curve, gains = [1, 1, 1]) {
    const top = curve === 'filmic' ? WHITE : 1;
    const scales = gains.map((gain) => gain * (2 ** stops) * (ENTRIES - 1) / top);
    const bytes = new Uint8Array(ENTRIES);
    for (let i = 0; i < ENTRIES; i += 1) {
        const value = i / (ENTRIES - 1) * top;
        bytes[i] = Math.round(255 * srgb(curve === 'filmic' ? Math.min(filmic(value), 1) : value));
    }
    return (value, channel = 1) => {
        const at = value * scales[channel] + 0.5;
        // NaN is neither.
        return at >= ENTRIES ? 255 : at > 0 ? bytes[at | 0] : 0;
    };
}

/** A colour of given lightness, chroma and hue (degrees) in OKLCh (B. Ottosson 2020), as bytes. */
function oklch(lightness, chroma, hue) {
    const [a, b] = [chroma * Math.cos(hue * Math.PI / 180), chroma * Math.sin(hue * Math.PI / 180)];
    const l = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3;
    const m = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3;
    const s = (lightness - 0.0894841775 * a - 1.291485548 * b) ** 3;
    return [
        4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s,
        -1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s,
        -0.0041960863 * l - 0.7034186147 * m + 1.707614701 * s,
    ].map((v) => Math.round(255 * srgb(Math.min(Math.max(v, 0), 1))));
}

const mix = (a, b, t) => a + (b - a) * t;

/** Coefficients of t⁰ to t⁶ of red, green and blue: a polynomial through viridis (S. van der Walt and N. Smith 2015), within 0.013. */
const VIRIDIS = [
    [0.277727, 0.105093, -0.330862, -4.63423, 6.22827, 4.77638, -5.43546],
    [0.00540734, 1.40461, 0.214848, -5.7991, 14.1799, -13.7451, 4.64585],
    [0.3341, 1.38459, 0.0950952, -19.3324, 56.6906, -65.353, 26.3124],
];

function viridis(t) {
    const sum = (coefficients) => coefficients.reduceRight((rest, c) => rest * t + c, 0);
    return VIRIDIS.map((coefficients) => Math.round(255 * Math.min(Math.max(sum(coefficients), 0), 1)));
}

/** Scales of colours, each a function of t in [0, 1]. Lightness grows evenly, or falls evenly from the middle to both ends. */
const SCALES = {
    viridis,
    grey: (t) => oklch(mix(0, 1, t), 0, 0),
    diverging: (t) => {
        const s = 2 * t - 1;
        return oklch(mix(0.97, 0.45, Math.abs(s)), 0.16 * Math.abs(s), s < 0 ? 250 : 27);
    },
};

/** Names of the scales for values, as `[value, text]`. */
export const SCALE_NAMES = [['viridis', 'viridis'], ['grey', 'grey'], ['diverging', 'diverging (blue, white, red)']];

/** Bytes of 256 colours of a scale. */
export function scale(name) {
    const table = new Uint8Array(768);
    for (let i = 0; i < 256; i += 1) table.set((SCALES[name] ?? SCALES.viridis)(i / 255), 3 * i);
    return table;
}

/** Colour of values that are not known. */
const UNKNOWN = [110, 110, 110];

/** A function that encodes a value in colours of a scale, over a range. */
export function encoder(name, range, isLogarithmic) {
    const colours = scale(name);
    return ([value], out, at) => {
        const t = position(value, range, isLogarithmic);
        for (let c = 0; c < 3; c += 1) out[at + c] = Number.isNaN(t) ? UNKNOWN[c] : colours[3 * Math.min(Math.floor(256 * t), 255) + c];
    };
}

/** Where a value lies in a range, 0 to 1; NaN if it is not known. */
export function position(value, [low, high], isLogarithmic) {
    const t = isLogarithmic ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low);
    return value <= low ? 0 : value >= high ? 1 : t;
}

/** The value at a position of a range. */
export function valueAt(t, [low, high], isLogarithmic) {
    return isLogarithmic ? low * (high / low) ** t : mix(low, high, t);
}
