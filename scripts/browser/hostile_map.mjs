// Prints a hostile map: GeoJSON around the hostile traffic, with malicious names and invalid properties.

const NAMES = ["<img src=x onerror=alert(2)>", "</script><script>alert(2)</script>", "__proto__", "constructor", "\u202e\u0007"];

const features = NAMES.map((name, k) => ({
  type: "Feature",
  id: `way/${name}`,
  properties: { highway: k % 2 ? name : "primary", name, [name]: name, width: k ? "1e300" : name, building: k === 2 ? name : undefined },
  geometry: k === 2
    ? { type: "Polygon", coordinates: [[[11.3, 44.5], [11.302, 44.5], [11.302, 44.502], [11.3, 44.5]], [[11.3, 44.5]], []] }
    : { type: "LineString", coordinates: Array.from({ length: 50 }, (_, n) => [11.3 + 2e-4 * n, 44.5 + 2e-4 * ((n * k) % 7)]) },
}));
console.log(JSON.stringify({ type: "FeatureCollection", name: NAMES[1], features }));
