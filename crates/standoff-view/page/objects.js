// The objects of a map: which one is at a place, and what there is to say about it.

/** How near a pointer has to come, px: a mouse, and a finger. */
const NEAR_PX = 12;
const FINGER_PX = 24;

/**
 * What is at a place of the canvas, first what is meant most likely: targets, UAVs and intruders, the nearest first, then centres
 * of groups, orbits, and fields of view. `part` says which part of an object it is, if not its middle.
 */
function objectsAt(map, x, y, near_px = NEAR_PX) {
  const { camera, scene, shown, film, choice } = map;
  const off = (one) => {
    const [at_x, at_y] = camera.at(one.x_m, one.y_m);
    return Math.hypot(at_x - x, at_y - y);
  };
  const near = [];
  if (shown.has("tracks") || shown.has("truth")) {
    for (const { target, x: at_x, y: at_y } of map.drawn) {
      if (!target.tracked && !shown.has("truth")) continue;
      near.push({ kind: "target", id: target.id, off: Math.hypot(at_x - x, at_y - y), plain: choice.passes(target.group) });
    }
  }
  if (shown.has("uavs")) for (const uav of scene.uavs) near.push({ kind: "uav", id: uav.id, off: off(uav), plain: true });
  if (shown.has("intruders")) for (const one of scene.intruders) near.push({ kind: "intruder", id: one.id, off: off(one), plain: true });
  const centres = [];
  const orbits = [];
  for (const group of shown.has("desired") ? scene.groups : []) {
    const far = off(group);
    centres.push({ kind: "group", id: group.id, off: far, plain: true });
    const off_orbit = Math.abs(far - group.standoff_distance_m * camera.px_per_m);
    orbits.push({ kind: "group", id: group.id, part: "orbit", off: off_orbit, plain: true });
  }
  const found = [near, centres, orbits].flatMap((some) =>
    some.filter((one) => one.off <= near_px && one.plain).sort((a, b) => a.off - b.off));
  if (shown.has("views")) {
    const half_rad = film.head.limits.field_of_view_rad / 2;
    const [x_m, y_m] = camera.world(x, y);
    for (const uav of scene.uavs) {
      const [dx, dy] = [x_m - uav.x_m, y_m - uav.y_m];
      const angle_rad = Math.abs(turned(uav.boresight_rad, Math.atan2(dy, dx), 1) - uav.boresight_rad);
      if (angle_rad <= half_rad && Math.hypot(dx, dy) <= wedgeReach_m(uav, scene)) found.push({ kind: "uav", id: uav.id, part: "view" });
    }
  }
  // An object is one, whatever parts of it are near.
  return found.filter((one, index) => found.findIndex((other) => other.kind === one.kind && other.id === one.id) === index);
}

/** What there is to say about an object now: a title, what it is in a sentence, and numbers: heading, value, meaning. */
function account(run, object) {
  const { film, map } = run;
  const { scene } = map;
  const one = found(scene, object);
  const name = objectName(film, object);
  const part = { orbit: "Orbit of ", view: "Field of view of " }[object.part];
  const title = part ? part + name : capital(object, name);
  const told = (columns, item) => columns.slice(1).map(([key, heading, words, about]) => [heading, words(item), about, key]);
  if (!one) return { title, what: absence(film, scene, object), facts: [] };
  if (object.kind === "target") {
    const target = { ...one, name };
    const more = one.tracked ? told([null, ...TARGET_DETAILS], target) : [];
    return { title, what: "Target", facts: [...told(TARGET_COLUMNS, target), ...more] };
  }
  if (object.kind === "group") return { title, what: groupWords(one, object.part), facts: told(GROUP_COLUMNS, one) };
  if (object.kind === "intruder") return { title, what: "Intruder: an aircraft that is not of the team", facts: told(INTRUDER_COLUMNS, one) };
  const facts = [...told([...UAV_COLUMNS, ...UAV_DETAILS], one), ...mindFacts(film, one)];
  if (object.part === "view") return { title, what: viewWords(film), facts: facts.filter(([, , , key]) => /sight/.test(key)) };
  return { title, what: one.out ? `${outWords(one)}: nobody hears it, and its sensor points nowhere` : "UAV", facts };
}

/** What a UAV's card says of its mind, where minds are several. */
function mindFacts(film, { id, mind }) {
  if (!mind) return [];
  const { instant, shown, owner } = mind;
  const facts = [];
  if (shown) {
    const age = Number.isNaN(shown.age_s) ? "" : `, newest report ${shown.age_s.toFixed(1)} s old`;
    facts.push([`For UAV ${owner}`, `${shown.presence}${age}`, "What the UAV whose picture is shown takes it for", "presence"]);
  }
  if (!mind.is_on) return [...facts, ["Computer", "off", "It hears nobody, and nobody hears it", "computer"]];
  const flown = mind.group === null ? "none" : `${mind.group}`;
  return [
    ...facts,
    ["Serves, by itself", flown, "The group that it serves by its own mind, by its own number: what it flies", "own_group"],
    ["Does not hear", film.minds.unheard(id, instant).map((other) => `UAV ${other.uav} (${other.presence})`).join(", ") || "none: it hears all",
      "UAVs that are not live to it", "hears"],
    ["Newest reports", agesWords(film, id, instant), "How old its newest report of each other UAV is", "ages"],
    ["Certain (s ago)", fixed(mind.lag_s, 1), "What it believes up to so long ago cannot change any more", "lag_s"],
  ];
}

function groupWords(group, part) {
  if (part !== "orbit") return "Group; the small cross is its estimated centre";
  return `Desired orbit, r_d about the group's estimated centre${group.feasible ? "" : "; broken: no orbit satisfies every constraint"}`;
}

/** What a wedge means. */
function viewWords(film) {
  const wide_deg = film.head.limits.field_of_view_rad * DEGREES;
  return `${wide_deg.toFixed(0)}\u00b0 about the boresight. A target counts as in view if it is inside, by the true geometry, and within ` +
    "sensing range; the wedge is drawn only as far as the group reaches";
}

/** A name as a sentence begins with it; those of targets are not ours to change. */
function capital({ kind }, name) {
  return kind === "group" || kind === "intruder" ? name[0].toUpperCase() + name.slice(1) : name;
}

/** That an object is not there, and since when or until when, as far as that is known. */
function absence(film, scene, { kind, id }) {
  const { time_s } = scene;
  const name = capital({ kind }, objectName(film, { kind, id }));
  if (kind === "target") return scene.targets ? `${name} is not there at ${time_s.toFixed(1)} s` : "";
  const there = film.series(`${kind}s`, "x_m", id);
  const now = film.instant(time_s);
  for (let k = now; k >= 0; k--) if (!Number.isNaN(there[k])) return `${name} ended at ${(film.times_s[k + 1] ?? time_s).toFixed(1)} s`;
  const first = there.findIndex((x_m) => !Number.isNaN(x_m));
  return first < 0 ? `${name} is not there` : `${name} begins at ${film.times_s[first].toFixed(1)} s`;
}
