// Lines of equal index in planes, by marching squares.

/** Levels between the smallest and the largest index. */
const LEVELS = 9;
/** Relative difference of the index below which nothing varies. */
const LEAST = 1e-9;

/** Lines of equal index of a medium, as pairs of points: `planes` of values across x, y and z, over the box `[min, max]`. */
export function isolines(planes, [min, max]) {
    const count = Math.round(Math.sqrt(planes.length / 3));
    const known = planes.filter((v) => !Number.isNaN(v));
    const [low, high] = [Math.min, Math.max].map((best) => known.reduce((a, b) => best(a, b), known[0]));
    if (!(high - low > LEAST * high)) return { pairs: [], low, high };
    const pairs = [];
    for (let axis = 0; axis < 3; axis += 1) {
        const [u, v] = [(axis + 1) % 3, (axis + 2) % 3];
        const place = (i, j) => {
            const x = [0, 0, 0];
            x[axis] = (min[axis] + max[axis]) / 2;
            x[u] = min[u] + (max[u] - min[u]) * (i + 0.5) / count;
            x[v] = min[v] + (max[v] - min[v]) * (j + 0.5) / count;
            return x;
        };
        const plane = planes.subarray(axis * count * count, (axis + 1) * count * count);
        for (let level = 1; level <= LEVELS; level += 1) contour(plane, count, low + (high - low) * level / (LEVELS + 1), (a, b) => pairs.push([place(...a), place(...b)]));
    }
    return { pairs, low, high };
}

/** Calls `add` with both ends of each piece of the line on which values are equal to `level`. */
function contour(plane, count, level, add) {
    for (let j = 0; j + 1 < count; j += 1) for (let i = 0; i + 1 < count; i += 1) {
        const corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
        const values = corners.map(([a, b]) => plane[b * count + a]);
        if (values.some(Number.isNaN)) continue;
        const cuts = [];
        for (let k = 0; k < 4; k += 1) {
            const [a, b] = [values[k], values[(k + 1) % 4]];
            if ((a < level) === (b < level)) continue;
            const t = (level - a) / (b - a);
            cuts.push([0, 1].map((c) => corners[k][c] + t * (corners[(k + 1) % 4][c] - corners[k][c])));
        }
        for (let k = 0; k + 1 < cuts.length; k += 2) add(cuts[k], cuts[k + 1]);
    }
}
