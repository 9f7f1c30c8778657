// SPDX-License-Identifier: GPL-3.0-or-later
// game_page_test.mjs CHROMIUM ADDRESS FOLDER: opens the page of examples/game after 30 simulated seconds.
import assert from 'node:assert/strict';
import { Browser } from './browser.mjs';

const [chromium, address, folder] = process.argv.slice(2), SECONDS = 30;
const browser = new Browser(chromium, folder), said = [];
process.on('exit', () => browser.close());
await browser.open(800, 600, `${address}?seconds=${SECONDS}`, ({ method, params }) => {
  if (method === 'Runtime.consoleAPICalled') said.push(params.args.map((x) => x.value ?? x.description).join(' '));
  if (method === 'Runtime.exceptionThrown') said.push(params.exceptionDetails.exception?.description ?? params.exceptionDetails.text);
  if (method === 'Log.entryAdded') said.push(`${params.entry.text} ${params.entry.url ?? ''}`);
});
await browser.run(`while (!document.title.includes('bodies')) await new Promise((go) => setTimeout(go, 100));`);
const bodies = await browser.run(`return bodies.map((rigid) => {
  const { x, y, z } = rigid.worldCom(), v = rigid.linvel(), w = rigid.angvel();
  return { place: [x, y, z], speed: Math.hypot(v.x, v.y, v.z), turn: Math.hypot(w.x, w.y, w.z) };
})`);
assert.equal(bodies.length, 30);
bodies.forEach(({ place, speed, turn }, i) => {
  assert(place.every(Number.isFinite) && place[1] > 0.02 && place[1] < 3, `body ${i} is at ${place}`);
  assert(Math.abs(place[0]) < 20 && Math.abs(place[2]) < 20, `body ${i} has left the ground: ${place}`);
  assert(speed < 0.05 && turn < 0.2, `body ${i} moves at ${speed} and turns at ${turn}`);
});
// The picture has the sky, the ground, and a share of pixels in the colours of the assets, which are not grey.
const { colours, vivid } = await browser.run(`
  const source = document.querySelector('canvas'), copy = new OffscreenCanvas(source.width, source.height), context = copy.getContext('2d');
  context.drawImage(source, 0, 0);
  const { data } = context.getImageData(0, 0, copy.width, copy.height), seen = new Set();
  let vivid = 0;
  for (let i = 0; i < data.length; i += 4) {
    const [r, g, b] = data.subarray(i, i + 3);
    seen.add((r >> 3) << 10 | (g >> 3) << 5 | b >> 3);
    vivid += Math.max(r, g, b) - Math.min(r, g, b) > 60;
  }
  return { colours: seen.size, vivid: 4 * vivid / data.length };`);
assert(colours > 100 && vivid > 0.01 && vivid < 0.6, `a picture of ${colours} colours, ${vivid} of it vivid`);
assert.deepEqual(said, []);
console.log(`ok: ${bodies.length} bodies at rest after ${SECONDS} s, ${colours} colours`);
browser.close();
