// Colours that colour-blind readers can tell apart, light and dark: those of the figures, lightened for the dark theme.

const PALETTES = {
  light: {
    uavs: ["#0072b2", "#d55e00", "#cc79a7", "#000000", "#490092", "#924900", "#006d6d", "#b66dff", "#881133", "#998866",
      "#334466", "#447744"],
    groups: ["#009e73", "#c98700", "#2e8fc9", "#6a9f3a", "#ee6677"],
    ground: "#ffffff",
    underlay: { green: "#e9f1e4", water: "#dbe8f3", other: "#f0f0f0", building: "#ebe7e1", path: "#e6dfd2", rail: "#cfcfd8",
      minor: "#dbe0e6", major: "#c6ced8" },
    grid: "#e6e8eb",
    ink: "#1d2329",
    faint: "#6b7683",
    alarm: "#c4261d",
    none: "#7a8591",
  },
  dark: {
    uavs: ["#3f9fe0", "#ff8b3d", "#f2a6d0", "#ffffff", "#9b6dff", "#b06a2a", "#1fa8a8", "#d9c2ff", "#cc2266", "#ffccbb",
      "#ffee00", "#889977"],
    groups: ["#2bd19e", "#f0b429", "#6cc3ff", "#a6d96a", "#ff8f9f"],
    ground: "#11161c",
    underlay: { green: "#14201a", water: "#13222f", other: "#181d24", building: "#1d232b", path: "#2a2722", rail: "#33333f",
      minor: "#29333e", major: "#3a4654" },
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
  return id === null ? none : groups[(film.colours.get(id) ?? 0) % groups.length];
}

/** The same colour, translucent. */
function faded(colour, opacity) {
  const [r, g, b] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  return `rgba(${r},${g},${b},${opacity})`;
}
