// Draws the pictures of the report and of the page of a driven run: OMNISTEP=.venv/bin/omnistep node scripts/docs/page_pictures.mjs [docs/images]. Needs
// Chromium and, in tests/viewers, what `npm ci` installs. Both pages are nearly as narrow as the documents show them, so that their letters keep their size.
import { execFileSync, spawn } from "node:child_process";
import { mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";

import { launched } from "../../tests/viewers/browser.mjs";

const [folder = "docs/images"] = process.argv.slice(2);
const [program, ...first] = (process.env.OMNISTEP ?? "omnistep").split(" ");
const omnistep = (...args) => execFileSync(program, [...first, ...args], { stdio: ["ignore", "ignore", "inherit"] });
const work = mkdtempSync(join(tmpdir(), "pages-"));
const browser = await launched({ calm: false });

// The page in light colours, of this size [px].
async function opened(address, width, height) {
  const tab = await browser.newPage({ viewport: { width, height }, colorScheme: "light" });
  tab.setDefaultTimeout(120_000); // without a graphics card
  await tab.goto(address);
  await tab.waitForSelector("html[data-ready=true]", { state: "attached" });
  return tab;
}
// The picture, as low as the lowest of these elements.
async function shot(tab, name, ...elements) {
  const ends = await Promise.all(elements.map(async (each) => { const box = await tab.locator(each).first().boundingBox(); return box.y + box.height; }));
  const { width } = tab.viewportSize();
  await tab.screenshot({ path: join(folder, name), clip: { x: 0, y: 0, width, height: Math.ceil(Math.max(...ends)) + 4 } });
}

// Two policies over the step, in the middle of the climb.
async function report() {
  for (const policy of ["independent", "traction"]) omnistep("run", "step", "--quiet", "--policy", policy, "--out", join(work, policy));
  const page = join(work, "report.html");
  omnistep("report", ...["independent", "traction"].map((policy) => join(work, policy, `step-${policy}.mcap`)), "-o", page);
  const tab = await opened(pathToFileURL(page).href, 800, 1600);
  await tab.locator("#time").fill("2.5");
  await tab.evaluate(() => document.activeElement.blur());
  await tab.waitForTimeout(1500);
  await shot(tab, "report-light.png", "table");
}

// Diagonally over the first bump.
async function drive() {
  const run = spawn(program, [...first, "drive", "--port", "0", "--no-keys"], { stdio: ["ignore", "ignore", "pipe"] });
  try {
    const address = await new Promise((found, failed) => {
      let said = "";
      run.stderr.on("data", (data) => {
        said += data;
        const match = /(http:\/\/127\.0\.0\.1:\d+) in a browser/.exec(said);
        if (match) found(match[1]);
      });
      run.on("exit", () => failed(new Error(`ended: ${said}`)));
    });
    const tab = await opened(address, 1000, 960);
    const until = async (test) => {
      const place = async () => (await tab.locator("#place").textContent()).match(/-?\d+(\.\d+)?/g).map(Number);
      for (let tries = 0; tries < 3000 && !test(...await place()); tries += 1) await tab.waitForTimeout(20);
    };
    await tab.keyboard.down("w");
    await until((x) => x > 0.4);
    await tab.keyboard.down("a");
    await until((x, y) => x > 0.55 && y > 0.05);
    await shot(tab, "drive-light.png", "#wheels");
  } finally {
    run.kill("SIGINT");
  }
}

try {
  await report();
  await drive();
} finally {
  await browser.close();
  rmSync(work, { recursive: true });
}
