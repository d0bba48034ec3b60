// The page that flies missions: its controls, and the data of a mission that a worker flies.

/**
 * Settings with a control of their own: scenario key, label, unit, and range, or labels by value. An empty control keeps the
 * value of the scenario.
 */
const FLIGHT_SETTINGS = [
  ["guidance.law", "Law", "", { '"standoff"': "standoff", '"oh-2015"': "oh-2015 (the paper's)" }],
  ["uavs.speed_m_s", "Speed", "m/s", 5, 200],
  ["orbit.radius_min_m", "Radius, min.", "m", 20, 5000],
  ["orbit.radius_max_m", "Radius, max.", "m", 20, 10000],
  ["sensor.field_of_view_deg", "Field of view", "deg", 5, 360],
  ["sensor.range_sd_m", "Range noise", "m", 0.1, 500],
  ["sensor.bearing_sd_deg", "Bearing noise", "deg", 0.01, 30],
  ["radio.packet_loss", "Packet loss", "0 to 1", 0, 0.9],
  ["radio.latency_s", "Latency", "s", 0, 5],
  ["wind.speed_m_s", "Wind", "m/s", 0, 60],
  ["world", "Buildings", "", { "{}": "none" }],
];

/** Names of map files, and of scenario files; other files are traffic. */
const MAP_NAME = /\.(net\.xml|geojson|json)(\.gz)?$/i;
const SCENARIO_NAME = /\.toml$/i;

/** Files that the user has dropped on the page. They stay in the browser, so that the page can load again. */
const droppedFiles = {
  async store(mode) {
    const opening = indexedDB.open("standoff", 1);
    opening.onupgradeneeded = () => opening.result.createObjectStore("files");
    return (await answerOf(opening)).transaction("files", mode).objectStore("files");
  },

  async put(file) {
    const bytes = new Uint8Array(await file.arrayBuffer());
    await answerOf((await this.store("readwrite")).put(bytes, file.name));
  },

  /** The names of all files that a scenario file mentions. */
  async mentioned(text) {
    const names = text ? await answerOf((await this.store("readonly")).getAllKeys()) : [];
    return names.filter((name) => text.includes(name));
  },

  /** The bytes of a file; an error if this browser does not have it. */
  async get(name) {
    const bytes = await answerOf((await this.store("readonly")).get(name));
    if (!bytes) throw new Error(`error: ${name}: this browser does not have the file; drop it on the page`);
    return bytes;
  },
};

/** The result of a request to the database of the browser. */
function answerOf(request) {
  return new Promise((resolve, reject) => {
    request.onsuccess = () => resolve(request.result);
    request.onerror = () => reject(request.error);
  });
}

/** The compiled WebAssembly and the script of all workers. */
let workerParts = null;

/** The data of a mission that a worker flies. */
class FlightSource {
  constructor() {
    this.live = false;
    this.waiting = new Map();
    this.last = 0;
    this.announce = null;
    this.state = { sealed: 0, open: 0, done: false };
  }

  /** Starts the worker and the mission; the error is the message of the loader. */
  async begin(request) {
    [this.first, this.warnings, this.values] = await this.start("begin", request);
  }

  /** Starts the worker with a mission or a batch. */
  async start(call, request) {
    workerParts ??= Promise.all([unpackedPart("engine").then(WebAssembly.compile), unpackedPart("worker")]);
    const names = [...request.traffic, ...request.maps, ...(await droppedFiles.mentioned(request.text))];
    const files = await Promise.all(names.map(async (name) => [name, await droppedFiles.get(name)]));
    const [engine, script] = await workerParts;
    this.worker = new Worker(URL.createObjectURL(new Blob([script], { type: "text/javascript" })));
    this.worker.onmessage = ({ data }) => this.take(data);
    return this.call(call, engine, files, JSON.stringify(request));
  }

  take({ id, value, error, state, failure }) {
    if (failure) {
      element("flight-error").textContent = failure;
      return;
    }
    if (state) {
      this.state = state;
      this.announce?.(state);
      return;
    }
    const { resolve, reject } = this.waiting.get(id);
    this.waiting.delete(id);
    if (error === undefined) resolve(value);
    else reject(new Error(error));
  }

  call(call, ...values) {
    return new Promise((resolve, reject) => {
      const id = ++this.last;
      this.waiting.set(id, { resolve, reject });
      this.worker.postMessage({ id, call, values });
    });
  }

  async head() {
    return JSON.parse(this.state.done ? await this.call("head") : this.first);
  }

  async map() {
    return JSON.parse(new TextDecoder().decode(await unpacked(await this.call("map"))));
  }

  async block(kind, part) {
    return new Block(await unpacked(await this.call("block", kind, part)));
  }

  follow(announce) {
    this.announce = announce;
    announce(this.state);
  }

  async charts() {
    return new FileSource().charts();
  }

  stop() {
    this.worker?.terminate();
  }
}

/** The mission in the address of the page. */
function requestOfAddress() {
  const of = new URLSearchParams(location.search);
  return {
    scenario: of.get("scenario") ?? "improved/figure-9",
    text: of.get("text"),
    set: of.getAll("set"),
    traffic: of.getAll("traffic"),
    maps: of.getAll("map"),
    uavs: of.has("uavs") ? Number(of.get("uavs")) : null,
    seed: of.get("seed") ?? "1",
  };
}

/** Writes a mission into the address, which loads the page again; `isCompared`: whether the unchanged scenario is shown, too. */
function openRequest({ scenario, text, set, traffic, maps, uavs, seed }, isCompared) {
  const to = new URLSearchParams({ scenario, seed });
  if (text) to.set("text", text);
  if (uavs) to.set("uavs", uavs);
  for (const change of set) to.append("set", change);
  for (const name of traffic) to.append("traffic", name);
  for (const name of maps) to.append("map", name);
  if (isCompared) to.set("compared", "1");
  location.search = to;
}

/** The control of a setting: a number from `least` to `most`, or one of the values that label `least`. */
function flightField(key, unit, least, most) {
  if (typeof least === "number") {
    const title = `${key}, ${least} to ${most} ${unit}; empty: as in the scenario`;
    return Object.assign(document.createElement("input"), { type: "number", min: least, max: most, step: "any", title });
  }
  const field = Object.assign(document.createElement("select"), { title: key });
  field.append(new Option("as in the scenario", ""), ...Object.entries(least).map(([value, text]) => new Option(text, value)));
  return field;
}

/** The controls of settings by key. */
let flightFields = new Map();

/** Shows the values of the scenario, by key, in the controls that are empty. */
function showDefaults(values) {
  for (const [key, field] of flightFields) {
    if (field.value !== "") continue;
    const text = values[key] ?? "none";
    if (field.options) field.options[0].text = `${text} (scenario)`;
    else field.placeholder = text;
  }
}

/** Fills in the controls for a mission, and connects them; `texts` are the built-in scenarios by name. */
function connectFlight(request, texts) {
  const scenario = element("flight-scenario");
  scenario.replaceChildren(...Object.keys(texts).map((name) => new Option(name, name, false, name === request.scenario)));
  const seed = element("flight-seed");
  seed.value = request.seed;
  element("flight-uavs").value = request.uavs ?? "";
  element("flight-files").textContent = [...request.traffic, ...request.maps].join(", ");
  const isCompared = element("flight-compared");
  isCompared.checked = isFlightCompared();
  const values = new Map(request.set.map((change) => [change.slice(0, change.indexOf("=")), change.slice(change.indexOf("=") + 1)]));
  const fields = FLIGHT_SETTINGS.map(([key, label, unit, ...range]) => {
    const field = flightField(key, unit, ...range);
    field.value = values.get(key) ?? "";
    values.delete(key);
    const frame = document.createElement("label");
    frame.append(`${label} `, field, ` ${unit}`);
    element("flight-settings").append(frame);
    return [key, field];
  });
  flightFields = new Map(fields);
  element("flight-set").value = [...values].map(([key, value]) => `${key}=${value}`).join("\n");
  element("flight-text").value = request.text ?? "";
  element("flight-copy-text").addEventListener("click", () => (element("flight-text").value = texts[scenario.value]));
  const fly = (change) => {
    const set = fields.filter(([, field]) => field.value !== "").map(([key, field]) => `${key}=${field.value}`);
    set.push(...element("flight-set").value.split("\n").map((line) => line.trim()).filter(Boolean));
    const text = element("flight-text").value.trim() || null;
    const uavs = element("flight-uavs").value || null;
    // A scenario file of the user is not the built-in scenario.
    const named = texts[request.scenario] ? "mine" : request.scenario;
    openRequest({ ...request, scenario: text ? named : scenario.value, text, set, uavs, seed: seed.value.trim(), ...change }, isCompared.checked);
  };
  element("flight").addEventListener("submit", (event) => {
    event.preventDefault();
    fly();
  });
  scenario.addEventListener("change", () => fly({ text: null, traffic: [], maps: [] }));
  for (const control of [element("flight-uavs"), isCompared, ...fields.map(([, field]) => field)]) control.addEventListener("change", () => fly());
  connectDrop(async (files) => {
    await Promise.all(files.map((file) => droppedFiles.put(file)));
    const file = files.find(({ name }) => SCENARIO_NAME.test(name));
    if (file) {
      const text = await file.text();
      openRequest({ ...request, scenario: file.name.replace(SCENARIO_NAME, ""), text, set: [], uavs: null, traffic: [], maps: [] }, false);
      return;
    }
    // A file that the scenario file mentions is neither.
    const all = files.map(({ name }) => name).filter((name) => !request.text?.includes(name));
    const maps = all.filter((name) => MAP_NAME.test(name));
    const traffic = all.filter((name) => !MAP_NAME.test(name));
    if (traffic.length) fly({ scenario: "traffic/convoy", text: null, traffic, maps });
    else fly(maps.length ? { maps } : {});
  });
}

/** Calls `given` with the files that are dropped on the page. */
function connectDrop(given) {
  window.addEventListener("dragover", (event) => event.preventDefault());
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    given([...event.dataTransfer.files]).catch((error) => (element("flight-error").textContent = `error: ${error.message}`));
  });
  element("flight-file").addEventListener("change", ({ target }) => given([...target.files]));
}

/** Flies a mission again, and saves its record. */
async function saveRecord(request) {
  const source = new FlightSource();
  await source.begin({ ...request, is_recorded: true });
  await new Promise((resolve) => source.follow(({ done }) => done && resolve()));
  save(fileName(`${JSON.parse(source.first).scenario}-${request.seed}.zip`), await source.call("record"), "application/zip");
  source.stop();
}

/** Flies a batch of consecutive seeds on several workers, and shows the means of its metrics. */
async function flyBatch(request, count) {
  const workers = Array.from({ length: Math.min(count, 4, navigator.hardwareConcurrency || 1) }, () => new FlightSource());
  const runs = new Array(count);
  let next = 0;
  try {
    await Promise.all(
      workers.map(async (worker) => {
        await worker.start("beginSeeds", request);
        while (next < count) {
          const index = next++;
          runs[index] = await worker.call("values", index);
          element("flight-progress").textContent = `${runs.filter(Boolean).length} of ${count} runs`;
        }
      }),
    );
    const values = new Float64Array(runs.flatMap((run) => [...run]));
    showBatchTable(JSON.parse(await workers[0].call("statistics", values)));
  } finally {
    workers.forEach((worker) => worker.stop());
  }
}

/** Shows the means of a batch with their 95 % confidence intervals. */
function showBatchTable(rows) {
  const cells = ({ label, unit, n, mean, ci95 }) => [label, formatNumber(mean), interval(ci95), unit, String(n)];
  const line = (texts, kind) => {
    const row = document.createElement("tr");
    row.append(...texts.map((text) => Object.assign(document.createElement(kind), { textContent: text })));
    return row;
  };
  const head = line(["Metric", "Mean", "95 % interval", "Unit", "Runs"], "th");
  element("flight-batch").replaceChildren(head, ...rows.map((row) => line(cells(row), "td")));
}

/** Whether the unchanged scenario is shown next to the changed one. */
const isFlightCompared = () => new URLSearchParams(location.search).has("compared");

/** Flies the mission in the address, and shows it while it is flown. */
async function showFlight() {
  const request = requestOfAddress();
  connectFlight(request, await new FileSource().json("scenarios"));
  const requests = isFlightCompared() ? [request, { ...request, set: [], uavs: null }] : [request];
  const sources = requests.map(() => new FlightSource());
  element("flight-stop").addEventListener("click", () => sources.forEach((source) => source.stop()));
  element("flight-fly-batch").addEventListener("click", () => {
    const count = Math.min(1000, Math.max(1, Math.round(Number(element("flight-runs").value)) || 20));
    flyBatch(request, count).catch((error) => (element("flight-error").textContent = error.message));
  });
  element("flight-record").addEventListener("click", () => {
    saveRecord(request).catch((error) => (element("flight-error").textContent = error.message));
  });
  try {
    await Promise.all(sources.map((source, index) => source.begin(requests[index])));
  } catch (error) {
    element("flight-error").textContent = error.message;
    element("warning").textContent = "";
    return;
  }
  element("flight-note").textContent = sources[0].warnings;
  showDefaults(JSON.parse(sources[0].values));
  await showReplay(sources);
}
