// The page: which of the things that are shown is in view.

import * as api from './api.js';
import * as state from './state.js';
import { button, choice, element, say } from './controls.js';
import { ImagePage } from './image.js';
import { LiveBar, begun } from './live.js';
import { MeasurePage } from './measures.js';
import { ScenePage } from './scene.js';

const [stage, side, chooser, live] = ['stage', 'side', 'choice', 'live'].map((id) => document.getElementById(id));
let [page, bar, shown, shownAs] = [null, null, -1, ''];
/** Things as the program takes them to be, and as they are shown: an array may be a picture or slices. */
const [given, items] = [[], []];

async function open(index) {
    const as = state.get('as');
    [shown, shownAs] = [index, as];
    if (given[index].other) {
        const isOther = as === given[index].other;
        const item = isOther ? await api.json(api.query(`${index}/about`, { as })) : given[index];
        if (shown !== index || shownAs !== as) return;
        items[index] = item;
    }
    page?.close();
    bar?.close();
    [page, bar] = [null, null];
    for (const part of [stage, side, live]) part.replaceChildren();
    chooser.replaceChildren(...(items.length > 1 ? [choice('Show', 'item', items.map((item, i) => [i, item.name]), index), ...arrows(index)] : []));
    document.title = `${items[index].name} · morgana`;
    if (items[index].kind === 'live' && !items[index].about) {
        const item = await begun(index);
        if (shown !== index) return;
        items[index] = item;
    }
    const { kind } = items[index];
    const Page = { image: ImagePage, live: ImagePage, arrays: MeasurePage, scene: ScenePage }[kind];
    page = new Page(stage, side, items, index);
    if (kind === 'live') bar = new LiveBar(live, side, index, (version) => page.renew(version));
    if (items.length === 1) chooser.replaceChildren(items[index].name);
    if (given[index].note) side.prepend(element('p', { class: 'warning' }, given[index].note));
}

/** Buttons that lead to the item before and to the next one. */
function arrows(index) {
    const to = (step) => () => step_by(step);
    return [button('‹', to(-1), { 'aria-label': 'Previous item', title: 'Previous item (p)', disabled: index === 0 }), button('›', to(1), { 'aria-label': 'Next item', title: 'Next item (n)', disabled: index === items.length - 1 })];
}

function step_by(step) {
    const next = Math.min(Math.max(wanted() + step, 0), items.length - 1);
    if (next !== wanted()) state.set({ item: next });
}

async function show(index) {
    try {
        await open(index);
    } catch (error) {
        say(error.message, true);
    }
}

function wanted() {
    return Math.min(Math.max(Math.round(state.number('item', 0)), 0), items.length - 1);
}

document.addEventListener('keydown', (event) => {
    const isTyped = ['INPUT', 'SELECT', 'TEXTAREA'].includes(event.target.tagName);
    if (isTyped || event.ctrlKey || event.altKey || event.metaKey) return;
    if (event.key === 'n' || event.key === 'p') step_by(event.key === 'n' ? 1 : -1);
    else page?.shortcut?.(event.key);
});

// A browser would leave the page for a file that is dropped on it.
document.addEventListener('dragover', (event) => event.preventDefault());
document.addEventListener('drop', (event) => {
    event.preventDefault();
    const names = [...event.dataTransfer.files].map(({ name }) => name);
    if (names.length > 0) say(`The page shows the files that the program was started with: morgana view ${[...items, ...names.map((name) => ({ name }))].map(({ name }) => name).join(' ')}`, true);
});

state.onChange(() => {
    if (wanted() !== shown) {
        // What was chosen for another thing says nothing of this one; images are compared at the same exposure and place.
        state.keep(['item', 'pixel', 'layer', 'exposure', ...(items[wanted()].kind === 'image' ? ['view', 'cursor', 'curve', 'white'] : [])]);
        show(wanted());
    } else if (given[shown]?.other && state.get('as') !== shownAs) {
        state.keep(['item', 'as']);
        show(shown);
    } else page?.update();
});

async function start() {
    try {
        given.push(...await api.json('items'));
        items.push(...given);
        await open(wanted());
    } catch (error) {
        say(error.message, true);
    }
}

start();
// For tests, and for the console.
window.viewer = { items, state, page: () => page };
