// Prints a SUMO net of the streets around the blocks of crowds.mjs, in metres: a grid with one lane from crossing to crossing.

const STEP_M = 100;
const [COLUMNS, ROWS] = [74, 65];
const place = (column, row) => `${STEP_M * (column - 5)},${STEP_M * (row - 5)}`;

const lines = ['<net version="1.20">', '<location netOffset="0.00,0.00" convBoundary="-500,-500,6900,6000" origBoundary="-500,-500,6900,6000" projParameter="!"/>'];
for (let column = 0; column < COLUMNS; column++) {
  for (let row = 0; row < ROWS; row++) {
    for (const [name, to] of [["east", place(column + 1, row)], ["north", place(column, row + 1)]]) {
      const id = `${name} ${column} ${row}`;
      const type = row % 9 && column % 9 ? "highway.residential" : "highway.primary";
      lines.push(`<edge id="${id}" from="a" to="b" type="${type}"><lane id="${id}_0" index="0" speed="14" length="100" width="6" shape="${place(column, row)} ${to}"/></edge>`);
    }
  }
}
console.log([...lines, "</net>"].join("\n"));
