// Numbers as text.

/** A number with about `digits` digits. */
export function plain(value, digits = 5) {
    if (!Number.isFinite(value)) return Number.isNaN(value) ? 'not known' : value > 0 ? '∞' : '−∞';
    const size = Math.abs(value);
    const text = size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(digits - 1) : String(Number(value.toPrecision(digits)));
    return text.replace('-', '−').replace('e−', 'e−').replace('e+', 'e');
}

/** A value with its standard error: as many digits as the error justifies. */
export function withError(value, error) {
    if (!Number.isFinite(error)) return `${plain(value)} ± ?`;
    if (error === 0 || !Number.isFinite(value)) return `${plain(value)} ± ${plain(error, 2)}`;
    const digits = Math.ceil(Math.log10(Math.max(Math.abs(value), error) / error)) + 2;
    return `${plain(value, Math.min(Math.max(digits, 2), 8))} ± ${plain(error, 2)}`;
}

/** A number of things. */
export function counted(number, one, several = `${one}s`) {
    return `${number} ${number === 1 ? one : several}`;
}

/** Seconds as a clock shows them. */
export function clock(seconds) {
    const s = Math.round(seconds);
    const two = (n) => String(n).padStart(2, '0');
    return s < 3600 ? `${Math.floor(s / 60)}:${two(s % 60)}` : `${Math.floor(s / 3600)}:${two(Math.floor(s / 60) % 60)}:${two(s % 60)}`;
}
