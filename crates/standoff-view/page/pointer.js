// The pointer on a map: a mouse or fingers.

/** Panning, zooming, measuring on the map of a run. */
function pointer(page, { map, film, choice }) {
  const { canvas, camera } = map;
  const down = new Map();
  let pressed = [0, 0];
  const place = (event) => [event.offsetX, event.offsetY];
  const say = (x, y) => {
    const [east_m, north_m] = camera.world(x, y);
    const { origin } = film.head;
    const [lat, lon] = origin ? geographic(origin, east_m, north_m) : [];
    const also = origin ? `, ${degrees(lat, "N", "S")} ${degrees(lon, "E", "W")}` : "";
    element("where").textContent = `${fixed(east_m, 0)} m east, ${fixed(north_m, 0)} m north${also}`;
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, place(event));
    pressed = place(event);
    if (map.ruler) map.ruler = { from: camera.world(...place(event)), to: null };
  });
  canvas.addEventListener("pointermove", (event) => {
    const [x, y] = place(event);
    const before = down.get(event.pointerId);
    if (!before) return say(x, y);
    if (map.ruler) {
      map.ruler.to = camera.world(x, y);
      element("measured").textContent = map.measured();
    } else if (down.size === 2) {
      const [other] = [...down].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      choice.hold();
      const apart = (a, b) => Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1);
      // What is between the fingers stays there.
      camera.pan((x - before[0]) / 2, (y - before[1]) / 2);
      camera.zoom(apart([x, y], other) / apart(before, other), (x + other[0]) / 2, (y + other[1]) / 2);
    } else {
      if (choice.followed && Math.hypot(x - pressed[0], y - pressed[1]) > 3) choice.follow(null);
      camera.pan(x - before[0], y - before[1]);
    }
    down.set(event.pointerId, [x, y]);
    say(x, y);
    page.renew();
  });
  for (const kind of ["pointerup", "pointercancel"]) canvas.addEventListener(kind, (event) => down.delete(event.pointerId));
  canvas.addEventListener(
    "wheel",
    (event) => {
      event.preventDefault();
      choice.hold();
      camera.zoom(Math.exp(-event.deltaY * (event.deltaMode ? 0.05 : 0.0015)), ...place(event));
      page.renew();
    },
    { passive: false },
  );
}
