// Geofence zones and areas of interest. They differ by hatching and outline, not by colour alone.

/** Distance between lines of the hatching, px. */
const HATCH_PX = 9;
/** Maximum number of hatching lines of a zone. */
const MAX_HATCHES = 400;

function drawZones(map, { ctx }) {
  const { camera, replayData } = map;
  const { alarm, faint } = palette();
  for (const zone of replayData.head.zones) {
    const isOut = zone.kind === "keep-out";
    const corners = zone.corners_m.map(([x_m, y_m]) => camera.at(x_m, y_m));
    const outline = () => {
      ctx.beginPath();
      for (const [x, y] of corners) ctx.lineTo(x, y);
      ctx.closePath();
    };
    const colour = isOut ? alarm : faint;
    ctx.fillStyle = faded(colour, isOut ? 0.08 : 0.05);
    outline();
    ctx.fill();
    if (isOut) hatch(ctx, camera, outline, corners, faded(colour, 0.3));
    ctx.strokeStyle = faded(colour, 0.9);
    ctx.lineWidth = 1.5;
    ctx.setLineDash({ "keep-out": [], "keep-in": [8, 5] }[zone.kind] ?? [2, 3]);
    outline();
    ctx.stroke();
    ctx.setLineDash([]);
    const label = [zone.name?.slice(0, 40), bandText(zone)].filter(Boolean).join(", ");
    if (!label) continue;
    const top = corners.reduce((best, at) => (at[1] < best[1] ? at : best));
    ctx.fillStyle = colour;
    ctx.textAlign = "center";
    ctx.fillText(label, top[0], top[1] - 6);
  }
}

/** Floor and ceiling of a zone as text; empty if it has neither. */
function bandText({ altitude_min_m: floor_m, altitude_max_m: ceiling_m }) {
  if (floor_m === undefined) return ceiling_m === undefined ? "" : `up to ${fixed(ceiling_m, 0)} m`;
  return ceiling_m === undefined ? `from ${fixed(floor_m, 0)} m` : `${fixed(floor_m, 0)} to ${fixed(ceiling_m, 0)} m`;
}

/** Draws slanted lines over the visible part of a zone; `outline` makes its outline the current path. */
function hatch(ctx, camera, outline, corners, colour) {
  const [xs, ys] = [0, 1].map((axis) => corners.map((at) => at[axis]));
  const [left, right] = [Math.max(Math.min(...xs), 0), Math.min(Math.max(...xs), camera.width)];
  const [top, bottom] = [Math.max(Math.min(...ys), 0), Math.min(Math.max(...ys), camera.height)];
  const high = bottom - top;
  if (right <= left || high <= 0) return;
  const step = Math.max(HATCH_PX, (right - left + high) / MAX_HATCHES);
  ctx.save();
  outline();
  ctx.clip();
  ctx.beginPath();
  for (let x = Math.floor((left - high) / step) * step; x < right; x += step) {
    ctx.moveTo(x, bottom);
    ctx.lineTo(x + high, top);
  }
  ctx.strokeStyle = colour;
  ctx.lineWidth = 1;
  ctx.stroke();
  ctx.restore();
}
