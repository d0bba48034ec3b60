// Relations between UAVs on the map: radio links, silent UAVs in the shown team state, and collision avoidance.

/** Maximum number of UAVs for which all two-way links are drawn; with more UAVs only those of the selected UAV are drawn. */
const MOST_LINKED = 6;
/** Distance of the ends of a line from the UAVs, so that their symbols stay clear, px. */
const CLEAR_PX = 16;

/** Draws radio links. For a one-way link, an arrow points to the UAV that receives. */
function drawRadio(map, { pen, scene }) {
  const { selection, replayData: { agents } } = map;
  if (!agents.isSeveral) return;
  const isOf = (uav) => scene.uavs.length <= MOST_LINKED || selection.isChosen("uav", uav.id);
  const { faint, alarm } = palette();
  const instant = map.replayData.instant(scene.time_s);
  const receives = (one, other) => one.agentState.is_on && other.agentState.is_on && !NOT_RECEIVED.has(agents.believed(one.id, other.id, instant).status);
  scene.uavs.forEach((one, k) => {
    for (const other of scene.uavs.slice(k + 1)) {
      const ways = [receives(one, other), receives(other, one)];
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

/** Draws a ring about each UAV whose reports are not received, and its position at the last report. */
function drawSilence(map, { pen, labels, scene }) {
  const { camera, replayData } = map;
  for (const { id, x_m, y_m, agentState, out } of scene.uavs.filter((uav) => uav.agentState?.is_not_received)) {
    const { status, age_s } = agentState.shown;
    const [x, y] = camera.at(x_m, y_m);
    const { alarm, faint } = palette();
    pen.strokeStyle = pen.fillStyle = status === "silent" ? faint : alarm;
    pen.lineWidth = 2;
    pen.setLineDash([5, 4]);
    pen.beginPath();
    addDisc(pen, x, y, 17);
    pen.stroke();
    pen.setLineDash([]);
    if (!out && camera.sees(x_m, y_m)) labels.nextTo(silenceText(agentState), x, y, 20, 24);
    if (Number.isNaN(age_s)) continue;
    const then = replayData.instant(replayData.times_s[agentState.instant] - age_s);
    const [x2, y2] = camera.at(replayData.value("uavs", "x_m", id, then), replayData.value("uavs", "y_m", id, then));
    if (Math.hypot(x2 - x, y2 - y) < 24) continue;
    pen.lineWidth = 1.25;
    pen.beginPath();
    addDisc(pen, x2, y2, 6);
    pen.stroke();
  }
}

/** Text that names the UAV that receives no reports, and the age of the last report. */
function silenceText({ owner, shown: { age_s } }) {
  const age = Number.isNaN(age_s) ? "" : ` for ${age_s.toFixed(1)} s`;
  return `no report at UAV ${owner}${age}`;
}

/** Draws a dashed line from each avoiding UAV, marked by a dot, to the UAV or intruder that it avoids. */
function drawAvoidance(map, { pen, scene }) {
  const { alarm } = palette();
  for (const uav of scene.uavs) {
    const other = scene.uavs.find(({ id }) => id === uav.avoided_uav) ?? scene.intruders.find(({ id }) => id === uav.avoided_intruder);
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
