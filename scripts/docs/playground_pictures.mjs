// Draws the playground as it opens, at the end of README's experiment: node scripts/docs/playground_pictures.mjs [out/playground], after
// scripts/playground.sh. docs/images/playground.png is the top of the page; web/playground/preview.jpg, which a shared link shows, its player alone.
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { basename, join } from "node:path";

import { launched } from "../../tests/viewers/browser.mjs";

const [folder = "out/playground"] = process.argv.slice(2);
const TYPES = { html: "text/html", js: "text/javascript", css: "text/css", wasm: "application/wasm" };
const server = createServer(async ({ url }, answer) => {
  const name = basename(new URL(url, "http://localhost").pathname) || "index.html";
  const bytes = await readFile(join(folder, name)).catch(() => undefined);
  answer.writeHead(bytes ? 200 : 404, { "content-type": TYPES[name.split(".").pop()] ?? "application/octet-stream" }).end(bytes);
});
await new Promise((done) => { server.listen(0, "127.0.0.1", done); });
const browser = await launched({ calm: false });
const tab = await browser.newPage({ viewport: { width: 800, height: 1200 }, colorScheme: "light" });
await tab.goto(`http://127.0.0.1:${server.address().port}/`);
await tab.waitForSelector("html[data-mode=ended]", { state: "attached", timeout: 120_000 });
// How fast this machine draws is of no interest.
await tab.addStyleTag({ content: "#drawing { display: none; }" });
await tab.waitForTimeout(1000);
const examples = await tab.locator("#examples").boundingBox();
await tab.screenshot({ path: "docs/images/playground.png", clip: { x: 0, y: 0, width: 800, height: Math.ceil(examples.y + examples.height) + 8 } });
await tab.addStyleTag({ content: "#player { position: fixed !important; inset: 0 auto auto 0; width: 600px; height: 315px !important; border: none !important; z-index: 9; } .osp-views { display: none !important; }" });
await tab.waitForTimeout(1000);
await tab.screenshot({ path: "web/playground/preview.jpg", quality: 80, type: "jpeg", clip: { x: 0, y: 0, width: 600, height: 315 } });
await browser.close();
server.close();
