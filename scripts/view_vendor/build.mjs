// Bundles the libraries of the viewer's page into crates/view/page/vendor, with their licences: npm ci && node build.mjs
// With --check, only says whether what is there is what would be built.
import { build } from 'esbuild';
import { copyFileSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const target = join(here, '../../crates/view/page/vendor');
const modules = join(here, 'node_modules');
const FILES = ['three.js', 'uplot.js', 'uplot.css', 'LICENSES.txt'];

async function bundle(folder) {
    const options = { bundle: true, format: 'esm', minify: true, legalComments: 'inline', target: 'es2022', absWorkingDir: here };
    await build({ ...options, entryPoints: ['three.entry.js'], outfile: join(folder, 'three.js') });
    await build({ ...options, entryPoints: [join(modules, 'uplot/dist/uPlot.esm.js')], outfile: join(folder, 'uplot.js') });
    copyFileSync(join(modules, 'uplot/dist/uPlot.min.css'), join(folder, 'uplot.css'));
    const licences = ['three', 'uplot'].map((name) => {
        const { version } = JSON.parse(readFileSync(join(modules, name, 'package.json'), 'utf8'));
        return `${name} ${version}\n\n${readFileSync(join(modules, name, 'LICENSE'), 'utf8').trim()}\n`;
    });
    writeFileSync(join(folder, 'LICENSES.txt'), licences.join('\n\n'));
}

if (process.argv.includes('--check')) {
    const folder = mkdtempSync(join(tmpdir(), 'vendor'));
    await bundle(folder);
    const other = FILES.filter((name) => !readFileSync(join(folder, name)).equals(readFileSync(join(target, name))));
    rmSync(folder, { recursive: true });
    if (other.length > 0) {
        console.error(`crates/view/page/vendor is not what build.mjs makes: ${other.join(', ')}`);
        process.exit(1);
    }
} else {
    await bundle(target);
}
