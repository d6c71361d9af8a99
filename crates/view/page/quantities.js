// The quantities of a file: each an array of values, with those arrays that tell something about it.

/** Endings of the names of arrays about another, and what the page calls them. */
const ABOUT = [['_error', 'standard error'], ['_effective', 'effective samples'], ['_few', 'cells whose error is not to be trusted']];
/** Axes that a file does not name. */
export const UNNAMED = /^(axis|dimension) \d+$/;
/** Names of lengths in metres. */
const LENGTHS = [[1, 'm'], [1e-2, 'cm'], [1e-3, 'mm'], [1e-6, 'µm'], [1e-9, 'nm']];
const SPACE = ['x', 'y', 'z'];

/** The name of an array without that of its meter, and what precedes it. */
function parts(name) {
    const dot = name.lastIndexOf('.') + 1;
    return [name.slice(0, dot), name.slice(dot)];
}

function isSame(a, b) {
    return String(a.shape) === String(b.shape);
}

/** Arrays that only say something about others: errors, flags and edges. */
function belongs(array, arrays) {
    const isAbout = ABOUT.some(([ending]) => array.name.endsWith(ending) && arrays.some((other) => other.name + ending === array.name && isSame(other, array)));
    const [meter, name] = parts(array.name);
    const axis = name.endsWith('_edges') ? name.slice(0, -6) : null;
    const isEdges = axis !== null && arrays.some((other) => parts(other.name)[0] === meter && other.axes.some((one, i) => one === axis && other.has_edges[i]));
    return isAbout || isEdges;
}

/** Arrays of values, those with the most axes and elements first: the fluence before all others of its kind. */
export function quantities(arrays) {
    const size = ({ shape }) => shape.reduce((a, b) => a * b, 1);
    const isFluence = ({ name }) => parts(name)[1] === 'fluence';
    const found = arrays.filter((array) => !belongs(array, arrays));
    const order = (a, b) => b.shape.length - a.shape.length || isFluence(b) - isFluence(a) || size(b) - size(a);
    const sorted = [...found].sort(order);
    return sorted.length > 0 ? sorted : arrays;
}

/** What can be shown of a quantity: `[name, text]`, the values first. */
export function aspects(array, arrays) {
    const has = (name) => arrays.some((other) => other.name === name && isSame(other, array));
    const found = ABOUT.filter(([ending]) => has(array.name + ending));
    const [first, ...rest] = found.map(([ending, text]) => [ending, text]);
    const relative = first?.[0] === '_error' ? [['relative', 'relative error']] : [];
    return [['', 'value'], ...(first ? [first] : []), ...relative, ...rest];
}

/** The axes of an array that have more than one element. */
export function longAxes(array) {
    return array.shape.map((n, i) => [n, i]).filter(([n]) => n > 1).map(([, i]) => i);
}

/** The axes of an array that are x, y and z, if each has more than one element; else null. */
export function spaceOf(array) {
    const axes = SPACE.map((name) => array.axes.indexOf(name));
    return axes.every((i) => i >= 0 && array.shape[i] > 1 && array.has_edges[i]) ? axes : null;
}

/** Whether cells have equal widths. */
export function isEven(edges) {
    const width = (edges[edges.length - 1] - edges[0]) / (edges.length - 1);
    return edges.every((edge, i) => i === 0 || Math.abs(edge - edges[i - 1] - width) < 1e-3 * width);
}

/** The name of a scene unit of length in an array's file: 'mm', 'units of 0.002 m', or `unknown`. */
function lengthOf({ metres_per_unit: metres }, unknown) {
    if (!metres) return unknown;
    const known = LENGTHS.find(([length]) => Math.abs(metres / length - 1) < 1e-9);
    return known ? known[1] : `units of ${metres} m`;
}

/** The unit of an axis as the page writes it; '' if it is not known. */
export function unitOf(array, axis, arrays) {
    const edges = arrays.find(({ name }) => name === `${parts(array.name)[0]}${axis}_edges`);
    return edges?.unit === 'unit' ? lengthOf(array, 'scene units') : edges?.unit ?? '';
}

/** The unit of the values as the page writes it. */
export function unitOfValues(array) {
    const length = lengthOf(array, 'unit');
    const named = / /.test(length) ? `(${length})` : length;
    return array.unit.replace(/\bunit\b/g, named).replace(/\^2/g, '²').replace(/\^3/g, '³');
}

/** The plane, as the axes up and across, that opens first: the largest one of space, or the last two axes. */
export function firstPlane(array, edges) {
    const space = spaceOf(array);
    if (!space) return longAxes(array).slice(-2);
    const extent = (i) => edges[i][edges[i].length - 1] - edges[i][0];
    const [x, y, z] = space;
    const planes = [[z, x], [z, y], [y, x]];
    // Of equal planes, the first: depth is up in it.
    return planes.reduce((best, plane) => (extent(plane[0]) * extent(plane[1]) > 1.001 * extent(best[0]) * extent(best[1]) ? plane : best));
}
