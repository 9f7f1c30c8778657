// SPDX-License-Identifier: GPL-3.0-or-later
// Headless Chromium, driven through its pipe, so that no package is needed.
import { spawn } from 'node:child_process';

let profiles = 0;

/** `folder` gets a profile; `options` say how to draw. */
export class Browser {
  constructor(chromium, folder, options = ['--enable-unsafe-swiftshader']) {
    this.process = spawn(chromium, ['--headless=new', '--no-sandbox', '--remote-debugging-pipe', '--hide-scrollbars', '--use-angle=swiftshader',
      `--user-data-dir=${folder}/profile${profiles++}`, ...options, 'about:blank'], { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
    this.waiting = new Map();
    this.next = 1;
    this.listeners = [];
    let text = '';
    this.process.stdio[4].setEncoding('utf8').on('data', (data) => {
      const parts = (text + data).split('\0');
      text = parts.pop();
      for (const part of parts) this.take(JSON.parse(part));
    });
  }
  take(message) {
    const done = this.waiting.get(message.id);
    this.waiting.delete(message.id);
    if (done && message.error) done.fail(new Error(message.error.message));
    else if (done) done.give(message.result);
    for (const listener of this.listeners) listener(message);
  }
  send(method, params = {}) {
    const id = this.next++;
    this.process.stdio[3].write(`${JSON.stringify({ id, method, params, sessionId: this.session })}\0`);
    return new Promise((give, fail) => this.waiting.set(id, { give, fail }));
  }
  /** Opens the address, on a narrow screen as a phone does; `listener` gets each message of the browser. */
  async open(width, height, address, listener, dark = false) {
    const { targetId } = await this.send('Target.createTarget', { url: 'about:blank' });
    this.session = (await this.send('Target.attachToTarget', { targetId, flatten: true })).sessionId;
    this.listeners.push(listener);
    for (const domain of ['Runtime', 'Log', 'Page', 'Network']) await this.send(`${domain}.enable`);
    await this.send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: width < 600 });
    await this.send('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: dark ? 'dark' : 'light' }] });
    const loaded = new Promise((give) => this.listeners.push(({ method }) => method === 'Page.loadEventFired' && give()));
    await this.send('Page.navigate', { url: address });
    await loaded;
  }
  /** The value of the body of an async function. */
  async run(body) {
    const { result, exceptionDetails } = await this.send('Runtime.evaluate', { expression: `(async () => { ${body} })()`, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(exceptionDetails.exception?.description ?? exceptionDetails.text);
    return result.value;
  }
  close() {
    this.process.kill();
  }
}
