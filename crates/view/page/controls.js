// Elements of the page. Names come from files: they are always set as text.

import * as state from './state.js';

/** An element with attributes, and children that are elements or texts. */
export function element(name, attributes = {}, ...children) {
    const made = document.createElement(name);
    for (const [key, value] of Object.entries(attributes)) {
        if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
        else if (value !== null && value !== false) made.setAttribute(key, value === true ? '' : value);
    }
    made.append(...children);
    return made;
}

let count = 0;

/** A labelled control. */
function field(label, control) {
    control.id = `control${(count += 1)}`;
    return element('div', { class: 'field' }, element('label', { for: control.id }, label), control);
}

/** A choice of `[value, text]` that is a parameter of the state. */
export function choice(label, name, options, fallback) {
    const items = options.map(([value, text]) => element('option', { value }, text));
    const select = element('select', { 'data-name': name, onchange: () => state.set({ [name]: select.value }) }, ...items);
    select.value = state.get(name, fallback);
    if (select.selectedIndex < 0) select.value = fallback;
    return field(label, select);
}

/** A number that is a parameter of the state; `attributes` are those of the input. */
export function number(label, name, attributes, fallback) {
    const input = element('input', { type: 'number', 'data-name': name, ...attributes });
    const changed = () => state.set({ [name]: input.value });
    input.addEventListener(attributes.type === 'range' ? 'input' : 'change', changed);
    input.value = state.get(name, fallback);
    const labelled = field(label, input);
    // A slider alone does not say where it is.
    if (attributes.type === 'range') {
        labelled.classList.add('ranged');
        labelled.append(element('output', { for: input.id }, input.value));
    }
    return labelled;
}

/** A text that is a parameter of the state. */
export function text(label, name, placeholder) {
    const input = element('input', { type: 'text', 'data-name': name, placeholder, autocomplete: 'off' });
    input.addEventListener('change', () => state.set({ [name]: input.value }));
    input.value = state.get(name);
    return field(label, input);
}

/** A switch that is a parameter of the state. */
export function toggle(label, name, isOn = false) {
    const standard = isOn ? '1' : '0';
    const input = element('input', { type: 'checkbox', 'data-name': name, 'data-standard': standard });
    input.checked = state.get(name, standard) === '1';
    input.addEventListener('change', () => state.set({ [name]: input.checked === isOn ? '' : Number(input.checked) }));
    return field(label, input);
}

/** Whether an array is shown as a picture or by slices; nothing if it can only be one of these. */
export function shownAs({ kind, other }) {
    return other ? [choice('Shown as', 'as', [['image', 'picture'], ['arrays', 'slices']], kind)] : [];
}

/** A button. */
export function button(label, action, attributes = {}) {
    return element('button', { type: 'button', onclick: action, ...attributes }, label);
}

/** A table with a head. */
export function table(head, rows, caption) {
    const cells = (tag, row) => row.map((cell) => element(tag, tag === 'th' ? { scope: 'col' } : {}, cell));
    const body = rows.map((row) => element('tr', {}, ...cells('td', row)));
    return element('table', { 'aria-label': caption }, element('thead', {}, element('tr', {}, ...cells('th', head))), element('tbody', {}, ...body));
}

/** Says something in the header; `isFailed` if it is a failure. */
export function say(message, isFailed = false) {
    const status = document.getElementById('status');
    status.textContent = message;
    status.classList.toggle('failed', isFailed);
}

let settledCount = 0;

/** Notes that the page shows what was asked for, for programs that drive it. */
export function settled() {
    document.body.dataset.shown = String(settledCount += 1);
}

/** Gives controls the values that the state has by now. */
export function refresh(parent) {
    for (const control of parent.querySelectorAll('[data-name]')) {
        const value = state.get(control.dataset.name);
        if (control.type === 'checkbox') control.checked = (value || control.dataset.standard) === '1';
        else if (control !== document.activeElement && (value !== '' || control.type === 'text')) control.value = value;
        const output = control.parentElement.querySelector('output');
        if (output) output.textContent = control.value;
    }
}

/** Shows controls again, without taking the focus from that which has it. */
export function refill(parent, ...children) {
    const focused = parent.contains(document.activeElement) ? document.activeElement.dataset?.name : null;
    parent.replaceChildren(...children);
    if (focused) parent.querySelector(`[data-name="${CSS.escape(focused)}"]`)?.focus();
}
