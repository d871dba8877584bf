// Opens pages of ldi-ops in a browser and says what is wrong with them.
// usage: node check.mjs [--screenshots FOLDER] KIND=FILE …      KIND: report, summary, comparison, clash or sweep
import { mkdir, access } from "node:fs/promises";
import { basename, dirname, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import { withBrowser } from "./browser.mjs";
import { SECTIONS, findings } from "./checks.mjs";

const USAGE = "usage: node check.mjs [--screenshots FOLDER] KIND=FILE …   KIND: report, summary, comparison, clash or sweep";

function parse(words) {
  const pages = [];
  let folder;
  while (words.length > 0) {
    const word = words.shift();
    if (word === "--screenshots" && words.length > 0) {
      folder = words.shift();
      continue;
    }
    const [kind, file] = [word.slice(0, word.indexOf("=")), word.slice(word.indexOf("=") + 1)];
    if (!(kind in SECTIONS) || !file) throw new Error(`what is "${word}"?\n${USAGE}`);
    pages.push({ kind, file });
  }
  if (pages.length === 0) throw new Error(USAGE);
  return { pages, folder };
}

try {
  const { pages, folder } = parse(process.argv.slice(2));
  if (folder) await mkdir(folder, { recursive: true });
  let wrong = 0;
  await withBrowser(async (browser) => {
    for (const [i, { kind, file }] of pages.entries()) {
      await access(file);
      const name = `${i + 1}-${kind}-${basename(dirname(resolve(file)))}`;
      const found = await findings(browser, { kind, url: pathToFileURL(file).href, name, folder });
      console.log(`${found.length === 0 ? "ok    " : "WRONG "} ${kind} ${file}`);
      for (const finding of found) console.log(`       ${finding}`);
      wrong += found.length;
    }
  });
  console.log(`${pages.length} pages, ${wrong} findings`);
  process.exitCode = wrong === 0 ? 0 : 1;
} catch (error) {
  console.error(error.message);
  process.exitCode = 2;
}
