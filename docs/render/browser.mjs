// What both tools share: options of the command line, a web server for this machine alone, the browser.
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { dirname, extname, join, normalize, sep } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const HERE = dirname(fileURLToPath(import.meta.url));
const THREE = join(HERE, "node_modules", "three");
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

/** Draws what a page of this folder makes of a model and saves it. */
export async function draw(page, options) {
  const server = await serve(page, options);
  try {
    await shoot(`http://127.0.0.1:${server.address().port}/`, options);
  } finally {
    server.closeAllConnections();
    server.close();
  }
}

/** An option and its value as one word: the value of a target may begin with a minus. */
export function joined(args) {
  const words = [];
  for (let idx = 0; idx < args.length; idx += 1) {
    const takes_next = /^--[a-z]+$/.test(args[idx]) && idx + 1 < args.length;
    words.push(takes_next ? `${args[idx]}=${args[(idx += 1)]}` : args[idx]);
  }
  return words;
}

export function numbers(text, n_numbers, option) {
  const found = text.split(",").map((part) => (part.trim() === "" ? Number.NaN : Number(part)));
  if (found.length !== n_numbers || !found.every(Number.isFinite)) {
    throw new Error(`${option} ${text}: expected ${n_numbers === 1 ? "a number" : `${n_numbers} numbers, with commas`}`);
  }
  return found;
}

/** Serves the page, three and the one model, to this machine only. */
async function serve(page, options) {
  const answers = {
    "/": () => readFile(join(HERE, "page.html")),
    "/page.mjs": () => readFile(join(HERE, page)),
    "/scene.mjs": () => readFile(join(HERE, "scene.mjs")),
    "/machine.mjs": () => readFile(join(HERE, "machine.mjs")),
    "/options.json": () => JSON.stringify(options),
    "/model": () => model,
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
    const { failed, done } = await outcome.jsonValue();
    if (failed) throw new Error(failed);
    // A page that chose its height itself is shown whole.
    if (done.height) await page.setViewportSize({ width, height: done.height });
    await page.screenshot({ path: output });
  } finally {
    await context.close();
  }
}
