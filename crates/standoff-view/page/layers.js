// The layers of a map, from the ground up: what is drawn later lies on top.

/** Layers that can be switched: name, title, shown at first, what it means, how it is drawn. */
const LAYERS = [
  ["underlay", "Roads and buildings", true, "Of the map that the scenario names, or that came with --map",
    (map, { pen }) => map.underlay?.draw(pen, map.camera)],
  ["grid", "Grid and scale", true, "Lines at round distances; the scale below on the left is one step of them", drawGrid],
  ["zones", "Zones", true, "Keep-outs, hatched, that no UAV may enter; keep-ins, with a broken outline, that none may leave", drawZones],
  ["truth", "True targets", true, "Where targets really are, which no UAV knows", drawTruth],
  ["target-trails", "Trails of targets", true, `Where tracks of targets have been in the last ${TRAIL_S} s, in their group's colour`,
    drawTargetTrails],
  ["trails", "Trails", true, `Where UAVs have been in the last ${TRAIL_S} s`, drawTrails],
  ["desired", "Desired orbits", true, "r_d about the estimated centre of each group; broken where no orbit satisfies the constraints",
    drawDesired],
  ["flown", "Orbits as flown", true, "A UAV's last turn relative to its group's centre, drawn about the centre of now", drawFlown],
  ["views", "Fields of view", true, "What the sensor of each UAV looks at, in the colour of the group that it serves", drawViews],
  ["radio", "Who hears whom", true, "A line: each hears the other (of more than " +
    `${MOST_LINKED} UAVs drawn of the chosen one alone); an arrow: only the UAV it points to hears the other; red dots: neither`, drawRadio],
  ["ellipses", "95 % ellipses", true, "Hold a target with 95 % probability if the filter is right; faint for targets in no group",
    drawEllipses],
  ["vectors", "Velocity vectors", true, `Where things will be in ${AHEAD_S} s: targets straight on at their estimated velocity, ` +
    "UAVs at their speed and turn rate", drawVectors],
  ["tracks", "Tracks", true, "Where the team thinks that targets are; the marks are explained under Keys", drawTracks],
  ["uavs", "UAVs", true, "Nose along the heading; a cross is the last known place of one that has dropped out", drawUavs],
  ["avoidance", "Who avoids whom", true, "A broken red line: the UAV at the dot flies something else than its orbit wants, to keep away from the other UAV or the intruder",
    drawAvoidance],
  ["intruders", "Intruders", true, "Aircraft that are not of the team, arrowheads with their numbers; hollow while they do not tell where they are",
    drawIntruders],
  ["silence", "Silent UAVs", true, "For the one whose picture is shown: where a UAV that it does not hear is, and where it was last heard", drawSilence],
  ["names", "Names", true, "Where there is no room, those with nothing to note go first", drawNames],
];

/** Layers that are only there where minds are several. */
const MINDS_LAYERS = new Set(["radio", "silence"]);
