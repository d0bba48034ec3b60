// What there is between UAVs, on a map: who hears whom, who is silent for the one whose picture is shown, and who keeps away
// from whom.

/** Of more UAVs than this, lines between those that hear each other are drawn of the chosen one alone. */
const MOST_LINKED = 6;
/** From where to where a line goes between two UAVs: their marks stay free. */
const CLEAR_PX = 16;

/** Who hears whom. An arrow points to the only one that hears. */
function drawRadio(map, { pen, scene }) {
  const { choice, film: { minds } } = map;
  if (!minds.isSeveral) return;
  const isOf = (uav) => scene.uavs.length <= MOST_LINKED || choice.isChosen("uav", uav.id);
  const { faint, alarm } = palette();
  const instant = map.film.instant(scene.time_s);
  const hears = (one, other) => one.mind.is_on && other.mind.is_on && !UNHEARD.has(minds.believed(one.id, other.id, instant).presence);
  scene.uavs.forEach((one, k) => {
    for (const other of scene.uavs.slice(k + 1)) {
      const ways = [hears(one, other), hears(other, one)];
      if (ways[0] && ways[1] && !isOf(one) && !isOf(other)) continue;
      const [from, to] = ways[0] && !ways[1] ? [other, one] : [one, other];
      const [[x, y], [x2, y2]] = [from, to].map(({ x_m, y_m }) => map.camera.at(x_m, y_m));
      const far = Math.hypot(x2 - x, y2 - y);
      if (far < 3 * CLEAR_PX) continue;
      const [ux, uy] = [(x2 - x) / far, (y2 - y) / far];
      const along = (at, side = 0) => [x + ux * at - uy * side, y + uy * at + ux * side];
      const isSilent = !ways[0] && !ways[1];
      pen.strokeStyle = pen.fillStyle = isSilent ? faded(alarm, 0.7) : faded(faint, 0.8);
      pen.lineWidth = isSilent ? 1.5 : 1.25;
      pen.setLineDash(isSilent ? [1.5, 6] : ways[0] && ways[1] ? [] : [7, 4]);
      pen.beginPath();
      pen.moveTo(...along(CLEAR_PX));
      pen.lineTo(...along(far - CLEAR_PX));
      pen.stroke();
      if (ways[0] === ways[1]) continue;
      pen.setLineDash([]);
      pen.beginPath();
      for (const place of [along(far - CLEAR_PX + 2), along(far - CLEAR_PX - 9, 5), along(far - CLEAR_PX - 9, -5)]) pen.lineTo(...place);
      pen.fill();
    }
  });
}

/** A ring about a UAV that is not heard, and where it was when it last was. */
function drawSilence(map, { pen, labels, scene }) {
  const { camera, film } = map;
  for (const { id, x_m, y_m, mind, out } of scene.uavs.filter((uav) => uav.mind?.is_unheard)) {
    const { presence, age_s } = mind.shown;
    const [x, y] = camera.at(x_m, y_m);
    const { alarm, faint } = palette();
    pen.strokeStyle = pen.fillStyle = presence === "silent" ? faint : alarm;
    pen.lineWidth = 2;
    pen.setLineDash([5, 4]);
    pen.beginPath();
    addDisc(pen, x, y, 17);
    pen.stroke();
    pen.setLineDash([]);
    if (!out && camera.sees(x_m, y_m)) labels.beside(silenceWords(mind), x, y, 20, 24);
    if (Number.isNaN(age_s)) continue;
    const then = film.instant(film.times_s[mind.instant] - age_s);
    const [x2, y2] = camera.at(film.value("uavs", "x_m", id, then), film.value("uavs", "y_m", id, then));
    if (Math.hypot(x2 - x, y2 - y) < 24) continue;
    pen.lineWidth = 1.25;
    pen.beginPath();
    addDisc(pen, x2, y2, 6);
    pen.stroke();
  }
}

/** That a UAV is not heard, and how old what was heard last is, in words. */
function silenceWords({ owner, shown: { presence, age_s } }) {
  const since = Number.isNaN(age_s) ? "" : ` (${age_s.toFixed(1)} s)`;
  return `${presence} for UAV ${owner}${since}`;
}

/** A broken line from a UAV to the UAV or intruder that it keeps away from, with a dot where it begins. */
function drawAvoidance(map, { pen, scene }) {
  const { alarm } = palette();
  for (const uav of scene.uavs) {
    const other = scene.uavs.find(({ id }) => id === uav.avoids) ?? scene.intruders.find(({ id }) => id === uav.avoids_intruder);
    if (!other) continue;
    const [[x, y], [x2, y2]] = [uav, other].map(({ x_m, y_m }) => map.camera.at(x_m, y_m));
    pen.strokeStyle = pen.fillStyle = alarm;
    pen.lineWidth = 2;
    pen.setLineDash([7, 5]);
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(x2, y2);
    pen.stroke();
    pen.setLineDash([]);
    pen.beginPath();
    pen.arc(x, y, 4.5, 0, 2 * Math.PI);
    pen.fill();
  }
}
