// The metrics of the runs, and for two runs the difference.

/** Formats a value. A fraction that is not quite 0 or 1 does not look like it. */
function outcomeValue(value, unit) {
  const text = fixed(value, 2);
  if (unit === "%" && value > 0 && text === "0.00") return "<0.01";
  return unit === "%" && value < 100 && text === "100.00" ? ">99.99" : text;
}

/** Shows the metrics of the runs that have ended: the main ones, or all of them if the user wants. */
function showOutcome({ runs }) {
  const table = element("outcome");
  element("all-metrics").onchange = () => showOutcome({ runs });
  const outcomes = runs.map(({ replayData }) => new Map(replayData.head.outcome.map((line) => [line.metric, line])));
  const isPair = runs.length > 1;
  const headings = ["Metric", ...(isPair ? [...runs.map((run) => run.letter), "B \u2212 A"] : ["Value"]), "Unit", "Goal or limit"];
  table.tHead.replaceChildren();
  const row = table.tHead.insertRow();
  for (const heading of headings) {
    const cell = document.createElement("th");
    cell.scope = "col";
    cell.textContent = heading;
    row.append(cell);
  }
  const body = table.tBodies[0];
  body.replaceChildren();
  let section = "";
  for (const metric of new Set(outcomes.flatMap((outcome) => [...outcome.keys()]))) {
    const lines = outcomes.map((outcome) => outcome.get(metric));
    const line = lines.find((one) => one);
    if (!line.is_main && !element("all-metrics").checked) continue;
    if (line.section !== section) {
      section = line.section;
      const cell = document.createElement("th");
      Object.assign(cell, { scope: "rowgroup", colSpan: headings.length, textContent: section });
      body.insertRow().append(cell);
    }
    const values = lines.map((one) => one?.value ?? NaN);
    if (isPair) values.push(values[1] - values[0]);
    const row = body.insertRow();
    const name = row.insertCell();
    name.textContent = line.label;
    name.title = metric;
    for (const value of values) {
      const cell = row.insertCell();
      cell.dataset.metric = metric;
      cell.textContent = outcomeValue(value, line.unit);
    }
    row.insertCell().textContent = line.unit;
    row.insertCell().textContent = line.target;
  }
}
