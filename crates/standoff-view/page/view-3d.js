// The scene in three dimensions, drawn with plotly.js: UAVs and orbits at their altitudes; zones between their floors and ceilings;
// buildings; targets, roads and fields of view on the ground. It shows the area that the map shows.

/** Segments of an orbit, and of the arc of a field of view. */
const ORBIT_SEGMENTS = 72;
const VIEW_SEGMENTS = 12;
/** Maximum number of points of the roads; with more, only major roads are drawn. */
const MAX_ROAD_POINTS = 40000;
/** Smallest height of the scene as a fraction of its width; lower scenes are stretched. */
const LOWEST = 0.22;
/** Area shown at least, m. */
const NARROWEST_M = 50;

class View3d {
  constructor(run, page) {
    this.run = run;
    this.page = page;
    this.plot = make("div", "view-3d");
    this.plot.hidden = true;
    run.map.canvas.after(this.plot);
    /** Scene to draw when the current drawing has ended. */
    this.next = null;
    this.isDrawing = false;
    this.top_m = { parts: -1, value: 0 };
  }

  /** Shows or hides the view. */
  show(isShown) {
    this.plot.hidden = !isShown;
    this.run.map.isCovered = isShown;
  }

  /** Draws a scene, at most one at a time; of the scenes that arrive meanwhile only the last is drawn. */
  async draw(scene) {
    this.next = scene;
    if (this.isDrawing || !window.Plotly) return;
    this.isDrawing = true;
    try {
      while (this.next && !this.plot.hidden) {
        const now = this.next;
        this.next = null;
        await window.Plotly.react(this.plot, this.traces(now), this.layout(now), { displaylogo: false, displayModeBar: false, responsive: true });
        this.connect();
        this.plot.dataset.timeS = now.time_s.toFixed(3);
      }
    } catch (error) {
      this.page.state.setError(`Cannot draw in three dimensions: ${error.message}`);
    }
    this.isDrawing = false;
  }

  /** Makes a click select an object. */
  connect() {
    if (this.isConnected) return;
    this.isConnected = true;
    this.plot.on("plotly_click", ({ points }) => {
      const object = points[0]?.customdata;
      if (object) this.run.selection.choose(object);
    });
  }

  /** Height of the scene, m: above the highest altitude of the run, and above zones up to twice as high. */
  get height_m() {
    const { replayData } = this.run;
    if (this.top_m.parts !== replayData.times_s.length) {
      const columns = [["uavs", "altitude_m"], ["uavs", "commanded_altitude_m"], ["groups", "altitude_m"]];
      let top_m = 0;
      for (const [table, column] of columns) {
        for (const id of replayData.ids[table]) for (const value of replayData.series(table, column, id)) if (value > top_m) top_m = value;
      }
      const limits_m = (replayData.head.zones ?? []).flatMap(({ altitude_min_m = 0, altitude_max_m = 0 }) => [altitude_min_m, altitude_max_m]);
      top_m = Math.max(top_m, ...limits_m.filter((limit_m) => limit_m <= 2 * top_m));
      this.top_m = { parts: replayData.times_s.length, value: top_m };
    }
    return 1.15 * this.top_m.value || 100;
  }

  layout(scene) {
    const { camera } = this.run.map;
    const { ink, grid, faint } = palette();
    const half = [camera.width, camera.height - camera.top].map((px) => Math.max(px / camera.px_per_m, NARROWEST_M) / 2);
    const widest = 2 * Math.max(...half);
    const height = Math.max(this.height_m / widest, LOWEST);
    const factor = (height * widest) / this.height_m;
    const axis = (title, middle, half_m) => ({
      title: { text: title, font: { size: 11, color: faint } }, range: [middle - half_m, middle + half_m], gridcolor: grid, zeroline: false,
      showspikes: false, tickfont: { size: 10, color: faint }, nticks: 6, showbackground: false,
    });
    return {
      ...plotLook(), margin: { l: 0, r: 0, t: camera.top, b: 0 }, showlegend: false, uirevision: "kept", hoverlabel: { font: { size: 12 } },
      scene: {
        uirevision: "kept", dragmode: "turntable", aspectmode: "manual",
        aspectratio: { x: (2 * half[0]) / widest, y: (2 * half[1]) / widest, z: height },
        camera: { eye: { x: 0.04, y: -1.05, z: 0.68 }, center: { x: 0, y: 0, z: -0.1 } },
        xaxis: axis("East (m)", camera.x_m, half[0]), yaxis: axis("North (m)", camera.y_m, half[1]),
        zaxis: { ...axis("Altitude (m)", this.height_m / 2, this.height_m / 2), nticks: 4 },
      },
      annotations: [{
        text: `${scene.time_s.toFixed(1)} s${factor > 1.05 ? `; altitudes stretched ${factor.toFixed(1)} times` : ""}`, xref: "paper", yref: "paper",
        x: 0.01, y: 0.01, xanchor: "left", yanchor: "bottom", showarrow: false, font: { size: 12, color: ink },
      }],
    };
  }

  traces(scene) {
    const views = this.views(scene);
    return [this.roads(), this.buildings(), this.zones(), this.fields(views), this.lines(scene, views), this.targets(scene), this.outOfView(scene), this.aircraft(scene)];
  }

  /** The roads of the background map. They are collected once. */
  roads() {
    const { basemap } = this.run.map;
    const colour = palette().none;
    const shapes = basemap?.shapes ?? [];
    if (this.road?.count !== shapes.length) {
      const of = (kinds) => shapes.filter(({ kind, area }) => !area && kinds.includes(kind));
      const count = (some) => some.reduce((sum, { rings }) => sum + rings[0].length / 2, 0);
      const all = of(["major", "minor"]);
      const line = new Lines();
      for (const { rings: [ring] } of count(all) > MAX_ROAD_POINTS ? of(["major"]) : all) {
        for (let k = 0; k + 1 < ring.length; k += 2) line.to(ring[k], ring[k + 1], 0, colour);
        line.lift();
      }
      this.road = { count: shapes.length, line };
    }
    return this.road.line.trace({ width: 1.5, color: faded(colour, 0.6) });
  }

  /** Edges of the buildings; without vertical ones if they are many. They are collected once for each theme. */
  buildings() {
    const colour = palette().none;
    if (this.building?.colour !== colour) {
      const buildings = this.run.replayData.head.buildings ?? [];
      const count = buildings.reduce((sum, { rings_m }) => sum + rings_m.reduce((all, ring) => all + ring.length, 0), 0);
      const line = new Lines();
      for (const { height_m, rings_m } of buildings) {
        for (const ring of rings_m) {
          for (const [x_m, y_m] of [...ring, ring[0]]) line.to(x_m, y_m, height_m, colour);
          line.lift();
          for (const [x_m, y_m] of count > MAX_ROAD_POINTS / 4 ? [] : ring) {
            line.to(x_m, y_m, 0, colour);
            line.to(x_m, y_m, height_m, colour);
            line.lift();
          }
        }
      }
      this.building = { colour, line };
    }
    return this.building.line.trace({ width: 1.5, color: faded(colour, 0.8) });
  }

  /** Outlines of zones: on the ground, or at floor and ceiling with the edges between them. Higher zones end at the top of the scene. */
  zones() {
    const line = new Lines();
    for (const { corners_m, kind, altitude_min_m, altitude_max_m } of this.run.replayData.head.zones ?? []) {
      const colour = kind === "keep-out" ? palette().alarm : palette().faint;
      const hasBand = altitude_min_m !== undefined || altitude_max_m !== undefined;
      const levels_m = hasBand ? [altitude_min_m ?? 0, altitude_max_m ?? Infinity].map((level_m) => Math.min(level_m, this.height_m)) : [0];
      for (const level_m of levels_m) {
        for (const [x_m, y_m] of [...corners_m, corners_m[0]]) line.to(x_m, y_m, level_m, colour);
        line.lift();
      }
      if (!hasBand) continue;
      for (const [x_m, y_m] of corners_m) {
        for (const level_m of levels_m) line.to(x_m, y_m, level_m, colour);
        line.lift();
      }
    }
    return line.trace({ width: 4 });
  }

  /** Fields of view: UAV, corners on the ground, and colour as on the map. */
  views(scene) {
    const { replayData } = this.run;
    const colour = (uav) => {
      const isOnWay = wayText(scene, uav, replayData.head.limits.field_of_view_rad) !== "";
      return isOnWay ? uavColour(replayData, uav.id) : groupColour(replayData, uav.group);
    };
    const shown = scene.uavs.filter((uav) => !Number.isNaN(uav.boresight_rad));
    return shown.map((uav) => ({ uav, corners: this.footprint(scene, uav), colour: colour(uav) }));
  }

  /** Corners on the ground of the field of view of a UAV, m; the first is below the UAV. */
  footprint(scene, uav) {
    const { field_of_view_rad } = this.run.replayData.head.limits;
    const reach_m = wedgeReach_m(uav, scene);
    const corners = [[uav.x_m, uav.y_m]];
    for (let k = 0; k <= VIEW_SEGMENTS; k++) {
      const angle_rad = uav.boresight_rad + (k / VIEW_SEGMENTS - 0.5) * field_of_view_rad;
      corners.push([uav.x_m + reach_m * Math.cos(angle_rad), uav.y_m + reach_m * Math.sin(angle_rad)]);
    }
    return corners;
  }

  /** The fields of view on the ground, as one surface of triangles. */
  fields(views) {
    const surface = { type: "mesh3d", x: [], y: [], z: [], i: [], j: [], k: [], facecolor: [], opacity: 0.2, hoverinfo: "skip", lighting: { ambient: 1, diffuse: 0 } };
    for (const { corners, colour } of views) {
      const from = surface.x.length;
      corners.forEach(([x_m, y_m], corner) => {
        surface.x.push(x_m);
        surface.y.push(y_m);
        // Slightly above the roads.
        surface.z.push(0.003 * this.height_m);
        if (corner < 2) return;
        surface.i.push(from);
        surface.j.push(from + corner - 1);
        surface.k.push(from + corner);
        surface.facecolor.push(colour);
      });
    }
    return surface;
  }

  /** Orbits, trails of UAVs, lines from UAVs to the ground below, and the edges of their fields of view. */
  lines(scene, views) {
    const { replayData, selection } = this.run;
    const line = new Lines();
    const opacity = (group) => (selection.passes(group) ? 1 : 0.2);
    for (const group of scene.groups) {
      const colour = faded(groupColour(replayData, group.id), opacity(group.id));
      for (let k = 0; k <= ORBIT_SEGMENTS; k++) {
        const angle_rad = (2 * Math.PI * k) / ORBIT_SEGMENTS;
        line.to(group.x_m + group.standoff_distance_m * Math.cos(angle_rad), group.y_m + group.standoff_distance_m * Math.sin(angle_rad), group.altitude_m, colour);
      }
      line.lift();
    }
    for (const uav of scene.uavs) {
      const colour = faded(uavColour(replayData, uav.id), 0.8 * opacity(uav.group));
      for (const k of recent(replayData, scene.time_s, scene.time_s - TRAIL_S)) {
        const at = (column) => replayData.value("uavs", column, uav.id, k);
        line.to(at("x_m"), at("y_m"), altitudeOf(at), colour);
      }
      line.to(uav.x_m, uav.y_m, uav.shown_altitude_m, colour);
      line.to(uav.x_m, uav.y_m, 0, colour);
      line.lift();
    }
    for (const { uav, corners, colour } of views) {
      const edge = faded(colour, 0.5 * opacity(uav.group));
      for (const [x_m, y_m] of [corners[1], corners.at(-1)]) {
        line.to(uav.x_m, uav.y_m, uav.shown_altitude_m, edge);
        line.to(x_m, y_m, 0, edge);
        line.lift();
      }
    }
    return line.trace({ width: 3 });
  }

  targets(scene) {
    const { replayData, selection } = this.run;
    const shown = scene.targets ?? [];
    return markers(shown.map((target) => {
      const colour = groupColour(replayData, target.group);
      const object = { kind: "target", id: target.id };
      return { at: [...positionOf(scene, object), 0], colour: selection.passes(target.group) ? colour : faded(colour, 0.2), object,
        size: selection.isChosen("target", target.id) ? 10 : 4, text: `${objectName(replayData, object)}: ${warningOf(target) || stateText(target)}` };
    }), { symbol: "circle" });
  }

  /** Rings about targets that are out of view. */
  outOfView(scene) {
    const hidden = (scene.targets ?? []).filter((target) => target.out_of_view && this.run.selection.passes(target.group));
    return markers(hidden.map(({ id }) => {
      const object = { kind: "target", id };
      return { at: [...positionOf(scene, object), 0], colour: palette().alarm, object, size: 11, text: `${objectName(this.run.replayData, object)}: out of view` };
    }), { symbol: "circle-open" });
  }

  /** UAVs and intruders. */
  aircraft(scene) {
    const { replayData, selection } = this.run;
    const { alarm } = palette();
    const of = (kind, some, colourOf, altitude) => some.filter(({ x_m }) => !Number.isNaN(x_m)).map((one) => {
      const object = { kind, id: one.id };
      const name = kind === "uav" ? `${one.id}` : `intruder ${one.id}`;
      return { at: [one.x_m, one.y_m, altitude(one)], colour: colourOf(one), object, size: selection.isChosen(kind, one.id) ? 13 : 8, label: name,
        text: `${objectName(replayData, object)}, ${fixed(altitude(one), 0)} m` };
    });
    const uavs = of("uav", scene.uavs, ({ id }) => uavColour(replayData, id), ({ shown_altitude_m }) => shown_altitude_m);
    const intruders = of("intruder", scene.intruders, () => alarm, ({ altitude_m }) => (Number.isNaN(altitude_m) ? 0 : altitude_m));
    return markers([...uavs, ...intruders], { symbol: "diamond" });
  }
}

/** Whether the browser can draw in three dimensions. */
function hasWebGl() {
  const canvas = document.createElement("canvas");
  return Boolean(canvas.getContext("webgl2") ?? canvas.getContext("webgl"));
}

/** Lines of many colours, which plotly draws as one trace. */
class Lines {
  constructor() {
    Object.assign(this, { x: [], y: [], z: [], colours: [] });
  }

  to(x_m, y_m, z_m, colour) {
    this.x.push(x_m);
    this.y.push(y_m);
    this.z.push(z_m);
    this.colours.push(colour);
  }

  /** Starts a new line. */
  lift() {
    this.to(null, null, null, this.colours.at(-1));
  }

  trace({ width, color = this.colours }) {
    const { x, y, z } = this;
    return { type: "scatter3d", mode: "lines", x, y, z, line: { width, color }, hoverinfo: "skip", connectgaps: false };
  }
}

/** A trace of symbols: position, colour, size, tooltip, label and object of each. */
function markers(some, { symbol }) {
  const of = (get) => some.map(get);
  const axis = (k) => some.map(({ at }) => at[k]);
  const hasLabels = some.some(({ label }) => label);
  return {
    type: "scatter3d", mode: hasLabels ? "markers+text" : "markers", x: axis(0), y: axis(1), z: axis(2), customdata: of(({ object }) => object),
    hovertext: of(({ text }) => escapeMarkup(text)), hoverinfo: "text", ...(hasLabels ? { text: of(({ label }) => label), textposition: "top center", textfont: { size: 12, color: palette().ink } } : {}),
    marker: { symbol, size: of(({ size }) => size), color: of(({ colour }) => colour), line: { width: 0 } },
  };
}
