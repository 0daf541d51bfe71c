// node docs/render/render.mjs IN.glb OUT.png [options]: a picture of a posed body. See README.md beside this file.
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { dirname, extname, join, normalize, sep } from "node:path";
import { fileURLToPath } from "node:url";
import { parseArgs } from "node:util";
import { chromium } from "playwright-core";

const HERE = dirname(fileURLToPath(import.meta.url));
const THREE = join(HERE, "node_modules", "three");
const CAMERAS = ["front", "side", "three-quarter"];
const USAGE = `usage: node docs/render/render.mjs IN.glb OUT.png [--target x,y,z]… [--camera ${CAMERAS.join("|")}]
       [--time SECS] [--width 900] [--height 900]`;
const TYPES = { ".html": "text/html", ".mjs": "text/javascript", ".js": "text/javascript", ".json": "application/json" };
const BROWSER_ARGS = [
  "--no-sandbox",
  "--disable-gpu",
  "--use-gl=angle",
  "--use-angle=swiftshader",
  "--enable-unsafe-swiftshader",
  "--disable-quic",
  "--no-first-run",
  "--disable-background-networking",
  "--disable-component-update",
  "--disable-sync",
];
const TIMEOUT_MS = 120_000;

try {
  const options = parse(process.argv.slice(2));
  const server = await serve(options);
  try {
    await shoot(`http://127.0.0.1:${server.address().port}/`, options);
  } finally {
    server.closeAllConnections();
    server.close();
  }
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

/** An option and its value as one word: the value of a target may begin with a minus. */
function joined(args) {
  const words = [];
  for (let idx = 0; idx < args.length; idx += 1) {
    const takes_next = /^--[a-z]+$/.test(args[idx]) && idx + 1 < args.length;
    words.push(takes_next ? `${args[idx]}=${args[(idx += 1)]}` : args[idx]);
  }
  return words;
}

function numbers(text, n_numbers, option) {
  const found = text.split(",").map((part) => (part.trim() === "" ? Number.NaN : Number(part)));
  if (found.length !== n_numbers || !found.every(Number.isFinite)) {
    throw new Error(`${option} ${text}: expected ${n_numbers === 1 ? "a number" : `${n_numbers} numbers, with commas`}`);
  }
  return found;
}

/** Serves the page, three and the one model, to this machine only. */
async function serve(options) {
  const answers = {
    "/": () => readFile(join(HERE, "page.html")),
    "/page.mjs": () => readFile(join(HERE, "page.mjs")),
    "/options.json": () => JSON.stringify(options),
    "/model.glb": () => model,
  };
  const model = await readFile(options.input);
  const server = createServer(async ({ url }, response) => {
    const { pathname } = new URL(url, "http://localhost");
    try {
      const file = normalize(join(THREE, pathname.slice("/three/".length)));
      const is_three = pathname.startsWith("/three/") && file.startsWith(THREE + sep);
      if (!is_three && !(pathname in answers)) throw new Error("no such page");
      const body = await (is_three ? readFile(file) : answers[pathname]());
      const type = pathname === "/" ? ".html" : extname(pathname);
      response.writeHead(200, { "content-type": TYPES[type] ?? "application/octet-stream" }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  await new Promise((resolve, reject) => server.once("error", reject).listen(0, "127.0.0.1", resolve));
  return server;
}

/** Opens the page in a browser with an empty profile and saves what it drew. */
async function shoot(url, { output, width, height }) {
  const context = await chromium.launchPersistentContext("", {
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    headless: true,
    args: BROWSER_ARGS,
    viewport: { width, height },
  });
  try {
    const page = await context.newPage();
    page.on("pageerror", (error) => console.error(`page: ${error.message}`));
    page.on("console", (message) => message.type() === "error" && console.error(`page: ${message.text()}`));
    await page.goto(url);
    const outcome = await page.waitForFunction(() => window.outcome, null, { timeout: TIMEOUT_MS });
    const { failed } = await outcome.jsonValue();
    if (failed) throw new Error(failed);
    await page.screenshot({ path: output });
  } finally {
    await context.close();
  }
}
