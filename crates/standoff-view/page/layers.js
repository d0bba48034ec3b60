// Layers of the map, from bottom to top.

/** Layers that the user can switch on and off: name, title, initially shown, tooltip, draw function. */
const LAYERS = [
  ["basemap", "Roads and buildings", true, "Background map of the scenario or of the option --map",
    (map, { ctx }) => map.basemap?.draw(ctx, map.camera)],
  ["grid", "Grid and scale", true, "Grid lines at round distances; the scale bar at the lower left is one grid step", drawGrid],
  ["zones", "Zones", true, "Keep-out zones (hatched) and keep-in zones (dashed outline) of the geofence", drawZones],
  ["truth", "True targets", true, "True positions of the targets, which the UAVs do not know", drawTruth],
  ["target-trails", "Target trails", true, `Positions of the target tracks during the last ${TRAIL_S} s, in the colour of the group`,
    drawTargetTrails],
  ["trails", "UAV trails", true, `Positions of the UAVs during the last ${TRAIL_S} s`, drawTrails],
  ["desired", "Desired orbits", true, "Circle of radius r_d about the estimated centre of each group; dashed if no orbit satisfies the constraints",
    drawDesired],
  ["flown", "Flown orbits", true, "Last revolution of each UAV relative to its group centre, drawn about the current centre", drawFlown],
  ["views", "Fields of view", true, "Field of view of each UAV, in the colour of the group that it is assigned to", drawViews],
  ["radio", "Radio links", true, "Line: both UAVs receive each other's reports (with more than " +
    `${MAX_LINKED} UAVs, only for the selected UAV); arrow: only the UAV at the tip receives reports; red dots: neither does`, drawRadio],
  ["ellipses", "95 % ellipses", true, "95 % confidence ellipses of target positions; faint for targets in no group",
    drawEllipses],
  ["vectors", "Velocity vectors", true, `Predicted motion over ${AHEAD_S} s: targets with constant estimated velocity, ` +
    "UAVs with constant speed and turn rate", drawVectors],
  ["tracks", "Tracks", true, "Estimated target positions in the team state; the symbols are explained under Help", drawTracks],
  ["uavs", "UAVs", true, "The nose points along the heading; a cross marks the last known position of a UAV in an outage", drawUavs],
  ["avoidance", "Collision avoidance", true, "Dashed red line: the UAV at the dot deviates from its orbit command to avoid the other UAV or the intruder",
    drawAvoidance],
  ["intruders", "Intruders", true, "Aircraft outside the team, drawn as arrowheads with their numbers; hollow while the transponder is off",
    drawIntruders],
  ["silence", "Silent UAVs", true, "UAVs whose reports the agent of the shown team state does not receive: current position, and position of the last report", drawSilence],
  ["names", "Names", true, "If there is no space, names of objects without a warning are left out first", drawNames],
];

/** Layers that exist only if every UAV runs its own agent. */
const AGENT_LAYERS = new Set(["radio", "silence"]);
