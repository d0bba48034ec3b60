// Colours of the light and the dark theme, found by optimisation. UAVs are blue to purple and groups are orange to green, so that
// colour-blind users can distinguish them as well. UAVs and groups have the same colours in both themes. The tests of `src/colours.rs`
// check this.

/** Colours of UAVs and groups in both themes. */
const UAV_COLOURS = ["#be55ff", "#b90f8c", "#5a3cff", "#468cd7", "#8750af", "#af0ad2", "#eb0fd2", "#416991"];
const GROUP_COLOURS = ["#cd7a06", "#04a688", "#854c2f", "#007501", "#48a715", "#8f994f", "#3b6348", "#817335"];

const PALETTES = {
  light: {
    uavs: UAV_COLOURS,
    groups: GROUP_COLOURS,
    runs: ["#0b5fa5", "#b4500a"],
    ground: "#ffffff",
    basemap: { green: "#e9f1e4", water: "#dbe8f3", other: "#f0f0f0", building: "#e7e1da", path: "#e0d6c4", rail: "#c2c2ce",
      minor: "#d3dae2", major: "#c0cad5" },
    grid: "#e6e8eb",
    ink: "#1d2329",
    faint: "#6b7683",
    alarm: "#c4261d",
    none: "#7a8591",
  },
  dark: {
    uavs: UAV_COLOURS,
    groups: GROUP_COLOURS,
    runs: ["#4aa3f0", "#ff9d21"],
    ground: "#000000",
    basemap: { green: "#14201a", water: "#13222f", other: "#181d24", building: "#242b35", path: "#2a2722", rail: "#33333f",
      minor: "#333f4c", major: "#435160" },
    grid: "#222b35",
    ink: "#e6ebf0",
    faint: "#93a1b0",
    alarm: "#ff6b5e",
    none: "#8896a5",
  },
};

/** The colours of the current theme. */
function palette() {
  return PALETTES[document.documentElement.dataset.theme] ?? PALETTES.light;
}

function uavColour(replayData, id) {
  const { uavs } = palette();
  return uavs[Math.max(0, replayData.ids.uavs.indexOf(id)) % uavs.length];
}

function groupColour(replayData, id) {
  const { groups, none } = palette();
  return id === null ? none : groups[(replayData.colours.get(id) ?? id) % groups.length];
}

/** A colour with an opacity. */
function faded(colour, opacity) {
  const [r, g, b] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  return `rgba(${r},${g},${b},${opacity})`;
}
