// The pointer over the charts.

/** Connects the pointer: a click goes to a time, dragging zooms in, a double click shows the whole run. */
function connectPointer(charts) {
  const container = element("panels");
  const span = element("span");
  let from = null;
  let dragged = false;
  let before_s = 0;
  const end = () => {
    from = null;
    span.hidden = true;
  };
  container.addEventListener("pointerdown", (pointer) => {
    if (pointer.button !== 0 || !pointer.target.closest(".plot")) return;
    dragged = false;
    from = { clientX: pointer.clientX, pointerId: pointer.pointerId };
  });
  container.addEventListener("pointermove", (pointer) => {
    // The button was released outside the window.
    if (from && !(pointer.buttons & 1)) end();
    if (from && Math.abs(pointer.clientX - from.clientX) >= CLICK_PX && !dragged) {
      dragged = true;
      container.setPointerCapture(from.pointerId);
    }
    if (from && dragged) {
      charts.hover.hide();
      const [a, b] = [from.clientX, pointer.clientX].map((x) => charts.pxOf(charts.timeAt(x, true))).sort((a, b) => a - b);
      span.hidden = false;
      span.style.left = `${a}px`;
      span.style.width = `${b - a}px`;
    } else {
      const section = pointer.target.closest(".plot")?.parentElement;
      charts.hover.show(charts.panels.find((panel) => panel.section === section), pointer.clientX, pointer.clientY);
    }
  });
  container.addEventListener("pointerup", (pointer) => {
    if (from && dragged) {
      const range_s = [from.clientX, pointer.clientX].map((x) => charts.timeAt(x, true)).sort((a, b) => a - b);
      if (Math.abs(pointer.clientX - from.clientX) >= CLICK_PX) charts.zoom(range_s);
    }
    end();
  });
  container.addEventListener("pointercancel", end);
  container.addEventListener("pointerleave", () => charts.hover.hide());
  charts.container.parentElement.addEventListener("scroll", () => charts.hover.hide());
  container.addEventListener("click", (click) => {
    const time_s = charts.timeAt(click.clientX);
    if (dragged || time_s === null || !click.target.closest(".plot")) return;
    if (click.detail < 2) {
      before_s = charts.clock.time_s;
      charts.clock.seek(time_s);
    }
  });
  container.addEventListener("dblclick", () => {
    if (!charts.range_s || dragged) return;
    // The first click of the double click has changed the time: restore it.
    charts.clock.seek(before_s);
    charts.zoom(null);
  });
}
