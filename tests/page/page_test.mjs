// SPDX-License-Identifier: GPL-3.0-or-later
// page_test.mjs CHROMIUM FOLDER: opens FOLDER/page.html, and compares it with both.png, overlay.png, middle.ma, middle.json.
import { readFileSync } from 'node:fs';
import { Browser } from './browser.mjs';

const [chromium, folder] = process.argv.slice(2);
const said = [];
let failures = 0;

function check(what, good, detail = '') {
  if (good) return;
  failures++;
  console.log(`FAILED: ${what} ${detail}`);
}

/** Opens the page, listens to what it says and fetches, and waits until it is there. */
async function open(browser, width, height, dark) {
  await browser.open(width, height, `file://${folder}/page.html`, ({ method, params }) => {
    if (method === 'Runtime.consoleAPICalled') said.push(params.args.map((x) => x.value ?? x.description).join(' '));
    if (method === 'Runtime.exceptionThrown') said.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
    if (method === 'Log.entryAdded') said.push(params.entry.text);
    if (method === 'Network.requestWillBeSent' && !/^(file|data|blob):/.test(params.request.url)) said.push(`a request: ${params.request.url}`);
  }, dark);
  for (let i = 0; i < 100 && !(await browser.run('return Boolean(globalThis.qmatPage)')); i++) await new Promise((give) => setTimeout(give, 100));
}

/** How two images differ: the mean of all channels, and the share of pixels with a channel that differs by more than 48. */
const COMPARE = `
  async function compare(image, base64) {
    const other = await createImageBitmap(await (await fetch('data:image/png;base64,' + base64)).blob());
    if (other.width !== image.width || other.height !== image.height) return { mean: 255, far: 1 };
    const pen = (source) => {
      const canvas = new OffscreenCanvas(image.width, image.height), context = canvas.getContext('2d');
      context.fillStyle = '#808080';
      context.fillRect(0, 0, image.width, image.height);
      context.drawImage(source, 0, 0);
      return context.getImageData(0, 0, image.width, image.height).data;
    };
    const a = pen(image), b = pen(other);
    let sum = 0, far = 0, drawn = 0;
    for (let i = 0; i < a.length; i += 4) {
      const apart = [0, 1, 2].map((k) => Math.abs(a[i + k] - b[i + k]));
      sum += apart[0] + apart[1] + apart[2];
      far += Math.max(...apart) > 48;
      drawn += a[i] !== 128 || a[i + 1] !== 128 || a[i + 2] !== 128;
    }
    return { mean: sum / (0.75 * a.length), far: far / (a.length / 4), drawn: drawn / (a.length / 4) };
  }`;

async function testView(browser) {
  for (const [view, width, height] of [['both', 640, 320], ['overlay', 320, 320]]) {
    const png = readFileSync(`${folder}/${view}.png`).toString('base64');
    const apart = await browser.run(`${COMPARE}
      qmatPage.setView('${view}');
      return compare(qmatPage.picture(${width}, ${height}), '${png}');`);
    console.log(`${view}: mean difference ${apart.mean.toFixed(3)} of 255, ${(100 * apart.far).toFixed(3)} % of the pixels differ by more than 48`);
    check(`the view ${view} is that of report.picture`, apart.mean < 1.0 && apart.far < 0.01 && apart.drawn > 0.05, JSON.stringify(apart));
  }
  // The comparison itself must be able to fail.
  const png = readFileSync(`${folder}/both.png`).toString('base64');
  const turned = await browser.run(`${COMPARE} qmatPage.setView('both'); qmatPage.state.turn += 10;
    const apart = await compare(qmatPage.picture(640, 320), '${png}'); qmatPage.state.turn -= 10; return apart;`);
  check('a turned view differs', turned.mean > 1.0 && turned.far > 0.01, JSON.stringify(turned));
}

/** The level of 30 spheres against medial.lod's file and report. */
async function testLevels(browser) {
  const lines = readFileSync(`${folder}/middle.ma`, 'utf8').trim().split('\n').map((line) => line.split(/\s+/));
  const wanted = { v: [], e: [], f: [] };
  for (const [kind, ...numbers] of lines.slice(1)) wanted[kind].push(numbers.map(Number));
  const report = JSON.parse(readFileSync(`${folder}/middle.json`, 'utf8'));
  const level = await browser.run(`
    const { state, setLevel, level } = qmatPage, mesh = state.mesh;
    setLevel(30);
    const c = level();
    return { spheres: Array.from(c.spheres), edges: c.edges, slabs: c.slabs, error: mesh.chain.error(30), proved: mesh.chain.proved.get(30), diagonal: mesh.diagonal, text: document.getElementById('level').textContent };`);
  check('a level has the spheres of medial.lod', level.spheres.length / 4 === wanted.v.length && wanted.v.length === 30, level.spheres.length / 4);
  check('a level has the error of medial.lod', Math.abs(level.error - report.threshold) < 1e-6, `${level.error} ${report.threshold}`);
  check('a level has both bounds of medial.lod', level.proved && Math.abs(level.proved[0] - report.surface_to_envelope) < 1e-12 &&
    Math.abs(level.proved[1] - report.envelope_to_surface) < 1e-12, JSON.stringify([level.proved, report]));
  check('a level says its spheres and both bounds', /^30 spheres: surface to envelope at most [0-9.]+ %, .*; envelope to surface at most [0-9.]+ %/.test(level.text), level.text);
  const between = await browser.run("qmatPage.setLevel(101); return document.getElementById('level').textContent");
  check('a level without bounds says so', /^101 spheres: both errors at most [0-9.]+ %.* at the constraint points$/.test(between), between);
  const pairs = (ids, size) => Array.from({ length: ids.length / size }, (_, i) => ids.slice(size * i, size * i + size).sort((a, b) => a - b).join(' ')).sort().join();
  check('a level has the cones of medial.lod', pairs(level.edges, 2) === wanted.e.map((row) => row.join(' ')).sort().join());
  check('a level has the slabs of medial.lod', pairs(level.slabs, 3) === wanted.f.map((row) => row.join(' ')).sort().join());
  const apart = (i) => Math.hypot(...[0, 1, 2].map((k) => (level.spheres[4 * i + k] - level.spheres[k]) * level.diagonal - (wanted.v[i][k] - wanted.v[0][k])));
  check('a level has the centres of medial.lod', wanted.v.every((_, i) => apart(i) < 1e-5 * level.diagonal));
  check('a level has the radii of medial.lod', wanted.v.every((row, i) => Math.abs(level.spheres[4 * i + 3] * level.diagonal - row[3]) < 1e-5 * level.diagonal));
  const moved = await browser.run(`
    const slider = document.getElementById('slider'), counts = [];
    for (const value of [0, 250, 500, 750, 1000]) {
      slider.value = Math.round(value * slider.max / 1000);
      slider.dispatchEvent(new Event('input'));
      counts.push([qmatPage.state.spheres, qmatPage.level().spheres.length / 4, qmatPage.state.mesh.chain.error(qmatPage.state.spheres)]);
    }
    document.getElementById('result').click();
    const { most, proved, stops } = qmatPage.state.mesh.chain;
    return { counts, most, stops, proved: [...proved.keys()], back: qmatPage.state.spheres };`);
  check('the slider goes from the finest level to one sphere', moved.most === 300 && moved.counts[0][0] === moved.most && moved.counts[4][0] === 1, JSON.stringify(moved));
  check('the slider stops at every proved level', moved.proved.length > 30 && moved.proved.every((n) => moved.stops.includes(n)), JSON.stringify(moved));
  check('the slider has four stops in each doubling above', moved.stops.every((n, i, all) => i === 0 || (n < all[i - 1] && all[i - 1] <= Math.max(n + 1, Math.round(n * 2 ** 0.25)))), JSON.stringify(moved.stops));
  check('each level has as many spheres as it says', moved.counts.every(([n, own]) => n === own), JSON.stringify(moved));
  check('fewer spheres, a larger error', moved.counts.every(([n, , error], i, all) => i === 0 || (n < all[i - 1][0] && error >= all[i - 1][2])), JSON.stringify(moved));
  check('the result comes back', moved.back === null);
}

async function testHands(browser) {
  const did = await browser.run(`
    const { state } = qmatPage, stage = document.getElementById('stage'), before = { ...state };
    const press = (key, on = document.body) => on.dispatchEvent(new KeyboardEvent('keydown', { key, bubbles: true }));
    press('ArrowLeft', stage); const turned = state.turn !== before.turn;
    press('+'); const nearer = state.zoom < before.zoom;
    press('2'); const view = state.view;
    press('w'); qmatPage.draw(); const marks = document.querySelectorAll('.mark').length;
    press('r'); const back = state.turn === before.turn && state.zoom === 1;
    press('t'); const dark = document.documentElement.dataset.theme;
    press('t'); press('1');
    const touch = (type, id, x, y) => stage.dispatchEvent(new PointerEvent(type, { pointerId: id, clientX: x, clientY: y, pointerType: 'touch', bubbles: true }));
    stage.setPointerCapture = () => {};
    touch('pointerdown', 1, 100, 100); touch('pointerdown', 2, 200, 100); touch('pointermove', 2, 300, 100); const pinched = state.zoom < 0.6;
    touch('pointerup', 1, 100, 100); touch('pointerup', 2, 300, 100); press('r');
    return { turned, nearer, view, marks, back, dark, pinched };`);
  check('keys and fingers', did.turned && did.nearer && did.view === 'overlay' && did.marks === 1 && did.back && did.dark === 'dark' && did.pinched, JSON.stringify(did));
}

/** The drawing goes with the graphics context, and comes back with it. */
async function testLostContext(browser) {
  const png = readFileSync(`${folder}/both.png`).toString('base64');
  const did = await browser.run(`${COMPARE}
    const canvas = document.getElementById('canvas'), hand = canvas.getContext('webgl2').getExtension('WEBGL_lose_context');
    const event = (name) => new Promise((give) => canvas.addEventListener(name, () => setTimeout(give, 50), { once: true }));
    const hidden = () => ['canvas', 'tools', 'still', 'levels'].map((id) => document.getElementById(id).hidden).join();
    const lost = event('webglcontextlost');
    hand.loseContext();
    await lost;
    qmatPage.setLevel(30);
    qmatPage.setLevel(null);
    document.body.dispatchEvent(new KeyboardEvent('keydown', { key: 's', bubbles: true }));
    const without = hidden(), restored = event('webglcontextrestored');
    hand.restoreContext();
    await restored;
    qmatPage.setView('both');
    return { without, back: hidden(), apart: await compare(qmatPage.picture(640, 320), '${png}') };`);
  check('a lost context leaves the picture', did.without === 'true,true,false,true', did.without);
  check('a context that comes back draws the same', did.back === 'false,false,true,false' && did.apart.mean < 1.0 && did.apart.drawn > 0.05, JSON.stringify(did));
}

/** Texts and controls do not overlap, and nothing is wider than the window. */
const LAYOUT = `
  const wide = [...document.querySelectorAll('body *')].filter((e) => e.getBoundingClientRect().right > innerWidth + 1 && !e.closest('#labels')).map((e) => e.id || e.tagName);
  const boxes = [...document.querySelectorAll('h1, #lead, h2, button, select, td, th, #ticks span, output, label, input, .caption')]
    .map((e) => [e, e.getBoundingClientRect()]).filter(([, r]) => r.width > 0 && r.height > 0);
  const over = [];
  for (const [a, r] of boxes) for (const [b, q] of boxes) if (a !== b && !a.contains(b) && !b.contains(a) &&
    Math.min(r.right, q.right) - Math.max(r.left, q.left) > 1.5 && Math.min(r.bottom, q.bottom) - Math.max(r.top, q.top) > 1.5) over.push([a, b].map((e) => e.id || e.textContent).join(' / '));
  return { wide, over, canvas: !document.getElementById('canvas').hidden, still: document.getElementById('still').getBoundingClientRect().width };`;

async function inBrowser(options, act) {
  const browser = new Browser(chromium, folder, options);
  const limit = setTimeout(() => browser.close(), 150000);
  try {
    await act(browser);
  } finally {
    clearTimeout(limit);
    browser.close();
  }
}

await inBrowser(['--enable-unsafe-swiftshader'], async (browser) => {
  await open(browser, 1280, 900);
  if (!(await browser.run("return !document.getElementById('canvas').hidden"))) {
    console.log('skipped in part: this Chromium has no WebGL 2');
    process.exitCode = 77;
    return;
  }
  await testView(browser);
  await testLevels(browser);
  await testHands(browser);
  await testLostContext(browser);
  for (const [width, dark] of [[360, false], [768, true], [1600, false]]) {
    await open(browser, width, 900, dark);
    const layout = await browser.run(LAYOUT);
    check(`nothing overlaps at ${width} pixels`, layout.wide.length === 0 && layout.over.length === 0, JSON.stringify(layout));
    const paper = await browser.run('return getComputedStyle(document.body).backgroundColor');
    check('dark is dark', (paper === 'rgb(255, 255, 255)') === !dark, paper);
  }
});
await inBrowser(['--disable-3d-apis'], async (browser) => {
  await open(browser, 360, 900);
  const layout = await browser.run(LAYOUT);
  check('without WebGL there is a picture, and the numbers', !layout.canvas && layout.still > 300 && layout.wide.length === 0, JSON.stringify(layout));
});
check('nothing is said on the console, and nothing is fetched', said.length === 0, said.join('; '));
if (failures > 0) process.exitCode = 1;
