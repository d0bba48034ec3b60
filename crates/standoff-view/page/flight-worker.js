// Worker of the page that flies missions. It answers the calls of `FlightSource` and announces progress; the functions of
// WebAssembly come from `standoff-web`.

/** Time between two announcements, during which the worker answers no call, ms. */
const SLICE_MS = 40;

let flight = null;

/** The message of an error. A trap of WebAssembly has no message of its own. */
function messageOf(error) {
  if (!(error instanceof WebAssembly.RuntimeError)) return String(error?.message ?? error);
  return `error: the simulator has stopped (${error.message}): it ran out of memory, or a file is damaged`;
}

/** Flies for one slice, announces the progress, and continues after the calls that wait. */
function fly(steps) {
  const begun_ms = performance.now();
  let state;
  try {
    state = JSON.parse(flight.advance(steps));
  } catch (error) {
    postMessage({ failure: messageOf(error) });
    return;
  }
  const took_ms = performance.now() - begun_ms;
  postMessage({ state });
  if (!state.done) setTimeout(() => fly(Math.min(1000, Math.max(1, Math.round((steps * SLICE_MS) / Math.max(took_ms, 1))))));
}

let seeds = null;

async function prepare(engine, files) {
  await wasm_bindgen({ module_or_path: engine });
  for (const [name, bytes] of files) wasm_bindgen.giveFile(name, bytes);
}

const calls = {
  async begin(engine, files, request) {
    await prepare(engine, files);
    flight = new wasm_bindgen.Flight(request);
    setTimeout(() => fly(4));
    return [flight.head(), flight.warnings(), flight.values()];
  },
  async beginSeeds(engine, files, request) {
    await prepare(engine, files);
    seeds = new wasm_bindgen.Seeds(request);
  },
  values: (index) => seeds.values(index),
  statistics: (values) => wasm_bindgen.statisticsOf(values),
  map: () => flight.map(),
  head: () => flight.head(),
  metrics: () => flight.metrics(),
  record: () => flight.record(),
  block: (kind, part) => flight.block(kind, part),
};

onmessage = async ({ data: { id, call, values } }) => {
  try {
    postMessage({ id, value: await calls[call](...values) });
  } catch (error) {
    postMessage({ id, error: messageOf(error) });
  }
};
