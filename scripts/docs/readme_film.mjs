// Pictures of a page, for scripts/docs/readme_film.py: node readme_film.mjs PAGE FRAMES WIDTH HEIGHT FOLDER writes FOLDER/K.png.
import { pathToFileURL } from "node:url";

import { launched } from "../../tests/viewers/browser.mjs";

const [page, frames, width, height, folder] = process.argv.slice(2);
const browser = await launched({ calm: false });
const tab = await browser.newPage({ viewport: { width: Number(width), height: Number(height) } });
tab.on("pageerror", (error) => { console.error(String(error)); process.exitCode = 1; });
await tab.goto(pathToFileURL(page).href);
for (let k = 0; k < Number(frames); k += 1) {
  await tab.evaluate((k) => window.showFrame(k), k);
  await tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  await tab.screenshot({ path: `${folder}/${k}.png` });
}
await browser.close();
