// Finding an object by name, highlighting one group, and saving the map as an image.

/** Maximum number of proposed names. */
const MAX_PROPOSED = 20;
/** The map shows at least this distance around an object that was found, m. */
const AROUND_M = 300;

/** Objects whose name contains a text. Exact matches come first, then names that begin with the text, then the others. */
function* matches({ replayData }, query) {
  const lower = query.trim().toLowerCase();
  if (!lower) return;
  const objects = function* () {
    for (const id of replayData.ids.uavs) yield { kind: "uav", id };
    for (const id of replayData.ids.groups) yield { kind: "group", id };
    for (const id of replayData.ids.intruders) yield { kind: "intruder", id };
    for (const id of replayData.head.targets.keys()) yield { kind: "target", id };
  };
  const ranks = [(name) => name === lower, (name) => name !== lower && name.startsWith(lower), (name) => name.indexOf(lower) > 0];
  // Names as stored in files, and as shown on the page.
  const names = (object) => [wholeName(replayData, object), objectName(replayData, object)].map((name) => name.toLowerCase());
  for (const fits of ranks) for (const object of objects()) if (names(object).some(fits)) yield object;
}

/** The first items of an iterable, at most `most`. */
function first(items, most) {
  const some = [];
  for (const item of items) if (some.push(item) === most) break;
  return some;
}

/** The text of a proposed object: its name, and the warning if it is a target. */
function proposal({ replayData, map }, object) {
  const target = object.kind === "target" && objectIn(map.scene, object);
  return [objectName(replayData, object), target && warningOf(target)].filter(Boolean).join(" \u2013 ");
}

/** Shows an object with its surroundings: its position is in the middle of the map below the toolbar. */
function showAround(camera, [x_m, y_m], scene, object) {
  const around_m = Math.max(AROUND_M, object.kind === "group" ? objectIn(scene, object).standoff_distance_m : 0);
  Object.assign(camera, camera.fitted([x_m - around_m, y_m - around_m, x_m + around_m, y_m + around_m], 1));
}

/** Connects the search field. */
function connectFind(page) {
  const field = element("find");
  const message = element("search-result");
  const propose = () => {
    const { replayData } = page;
    const found = first(matches(page, field.value), MAX_PROPOSED);
    element("search-names").replaceChildren(...found.map((object) => new Option(proposal(page, object), wholeName(replayData, object))));
    message.textContent = field.value.trim() && !found.length ? "no match" : "";
  };
  const take = () => {
    const [object] = first(matches(page, field.value), 1);
    if (!object) return propose();
    page.selection.choose(object);
    const { map } = page;
    const { scene, camera } = map;
    const position = positionOf(scene, object);
    message.textContent = position ? "" : absenceText(page.replayData, scene, object);
    if (!position) return undefined;
    page.selection.follow(null);
    map.canvas.focus();
    showAround(camera, position, scene, object);
    return page.renew();
  };
  field.addEventListener("input", (input) => {
    propose();
    // The user has selected a proposed name.
    if (input.inputType === "insertReplacementText" || !input.inputType) take();
  });
  field.addEventListener("keydown", (key) => {
    if (key.key === "Enter") take();
    if (key.key === "Escape") {
      field.value = "";
      propose();
      page.map.canvas.focus();
    }
  });
}

/** Updates the list of groups that can be highlighted. */
function filters({ replayData, selection }) {
  const select = element("highlighted-group");
  const options = [["all", "all"], ...replayData.ids.groups.map((id) => [`${id}`, `group ${id}`]), ["none", "ungrouped"]];
  const isSame = options.length === select.options.length && options.every(([value], k) => select.options[k].value === value);
  if (!isSame) select.replaceChildren(...options.map(([value, text]) => new Option(text, value)));
  select.value = selection.group === null ? "none" : `${selection.group}`;
}

function connectFilter(page) {
  const select = element("highlighted-group");
  select.addEventListener("change", () => {
    const { value } = select;
    page.selection.filter(value === "all" ? value : value === "none" ? null : Number(value));
  });
  for (const { selection } of page.runs) selection.on(() => filters(page));
}
