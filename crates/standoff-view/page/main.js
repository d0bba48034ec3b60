// Which page this is, and where its data is: inside it, or at the server that it came from.

const { base } = document.body.dataset;
const source = base === undefined ? new FileSource() : new ServedSource(base);
if (element("metrics")) showBatch(source);
else {
  element("warning").textContent = "loading";
  showReplay(source).catch((error) => (element("warning").textContent = `The run cannot be shown: ${error.message}`));
}
