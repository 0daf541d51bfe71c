// node docs/render/render.mjs IN.glb OUT.png [options]: a picture of a posed body. See README.md beside this file.
import { parseArgs } from "node:util";
import { draw, joined, numbers } from "./browser.mjs";

const CAMERAS = ["front", "side", "three-quarter"];
const USAGE = `usage: node docs/render/render.mjs IN.glb OUT.png [--target x,y,z]… [--camera ${CAMERAS.join("|")}]
       [--time SECS] [--width 900] [--height 900]`;

try {
  const options = parse(process.argv.slice(2));
  await draw("page.mjs", options);
  console.log(options.output);
} catch (error) {
  console.error(`render: ${error.message}`);
  process.exitCode = 1;
}

/** What was typed, checked. */
function parse(args) {
  const { values, positionals } = parseArgs({
    args: joined(args),
    allowPositionals: true,
    options: {
      target: { type: "string", multiple: true, default: [] },
      camera: { type: "string", default: "three-quarter" },
      time: { type: "string" },
      width: { type: "string", default: "900" },
      height: { type: "string", default: "900" },
    },
  });
  if (positionals.length !== 2) throw new Error(`${positionals.length} files were given, expected two\n${USAGE}`);
  if (!CAMERAS.includes(values.camera)) {
    throw new Error(`no camera \`${values.camera}\`, expected one of ${CAMERAS.join(", ")}`);
  }
  return {
    input: positionals[0],
    output: positionals[1],
    targets: values.target.map((text) => numbers(text, 3, "--target")),
    camera: values.camera,
    time: values.time === undefined ? null : numbers(values.time, 1, "--time")[0],
    width: numbers(values.width, 1, "--width")[0],
    height: numbers(values.height, 1, "--height")[0],
  };
}
