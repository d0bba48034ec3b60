// Starts the page. Its data is inside the file, on the server that the page came from, or flown by a worker.

const { bases } = document.body.dataset;
const sources = bases === undefined ? [new FileSource()] : bases.split(" ").map((base) => new ServedSource(base));
if (element("metrics")) showBatch(sources[0]);
else if (element("flight")) showFlight().catch((error) => (element("warning").textContent = `Cannot fly: ${error.message}`));
else {
  element("warning").textContent = "loading";
  showReplay(sources).catch((error) => (element("warning").textContent = `Cannot show the run: ${error.message}`));
}
