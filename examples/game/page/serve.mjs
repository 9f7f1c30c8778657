// SPDX-FileCopyrightText: 2026 the qmat authors
// SPDX-License-Identifier: MIT
//
// Serves the page with the assets that the build made: node serve.mjs [FOLDER_OF_ASSETS [PORT]]
import { createReadStream, readdirSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { dirname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url)), assets = process.argv[2] ?? join(here, '../build/assets');
const folders = { '/assets/': assets, '/readers/': join(here, '../../readers'), '/': here };
const types = { html: 'text/html', js: 'text/javascript', mjs: 'text/javascript', wasm: 'application/wasm', json: 'application/json' };

const server = createServer((request, response) => {
  let path = '/', about;
  try {
    path = normalize(decodeURIComponent(new URL(request.url, 'http://localhost').pathname));
  } catch {
    path = '/none'; // a malformed address
  }
  if (path === '/assets.json') {
    response.setHeader('Content-Type', 'application/json');
    response.end(JSON.stringify(readdirSync(assets).filter((name) => name.endsWith('.glb'))));
    return;
  }
  const prefix = Object.keys(folders).find((start) => path.startsWith(start));
  const file = join(folders[prefix], path === '/' ? 'index.html' : path.slice(prefix.length));
  try {
    about = statSync(file);
  } catch { /* none, or a name that no file can have */ }
  if (!about?.isFile()) {
    response.statusCode = 404;
    response.end();
    return;
  }
  response.setHeader('Content-Type', types[file.split('.').pop()] ?? 'application/octet-stream');
  createReadStream(file).on('error', () => response.destroy()).pipe(response);
});
server.listen(Number(process.argv[3] ?? 8080), 'localhost', () => console.log(`http://localhost:${server.address().port}/`));
