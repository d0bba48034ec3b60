// Geofence zones. Keep-out and keep-in zones differ by hatching and outline, not by colour alone.

/** Distance between lines of the hatching, px. */
const HATCH_PX = 9;
/** Maximum number of hatching lines of a zone. */
const MOST_HATCHES = 400;

function drawZones(map, { pen }) {
  const { camera, replayData } = map;
  const { alarm, faint } = palette();
  for (const zone of replayData.head.zones) {
    const isOut = zone.kind === "keep-out";
    const corners = zone.corners_m.map(([x_m, y_m]) => camera.at(x_m, y_m));
    const outline = new Path2D();
    corners.forEach(([x, y], place) => (place ? outline.lineTo(x, y) : outline.moveTo(x, y)));
    outline.closePath();
    const colour = isOut ? alarm : faint;
    pen.fillStyle = faded(colour, isOut ? 0.08 : 0.05);
    pen.fill(outline);
    if (isOut) hatch(pen, camera, outline, corners, faded(colour, 0.3));
    pen.strokeStyle = faded(colour, 0.9);
    pen.lineWidth = 1.5;
    pen.setLineDash(isOut ? [] : [8, 5]);
    pen.stroke(outline);
    pen.setLineDash([]);
    if (!zone.name) continue;
    const top = corners.reduce((best, at) => (at[1] < best[1] ? at : best));
    pen.fillStyle = colour;
    pen.textAlign = "center";
    pen.fillText(zone.name.slice(0, 40), top[0], top[1] - 6);
  }
}

/** Draws slanted lines over the visible part of a zone. */
function hatch(pen, camera, outline, corners, colour) {
  const [xs, ys] = [0, 1].map((axis) => corners.map((at) => at[axis]));
  const [left, right] = [Math.max(Math.min(...xs), 0), Math.min(Math.max(...xs), camera.width)];
  const [top, bottom] = [Math.max(Math.min(...ys), 0), Math.min(Math.max(...ys), camera.height)];
  const high = bottom - top;
  if (right <= left || high <= 0) return;
  const step = Math.max(HATCH_PX, (right - left + high) / MOST_HATCHES);
  pen.save();
  pen.clip(outline);
  pen.beginPath();
  for (let x = Math.floor((left - high) / step) * step; x < right; x += step) {
    pen.moveTo(x, bottom);
    pen.lineTo(x + high, top);
  }
  pen.strokeStyle = colour;
  pen.lineWidth = 1;
  pen.stroke();
  pen.restore();
}
