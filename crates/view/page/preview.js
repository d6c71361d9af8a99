// Previews of a scene: coarse at first, then finer, then the mean of many samples.

import * as api from './api.js';
import { toneCurve } from './colour.js';

/** Pixels of the picture along a pixel of the first, coarse sample. */
const COARSE = 8;
/** Longest side of a picture. */
const LONGEST = 480;
/** Samples of the finest picture: of a preview, and of another estimator. */
const SAMPLES = [64, 4096];
/** A name of this page: the program gives up a picture if its page wants another. */
const PAGE = String(Math.random());
/** Milliseconds and samples after which a coarse picture gives way to a finer one. */
const ENOUGH = { milliseconds: 250, samples: 8 };

export class Preview {
    /** `onPicture(picture, { number, scale, first, milliseconds })`: a better picture is there, so many milliseconds after the wish; `onError(message)`: there will be none. */
    constructor(index, onPicture, onError) {
        Object.assign(this, { index, onPicture, onError, turn: 0, isCoarse: false, waiting: null });
    }

    /** Makes pictures of a size until there is another wish: `view` names the camera (null for the scene's own), the estimator (null for previews) and changed parameters. */
    want([width, height], view) {
        const shrink = Math.max(1, width / LONGEST, height / LONGEST);
        const job = { view, size: [width / shrink, height / shrink], since: performance.now() };
        // The first, coarse sample takes little time. The program gives up others.
        if (this.isCoarse) this.waiting = job;
        else this.start(job);
    }

    /** Makes no more pictures. */
    stop() {
        this.turn += 1;
        this.waiting = null;
        this.isCoarse = false;
    }

    async start(job) {
        const turn = (this.turn += 1);
        try {
            await this.refine(job, turn);
        } catch (error) {
            if (turn === this.turn && !this.waiting) this.onError(error.message);
        }
        if (turn !== this.turn) return;
        this.isCoarse = false;
        const next = this.waiting;
        this.waiting = null;
        if (next) this.start(next);
    }

    async refine({ view, size: whole, since }, turn) {
        const samples = SAMPLES[view.estimator ? 1 : 0];
        let [scale, number, sums, start, first] = [COARSE, 0, null, since, null];
        while (number < samples && turn === this.turn && !this.waiting) {
            const size = whole.map((n) => Math.max(1, Math.round(n / scale)));
            this.isCoarse = first === null;
            const values = await api.postFloats(`${this.index}/picture`, { page: PAGE, size, number, ...view });
            if (turn !== this.turn) return;
            number += 1;
            sums = sums ? sums.map((sum, i) => sum + values[i]) : values;
            const now = performance.now();
            first ??= now - since;
            this.isCoarse = false;
            this.onPicture(drawn(sums, size, number), { number, scale, first, milliseconds: now - since });
            const isEnough = now - start > ENOUGH.milliseconds || number >= ENOUGH.samples;
            if (scale > 1 && isEnough) [scale, number, sums, start] = [scale / 2, 0, null, now];
        }
    }
}

/** The mean of samples as a picture: the first number is the exposure, the others are red, green and blue. */
function drawn(sums, [width, height], number) {
    const tone = toneCurve(sums[0] / number, 'srgb');
    const picture = new ImageData(width, height);
    for (let i = 0; i < width * height; i += 1) {
        for (let c = 0; c < 3; c += 1) picture.data[4 * i + c] = tone(sums[1 + 3 * i + c] / number);
        picture.data[4 * i + 3] = 255;
    }
    return picture;
}

/** Draws a picture over a whole canvas. */
export function fill(canvas, picture) {
    const context = canvas.getContext('2d');
    const small = document.createElement('canvas');
    [small.width, small.height] = [picture.width, picture.height];
    small.getContext('2d').putImageData(picture, 0, 0);
    context.drawImage(small, 0, 0, canvas.width, canvas.height);
}
