// Generates a traffic file (CSV) with VEHICLES vehicles for DURATION_S seconds, with one position per vehicle every STEP_S seconds.
// Usage: node crowds.mjs VEHICLES DURATION_S STEP_S [LIFE_S] > traffic.csv
// With LIFE_S, vehicles appear one after the other, and each exists for LIFE_S seconds.

import { once } from "node:events";

const [vehicles, duration_s, step_s, life_s = Infinity] = process.argv.slice(2).map(Number);
const PER_GROUP = 13;

/** Position of a vehicle. Vehicles drive in groups, each around a separate block; within a group they change places slowly. */
function place(vehicle, t_s) {
  const group = Math.floor(vehicle / PER_GROUP);
  const [column, row] = [group % 8, Math.floor(group / 8)];
  const turn_rad = 0.01 * t_s + group;
  const own_rad = 0.004 * (1 + (vehicle % 5)) * t_s + 2.4 * vehicle;
  const x_m = 900 * column + 400 * Math.cos(turn_rad) + 45 * Math.cos(own_rad);
  const y_m = 900 * row + 400 * Math.sin(turn_rad) + 45 * Math.sin(own_rad);
  return `${x_m.toFixed(2)},${y_m.toFixed(2)}`;
}

/** Whether a vehicle exists at a time. */
function exists(vehicle, t_s) {
  const begins_s = life_s === Infinity ? 0 : ((duration_s - life_s) * vehicle) / vehicles;
  return t_s >= begins_s && t_s <= begins_s + life_s;
}

process.stdout.write("t_s,vehicle,x_m,y_m\n");
for (let t_s = 0; t_s <= duration_s; t_s += step_s) {
  const present = Array.from({ length: vehicles }, (_, vehicle) => vehicle).filter((vehicle) => exists(vehicle, t_s));
  const lines = present.map((vehicle) => `${t_s},car ${vehicle},${place(vehicle, t_s)}\n`);
  if (!process.stdout.write(lines.join(""))) await once(process.stdout, "drain");
}
