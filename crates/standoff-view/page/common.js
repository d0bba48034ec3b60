// Functions that all pages share.

const element = (id) => document.getElementById(id);

document.documentElement.classList.toggle("zoomable", "currentCSSZoom" in document.documentElement);
/** CSS zoom factor of the page; it is larger than 1 on very large screens. */
const pageZoom = () => document.documentElement.currentCSSZoom ?? 1;
/** Device pixels per CSS pixel of the page. */
const screenRatio = () => (window.devicePixelRatio || 1) * pageZoom();

/** Pointer movement between press and release below which it is a click, px. */
const CLICK_PX = 4;

/** Connects the tabs of a tab list to their panels; calls `chosen` with the selected tab. */
function tabs(list, chosen) {
  const all = [...list.querySelectorAll("[role=tab]")];
  const choose = (selected) => {
    for (const tab of all) {
      const on = tab === selected;
      tab.setAttribute("aria-selected", String(on));
      tab.tabIndex = on ? 0 : -1;
      element(tab.getAttribute("aria-controls")).hidden = !on;
    }
    chosen(selected);
  };
  for (const tab of all) {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (key) => {
      const step = { ArrowLeft: -1, ArrowRight: 1 }[key.key];
      if (!step) return;
      const shown = all.filter((other) => !other.hidden);
      const next = shown[(shown.indexOf(tab) + step + shown.length) % shown.length];
      next.focus();
      choose(next);
    });
  }
}

/** Whether the page is being printed. */
let isPrinting = false;

/** Applies the theme of the system, or the theme that the user has selected, or on paper the light one; calls `changed` after every change. */
function themed(changed) {
  const root = document.documentElement;
  const dark = window.matchMedia("(prefers-color-scheme: dark)");
  let chosen = setting("theme");
  const apply = () => {
    root.dataset.theme = isPrinting ? "light" : chosen ?? (dark.matches ? "dark" : "light");
    changed();
  };
  dark.addEventListener("change", apply);
  element("theme").addEventListener("click", () => {
    chosen = root.dataset.theme === "dark" ? "light" : "dark";
    keepSetting("theme", chosen);
    apply();
  });
  for (const [kind, begins] of [["beforeprint", true], ["afterprint", false]]) {
    window.addEventListener(kind, () => {
      isPrinting = begins;
      apply();
    });
  }
  apply();
}

/** A setting that the user has made before; `null` if there is none. Pages opened from a file may have no storage. */
function setting(name) {
  try {
    return localStorage.getItem(`standoff-${name}`);
  } catch {
    return null;
  }
}

function keepSetting(name, value) {
  try {
    localStorage.setItem(`standoff-${name}`, value);
  } catch {
    // The setting is lost when the page is closed.
  }
}

/** Connects the option of the help that switches off the keys with one character: speech input types letters. */
function connectCharacterKeys() {
  const box = element("character-keys");
  box.checked = setting("character-keys") !== "off";
  box.addEventListener("change", () => keepSetting("character-keys", box.checked ? "on" : "off"));
}

/** Whether a key is switched off: one that types a character, except Space. */
function isSwitchedOff({ key }) {
  return !element("character-keys").checked && [...key].length === 1 && key !== " ";
}

/** Configuration of all interactive plots. */
const PLOT_CONFIG = {
  responsive: true, displaylogo: false, displayModeBar: "hover",
  modeBarButtonsToRemove: ["toImage", "select2d", "lasso2d", "autoScale2d"],
};

/** Colours and font of plots in the current theme. */
function plotLook() {
  const { ground, ink } = palette();
  return { paper_bgcolor: ground, plot_bgcolor: ground, font: { color: ink, size: 11, family: "system-ui, sans-serif" } };
}

/** A file name without characters that some systems do not allow. */
function fileName(name) {
  return name.replace(/[^A-Za-z0-9._-]+/g, "-");
}

/** Downloads a file. */
function save(name, contents, type) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([contents], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** Writes a name with opportunities for line breaks after spaces and punctuation, so that it does not break inside words. */
function writeName(element, name) {
  if (element.textContent === name && element.firstChild) return;
  const parts = name.split(/(?<=[-_.:/,;])(?=[^-_.:/,;\s])/u);
  element.replaceChildren(...parts.flatMap((part, k) => (k ? [document.createElement("wbr"), part] : [part])));
}
