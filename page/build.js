// Builds the page into the service's package: bundles, static files, and the pose detector with its lite model.
//
//     npm ci --omit=dev && npm run build

import { cp, mkdir, rename, rm } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const HERE = dirname(fileURLToPath(import.meta.url));
const TARGET = join(HERE, "../service/fervor/server/page_files");
const FRESH = `${TARGET}.new`; // a service that runs meanwhile goes on with the old one

// Every browser that can run the page has WebAssembly with SIMD; the detector's files for others stay away.
const DETECTOR = [
  "pose.js",
  "pose_landmark_lite.tflite",
  "pose_solution_packed_assets.data",
  "pose_solution_packed_assets_loader.js",
  "pose_solution_simd_wasm_bin.js",
  "pose_solution_simd_wasm_bin.wasm",
  "pose_web.binarypb",
];

await rm(FRESH, { recursive: true, force: true });
await mkdir(join(FRESH, "pose"), { recursive: true });
await build({
  absWorkingDir: HERE,
  entryPoints: ["src/main.ts", "src/detector.ts"],
  outdir: FRESH,
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "linked",
  logLevel: "warning",
});
await cp(join(HERE, "static"), FRESH, { recursive: true });
for (const file of DETECTOR) {
  await cp(join(HERE, "node_modules/@mediapipe/pose", file), join(FRESH, "pose", file));
}
for (const name of ["three", "uplot"]) {
  await cp(join(HERE, "node_modules", name, "LICENSE"), join(FRESH, "licenses", `${name}.txt`));
}
await rm(TARGET, { recursive: true, force: true });
await rename(FRESH, TARGET);
