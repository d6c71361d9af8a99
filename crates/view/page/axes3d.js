// Axes with ticks in units along the edges of a box in three dimensions, drawn over the picture.

import * as three from './vendor/three.js';
import { roundBelow, ticks } from './axes.js';
import { plain } from './format.js';

const FONT = 12;
/** Distance between ticks in pixels, at least. */
const BETWEEN = 46;
/** Length of the scale in pixels, at most. */
const BAR = 160;
/** Distance of numbers and of labels from their axis, in pixels. */
const [NUMBERS, LABEL] = [14, 40];

export class AxesOverlay {
    constructor(parent) {
        this.canvas = document.createElement('canvas');
        this.canvas.className = 'overlay';
        this.canvas.setAttribute('aria-hidden', 'true');
        parent.append(this.canvas);
        this.context = this.canvas.getContext('2d');
    }

    /** Draws axes along a box `[min, max]` of the scene, whose values run through `ranges` along x, y and z. */
    setBox([min, max], ranges, labels) {
        Object.assign(this, { min, max, ranges, labels });
    }

    /** Draws the axes, and with a `target` the scale at its distance. */
    draw(camera, target = null) {
        const ratio = window.devicePixelRatio || 1;
        const { clientWidth, clientHeight } = this.canvas.parentElement;
        Object.assign(this.canvas, { width: clientWidth * ratio, height: clientHeight * ratio });
        if (!this.min) return;
        const context = this.context;
        context.setTransform(ratio, 0, 0, ratio, 0, 0);
        Object.assign(context, { font: `${FONT}px system-ui, sans-serif`, textAlign: 'center', textBaseline: 'middle', fillStyle: '#c9d0da', strokeStyle: '#8b94a3', lineWidth: 1 });
        const screen = (p) => {
            const v = new three.Vector3(...p).project(camera);
            return v.z < 1 ? [(v.x + 1) / 2 * clientWidth, (1 - v.y) / 2 * clientHeight] : null;
        };
        const middle = screen([0, 1, 2].map((i) => (this.min[i] + this.max[i]) / 2));
        if (!middle) return;
        this.outline(screen);
        for (let axis = 0; axis < 3; axis += 1) this.axis(axis, screen, middle);
        if (target) this.scale(camera, camera.position.distanceTo(target), clientHeight);
    }

    /** A bar as long as a round length is at a distance. */
    scale(camera, distance, height) {
        const pixels = height / (2 * distance * Math.tan(camera.fov * Math.PI / 360));
        const length = roundBelow(BAR / pixels);
        const [context, left, bottom] = [this.context, 16, height - 16];
        context.lineWidth = 2;
        context.beginPath();
        context.moveTo(left, bottom - 4);
        context.lineTo(left, bottom);
        context.lineTo(left + length * pixels, bottom);
        context.lineTo(left + length * pixels, bottom - 4);
        context.stroke();
        context.textAlign = 'left';
        context.fillText(`${plain(length, 3)} at the middle of the view`, left, bottom - 14);
    }

    /** The edges of the box, faintly. */
    outline(screen) {
        const corner = (k) => screen([0, 1, 2].map((i) => ((k >> i) & 1 ? this.max : this.min)[i]));
        this.context.globalAlpha = 0.3;
        this.context.beginPath();
        for (let k = 0; k < 8; k += 1) for (const bit of [1, 2, 4]) {
            const [a, b] = [corner(k), corner(k | bit)];
            if ((k & bit) || !a || !b) continue;
            this.context.moveTo(...a);
            this.context.lineTo(...b);
        }
        this.context.stroke();
        this.context.globalAlpha = 1;
    }

    /** The two ends of an edge of the box along an axis: the one farthest from the middle of the picture, so that nothing hides it. */
    edge(axis, screen, middle) {
        const others = [0, 1, 2].filter((i) => i !== axis);
        const edges = [0, 1, 2, 3].map((k) => [this.min, this.max].map((end) => {
            const p = [...end];
            others.forEach((i, bit) => { p[i] = ((k >> bit) & 1 ? this.max : this.min)[i]; });
            return p;
        }));
        const far = (ends) => {
            const seen = ends.map(screen);
            if (seen.includes(null)) return -1;
            const [u, v] = [0, 1].map((i) => (seen[0][i] + seen[1][i]) / 2 - middle[i]);
            // Of edges as far, the lower one.
            return Math.hypot(u, v) + 0.2 * v;
        };
        return edges.reduce((best, ends) => (far(ends) > far(best) ? ends : best));
    }

    axis(axis, screen, middle) {
        const ends = this.edge(axis, screen, middle);
        const [a, b] = ends.map(screen);
        if (!a || !b) return;
        const context = this.context;
        const line = (from, to) => {
            context.beginPath();
            context.moveTo(...from);
            context.lineTo(...to);
            context.stroke();
        };
        line(a, b);
        const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
        if (length < BETWEEN) return;
        // Away from the middle of the box.
        let normal = [(b[1] - a[1]) / length, (a[0] - b[0]) / length];
        const center = [0, 1].map((i) => (a[i] + b[i]) / 2);
        if (normal[0] * (center[0] - middle[0]) + normal[1] * (center[1] - middle[1]) < 0) normal = normal.map((v) => -v);
        const away = ([x, y], distance) => [x + distance * normal[0], y + distance * normal[1]];
        const [low, high] = this.ranges[axis];
        for (const value of ticks(low, high, Math.floor(length / BETWEEN))) {
            const t = (value - low) / (high - low);
            const at = screen([0, 1, 2].map((i) => ends[0][i] + t * (ends[1][i] - ends[0][i])));
            line(at, away(at, 5));
            context.fillText(plain(value, 5), ...away(at, NUMBERS + 4 * Math.abs(normal[0])));
        }
        context.fillText(this.labels[axis], ...away(center, LABEL));
    }
}
