// Objects of the map: which object is at a position, and the contents of its card.

/** Kinds of objects that have a card but exist for one time step only, so that they cannot be selected. */
const HOVER_ONLY = new Set(["detection", "tentative"]);

/** Distance from an object within which a pointer selects it, px: mouse and finger. */
const NEAR_PX = 12;
const FINGER_PX = 24;

/**
 * Returns the objects at a position of the canvas, the most likely selection first: aircraft whose symbol is at the position, the
 * uppermost first; then targets, aircraft, group centres, detections and tentative tracks within `near_px` by distance, then orbits, and fields of view. `part`
 * is set if the position is on an orbit or in a field of view.
 */
function objectsAt(map, x, y, near_px = NEAR_PX) {
  const { camera, scene, shown, replayData, selection } = map;
  const off = (one) => {
    const [at_x, at_y] = camera.at(one.x_m, one.y_m);
    return Math.hypot(at_x - x, at_y - y);
  };
  const near = [];
  const uppermost = [];
  if (shown.has("tracks") || shown.has("truth")) {
    for (const { target, x: at_x, y: at_y } of map.drawn) {
      if (!target.tracked && !shown.has("truth") && !selection.isChosen("target", target.id)) continue;
      near.push({ kind: "target", id: target.id, off: Math.hypot(at_x - x, at_y - y), isSelectable: selection.passes(target.group) });
    }
  }
  const addAircraft = (kind, all, outline, size) => {
    for (const one of all) {
      const aircraft = { kind, id: one.id, off: off(one), isSelectable: true };
      const [at_x, at_y] = camera.at(one.x_m, one.y_m);
      if (isOnSymbol(outline, one.nose_rad ?? one.heading_rad, (x - at_x) / size, (y - at_y) / size)) uppermost.unshift(aircraft);
      else near.push(aircraft);
    }
  };
  if (shown.has("uavs")) addAircraft("uav", scene.uavs, AIRCRAFT, map.uavSize());
  if (shown.has("intruders")) addAircraft("intruder", scene.intruders, INTRUDER, 1);
  for (const one of shown.has("detections") ? scene.detections : []) near.push({ kind: "detection", id: one.id, off: off(one), isSelectable: true });
  for (const one of shown.has("tentative") ? scene.tentatives : []) near.push({ kind: "tentative", id: one.id, off: off(one), isSelectable: true });
  const orbits = [];
  for (const group of shown.has("desired") ? scene.groups : []) {
    const far = off(group);
    near.push({ kind: "group", id: group.id, off: far, isSelectable: true });
    const off_orbit = Math.abs(far - group.standoff_distance_m * camera.px_per_m);
    orbits.push({ kind: "group", id: group.id, part: "orbit", off: off_orbit, isSelectable: true });
  }
  const found = [near, orbits].flatMap((some) =>
    some.filter((one) => one.off <= near_px && one.isSelectable).sort((a, b) => a.off - b.off));
  found.unshift(...uppermost);
  if (shown.has("views")) {
    const half_rad = replayData.head.limits.field_of_view_rad / 2;
    const [x_m, y_m] = camera.world(x, y);
    for (const uav of scene.uavs) {
      const range_m = Math.hypot(x_m - uav.x_m, y_m - uav.y_m);
      if (offBoresight_rad(uav, x_m, y_m) <= half_rad && range_m <= wedgeReach_m(uav, scene)) found.push({ kind: "uav", id: uav.id, part: "view" });
    }
  }
  // Each object is listed once, even if several of its parts are near.
  return found.filter((one, index) => found.findIndex((other) => other.kind === one.kind && other.id === one.id) === index);
}

/** Distance from the middle of a symbol within which a position is on it, although its outline is narrow, px. */
const MIDDLE_PX = 5;

/** Whether a position, relative to an aircraft, is on its symbol with the outline `corners`. */
function isOnSymbol(corners, heading_rad, dx, dy) {
  if (Math.hypot(dx, dy) <= MIDDLE_PX) return true;
  const [cos, sin] = [Math.cos(heading_rad), Math.sin(heading_rad)];
  // The inverse of the rotation with which the symbols are drawn.
  const [x, y] = [dx * cos - dy * sin, dx * sin + dy * cos];
  let isInside = false;
  corners.forEach(([ax, ay], k) => {
    const [bx, by] = corners[(k + 1) % corners.length];
    if (ay > y !== by > y && x < ((bx - ax) * (y - ay)) / (by - ay) + ax) isInside = !isInside;
  });
  return isInside;
}

/** Returns the contents of an object's card: title, description, and facts (heading, value, tooltip, key). */
function cardContents(run, object) {
  const { replayData, map } = run;
  const { scene } = map;
  const one = objectIn(scene, object);
  const name = objectName(replayData, object);
  const part = { orbit: "Orbit of ", view: "Field of view of " }[object.part];
  const title = part ? part + name : capital(object, name);
  const factsOf = (columns, item) => columns.slice(1).map(([key, heading, text, about]) => [heading, text(item), about, key]);
  if (!one) return { title, what: absenceText(replayData, scene, object), facts: [] };
  if (object.kind === "target") {
    const target = { ...one, name };
    const more = one.tracked ? factsOf([null, ...TARGET_DETAILS], target) : [];
    const priority = ["Priority", String(replayData.head.priorities?.[one.id] ?? ""), "How much the target counts, without areas of interest", "priority"];
    const blind = ["Blind to", blindTargetText(replayData, one), "UAVs that have the target in view but rarely detect it: its true radial speed over ground, which is given, is " +
      "below the minimum detectable velocity (MDV)", "blind"];
    return { title, what: "Target", facts: [...factsOf(TARGET_COLUMNS, target), ...more, priority, blind] };
  }
  if (object.kind === "tentative") return tentativeCard(one);
  if (object.kind === "detection") return detectionCard(replayData, one);
  if (object.kind === "group") return { title, what: groupText(one, object.part), facts: factsOf(GROUP_COLUMNS, one) };
  if (object.kind === "intruder") return { title, what: "Intruder: aircraft outside the team", facts: factsOf(INTRUDER_COLUMNS, one) };
  const details = Number.isNaN(one.airspeed_m_s) ? UAV_DETAILS : [...UAV_DETAILS, ...WIND_DETAILS];
  const facts = [...factsOf([...UAV_COLUMNS, ...details], one), ...agentFacts(replayData, one)];
  facts.push(["Blind to", blindUavText(replayData, scene, one), "Targets in view that it rarely detects: their true radial speed over ground, which is given, is " +
    "below the minimum detectable velocity (MDV)", "blind"]);
  const { field_of_view_rad } = replayData.head.limits;
  const way = wayText(scene, one, field_of_view_rad);
  if (object.part === "view") return { title, what: [way, viewText(replayData)].filter(Boolean).join(". "), facts: facts.filter(([, , , key]) => /sight/.test(key)) };
  return { title, what: one.out ? `${outageText(one)}: no UAV receives its reports, and its sensor points nowhere` : way || "UAV", facts };
}

/** Facts about the agent of a UAV; empty if the team shares one agent. */
function agentFacts(replayData, { id, agentState }) {
  if (!agentState) return [];
  const { stepIndex, shown, owner } = agentState;
  const facts = [];
  if (shown) {
    const age = Number.isNaN(shown.age_s) ? "" : `, last report ${shown.age_s.toFixed(1)} s ago`;
    facts.push([`Status at UAV ${owner}`, `${shown.status}${age}`, "Status of this UAV in the shown team state", "status"]);
  }
  if (!agentState.isOn) return [...facts, ["Computer", "off", "The agent neither sends nor receives", "computer"]];
  const ownGroup = agentState.group === null ? "none" : `${agentState.group}`;
  return [
    ...facts,
    ["Own assignment", ownGroup, "Group that this UAV is assigned to in its own team state; the UAV flies this assignment", "own_group"],
    ["No reports from", replayData.agents.notReceived(id, stepIndex).map((other) => `UAV ${other.uav} (${other.status})`).join(", ") || "none",
      "UAVs whose reports this agent does not receive", "missing_reports"],
    ["Report ages", reportAgesText(replayData, id, stepIndex), "Age of the last report received from each other UAV", "ages"],
    ["Commit lag (s)", fixed(agentState.lag_s, 1), "Time since the last committed time step; the team state up to that step is final", "lag_s"],
    ...(agentState.isLimited
      ? [["Retransmissions", "limited", "Missing messages wait, because the bandwidth or the budget for retransmissions is spent", "retransmissions"]] : []),
  ];
}

function groupText(group, part) {
  if (part !== "orbit") return "Group; the small cross marks its estimated centre";
  return `Desired orbit: radius r_d about the estimated centre of the group${group.feasible ? "" : "; dashed: no orbit satisfies all constraints"}`;
}

/** Description of the field of view. */
function viewText(replayData) {
  const wide_deg = replayData.head.limits.field_of_view_rad * DEGREES;
  return `${wide_deg.toFixed(0)}\u00b0 wide, centred on the boresight. A target is in view if its true position is inside and within ` +
    "sensing range; the wedge is drawn only to the far side of the group";
}

/** A name with a capital first letter, for the start of a sentence; names of targets stay unchanged. */
function capital({ kind }, name) {
  return kind === "group" || kind === "intruder" ? name[0].toUpperCase() + name.slice(1) : name;
}

/** Text stating that an object does not exist at the time shown, and when it ended or begins, if known. */
function absenceText(replayData, scene, { kind, id }) {
  const { time_s } = scene;
  const name = capital({ kind }, objectName(replayData, { kind, id }));
  if (kind === "target") return scene.targets ? `${name} does not exist at ${time_s.toFixed(1)} s` : "";
  const positions = replayData.series(`${kind}s`, "x_m", id);
  const now = replayData.stepAt(time_s);
  for (let k = now; k >= 0; k--) if (!Number.isNaN(positions[k])) return `${name} ended at ${(replayData.times_s[k + 1] ?? time_s).toFixed(1)} s`;
  const first = positions.findIndex((x_m) => !Number.isNaN(x_m));
  return first < 0 ? `${name} does not exist` : `${name} begins at ${replayData.times_s[first].toFixed(1)} s`;
}
