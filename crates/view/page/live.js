// A render under way: how far it is, how its error falls; pause, go on, stop.

import * as api from './api.js';
import { button, element, say } from './controls.js';
import { clock, plain } from './format.js';
import { plotCurves } from './plots.js';

/** Milliseconds between two questions. */
const INTERVAL = 500;

/** Waits until a render has its first picture, and returns what it is. */
export async function begun(index) {
    for (;;) {
        await api.json(`${index}/status`);
        const item = await api.json(`${index}/about`);
        if (item.about) return item;
        say('The render has not begun yet');
        await new Promise((resolve) => setTimeout(resolve, INTERVAL));
    }
}

export class LiveBar {
    constructor(parent, side, index, onPicture) {
        Object.assign(this, { index, onPicture, version: -1, history: [] });
        this.bar = element('progress', { max: 1, 'aria-label': 'Progress of the render' });
        this.text = element('span', { id: 'progress' });
        this.pause = button('Pause', () => this.command(this.isPaused ? 'continue' : 'pause'));
        this.stop = button('Stop', () => this.command('stop'), { title: 'Ends the render, which then writes its files' });
        parent.replaceChildren(this.bar, this.text, this.pause, this.stop);
        this.plot = element('div', { id: 'error' });
        side.append(element('h2', {}, 'Error of the mean'), this.plot);
        this.ask();
    }

    async command(name) {
        this.show(await api.post(`${this.index}/command`, { name }));
    }

    async ask() {
        try {
            const status = await api.json(`${this.index}/status`);
            this.show(status);
            if (status.version !== this.version) {
                this.version = status.version;
                await this.onPicture(status.version);
                this.follow(status);
            }
            if (status.ended) return;
        } catch (error) {
            say(error.message, true);
            return;
        }
        this.timer = setTimeout(() => this.ask(), INTERVAL);
    }

    show(status) {
        this.isPaused = status.paused;
        this.bar.value = status.fraction;
        const samples = status.total === null ? plain(status.done) : `${plain(status.done)}/${plain(status.total)}`;
        const left = status.left === null ? '' : ` · ${clock(status.left)} left`;
        const what = status.ended ? 'done' : status.stopping ? 'stopping' : status.paused ? 'paused' : `${Math.round(100 * status.fraction)} %`;
        this.text.textContent = `${what} · ${samples} spp · mean ${plain(status.mean ?? NaN, 4)} ± ${plain(status.error ?? NaN, 2)}${left}`;
        this.pause.textContent = status.paused ? 'Go on' : 'Pause';
        this.pause.disabled = this.stop.disabled = status.stopping;
        this.pause.hidden = this.stop.hidden = status.ended;
    }

    follow({ elapsed, error }) {
        if (!(error > 0 && elapsed > 0)) return;
        this.history.push([elapsed, error]);
        if (this.history.length < 2) return;
        const [x, values] = [0, 1].map((k) => this.history.map((point) => point[k]));
        plotCurves(this.plot, x, [{ name: 'error', colour: '#ffd166', values }], { xLabel: 'seconds', height: 140, isLogarithmic: true, legend: false, title: 'Standard error of the mean over time' });
    }

    close() {
        clearTimeout(this.timer);
    }
}
