// Earlier views of the map: "Last view" and the buttons of the browser return to them.

/** Time without movement after which a view is an entry of the history, ms. */
const VIEW_PAUSE_MS = 600;

class ViewHistory {
  constructor(page) {
    this.page = page;
    /** Views of the current entry of the browser's history, one per map; `null` before the page has opened its link. */
    this.entry = null;
    /** Views of the last frame, and when they changed. */
    this.last = null;
    this.changed_ms = -Infinity;
    /** Position of the current entry after the entry with which the page or a link was opened. */
    this.index = 0;
    window.addEventListener("popstate", ({ state }) => this.restore(state));
  }

  /** The views of the maps: centre, m; scale, px per m; and what each map follows. */
  views() {
    return this.page.runs.map(({ map: { camera }, selection }) => ({
      followed: objectKey(selection.followed), x_m: camera.x_m, y_m: camera.y_m, px_per_m: camera.px_per_m,
    }));
  }

  /** Makes the views that are shown the first entry; called when the page has opened a link. */
  begin() {
    this.index = 0;
    this.entry = this.last = this.views();
    this.store("replaceState");
  }

  /** Adds an entry after the user has moved the map; called for every frame. */
  note(now_ms) {
    if (!this.entry) return;
    const views = this.views();
    if (!areSameViews(views, this.last)) {
      this.last = views;
      this.changed_ms = now_ms;
    } else if (now_ms - this.changed_ms >= VIEW_PAUSE_MS) this.add();
  }

  /** Adds the views that are shown as an entry, if they differ from the current one. */
  add() {
    if (areSameViews(this.last, this.entry)) return;
    this.entry = this.last;
    this.index += 1;
    this.store("pushState");
  }

  store(how) {
    try {
      history[how]({ views: this.entry, index: this.index }, "");
    } catch {
      // Some browsers limit the history of pages in frames and of pages opened from a file.
    }
  }

  /** Returns to the view before the last movement. */
  back() {
    if (!this.entry) return;
    this.last = this.views();
    this.add();
    if (this.index > 0) history.back();
    else this.page.timeline.showMessage("This is the first view");
  }

  /** Shows the views of an entry. Entries of links have none; the link sets their view. */
  restore(state) {
    const { page } = this;
    if (!this.entry || state?.views?.length !== page.runs.length) return;
    page.runs.forEach(({ map, selection }, k) => {
      const { followed, x_m, y_m, px_per_m } = state.views[k];
      selection.followed = parseObjectKey(followed);
      Object.assign(map.camera, { x_m, y_m, px_per_m });
      map.view.restart();
    });
    this.index = state.index;
    this.entry = this.last = this.views();
    this.store("replaceState");
    page.selection.notify();
    page.renew();
  }
}

/** Whether views are equal for the user: movements of a map that follows something do not count. */
function areSameViews(before, now) {
  return before.every((one, k) => {
    const other = now[k];
    if (one.followed !== other.followed) return false;
    if (one.followed === WHOLE_RUN.kind || one.followed === ALL_NOW.kind) return true;
    return one.px_per_m === other.px_per_m && (one.followed !== "" || (one.x_m === other.x_m && one.y_m === other.y_m));
  });
}
