/** Decompresses bytes. The script of the page calls this function and the next one, too. */
async function unpacked(gz) {
  const stream = new Blob([gz]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Returns the contents of a part of this file. */
async function unpackedPart(name) {
  const letters = atob(document.querySelector(`script[data-part="${name}"]`).textContent);
  // `Uint8Array.from` with a function takes 15 times as long.
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  return unpacked(bytes);
}

if (typeof DecompressionStream === "undefined") {
  document.getElementById("title").textContent = "This page needs a newer browser: Firefox 113, Chrome 93, Safari 16.4 or later";
} else unpackedPart("page").then((bytes) => {
  const script = document.createElement("script");
  script.src = URL.createObjectURL(new Blob([bytes], { type: "text/javascript" }));
  document.head.append(script);
});
