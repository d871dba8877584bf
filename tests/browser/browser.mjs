// A browser without a screen, a profile or a network.
import { access, mkdtemp, rm } from "node:fs/promises";
import { constants } from "node:fs";
import { tmpdir } from "node:os";
import { delimiter, join } from "node:path";
import { chromium } from "playwright-core";

const NAMES = ["chromium", "chromium-browser", "google-chrome-stable", "google-chrome"];
const PATIENCE = 180_000;
const FLAGS = [
  "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync",
];

/** The path of the browser: $CHROMIUM, or the first of its usual names on $PATH. */
async function executable() {
  if (process.env.CHROMIUM) return process.env.CHROMIUM;
  const folders = (process.env.PATH ?? "").split(delimiter).filter(Boolean);
  for (const name of NAMES) {
    for (const folder of folders) {
      const path = join(folder, name);
      try {
        await access(path, constants.X_OK);
        return path;
      } catch {
        // Not here.
      }
    }
  }
  throw new Error(`no browser: install chromium, or name one with CHROMIUM (looked for ${NAMES.join(", ")})`);
}

/** Gives an open browser to `use`, with an empty profile that is gone afterwards. */
export async function withBrowser(use) {
  const profile = await mkdtemp(join(tmpdir(), "ldi-ops-browser-"));
  // Playwright starts a browser with an empty user-data-dir; what Chromium keeps outside it goes here.
  const environment = { ...process.env, HOME: profile, XDG_CONFIG_HOME: profile, XDG_CACHE_HOME: profile };
  const browser = await chromium.launch({ executablePath: await executable(), args: FLAGS, env: environment });
  try {
    return await use(browser);
  } finally {
    await browser.close();
    await rm(profile, { recursive: true, force: true, maxRetries: 5 });
  }
}

/** Opens a page in a context of its own; gives `use` the page and what it has complained of. */
export async function withPage(browser, url, options, use) {
  const context = await browser.newContext({ offline: true, bypassCSP: options.bypassCSP ?? false, ...options });
  // A busy machine takes its time over a long page.
  context.setDefaultTimeout(PATIENCE);
  const page = await context.newPage();
  const complaints = [];
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) complaints.push(`console ${message.type()}: ${message.text()}`);
  });
  page.on("pageerror", (error) => complaints.push(`page error: ${error.message}`));
  page.on("request", (request) => {
    if (!/^(file|data|blob):/.test(request.url())) complaints.push(`request to ${request.url().slice(0, 120)}`);
  });
  try {
    await page.goto(url, { waitUntil: "load" });
    return await use(page, complaints);
  } finally {
    await context.close();
  }
}
