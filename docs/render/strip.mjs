// node docs/render/strip.mjs IN OUT.png [options]: a motion as a row of poses, seen by one camera. See README.md.
import { extname } from "node:path";
import { parseArgs } from "node:util";
import { draw, joined, numbers } from "./browser.mjs";

const USAGE = `usage: node docs/render/strip.mjs IN.glb|IN.bvh OUT.png [--times 0,0.5,1] [--target x,y,z[,secs]]… [--trail JOINT]…
       [--camera x,y,z] [--gap 0.05] [--width 1500]`;

try {
  const options = parse(process.argv.slice(2));
  await draw("strip_page.mjs", options);
  console.log(options.output);
} catch (error) {
  console.error(`strip: ${error.message}`);
  process.exitCode = 1;
}

/** What was typed, checked. */
function parse(args) {
  const { values, positionals } = parseArgs({
    args: joined(args),
    allowPositionals: true,
    options: {
      times: { type: "string" },
      target: { type: "string", multiple: true, default: [] },
      trail: { type: "string", multiple: true, default: [] },
      camera: { type: "string", default: "0.62,0.2,1" },
      gap: { type: "string", default: "0.05" },
      width: { type: "string", default: "1500" },
    },
  });
  if (positionals.length !== 2) throw new Error(`${positionals.length} files were given, expected two\n${USAGE}`);
  const kind = extname(positionals[0]).slice(1).toLowerCase();
  if (kind !== "glb" && kind !== "bvh") throw new Error(`${positionals[0]}: expected a .glb or .bvh file\n${USAGE}`);
  const times = values.times?.split(",") ?? null;
  const target = (text) => {
    const [x, y, z, secs] = numbers(text, text.split(",").length === 4 ? 4 : 3, "--target");
    return { point: [x, y, z], secs: secs ?? null };
  };
  return {
    input: positionals[0],
    output: positionals[1],
    kind,
    times: times && numbers(values.times, times.length, "--times"),
    targets: values.target.map(target),
    trails: values.trail,
    camera: numbers(values.camera, 3, "--camera"),
    gap: numbers(values.gap, 1, "--gap")[0],
    width: numbers(values.width, 1, "--width")[0],
    height: 400, // until the page knows how high the row is
  };
}
