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

/** A chart, with what is drawn into it and written about it. */
const chart = (marks, texts = "") =>
  `<figure><svg role="img" aria-label="Chart" viewBox="0 0 100 60" style="height: 60px"><line class="axis" x1="10" y1="50" x2="90" y2="50" stroke="#222"/>${marks}${texts}</svg></figure>`;
const CURVE = '<polyline class="series a" fill="none" stroke="#222" points="10,50 50,20 90,50"/>';
const BAR = '<rect class="bar" x="20" y="20" width="20" height="30"/>';
const label = (x, text) => `<text x="${x}" y="10" font-size="10">${text}</text>`;

/** What is broken, by the part of the check that must notice it, and a part of what must be found then. */
const BROKEN = {
  views: {
    "console error": [page({ script: `${SORT}; console.error("oh")` }), "console error: oh"],
    "page error": [page({ script: `${SORT}; missing()` }), "page error"],
    request: [page({ more: '<img alt="far" src="http://192.0.2.1/x.png">' }), "request to http://192.0.2.1/x.png"],
    "wide page": [page({ more: '<div style="width: 1400px">wide</div>' }), "px wide in a window"],
    "hidden overflow": [page({ style: "html, body { overflow-x: hidden }", more: '<div style="width: 1400px">wide</div>' }), "ends at"],
    "missing section": [page({ id: "others" }), "section solids is missing"],
    "empty section": [page({ style: "section { display: none }" }), "section solids is empty"],
    "cut label": [page({ more: '<svg role="img" aria-label="B" viewBox="0 0 100 20"><text x="90" y="14">label</text></svg>' }), "cut off"],
    "label cut by a pixel": [page({ more: chart(BAR, `<text x="100.8" y="30" font-size="10" text-anchor="end">label</text>`) }), "cut off"],
    "overlapping labels": [page({ more: chart(BAR, label(10, "mean A") + label(25, "mean B")) }), '"mean A" lies on "mean B"'],
    "empty chart": [page({ more: chart("") }), "nothing is drawn"],
    "curve on the axis": [page({ more: chart(CURVE + CURVE.replace("50,20", "50,50").replace("series a", "series b")) }), 'curve "series b" is not to be seen'],
    "curve beyond the frame": [page({ more: chart(BAR + CURVE.replace("10,50 50,20 90,50", "110,50 150,20 190,50")) }), "is not to be seen"],
    "curve without colour": [page({ more: chart(BAR + CURVE.replace("#222", "none")) }), "is not to be seen"],
    "bars without height": [page({ more: chart(BAR.replace('height="30"', 'height="0"')) }), "nothing is drawn"],
    "negative width": [page({ more: chart(CURVE + BAR.replace('width="20"', 'width="-20"')) }), 'width="-20"'],
    "coordinate that is none": [page({ more: chart(CURVE + BAR.replace('x="20"', 'x="NaN"')) }), 'x="NaN"'],
    "points that are none": [page({ more: chart(BAR + CURVE.replace("50,20", "50,NaN")) }), "points that are no numbers"],
    "symbol broken in mid-word": [page({ more: '<p class="symbol" style="width: 30px; overflow-wrap: anywhere">overhang</p>' }), '"overhang" is broken'],
    "cut table": [page({ more: '<div class="scroll" tabindex="0" style="overflow-x: auto"><p style="width: 1400px">wide</p></div>' }), "is cut off: 1400 px wide"],
    "endless page": [page({ more: '<div style="height: 12000px"></div>' }), "px long"],
  },
  axe: {
    "low contrast": [page({ style: "h2 { color: #ccc }" }), "color-contrast"],
    "low contrast in the dark": [page({ style: "@media (prefers-color-scheme: dark) { body { background: #444 } }" }), "axe, dark: color-contrast"],
  },
  text: {
    "negative zero": [page({ more: "<p>changes by −0 %</p>" }), '"−0"'],
    "negative zero with decimals": [page({ more: "<p>-0.00 ± 0.02</p>" }), '"-0.00"'],
    "exponent for programs": [page({ more: "<p>at 7.772000e-15, 2</p>" }), '"7.772000e-15"'],
    "no buttons": [page({ script: "" }), "no buttons"],
    "unsorted rows": [page({ script: SORT.replace("body.append", "[].concat") }), "is not ascending"],
    "sorted as text": [page({ script: SORT.replace("key(a) - key(b)", "key(a).localeCompare(key(b))") }), "is not ascending"],
    "no aria-sort": [page({ script: SORT.replaceAll("setAttribute", "getAttribute") }), "aria-sort is"],
    "heading order": [page({ more: "<h4>deep</h4>" }), "h4 follows an h2"],
    "not a number": [page({ more: "<p>NaN mm</p>" }), "says NaN"],
  },
  scripts: {
    "no text without scripts": [page({ script: `${SORT}; document.querySelector("section").append("only with scripts")` }), "text differs"],
  },
  paper: {
    "folded on paper": [page({ more: "<details><summary>More</summary><p>folded</p></details>" }), "print: 1 parts are folded"],
    "dark paper": [page({ style: "@media (prefers-color-scheme: dark) { body { background: #000; color: #fff } }" }), "the paper is"],
  },
};

const folder = await mkdtemp(join(tmpdir(), "ldi-ops-self-test-"));
let failed = 0;
const verdict = (good, text) => {
  console.log(`${good ? "ok    " : "FAILED"} ${text}`);
  failed += good ? 0 : 1;
};
try {
  await withBrowser(async (browser) => {
    const of = async (html, parts) => {
      const file = join(folder, "page.html");
      await writeFile(file, html);
      return findings(browser, { kind: "summary", url: pathToFileURL(file).href, name: "page" }, parts);
    };
    const numbers = "<p>−0.5 %, 0 %, 1 × 10⁻⁵, A-0, 2026-01-02</p>";
    const unfolded = "<style>@media print { details::details-content { content-visibility: visible; block-size: auto; display: block } }</style>";
    const more = `${numbers}${chart(CURVE + BAR, label(10, "mean A") + label(55, "mean B"))}${unfolded}<details><summary>More</summary><p>folded</p></details>`;
    const sound = await of(page({ more }));
    verdict(sound.length === 0, `a page with nothing wrong passes ${sound.join("; ")}`);
    const late = `${SORT}; console.error("oh"); document.querySelector("section").append("only with scripts")`;
    const all = await of(page({ style: "h2 { color: #ccc }", script: late, more: "<p>NaN mm</p><details><summary>More</summary><p>folded</p></details>" }));
    const expected = ["console error: oh", "color-contrast", "says NaN", "text differs", "print: 1 parts are folded"];
    const missed = expected.filter((text) => !all.some((finding) => finding.includes(text)));
    verdict(missed.length === 0, `a page with a fault for every part has all found ${missed.join("; ")}`);
    for (const [part, broken] of Object.entries(BROKEN)) {
      for (const [name, [html, expected]] of Object.entries(broken)) {
        const found = await of(html, [part]);
        verdict(found.some((finding) => finding.includes(expected)), `${name} is noticed${found.length === 0 ? " (nothing was)" : ""}`);
      }
    }
  });
} finally {
  await rm(folder, { recursive: true, force: true });
}
process.exitCode = failed === 0 ? 0 : 1;
