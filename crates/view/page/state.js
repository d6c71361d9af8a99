// What is shown, as parameters after the # of the address: a copied address shows the same.

let values = new URLSearchParams(location.hash.slice(1));
const listeners = new Set();
let timer = 0;

/** The value of a parameter, or `fallback`. */
export function get(name, fallback = '') {
    return values.get(name) ?? fallback;
}

/** The value of a parameter as a finite number, or `fallback`. */
export function number(name, fallback = 0) {
    const value = Number.parseFloat(values.get(name));
    return Number.isFinite(value) ? value : fallback;
}

/** The value of a parameter as finite numbers between commas, or `fallback` if there are not as many. */
export function numbers(name, count, fallback = null) {
    const parts = (values.get(name) ?? '').split(',').map(Number.parseFloat);
    return parts.length === count && parts.every(Number.isFinite) ? parts : fallback;
}

/** Sets parameters; null and '' take one away. */
export function set(changes) {
    let isChanged = false;
    for (const [name, value] of Object.entries(changes)) {
        const text = value === null || value === '' ? null : String(value);
        if (text === values.get(name)) continue;
        isChanged = true;
        if (text === null) values.delete(name);
        else values.set(name, text);
    }
    if (!isChanged) return;
    // Browsers limit how often an address may change.
    clearTimeout(timer);
    timer = setTimeout(keepInAddress, 150);
    listeners.forEach((listener) => listener());
}

function keepInAddress() {
    // The frame of a notebook has no address of its own.
    if (location.protocol !== 'about:') history.replaceState(null, '', `#${values}`);
}

/** Keeps only these parameters. */
export function keep(names) {
    values = new URLSearchParams([...values].filter(([name]) => names.includes(name)));
}

/** Calls `listener` after each change. */
export function onChange(listener) {
    listeners.add(listener);
}

window.addEventListener('hashchange', () => {
    values = new URLSearchParams(location.hash.slice(1));
    listeners.forEach((listener) => listener());
});
