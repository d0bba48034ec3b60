// Colours, light and dark, searched for by computer: UAVs are blue to purple and groups orange to green, so that nobody takes
// one for the other, colour-blind readers included; both stand out from the ground. `src/colours.rs` holds them to that.

const PALETTES = {
  light: {
    uavs: ["#010492", "#8a0778", "#7d5bf5", "#017fad", "#47055e", "#a980d6", "#5408b0", "#08496a",
      "#5c559b", "#bf48cb", "#4590fd", "#892dc1"],
    groups: ["#de7701", "#1aa700", "#026a01", "#143714", "#9c7e52", "#653a07", "#4da27e", "#4b7859"],
    ground: "#ffffff",
    underlay: { green: "#e9f1e4", water: "#dbe8f3", other: "#f0f0f0", building: "#efebe6", path: "#e6dfd2", rail: "#cfcfd8",
      minor: "#e0e5eb", major: "#d3dae3" },
    grid: "#e6e8eb",
    ink: "#1d2329",
    faint: "#6b7683",
    alarm: "#c4261d",
    none: "#7a8591",
  },
  dark: {
    uavs: ["#b6ddff", "#be7f9f", "#6d6bf4", "#2b7386", "#ef76e6", "#913fb6", "#caadff", "#32abdf",
      "#af77ff", "#c854c5", "#0461d8", "#8072a9"],
    groups: ["#ffaa0b", "#54ac04", "#5b7233", "#a7ea49", "#ffda92", "#a97611", "#abffc1", "#9fc68f"],
    ground: "#11161c",
    underlay: { green: "#14201a", water: "#13222f", other: "#181d24", building: "#1d232b", path: "#2a2722", rail: "#33333f",
      minor: "#29333e", major: "#35404d" },
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
