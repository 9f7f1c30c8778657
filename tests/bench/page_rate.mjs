// SPDX-License-Identifier: GPL-3.0-or-later
// How quickly a page draws while its view turns: page_rate.mjs CHROMIUM FOLDER PAGE
// Headless Chromium draws with SwiftShader on the processor, far more slowly than any graphics card.
import { resolve } from 'node:path';
import { Browser } from '../page/browser.mjs';

const [chromium, folder, page] = process.argv.slice(2);
const browser = new Browser(chromium, folder);
let messages = 0;
try {
  await browser.open(1280, 720, `file://${resolve(page)}`, ({ method }) => {
    messages += ['Runtime.consoleAPICalled', 'Runtime.exceptionThrown', 'Log.entryAdded'].includes(method);
  });
  const found = await browser.run(`
    const wait = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));
    const next = () => new Promise((done) => requestAnimationFrame(done));
    const gl = document.querySelector('#stage canvas').getContext('webgl2'), pixel = new Uint8Array(4);
    let calls = 0;
    for (const name of ['drawElements', 'drawArrays', 'drawElementsInstanced', 'drawArraysInstanced']) {
      const original = gl[name].bind(gl);
      gl[name] = (...rest) => { calls++; original(...rest); };
    }
    const turn = (seconds, before) => {
      const start = performance.now();
      let frames = 0;
      return (async () => {
        while (performance.now() - start < 1000 * seconds) {
          before();
          qmatPage.state.turn += 2;
          qmatPage.draw();
          gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
          frames++;
          await next();
        }
        return { rate: 1000 * frames / (performance.now() - start), frames };
      })();
    };
    await wait(1500);
    calls = 0;
    await wait(1000);
    const atRest = calls;
    const full = await turn(4, () => { qmatPage.pace.last = 0; qmatPage.pace.moving = false; });
    const perFrame = (calls - atRest) / full.frames;
    const moving = await turn(6, () => { qmatPage.pace.moving = true; });
    return { atRest, perFrame, full: full.rate, moving: moving.rate, quality: qmatPage.pace.quality };
  `);
  console.log(`all pixels: ${found.full.toFixed(1)} frames a second, ${found.perFrame} draw calls each`);
  console.log(`while it turns: ${found.moving.toFixed(1)} frames a second with ${Math.round(100 * found.quality)} % of the pixels`);
  console.log(`at rest: ${found.atRest} draw calls in a second; ${messages} messages on the console`);
} finally {
  browser.close();
}
