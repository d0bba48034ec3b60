// The page on paper.

import assert from "node:assert/strict";

import { goTo, painted } from "./browser.mjs";
import { inReport } from "./in_report.mjs";

/** What would be on paper. */
function onPaper(page) {
  return page.evaluate(() => {
    const isVisible = (one) => one.checkVisibility();
    const all = (selector) => [...document.querySelectorAll(selector)].filter(isVisible);
    const [canvas] = all("#paper canvas");
    const { width, height } = canvas.getBoundingClientRect();
    return {
      theme: document.documentElement.dataset.theme,
      shape: width / height / (canvas.width / canvas.height),
      corner: [...canvas.getContext("2d").getImageData(1, 1, 1, 1).data],
      strokes: [...new Set(all("#legend .stroke").map((stroke) => stroke.style.borderTopColor))],
      curves: [...new Set(all(".plot").flatMap(({ data }) => data.map(({ line }) => line.color)))],
      plots: all(".plot").map((plot) => [plot.layout.paper_bgcolor, plot.layout.width]),
      controls: all("button, summary, select, input").filter((one) => !one.closest("#custody, #legend, table")).map((one) => one.id),
      cut: all("aside *").filter((one) => getComputedStyle(one).overflowY !== "visible" && one.scrollHeight > one.clientHeight + 1 && !one.closest("svg, .clipped")).map((one) => one.id || one.className),
      events: all("#events [role=option]").length,
      targets: all("#targets tbody tr").length,
      isWide: document.documentElement.scrollWidth > innerWidth,
    };
  });
}

inReport("paper shows a light, undistorted map and all of the selected tab", { flight: "crowd", colorScheme: "dark" }, async (page) => {
  // The width of A4 within the margins.
  await page.setViewportSize({ width: 1280, height: 720 });
  await goTo(page, 15);
  const expected = { charts: { plots: true }, state: { targets: 80 }, events: { events: true } };
  for (const [tab, { plots, events, targets }] of Object.entries(expected)) {
    await page.click(`#tab-${tab}`);
    if (events) await page.click("#routine-events");
    await painted(page);
    await page.evaluate(() => window.dispatchEvent(new Event("beforeprint")));
    await page.emulateMedia({ media: "print" });
    await page.setViewportSize({ width: 718, height: 1000 });
    const paper = await onPaper(page);
    assert.equal(paper.theme, "light");
    assert.ok(Math.abs(paper.shape - 1) < 0.01, `${tab}: stretched by ${paper.shape}`);
    assert.deepEqual(paper.corner.slice(0, 3), [255, 255, 255]);
    assert.deepEqual([paper.controls, paper.cut, paper.isWide], [[], [], false], tab);
    const rgb = (hex) => `rgb(${[1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16)).join(", ")})`;
    if (plots) assert.deepEqual(paper.strokes.filter((colour) => !paper.curves.map(rgb).includes(colour)), [], "the legend has the colours of the curves");
    if (plots) assert.ok(paper.plots.length >= 9 && paper.plots.every(([ground, width]) => ground === "#ffffff" && width === 700), `${paper.plots}`);
    if (events) assert.equal(paper.events, Math.min(1000, await page.locator("#event-count").textContent().then((text) => Number(text.split(" ")[0].replace(",", "")))));
    if (targets) assert.equal(paper.targets, targets);
    await page.emulateMedia({ media: "screen" });
    await page.setViewportSize({ width: 1280, height: 720 });
    await page.evaluate(() => window.dispatchEvent(new Event("afterprint")));
    await painted(page);
    assert.deepEqual(await page.evaluate(() => [document.documentElement.dataset.theme, document.getElementById("paper").children.length]), ["dark", 0]);
  }
});

inReport("the browser prints the page with its map, and shows it again afterwards", {}, async (page) => {
  await page.evaluate(() => addEventListener("afterprint", () => (window.isPrinted = true)));
  await page.evaluate(() => addEventListener("beforeprint", () => (window.maps = document.querySelectorAll("#paper canvas").length)));
  const pages = (await page.pdf({ format: "A4" })).toString("latin1").match(/\/Type \/Page\b/g).length;
  assert.ok(pages >= 2, `${pages} pages`);
  assert.deepEqual(await page.evaluate(() => [window.isPrinted, window.maps]), [true, 1]);
  await painted(page);
  assert.equal(await page.locator("#map").isVisible(), true);
});
