// Hostile vehicle names. As a script it prints a traffic file with these names, or with the argument "scenario" a hostile
// scenario name.

import { fileURLToPath } from "node:url";

export const NAMES = [
  "<img src=x onerror=alert(1)>",
  "</script><script>alert(1)</script>",
  '"onmouseover="alert(1)',
  "x".repeat(200),
  "bell\u0007 escape\u001b[31m tab\t",
  "right\u202eto left",
  "<!--",
  "javascript:alert(1)",
  "__proto__",
  "&lt;b&gt;",
  "=HYPERLINK(1)",
];

/** A scenario name of the maximum length that file systems allow. */
export const SCENARIO = `"><img src=x onerror=alert(1)>${" and so on".repeat(20)}`;

/** Cars that drive north-east next to each other for one minute; the last one turns away. */
function* traffic() {
  yield "t_s,vehicle,lat_deg,lon_deg";
  for (let t_s = 0; t_s <= 60; t_s += 0.5) {
    for (const [car, name] of NAMES.entries()) {
      const away = car === NAMES.length - 1 ? 1e-6 * t_s * t_s : 0;
      const lat_deg = 44.5 + 4e-5 * t_s + 1e-4 * (car % 4) + away;
      const lon_deg = 11.3 + 6e-5 * t_s + 1.5e-4 * Math.floor(car / 4) - away;
      yield `${t_s},"${name.replaceAll('"', '""')}",${lat_deg.toFixed(8)},${lon_deg.toFixed(8)}`;
    }
  }
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
  if (process.argv[2] === "scenario") console.log(SCENARIO);
  else for (const line of traffic()) console.log(line);
}
