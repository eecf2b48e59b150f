// Pictures of a page, for scripts/readme_film.py: node readme_film.mjs PAGE FRAMES WIDTH HEIGHT FOLDER writes FOLDER/K.png.
import { createRequire } from "node:module";
import { pathToFileURL } from "node:url";

const { chromium } = createRequire(new URL("../tests/viewers/", import.meta.url))("playwright-core");
const [page, frames, width, height, folder] = process.argv.slice(2);
const executablePath = process.env.CHROMIUM ?? "/usr/bin/chromium";
const browser = await chromium.launch({ executablePath, args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"] });
const tab = await browser.newPage({ viewport: { width: Number(width), height: Number(height) } });
tab.on("pageerror", (error) => { console.error(String(error)); process.exitCode = 1; });
await tab.goto(pathToFileURL(page).href);
for (let k = 0; k < Number(frames); k += 1) {
  await tab.evaluate((k) => window.showFrame(k), k);
  await tab.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  await tab.screenshot({ path: `${folder}/${k}.png` });
}
await browser.close();
