// What a page has to be. A check gives a list of findings, empty where all is well.
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { join } from "node:path";
import { withPage } from "./browser.mjs";

/** Sections of each kind of page, by id. */
export const SECTIONS = {
  report: [
    "verdict", "alerts", "figures", "pictures", "metrics", "distributions", "access", "profiles", "anisotropy", "topology",
    "convergence", "provenance",
  ],
  summary: ["solids"],
  comparison: ["designs", "metrics", "pictures", "curves"],
  clash: ["verdict", "matrix", "list", "pictures"],
  sweep: ["front", "designs", "table"],
};

const SCHEMES = ["light", "dark"];
const WIDTHS = [390, 1280];
const HEIGHT = 900;
/** Windows from this width on show tables whole; narrower ones may scroll them. */
const WIDE = 1280;
/** The length in windows of that width beyond which nobody finds anything on a page. */
const LONGEST = 10_000;
/** The width of A4 between its margins, in CSS pixels. */
const PAPER = 696;

const axeSource = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Parts of the check by name: each notes findings on a page of a kind under where they were found. */
const PARTS = {
  async views(browser, { kind, url, name, folder }, note) {
    for (const colorScheme of SCHEMES) {
      for (const width of WIDTHS) {
        await withPage(browser, url, { colorScheme, viewport: { width, height: HEIGHT } }, async (page, complaints) => {
          const where = `${width} px, ${colorScheme}`;
          note(where, await page.evaluate(sectionsMissing, SECTIONS[kind]));
          note(where, await page.evaluate(overflowing));
          note(where, await page.evaluate(cutTexts));
          note(where, await page.evaluate(overlappingTexts));
          note(where, await page.evaluate(undrawn));
          note(where, await page.evaluate(brokenWords));
          if (width >= WIDE) note(where, await page.evaluate(cutTables, LONGEST));
          if (folder) await page.screenshot({ path: join(folder, `${name}-${width}-${colorScheme}.png`), fullPage: true });
          await page.waitForTimeout(50);
          note(where, complaints);
        });
      }
    }
  },
  async axe(browser, { url }, note) {
    for (const colorScheme of SCHEMES) {
      await withPage(browser, url, { colorScheme, viewport: { width: 1280, height: HEIGHT }, bypassCSP: true }, async (page) => {
        note(`axe, ${colorScheme}`, await axe(page));
      });
    }
  },
  async text(browser, { kind, url }, note) {
    await withPage(browser, url, { viewport: { width: 1280, height: HEIGHT } }, async (page) => {
      note("structure", await page.evaluate(structure));
      note("numbers", await page.evaluate(oddNumbers));
      if (["summary", "clash", "sweep"].includes(kind)) note("sorting", await sorting(page));
    });
  },
  async scripts(browser, { kind, url }, note) {
    note("without scripts", await withoutScripts(browser, url, SECTIONS[kind]));
  },
  async paper(browser, { url, name, folder }, note) {
    note("print", await printed(browser, url, folder && join(folder, `${name}.pdf`)));
  },
};

/** All findings on a page of a kind, by all parts of the check or those named. Screenshots go into a folder, if one is named. */
export async function findings(browser, page, parts = Object.keys(PARTS)) {
  const all = [];
  const note = (where, list) => all.push(...list.map((finding) => `${where}: ${finding}`));
  for (const part of parts) await PARTS[part](browser, page, note);
  return all;
}

/** In the page: sections that are not there, or show nothing. */
function sectionsMissing(ids) {
  return ids.flatMap((id) => {
    const section = document.querySelector(`section#${id}`);
    if (!section) return [`section ${id} is missing`];
    const { width, height } = section.getBoundingClientRect();
    const text = section.innerText.trim();
    return width > 0 && height > 0 && text.length > 20 ? [] : [`section ${id} is empty`];
  });
}

/** In the page: what reaches beyond the window, other than inside a box that scrolls. */
function overflowing() {
  const found = [];
  const width = document.documentElement.scrollWidth;
  if (width > innerWidth) found.push(`the page is ${width} px wide in a window of ${innerWidth}`);
  const scrolls = (element) => {
    for (let box = element.parentElement; box && box !== document.body; box = box.parentElement) {
      if (["auto", "scroll"].includes(getComputedStyle(box).overflowX)) return true;
    }
    return false;
  };
  for (const element of document.body.querySelectorAll("*:not(svg *)")) {
    const { right, width } = element.getBoundingClientRect();
    if (width > 0 && right > innerWidth + 1 && !scrolls(element)) {
      found.push(`<${element.localName} class="${element.className}"> ends at ${Math.round(right)} px`);
      break;
    }
  }
  return found;
}

/** In the page: labels of drawings that are cut off. */
function cutTexts() {
  const found = [];
  for (const svg of document.querySelectorAll("svg")) {
    const frame = svg.getBoundingClientRect();
    for (const text of svg.querySelectorAll("text")) {
      const box = text.getBoundingClientRect();
      // The box of a text is higher than its letters, and no wider.
      const aside = Math.max(frame.left - box.left, box.right - frame.right);
      const beyond = Math.max(aside + 1, frame.top - box.top, box.bottom - frame.bottom);
      if (beyond > 1.5) found.push(`"${text.textContent}" is cut off by ${beyond.toFixed(1)} px in "${svg.getAttribute("aria-label")?.slice(0, 60)}"`);
    }
  }
  return found;
}

/** In the page: labels of drawings that lie on one another. */
function overlappingTexts() {
  const found = [];
  for (const svg of document.querySelectorAll("svg")) {
    const texts = [...svg.querySelectorAll("text")].map((text) => ({ text: text.textContent, box: text.getBoundingClientRect() }));
    texts.forEach((a, i) => {
      for (const b of texts.slice(i + 1)) {
        const across = Math.min(a.box.right, b.box.right) - Math.max(a.box.left, b.box.left);
        const down = Math.min(a.box.bottom, b.box.bottom) - Math.max(a.box.top, b.box.top);
        // The boxes of texts are higher than their letters.
        const lower = Math.min(a.box.height, b.box.height);
        if (across > 0.5 && down > 0.4 * lower) found.push(`"${a.text}" lies on "${b.text}" in "${svg.getAttribute("aria-label")?.slice(0, 60)}"`);
      }
    });
  }
  return found;
}

/** In the page: drawings that show nothing, marks of no size, and attributes that are no lengths. */
function undrawn() {
  const found = [];
  const LENGTHS = ["x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "rx", "ry", "width", "height"];
  const SIZES = ["r", "rx", "ry", "width", "height"];
  // What a chart has whether or not there is anything to show.
  const FURNITURE = ".grid, .axis, .frame, .paper, .hint, .mark, .track, .circle, .scale-bar";
  const painted = (element) => {
    const { fill, stroke, fillOpacity, opacity, visibility, display } = getComputedStyle(element);
    const clear = (paint) => paint === "none" || /^rgba\(.*, 0\)$/.test(paint);
    if (visibility === "hidden" || display === "none" || Number(opacity) === 0) return false;
    return element.localName === "image" || !clear(stroke) || !(clear(fill) || Number(fillOpacity) === 0);
  };
  for (const svg of document.querySelectorAll("svg")) {
    const name = `"${svg.getAttribute("aria-label")?.slice(0, 60)}"`;
    for (const element of svg.querySelectorAll("*")) {
      for (const attribute of LENGTHS.filter((attribute) => element.hasAttribute(attribute))) {
        const value = Number.parseFloat(element.getAttribute(attribute));
        const bad = !Number.isFinite(value) || (value < 0 && SIZES.includes(attribute));
        if (bad) found.push(`<${element.localName}> has ${attribute}="${element.getAttribute(attribute)}" in ${name}`);
      }
      const points = element.getAttribute("points")?.trim().split(/[\s,]+/) ?? [];
      if (points.some((point) => !Number.isFinite(Number(point)))) found.push(`a curve has points that are no numbers in ${name}`);
    }
  }
  for (const svg of document.querySelectorAll("figure svg")) {
    const name = `"${svg.getAttribute("aria-label")?.slice(0, 60)}"`;
    const frame = svg.getBoundingClientRect();
    const axes = [...svg.querySelectorAll("line.axis")].map((line) => line.getBoundingClientRect().top);
    const floor = axes.length > 0 ? Math.max(...axes) : Infinity;
    const shows = (mark) => {
      const box = mark.getBoundingClientRect();
      const within = box.right > frame.left && box.left < frame.right && box.bottom > frame.top && box.top < frame.bottom;
      const sized = mark.localName === "polyline" ? Math.max(box.width, box.height) > 1 : box.width > 0 && box.height > 0;
      // A curve that nowhere leaves the axis cannot be told from it.
      return within && sized && painted(mark) && !(mark.matches("rect, polyline, polygon") && box.top > floor - 1.5);
    };
    const marks = [...svg.querySelectorAll("rect, path, polyline, polygon, circle, ellipse, image")].filter((mark) => !mark.matches(FURNITURE));
    if (!marks.some(shows)) found.push(`nothing is drawn in ${name}`);
    for (const curve of marks.filter((mark) => mark.matches("polyline, path") && !shows(mark))) {
      found.push(`the curve "${curve.getAttribute("class")}" is not to be seen in ${name}`);
    }
  }
  return found;
}

/** In the page: symbols, names and headers that go on in the next line in mid-word. */
function brokenWords() {
  const found = [];
  const TEXTS = ".symbol, .column-symbol, .column-name, .unit, .name, thead th, .card-name, .chip, summary";
  for (const element of document.querySelectorAll(TEXTS)) {
    const walker = document.createTreeWalker(element, NodeFilter.SHOW_TEXT);
    for (let node = walker.nextNode(); node; node = walker.nextNode()) {
      for (const { 0: word, index } of node.data.matchAll(/[^\s\-–/]+/g)) {
        const range = document.createRange();
        range.setStart(node, index);
        range.setEnd(node, index + word.length);
        const lines = new Set([...range.getClientRects()].map(({ top }) => Math.round(top)));
        if (lines.size > 1) found.push(`"${word}" is broken in "${element.textContent.trim().slice(0, 60)}"`);
      }
    }
  }
  return [...new Set(found)];
}

/** In the page: boxes that have to be scrolled sideways in a wide window, and a page of no end. */
function cutTables(longest) {
  const found = [];
  for (const box of document.querySelectorAll(".scroll")) {
    if (box.scrollWidth > box.clientWidth + 1) {
      found.push(`"${box.innerText.trim().slice(0, 40)}" is cut off: ${box.scrollWidth} px wide in ${box.clientWidth}`);
    }
  }
  const length = document.documentElement.scrollHeight;
  if (length > longest) found.push(`the page is ${length} px long`);
  return found;
}

/** In the page: numbers that are not for people, unfolded or not; code, paths and hashes are not. */
function oddNumbers() {
  const found = [];
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    if (node.parentElement.closest("code, pre, script, style, h1, a, .hash, .path, .alerts strong")) continue;
    const odd = node.data.match(/(?<![\d.,\p{L}])[−-]0(\.0+)?(?![\d.,⁰-⁹]|\s×)/u) ?? node.data.match(/(?<![\p{L}\d])\d+(\.\d+)?e[+-]?\d+/u);
    if (odd) found.push(`"${odd[0]}" in "${node.data.trim().slice(0, 60)}"`);
  }
  return found;
}

/** In the page, on paper: what is folded and stays so. */
function folded() {
  const hidden = [...document.querySelectorAll("details > :not(summary)")].filter((part) => !part.checkVisibility());
  return hidden.length === 0 ? [] : [`${hidden.length} parts are folded, first: "${hidden[0].textContent.trim().slice(0, 60)}"`];
}

/** In the page: headings in order, names for what is drawn, tables with captions and headers that say what they head. */
function structure() {
  const found = [];
  const levels = [...document.querySelectorAll("h1, h2, h3, h4, h5, h6")].map((heading) => Number(heading.localName[1]));
  if (levels.filter((level) => level === 1).length !== 1) found.push("there is not one h1");
  levels.forEach((level, i) => {
    if (i > 0 && level > levels[i - 1] + 1) found.push(`an h${level} follows an h${levels[i - 1]}`);
  });
  if (!document.documentElement.lang) found.push("no language");
  for (const image of document.images) if (!image.alt || !image.naturalWidth) found.push("an image without text, or broken");
  for (const svg of document.querySelectorAll("svg")) if (!svg.getAttribute("aria-label")) found.push("a drawing without a label");
  for (const table of document.querySelectorAll("table")) {
    if (!table.caption) found.push("a table without a caption");
    for (const header of table.querySelectorAll("th")) if (!header.scope) found.push(`th "${header.innerText}" without a scope`);
  }
  const text = document.body.innerText;
  for (const bad of ["NaN", "undefined", "Infinity"]) if (text.includes(bad)) found.push(`the page says ${bad}`);
  return found;
}

/** Serious findings of axe-core. */
async function axe(page) {
  await page.evaluate(axeSource);
  const { violations } = await page.evaluate(() => globalThis.axe.run(document, { resultTypes: ["violations"] }));
  return violations
    .filter(({ impact }) => ["serious", "critical"].includes(impact))
    .map(({ id, help, nodes }) => `${id} (${help}), ${nodes.length} times, first: ${nodes[0].html.slice(0, 160)}`);
}

/** Sorts by every column with nothing but keys. */
async function sorting(page) {
  const found = [];
  const headers = page.locator("table.sortable thead th");
  const count = await headers.count();
  if (count === 0 || (await page.locator("table.sortable thead th > button").count()) !== count) {
    return ["headers of the table are no buttons"];
  }
  for (let tabs = 0; ; tabs += 1) {
    if (tabs > 100) return ["no header is reached with the Tab key"];
    await page.keyboard.press("Tab");
    if (await page.evaluate(() => document.activeElement.matches("table.sortable thead th > button"))) break;
  }
  for (let column = 0; column < count; column += 1) {
    if (column > 0) await page.keyboard.press("Tab");
    const at = await page.evaluate(() => document.activeElement.closest("th")?.cellIndex);
    if (at !== column) return [...found, `Tab leads to column ${at}, not ${column}`];
    for (const direction of ["ascending", "descending"]) {
      await page.keyboard.press("Enter");
      const state = await page.evaluate(sortedState, column);
      if (state.sorts.join() !== direction) found.push(`column ${column}: aria-sort is "${state.sorts}", not ${direction}`);
      if (!inOrder(state, direction)) found.push(`column ${column} is not ${direction}: ${state.keys.join(", ")}`);
      if (!state.said.includes(direction)) found.push(`column ${column}: nobody is told of the order`);
    }
  }
  return found;
}

/** In the page: what a column holds, row after row. */
function sortedState(column) {
  const table = document.querySelector("table.sortable");
  const header = table.tHead.rows[0].cells[column];
  return {
    sorts: [...table.querySelectorAll("[aria-sort]")].map((cell) => `${cell.cellIndex === column ? "" : "other "}${cell.getAttribute("aria-sort")}`),
    numbers: header.dataset.sort === "number",
    keys: [...table.tBodies[0].rows].map(({ cells }) => cells[column].dataset.key ?? cells[column].textContent.trim()),
    said: document.querySelector("[role=status]")?.textContent ?? "",
  };
}

/** Whether keys are in order, with those that are missing at the end either way. */
function inOrder({ keys, numbers }, direction) {
  const known = keys.filter((key) => key !== "");
  if (keys.slice(0, known.length).includes("")) return false;
  const sign = direction === "ascending" ? 1 : -1;
  return known.every((key, i) => {
    if (i === 0) return true;
    const order = numbers ? Number(known[i - 1]) - Number(key) : known[i - 1].localeCompare(key, "en", { numeric: true });
    return sign * order <= 0;
  });
}

/** A page must say the same without scripts. */
async function withoutScripts(browser, url, ids) {
  const read = (javaScriptEnabled) =>
    withPage(browser, url, { javaScriptEnabled, viewport: { width: 1280, height: HEIGHT } }, async (page) => ({
      missing: await page.evaluate(sectionsMissing, ids),
      dead: await page.locator("main button").count(),
      text: (await page.locator("main").innerText()).replace(/\s+/g, " ").trim(),
    }));
  const [plain, scripted] = [await read(false), await read(true)];
  const found = [...plain.missing];
  if (plain.dead > 0) found.push(`${plain.dead} buttons that do nothing`);
  if (plain.text !== scripted.text) found.push("the text differs from that with scripts");
  return found;
}

/** On paper, also of a reader whose screen is dark. */
async function printed(browser, url, path) {
  return withPage(browser, url, { colorScheme: "dark", viewport: { width: PAPER, height: HEIGHT } }, async (page) => {
    await page.emulateMedia({ media: "print", colorScheme: "dark" });
    const found = await page.evaluate(overflowing);
    found.push(...(await page.evaluate(cutTexts)));
    found.push(...(await page.evaluate(undrawn)));
    found.push(...(await page.evaluate(folded)));
    const background = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    if (background !== "rgb(255, 255, 255)") found.push(`the paper is ${background}`);
    const file = await page.pdf({ path: path || undefined, preferCSSPageSize: true, printBackground: true });
    if (file.length < 2000 || file.subarray(0, 5).toString() !== "%PDF-") found.push("no PDF file came of it");
    return found;
  });
}
