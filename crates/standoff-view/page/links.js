// Relations between UAVs on the map: radio links, silent UAVs in the shown team state, and collision avoidance.

/** Maximum number of UAVs for which all two-way links are drawn; with more UAVs only those of the selected UAV are drawn. */
const MAX_LINKED = 6;
/** Distance of the ends of a line from the UAVs, so that their symbols stay clear, px. */
const CLEAR_PX = 16;

/** Draws radio links. For a one-way link, an arrow points to the UAV that receives. */
function drawRadio(map, { ctx, scene }) {
  const { selection, replayData: { agents } } = map;
  if (!agents.isSeveral) return;
  const isOf = (uav) => scene.uavs.length <= MAX_LINKED || selection.isChosen("uav", uav.id);
  const { faint, alarm } = palette();
  const stepIndex = map.replayData.stepAt(scene.time_s);
  const receives = (one, other) => one.agentState.isOn && other.agentState.isOn && !NOT_RECEIVED.has(agents.believed(one.id, other.id, stepIndex).status);
  scene.uavs.forEach((one, k) => {
    for (const other of scene.uavs.slice(k + 1)) {
      const received = [receives(one, other), receives(other, one)];
      if (received[0] && received[1] && !isOf(one) && !isOf(other)) continue;
      const [from, to] = received[0] && !received[1] ? [other, one] : [one, other];
      const [[x, y], [x2, y2]] = [from, to].map(({ x_m, y_m }) => map.camera.at(x_m, y_m));
      const far = Math.hypot(x2 - x, y2 - y);
      if (far < 3 * CLEAR_PX) continue;
      const [ux, uy] = [(x2 - x) / far, (y2 - y) / far];
      const along = (at, side = 0) => [x + ux * at - uy * side, y + uy * at + ux * side];
      const isSilent = !received[0] && !received[1];
      ctx.strokeStyle = ctx.fillStyle = isSilent ? faded(alarm, 0.7) : faded(faint, 0.8);
      ctx.lineWidth = isSilent ? 1.5 : 1.25;
      ctx.setLineDash(isSilent ? [1.5, 6] : received[0] && received[1] ? [] : [7, 4]);
      ctx.beginPath();
      ctx.moveTo(...along(CLEAR_PX));
      ctx.lineTo(...along(far - CLEAR_PX));
      ctx.stroke();
      if (received[0] === received[1]) continue;
      ctx.setLineDash([]);
      ctx.beginPath();
      for (const corner of [along(far - CLEAR_PX + 2), along(far - CLEAR_PX - 9, 5), along(far - CLEAR_PX - 9, -5)]) ctx.lineTo(...corner);
      ctx.fill();
    }
  });
}

/** Draws a ring about each UAV whose reports are not received, and its position at the last report. */
function drawSilence(map, { ctx, labels, scene }) {
  const { camera, replayData } = map;
  for (const { id, x_m, y_m, agentState, out } of scene.uavs.filter((uav) => uav.agentState?.isNotReceived)) {
    const { status, age_s } = agentState.shown;
    const [x, y] = camera.at(x_m, y_m);
    const { alarm, faint } = palette();
    ctx.strokeStyle = ctx.fillStyle = status === "silent" ? faint : alarm;
    ctx.lineWidth = 2;
    ctx.setLineDash([5, 4]);
    ctx.beginPath();
    addDisc(ctx, x, y, 17);
    ctx.stroke();
    ctx.setLineDash([]);
    if (!out && camera.shows(x_m, y_m)) labels.nextTo(silenceText(agentState), x, y, 20, 24);
    if (Number.isNaN(age_s)) continue;
    const then = replayData.stepAt(replayData.times_s[agentState.stepIndex] - age_s);
    const [x2, y2] = camera.at(replayData.value("uavs", "x_m", id, then), replayData.value("uavs", "y_m", id, then));
    if (Math.hypot(x2 - x, y2 - y) < 24) continue;
    ctx.lineWidth = 1.25;
    ctx.beginPath();
    addDisc(ctx, x2, y2, 6);
    ctx.stroke();
  }
}

/** Text that names the UAV that receives no reports, and the age of the last report. */
function silenceText({ owner, shown: { age_s } }) {
  const age = Number.isNaN(age_s) ? "" : ` for ${age_s.toFixed(1)} s`;
  return `no report at UAV ${owner}${age}`;
}

/** Draws a dashed line from each avoiding UAV, marked by a dot, to the UAV or intruder that it avoids. */
function drawAvoidance(map, { ctx, scene }) {
  const { alarm } = palette();
  for (const uav of scene.uavs) {
    if (uav.avoided_uav === null && uav.avoided_intruder === null) continue;
    const other = scene.uavs.find(({ id }) => id === uav.avoided_uav) ?? scene.intruders.find(({ id }) => id === uav.avoided_intruder);
    if (!other) continue;
    const [[x, y], [x2, y2]] = [uav, other].map(({ x_m, y_m }) => map.camera.at(x_m, y_m));
    ctx.strokeStyle = ctx.fillStyle = alarm;
    ctx.lineWidth = 2;
    ctx.setLineDash([7, 5]);
    ctx.beginPath();
    ctx.moveTo(x, y);
    ctx.lineTo(x2, y2);
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.beginPath();
    ctx.arc(x, y, 4.5, 0, 2 * Math.PI);
    ctx.fill();
  }
}
