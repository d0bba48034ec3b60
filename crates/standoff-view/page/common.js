// What all pages share.

const element = (id) => document.getElementById(id);

/** How much larger than its own px the page is drawn, as it is on very large screens. */
const pageZoom = () => document.documentElement.currentCSSZoom ?? 1;
/** The screen's px in one of the page. */
const screenRatio = () => (window.devicePixelRatio || 1) * pageZoom();

/** What moves less than this between pressing and letting go is a click, px. */
const CLICK_PX = 4;

/** One panel of several, chosen by the tabs of a list. */
function tabs(list, chosen) {
  const all = [...list.querySelectorAll("[role=tab]")];
  const choose = (wanted) => {
    for (const tab of all) {
      const on = tab === wanted;
      tab.setAttribute("aria-selected", String(on));
      tab.tabIndex = on ? 0 : -1;
      element(tab.getAttribute("aria-controls")).hidden = !on;
    }
    chosen(wanted);
  };
  for (const tab of all) {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (key) => {
      const way = { ArrowLeft: -1, ArrowRight: 1 }[key.key];
      if (!way) return;
      const shown = all.filter((other) => !other.hidden);
      const next = shown[(shown.indexOf(tab) + way + shown.length) % shown.length];
      next.focus();
      choose(next);
    });
  }
}

/** The theme of the system, until another one is chosen. */
function themed(changed) {
  const root = document.documentElement;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  let chosen = null;
  try {
    chosen = localStorage.getItem("standoff-theme");
  } catch {
    // Pages opened from a file may have no storage.
  }
  const apply = () => {
    root.dataset.theme = chosen ?? (dark.matches ? "dark" : "light");
    changed();
  };
  dark.addEventListener("change", apply);
  element("theme").addEventListener("click", () => {
    chosen = root.dataset.theme === "dark" ? "light" : "dark";
    try {
      localStorage.setItem("standoff-theme", chosen);
    } catch {
      // As above.
    }
    apply();
  });
  apply();
}

/** How every plot behaves. */
const PLOT_CONFIG = {
  responsive: true, displaylogo: false, displayModeBar: "hover",
  modeBarButtonsToRemove: ["toImage", "select2d", "lasso2d", "autoScale2d"],
};

/** Colours and letters of a plot, in the theme that is on. */
function plotLook() {
  const { ground, ink } = palette();
  return { paper_bgcolor: ground, plot_bgcolor: ground, font: { color: ink, size: 11, family: "system-ui, sans-serif" } };
}

/** A file's name without what some systems do not take. */
function fileName(name) {
  return name.replace(/[^A-Za-z0-9._-]+/g, "-");
}

/** Hands a file to the reader. */
function save(name, contents, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([contents], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
