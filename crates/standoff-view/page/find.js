// Finding an object by its name, showing one group, and taking the map away as a picture.

/** Most names that are proposed. */
const MOST_PROPOSED = 20;

/** Objects whose name has these words, those that begin with them first; an exact name before all. */
function* matches({ film }, words) {
  const wanted = words.trim().toLowerCase();
  if (!wanted) return;
  const objects = function* () {
    for (const id of film.ids.uavs) yield { kind: "uav", id };
    for (const id of film.ids.groups) yield { kind: "group", id };
    for (const id of film.ids.intruders) yield { kind: "intruder", id };
    for (const id of film.head.targets.keys()) yield { kind: "target", id };
  };
  const ranks = [(name) => name === wanted, (name) => name !== wanted && name.startsWith(wanted), (name) => name.indexOf(wanted) > 0];
  // As they are in files, or as the page shows them.
  const names = (object) => [wholeName(film, object), objectName(film, object)].map((name) => name.toLowerCase());
  for (const fits of ranks) for (const object of objects()) if (names(object).some(fits)) yield object;
}

/** The first of them, at most so many. */
function first(items, most) {
  const some = [];
  for (const item of items) if (some.push(item) === most) break;
  return some;
}

/** Wires the field that finds. */
function connectFind(page) {
  const field = element("find");
  const said = element("found");
  const propose = () => {
    const { film } = page;
    const found = first(matches(page, field.value), MOST_PROPOSED);
    element("names").replaceChildren(...found.map((object) => new Option(objectName(film, object), wholeName(film, object))));
    said.textContent = field.value.trim() && !found.length ? "no match" : "";
  };
  const take = () => {
    const [object] = first(matches(page, field.value), 1);
    if (!object) return propose();
    page.choice.choose(object);
    const { map } = page;
    const { scene, camera } = map;
    const place = placeAt(scene, object);
    said.textContent = place ? "" : absence(page.film, scene, object);
    if (!place) return undefined;
    page.choice.follow(null);
    map.canvas.focus();
    [camera.x_m, camera.y_m] = place;
    return page.renew();
  };
  field.addEventListener("input", (input) => {
    propose();
    // One of those proposed has been taken.
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

/** Which groups can be shown alone. */
function filters({ film, choice }) {
  const select = element("only");
  const wanted = [["all", "all"], ...film.ids.groups.map((id) => [`${id}`, `group ${id}`]), ["none", "in no group"]];
  const isKnown = wanted.length === select.options.length && wanted.every(([value], k) => select.options[k].value === value);
  if (!isKnown) select.replaceChildren(...wanted.map(([value, text]) => new Option(text, value)));
  select.value = choice.group === null ? "none" : `${choice.group}`;
}

function connectFilter(page) {
  const select = element("only");
  select.addEventListener("change", () => {
    const { value } = select;
    page.choice.filter(value === "all" ? value : value === "none" ? null : Number(value));
  });
  for (const { choice } of page.runs) choice.on(() => filters(page));
}

/** What the map shows as a picture, with its scale, the time and the run's name written in. */
async function savePicture({ map, film, clock }) {
  const { canvas } = map;
  const ratio = canvas.width / map.camera.width;
  const strip = 26;
  const copy = document.createElement("canvas");
  copy.width = canvas.width;
  copy.height = canvas.height + Math.round(strip * ratio);
  const pen = copy.getContext("2d", { alpha: false });
  const { ground, ink, grid } = palette();
  pen.fillStyle = ground;
  pen.fillRect(0, 0, copy.width, copy.height);
  pen.drawImage(canvas, 0, 0);
  pen.scale(ratio, ratio);
  pen.font = "12px system-ui, sans-serif";
  if (!map.shown.has("grid")) map.painted(pen, () => drawScale(map, pen));
  const { width, height } = map.camera;
  pen.fillStyle = grid;
  pen.fillRect(0, height, width, 1);
  pen.fillStyle = ink;
  pen.textBaseline = "middle";
  const time = `${clock.time_s.toFixed(1)} s`;
  const whose = film.minds.isSeveral ? `, ${pictureWords(film, film.instant(clock.time_s))}` : "";
  pen.fillText(`${runName(film.head)}${whose}`, 10, height + strip / 2, width - 100);
  pen.textAlign = "right";
  pen.fillText(time, width - 10, height + strip / 2);
  const picture = await new Promise((resolve) => copy.toBlob(resolve, "image/png"));
  if (!picture) return element("found").replaceChildren("The map is too large for a picture");
  return save(`${fileName(`${runName(film.head)}-map-${time}`)}.png`, picture, "image/png");
}
