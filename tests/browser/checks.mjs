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
};

const SCHEMES = ["light", "dark"];
const WIDTHS = [390, 1280];
const HEIGHT = 900;
/** The width of A4 between its margins, in CSS pixels. */
const PAPER = 696;

const axeSource = await readFile(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** All findings on a page of a kind. Screenshots go into a folder, if one is named. */
export async function findings(browser, { kind, url, name, folder }) {
  const all = [];
  const note = (where, list) => all.push(...list.map((finding) => `${where}: ${finding}`));
  for (const colorScheme of SCHEMES) {
    for (const width of WIDTHS) {
      await withPage(browser, url, { colorScheme, viewport: { width, height: HEIGHT } }, async (page, complaints) => {
        const where = `${width} px, ${colorScheme}`;
        note(where, await page.evaluate(sectionsMissing, SECTIONS[kind]));
        note(where, await page.evaluate(overflowing));
        note(where, await page.evaluate(cutTexts));
        if (folder) await page.screenshot({ path: join(folder, `${name}-${width}-${colorScheme}.png`), fullPage: true });
        await page.waitForTimeout(50);
        note(where, complaints);
      });
    }
    await withPage(browser, url, { colorScheme, viewport: { width: 1280, height: HEIGHT }, bypassCSP: true }, async (page) => {
      note(`axe, ${colorScheme}`, await axe(page));
    });
  }
  await withPage(browser, url, { viewport: { width: 1280, height: HEIGHT } }, async (page) => {
    note("structure", await page.evaluate(structure));
    if (kind === "summary") note("sorting", await sorting(page));
  });
  note("without scripts", await withoutScripts(browser, url, SECTIONS[kind]));
  note("print", await printed(browser, url, folder && join(folder, `${name}.pdf`)));
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
      const beyond = Math.max(frame.left - box.left, box.right - frame.right, frame.top - box.top, box.bottom - frame.bottom);
      if (beyond > 1.5) found.push(`"${text.textContent}" is cut off by ${beyond.toFixed(1)} px in "${svg.getAttribute("aria-label")?.slice(0, 60)}"`);
    }
  }
  return found;
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
    const background = await page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    if (background !== "rgb(255, 255, 255)") found.push(`the paper is ${background}`);
    const file = await page.pdf({ path: path || undefined, preferCSSPageSize: true, printBackground: true });
    if (file.length < 2000 || file.subarray(0, 5).toString() !== "%PDF-") found.push("no PDF file came of it");
    return found;
  });
}
