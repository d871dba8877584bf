// Whether the checks can fail: pages that are broken in one way each must be noticed, and a page that is not must pass.
import { mkdtemp, rm, writeFile } from "node:fs/promises";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import { withBrowser } from "./browser.mjs";
import { findings } from "./checks.mjs";

const SORT = `
for (const [column, th] of document.querySelectorAll("th[data-sort]").entries()) {
  const button = document.createElement("button");
  button.append(...th.childNodes);
  th.append(button);
  button.onclick = () => {
    const down = th.getAttribute("aria-sort") === "ascending";
    document.querySelectorAll("[aria-sort]").forEach((other) => other.removeAttribute("aria-sort"));
    th.setAttribute("aria-sort", down ? "descending" : "ascending");
    const body = document.querySelector("tbody");
    const key = (row) => row.cells[column].dataset.key ?? row.cells[column].textContent;
    const order = (a, b) => (th.dataset.sort === "number" ? key(a) - key(b) : key(a).localeCompare(key(b)));
    body.append(...[...body.rows].sort((a, b) => (down ? -1 : 1) * order(a, b)));
    document.querySelector("[role=status]").textContent = down ? "descending" : "ascending";
  };
}`;

const page = ({ style = "", more = "", id = "solids", script = SORT, title = "Solids" } = {}) => `<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>Solids</title><meta name="viewport" content="width=device-width">
<style>body { background: #fff; color: #222; } svg { width: 100px; height: 20px } ${style}</style></head>
<body><main><h1>${title}</h1><section id="${id}"><h2>A table of two solids</h2><p role="status"></p>
<table class="sortable"><caption>Solids</caption>
<thead><tr><th scope="col" data-sort="text">Name</th><th scope="col" data-sort="number">Size</th></tr></thead>
<tbody><tr><th scope="row">b</th><td data-key="10">10</td></tr><tr><th scope="row">a</th><td data-key="9">9</td></tr></tbody></table>
<svg role="img" aria-label="A label" viewBox="0 0 100 20"><text x="5" y="14" font-size="10">label</text></svg>
${more}</section></main><script>${script}</script></body></html>`;

/** What is broken, and a part of what must be found then. */
const BROKEN = {
  "console error": [page({ script: `${SORT}; console.error("oh")` }), "console error: oh"],
  "page error": [page({ script: `${SORT}; missing()` }), "page error"],
  request: [page({ more: '<img alt="far" src="http://192.0.2.1/x.png">' }), "request to http://192.0.2.1/x.png"],
  "wide page": [page({ more: '<div style="width: 1400px">wide</div>' }), "px wide in a window"],
  "hidden overflow": [page({ style: "html, body { overflow-x: hidden }", more: '<div style="width: 1400px">wide</div>' }), "ends at"],
  "missing section": [page({ id: "others" }), "section solids is missing"],
  "empty section": [page({ style: "section { display: none }" }), "section solids is empty"],
  "cut label": [page({ more: '<svg role="img" aria-label="B" viewBox="0 0 100 20"><text x="90" y="14">label</text></svg>' }), "cut off"],
  "no buttons": [page({ script: "" }), "no buttons"],
  "unsorted rows": [page({ script: SORT.replace("body.append", "[].concat") }), "is not ascending"],
  "sorted as text": [page({ script: SORT.replace("key(a) - key(b)", "key(a).localeCompare(key(b))") }), "is not ascending"],
  "no aria-sort": [page({ script: SORT.replaceAll("setAttribute", "getAttribute") }), "aria-sort is"],
  "low contrast": [page({ style: "h2 { color: #ccc }" }), "color-contrast"],
  "low contrast in the dark": [page({ style: "@media (prefers-color-scheme: dark) { body { background: #444 } }" }), "axe, dark: color-contrast"],
  "heading order": [page({ more: "<h4>deep</h4>" }), "h4 follows an h2"],
  "not a number": [page({ more: "<p>NaN mm</p>" }), "says NaN"],
  "no text without scripts": [page({ script: `${SORT}; document.querySelector("section").append("only with scripts")` }), "text differs"],
  "dark paper": [page({ style: "@media (prefers-color-scheme: dark) { body { background: #000; color: #fff } }" }), "the paper is"],
};

const folder = await mkdtemp(join(tmpdir(), "ldi-ops-self-test-"));
let failed = 0;
const verdict = (good, text) => {
  console.log(`${good ? "ok    " : "FAILED"} ${text}`);
  failed += good ? 0 : 1;
};
try {
  await withBrowser(async (browser) => {
    const of = async (html) => {
      const file = join(folder, "page.html");
      await writeFile(file, html);
      return findings(browser, { kind: "summary", url: pathToFileURL(file).href, name: "page" });
    };
    const sound = await of(page());
    verdict(sound.length === 0, `a page with nothing wrong passes ${sound.join("; ")}`);
    for (const [name, [html, part]] of Object.entries(BROKEN)) {
      const found = await of(html);
      verdict(found.some((finding) => finding.includes(part)), `${name} is noticed${found.length === 0 ? " (nothing was)" : ""}`);
    }
  });
} finally {
  await rm(folder, { recursive: true, force: true });
}
process.exitCode = failed === 0 ? 0 : 1;
