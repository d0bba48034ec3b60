// The pointer on a map: a mouse or fingers.

/** Choosing, panning, zooming, measuring on the map of a run. */
function pointer(page, { map, film, choice, cards }) {
  const { canvas, camera } = map;
  const down = new Map();
  let pressed = [0, 0];
  let dragged = false;
  const place = (event) => [event.offsetX / pageZoom(), event.offsetY / pageZoom()];
  const say = (x, y) => {
    const [east_m, north_m] = camera.world(x, y);
    const { origin } = film.head;
    const [lat, lon] = origin ? geographic(origin, east_m, north_m) : [];
    const also = origin ? `, ${degrees(lat, "N", "S")} ${degrees(lon, "E", "W")}` : "";
    element("where").textContent = `${fixed(east_m, 0)} m east, ${fixed(north_m, 0)} m north${also}`;
  };
  const point = (event) => {
    cards.pointed = event.pointerType === "touch" || down.size ? null : place(event);
    cards.show();
  };
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    down.set(event.pointerId, place(event));
    // A second finger is no click.
    dragged = down.size > 1;
    pressed = place(event);
    if (map.ruler && down.size === 1) map.ruler = { from: camera.world(...place(event)), to: null };
  });
  canvas.addEventListener("pointermove", (event) => {
    const [x, y] = place(event);
    const before = down.get(event.pointerId);
    point(event);
    if (!before) return say(x, y);
    if (Math.hypot(x - pressed[0], y - pressed[1]) > CLICK_PX) dragged = true;
    if (map.ruler && down.size === 1) {
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
      if (!dragged) return;
      if (choice.followed) choice.follow(null);
      camera.pan(x - before[0], y - before[1]);
    }
    down.set(event.pointerId, [x, y]);
    say(x, y);
    page.renew();
  });
  canvas.addEventListener("pointerup", (event) => {
    if (down.delete(event.pointerId) && !dragged && !map.ruler && event.button === 0) click(...place(event), event.pointerType === "touch");
  });
  canvas.addEventListener("pointercancel", (event) => down.delete(event.pointerId));
  canvas.addEventListener("pointerleave", () => {
    cards.pointed = null;
    cards.show();
  });
  /** Chooses what is there; what is there as well, if that is chosen already; or nothing. */
  const click = (x, y, isFinger) => {
    const there = objectsAt(map, x, y, isFinger ? FINGER_PX : NEAR_PX);
    const chosen = there.findIndex(({ kind, id }) => choice.isChosen(kind, id));
    const next = there[(chosen + 1) % Math.max(there.length, 1)];
    choice.choose(next ? { kind: next.kind, id: next.id } : null);
  };
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
