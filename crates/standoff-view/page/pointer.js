// Mouse and touch input on the map.

/** Connects selecting, panning, zooming and measuring on the map of a run. */
function pointer(page, { map, replayData, selection, cards }) {
  const { canvas, camera } = map;
  const down = new Map();
  let pressed = [0, 0];
  let dragged = false;
  const positionIn = (event) => [event.offsetX / pageZoom(), event.offsetY / pageZoom()];
  const showPosition = (x, y) => {
    const [east_m, north_m] = camera.world(x, y);
    const { origin } = replayData.head;
    const [lat, lon] = origin ? geographic(origin, east_m, north_m) : [];
    const latLon = origin ? `, ${degrees(lat, "N", "S")} ${degrees(lon, "E", "W")}` : "";
    element("pointer-position").textContent = `${fixed(east_m, 0)} m east, ${fixed(north_m, 0)} m north${latLon}`;
  };
  const point = (event) => {
    cards.pointed = event.pointerType === "touch" || down.size ? null : positionIn(event);
    cards.show();
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, positionIn(event));
    // Touching with a second finger is not a click.
    dragged = down.size > 1;
    pressed = positionIn(event);
    if (map.ruler && down.size === 1) map.ruler = { from: map.rulerEnd(...positionIn(event)), to: null };
  });
  canvas.addEventListener("pointermove", (event) => {
    const [x, y] = positionIn(event);
    const before = down.get(event.pointerId);
    point(event);
    if (!before) return showPosition(x, y);
    if (Math.hypot(x - pressed[0], y - pressed[1]) > CLICK_PX) dragged = true;
    if (map.ruler && down.size === 1) {
      map.ruler.to = map.rulerEnd(x, y);
      element("ruler-result").textContent = map.measured();
    } else if (down.size === 2) {
      const [other] = [...down].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      selection.stopFitting();
      const distance = (a, b) => Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1);
      // The point between the fingers stays in place.
      camera.pan((x - before[0]) / 2, (y - before[1]) / 2);
      camera.zoom(distance([x, y], other) / distance(before, other), (x + other[0]) / 2, (y + other[1]) / 2);
    } else {
      if (!dragged) return;
      if (selection.followed) selection.follow(null);
      camera.pan(x - before[0], y - before[1]);
    }
    down.set(event.pointerId, [x, y]);
    showPosition(x, y);
    page.renew();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (down.delete(event.pointerId) && !dragged && !map.ruler && event.button === 0) click(...positionIn(event), event.pointerType === "touch");
  });
  canvas.addEventListener("pointercancel", (event) => down.delete(event.pointerId));
  canvas.addEventListener("pointerleave", () => {
    cards.pointed = null;
    cards.show();
  });
  /** Selects the object at a position. If it is already selected, selects the next object at that position. */
  const click = (x, y, isFinger) => {
    const objects = objectsAt(map, x, y, isFinger ? FINGER_PX : NEAR_PX).filter(({ kind }) => !HOVER_ONLY.has(kind));
    const chosen = objects.findIndex(({ kind, id }) => selection.isChosen(kind, id));
    const next = objects[(chosen + 1) % Math.max(objects.length, 1)];
    selection.choose(next ? { kind: next.kind, id: next.id } : null);
  };
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      selection.stopFitting();
      camera.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...positionIn(event));
      page.renew();
    },
    { passive: false },
  );
}
