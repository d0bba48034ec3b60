// Checks of accessibility (rules of axe-core) and of the layout.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";

const AXE = readFileSync(createRequire(import.meta.url).resolve("axe-core/axe.min.js"), "utf8");

/** Checks the page against the rules of axe-core. */
export async function axe(page, what) {
  await page.evaluate(AXE);
  const { violations, passes } = await page.evaluate(() => window.axe.run(document, { resultTypes: ["violations"] }));
  const messages = violations.flatMap(({ id, nodes }) => nodes.map((node) => `${id}: ${node.target}: ${node.any.map((any) => any.message)}`));
  assert.deepEqual(messages, [], what);
  assert.ok(passes.some((rule) => rule.id === "color-contrast"), "contrast was checked");
}

/** Checks that no elements overlap or are cut off, and that nothing scrolls horizontally. */
export async function checkLayout(page, what) {
  const { scrolls, boxes, outside } = await page.evaluate(() => {
    const root = document.scrollingElement;
    const visible = [...document.querySelectorAll("header > *, .tools > *, #pointer-position, [role=tab], .bar > *, footer > *")]
      .map((one) => [one.id || one.textContent.trim().slice(0, 20), one.getBoundingClientRect()])
      .filter(([, box]) => box.width > 0 && box.height > 0);
    return {
      scrolls: root.scrollHeight > root.clientHeight || [root, ...document.querySelectorAll(".scrolled")].some((one) => one.scrollWidth > one.clientWidth),
      boxes: visible.map(([name, { left, top, right, bottom }]) => ({ name, left, top, right, bottom })),
      outside: visible.filter(([, box]) => box.left < 0 || box.top < 0 || box.right > innerWidth || box.bottom > innerHeight).map(([name]) => name),
    };
  });
  assert.ok(!scrolls, `${what}: the page does not scroll, and no panel scrolls horizontally`);
  assert.deepEqual(outside, [], what);
  assert.ok(boxes.length > 15, `${boxes.length} elements are checked`);
  for (const [k, a] of boxes.entries()) {
    for (const b of boxes.slice(k + 1)) {
      const isDisjoint = a.right <= b.left + 0.5 || b.right <= a.left + 0.5 || a.bottom <= b.top + 0.5 || b.bottom <= a.top + 0.5;
      assert.ok(isDisjoint, `${what}: ${a.name} and ${b.name} overlap: ${JSON.stringify([a, b])}`);
    }
  }
}
