// Bundles the player for pages without a module loader: `node build.mjs [FILE]`, by default into the Python package.
import { readFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ? resolve(process.argv[2]) : join(here, "../python/omnistep/assets/player.js");
// three.js is in the bundle, so its licence is too.
const licence = readFileSync(join(here, "node_modules/three/LICENSE"), "utf8").trim();
const { version } = JSON.parse(readFileSync(join(here, "node_modules/three/package.json"), "utf8"));

await build({
  absWorkingDir: here,
  entryPoints: ["player/index.js"],
  bundle: true,
  minify: true,
  format: "iife",
  globalName: "omnistepPlayer",
  target: "es2022",
  charset: "ascii",
  legalComments: "none",
  banner: { js: `/* Made by scripts/web.sh from web/player and three.js ${version}; do not edit.\n\nthree.js:\n${licence}\n*/` },
  outfile: out,
});
// The report has it between <script> and </script>.
if (/<\/script|<!--/i.test(readFileSync(out, "utf8"))) throw new Error(`${out} cannot stand inside a page: it ends a script`);
