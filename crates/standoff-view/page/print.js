// The page on paper: the maps with their legends, then all of the selected tab, in the light theme.

/** Width of the charts on paper, px: that of A4 with the margins of browsers. */
const PAPER_PX = 700;

/** Prepares the page for the printer: a browser would squeeze the canvas of the map, and would not wait for a frame. */
function connectPrint(page) {
  const paper = element("paper");
  // These listeners run after those that change the theme, which also redraw everything after printing.
  window.addEventListener("beforeprint", () => {
    paper.replaceChildren(...page.runs.map(({ map, replayData }) => {
      map.inks.clear();
      return exportedMap({ map, replayData, clock: page.clock }, 2);
    }));
    page.charts.print(PAPER_PX);
    page.state.targetTable.fill();
    page.timeline.list.show();
  });
  window.addEventListener("afterprint", () => paper.replaceChildren());
}
