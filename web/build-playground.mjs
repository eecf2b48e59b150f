// Puts the playground's page together: node build-playground.mjs FOLDER MODULE.wasm. Says what a browser loads, and fails above 2 MB compressed.
// The page does not load the picture of a link's preview: programs that show the link do.
import { copyFileSync, mkdirSync, readdirSync, readFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const MOST = 2_000_000, PREVIEW = "preview.jpg";
const here = dirname(fileURLToPath(import.meta.url));
const [folder, module] = process.argv.slice(2).map((path) => resolve(path));
const licence = (name) => `${name}:\n${readFileSync(join(here, `node_modules/${name}/LICENSE`), "utf8").trim()}`;

mkdirSync(folder, { recursive: true });
const bundle = (entry, name, banner = "") => build({
  absWorkingDir: here,
  entryPoints: [entry],
  outfile: join(folder, name),
  bundle: true,
  minify: true,
  format: "iife",
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
  banner: { js: banner },
});
// What others wrote is in the bundle, so its licences are too.
await bundle("playground/main.js", "playground.js", `/* ${["three", "smol-toml"].map(licence).join("\n\n")}\n*/`);
await bundle("playground/worker.js", "worker.js");
for (const name of ["index.html", "playground.css", "theme.js", PREVIEW]) copyFileSync(join(here, "playground", name), join(folder, name));
copyFileSync(module, join(folder, "omnistep.wasm"));

let all = 0;
for (const name of readdirSync(folder)) {
  const bytes = readFileSync(join(folder, name)), packed = gzipSync(bytes, { level: 9 }).length;
  if (name !== PREVIEW) all += packed;
  console.log(`${name}: ${bytes.length} bytes, ${packed} compressed`);
}
console.log(`the playground: ${all} bytes compressed, at most ${MOST}`);
if (all > MOST) process.exitCode = 1;
