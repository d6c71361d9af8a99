// Requests to the program that serves the page.

/** Bytes of planes that are kept, at most. */
const KEPT = 600e6;
/** Milliseconds before a request that came too soon is repeated. */
const AGAIN = 300;

/** What is said if nobody answers. */
const GONE = 'The program that shows this page has ended. Start it again, and open the address that it prints.';

const planes = new Map();

/** In a notebook, what asks the kernel in place of a server (widget.js). */
function kernel() {
    try {
        return window.frameElement?.ask ?? null;
    } catch {
        // Frames of other origins are served.
        return null;
    }
}

const ask = kernel();

/** The response of the kernel, as a server would give it. */
async function fromKernel(path, { method = 'GET', body = '' } = {}) {
    const { status, kind, bytes } = await ask(method, path, body);
    return new Response(bytes, { status, headers: { 'Content-Type': kind } });
}

async function request(path, options) {
    for (;;) {
        const asked = ask ? fromKernel(`api/${path}`, options) : fetch(`api/${path}`, options);
        const response = await asked.catch(() => null);
        if (!response) throw new Error(GONE);
        if (response.ok) return response;
        if (response.status !== 429) throw new Error(await response.text());
        await new Promise((resolve) => setTimeout(resolve, AGAIN));
    }
}

/** The answer to a question, as an object. */
export async function json(path) {
    return (await request(path)).json();
}

/** The answer to a command. */
export async function post(path, body) {
    const headers = { 'Content-Type': 'application/json' };
    return (await request(path, { method: 'POST', headers, body: JSON.stringify(body) })).json();
}

/** The answer to a command, as numbers. */
export async function postFloats(path, body) {
    const headers = { 'Content-Type': 'application/json' };
    return new Float32Array(await (await request(path, { method: 'POST', headers, body: JSON.stringify(body) })).arrayBuffer());
}

/** The answer as bytes. */
export async function bytes(path) {
    return (await request(path)).arrayBuffer();
}

/** Numbers; those of the last requests are kept. */
export function floats(path) {
    let found = planes.get(path);
    planes.delete(path);
    if (!found) {
        found = { values: bytes(path).then((buffer) => new Float32Array(buffer)), size: 0 };
        found.values.then((values) => { found.size = values.byteLength; forget(); }, () => planes.delete(path));
    }
    // The most recent is the last.
    planes.set(path, found);
    return found.values;
}

/** Forgets the oldest planes beyond a limit, or all whose path starts in some way. */
export function forget(start = null) {
    let size = 0;
    for (const [path, { size: bytes }] of [...planes].reverse()) {
        size += bytes;
        if (start === null ? size > KEPT : path.startsWith(start)) planes.delete(path);
    }
}

/** A query of parameters. */
export function query(path, parameters) {
    return `${path}?${new URLSearchParams(parameters)}`;
}
