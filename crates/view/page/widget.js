// The page in a notebook, without a server: an anywidget whose requests travel as messages to the kernel.
//
// The page runs in a frame of its own, so that styles do not mix. Its modules come from the kernel, too.

/** Imports of other files of the page, as `from './x.js'` and `import('./x.js')`. */
const IMPORTS = /(from |import\()'\.\/([^']+)'/g;

/** A function that asks the kernel: for a method, a path and a body, it gives { status, kind, bytes }. */
function connected(model) {
    const name = Math.random().toString(36).slice(2);
    const waiting = new Map();
    let count = 0;
    const answered = ({ id, status, kind }, buffers) => {
        const resolve = waiting.get(id);
        waiting.delete(id);
        const view = buffers?.[0];
        // Notebooks send views of larger buffers.
        const bytes = view ? (view.buffer ? view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength) : view) : new ArrayBuffer(0);
        resolve?.({ status, kind, bytes });
    };
    model.on('msg:custom', answered);
    const ask = (method, path, body = '') => new Promise((resolve) => {
        const id = `${name}${(count += 1)}`;
        waiting.set(id, resolve);
        model.send({ id, method, path, body });
    });
    return [ask, () => model.off('msg:custom', answered)];
}

/** Addresses of modules, each after those that it imports. */
class Modules {
    constructor(ask) {
        this.ask = ask;
        this.found = new Map();
    }

    text = async (name) => new TextDecoder().decode((await this.ask('GET', name)).bytes);

    address(name) {
        if (!this.found.has(name)) this.found.set(name, this.made(name));
        return this.found.get(name);
    }

    async made(name) {
        const text = await this.text(name);
        const names = [...new Set([...text.matchAll(IMPORTS)].map((match) => match[2]))];
        const addresses = new Map(await Promise.all(names.map(async (other) => [other, await this.address(other)])));
        const complete = text.replace(IMPORTS, (_, before, other) => `${before}'${addresses.get(other)}'`);
        return URL.createObjectURL(new Blob([complete], { type: 'text/javascript' }));
    }
}

/** The page as one document. */
async function wholePage(modules) {
    const page = new DOMParser().parseFromString(await modules.text('index.html'), 'text/html');
    page.querySelector('link[rel=icon]')?.remove();
    for (const link of page.querySelectorAll('link[rel=stylesheet]')) {
        const style = page.createElement('style');
        style.textContent = await modules.text(link.getAttribute('href'));
        link.replaceWith(style);
    }
    for (const script of page.querySelectorAll('script[src]')) script.src = await modules.address(script.getAttribute('src'));
    return `<!DOCTYPE html>${page.documentElement.outerHTML}`;
}

async function render({ model, el }) {
    const [ask, disconnect] = connected(model);
    const frame = document.createElement('iframe');
    frame.title = 'morgana';
    frame.style.cssText = `border: 0; width: 100%; height: ${model.get('height')}px`;
    // The page finds this function by its frame.
    frame.ask = ask;
    el.append(frame);
    frame.srcdoc = await wholePage(new Modules(ask));
    return disconnect;
}

export default { render };
