// Which page this is, and where its data is: inside it, or at the server that it came from.

const { bases } = document.body.dataset;
const sources = bases === undefined ? [new FileSource()] : bases.split(" ").map((base) => new ServedSource(base));
if (element("metrics")) showBatch(sources[0]);
else {
  element("warning").textContent = "loading";
  showReplay(sources).catch((error) => (element("warning").textContent = `The run cannot be shown: ${error.message}`));
}
