// Colours that colour-blind readers can tell apart, light and dark: those of the figures, lightened for the dark theme.

const PALETTES = {
  light: {
    uavs: ["#0072b2", "#d55e00", "#cc79a7", "#000000", "#490092", "#924900", "#006d6d", "#b66dff"],
    groups: ["#009e73", "#c98700", "#2e8fc9", "#6a9f3a", "#ee6677"],
    ground: "#ffffff",
    grid: "#e6e8eb",
    ink: "#1d2329",
    faint: "#6b7683",
    alarm: "#c4261d",
    none: "#7a8591",
  },
  dark: {
    uavs: ["#4db2f0", "#ff8b3d", "#eaa2c9", "#f2f2f2", "#b18cff", "#d9955a", "#3fc1c1", "#d6b0ff"],
    groups: ["#2bd19e", "#f0b429", "#6cc3ff", "#a6d96a", "#ff8f9f"],
    ground: "#11161c",
    grid: "#222b35",
    ink: "#e6ebf0",
    faint: "#93a1b0",
    alarm: "#ff6b5e",
    none: "#8896a5",
  },
};

/** Of the theme that is on. */
function palette() {
  return PALETTES[document.documentElement.dataset.theme] ?? PALETTES.light;
}

function uavColour(film, id) {
  const { uavs } = palette();
  return uavs[Math.max(0, film.ids.uavs.indexOf(id)) % uavs.length];
}

function groupColour(film, id) {
  const { groups, none } = palette();
  return id === null ? none : groups[Math.max(0, film.ids.groups.indexOf(id)) % groups.length];
}

/** The same colour, translucent. */
function faded(colour, opacity) {
  const [r, g, b] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  return `rgba(${r},${g},${b},${opacity})`;
}
