// The page: which of the things that are shown is in view.

import * as api from './api.js';
import * as state from './state.js';
import { choice, element, say } from './controls.js';
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
    chooser.replaceChildren(...(items.length > 1 ? [choice('Show', 'item', items.map((item, i) => [i, item.name]), index)] : []));
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

state.onChange(() => {
    if (wanted() !== shown) {
        // What was chosen for another thing says nothing of this one.
        state.keep(['item', 'pixel', 'layer', 'exposure']);
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
