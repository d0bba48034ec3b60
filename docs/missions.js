// Missions inside the book: an element with `data-mission` gets a button that flies this mission in a frame. The page that
// flies is docs/fly.html, which scripts/build_web makes.

for (const place of document.querySelectorAll("[data-mission]")) {
  const mission = new URLSearchParams(place.dataset.mission);
  const changes = mission.getAll("set").map((change) => ` with ${change}`);
  const name = `${mission.get("scenario")}${changes.join("")}`;
  const button = document.createElement("button");
  button.textContent = `Fly ${name} here`;
  button.addEventListener("click", () => {
    const frame = Object.assign(document.createElement("iframe"), { title: name, src: `${path_to_root}fly.html?${mission}` });
    place.replaceChildren(frame);
  });
  place.replaceChildren(button);
}
