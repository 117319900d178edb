// Things of everyday size, made of solids of revolution and boxes, in metres. They determine the
// mass, the centre and the moments of the body of a scene. A thing can be drawn for any body:
// stretched along the axes of the cuboid of this body, it has the second moments of this body,
// because those of each solid grow with the square of the stretching.

// Densities [kg/m³] and colours. Paint has the colour of the top.
const STEEL = { density: 7800, colour: "#aab2bd" };
const BRASS = { density: 8500, colour: "#c9a64b" };
const ALUMINIUM = { density: 2700, colour: "#c3c9d1" };
const PAINT = { density: 2700 };
const RUBBER = { density: 400, colour: "#3c4048" }; // of a tyre with its air
const CELLS = { density: 300, colour: "#2c4a8a" }; // of solar panels
const FOIL = { density: 300, colour: "#c9a64b" }; // of a satellite
const THREAD = { density: 0, colour: "#8b929c" };

// A solid of revolution has an axis, 0 to 2, and corners [height, radius]. A box has half edges.
// Solids of a wheel turn with the rotor, in a thing with one.
const makeSolid = (profile, look, how = {}) => ({
  profile,
  axis: 2,
  at: [0, 0, 0],
  ...look,
  ...how,
});
const makeRod = (low, high, r, ...more) =>
  makeSolid(
    [
      [low, 0],
      [low, r],
      [high, r],
      [high, 0],
    ],
    ...more,
  );
const makeRing = (inner, outer, half, ...more) =>
  makeSolid(
    [
      [-half, inner],
      [-half, outer],
      [half, outer],
      [half, inner],
      [-half, inner],
    ],
    ...more,
  );
const makeHoop = (radius, r, ...more) => {
  const corner = (_, k) => [
    r * Math.sin((Math.PI * k) / 6),
    radius + r * Math.cos((Math.PI * k) / 6),
  ];
  return makeSolid(Array.from({ length: 13 }, corner), ...more);
};
const makeBlock = (half, at, look, how) => ({ half, at, ...look, ...how });

// The wheel of a gyroscope with radius 0.03 in three rings.
const makeGyroscope = (at, axis) => [
  makeRing(0.022, 0.03, 0.005, BRASS, { at, axis, isWheel: true }),
  makeRod(-0.001, 0.001, 0.022, BRASS, { at, axis, isWheel: true }),
  makeRod(-0.036, 0.036, 0.0022, STEEL, { at, axis, isWheel: true }),
  ...[0, 1, 2].map((axis) => makeHoop(0.0375, 0.0015, PAINT, { at, axis })),
];
const HUB = [0, 0, 0.12]; // of the bicycle wheel, whose axle begins at the fixed point
export const THINGS = {
  disk: {
    name: "disk on a rod",
    isRound: true,
    solids: [
      makeSolid(
        [
          [0.0275, 0],
          [0.0275, 0.027],
          [0.028, 0.028],
          [0.032, 0.028],
          [0.0325, 0.027],
          [0.0325, 0],
        ],
        { ...PAINT, density: 7800 },
      ),
      makeSolid(
        [
          [0, 0],
          [0.004, 0.0018],
          [0.066, 0.0018],
          [0.067, 0.001],
          [0.067, 0],
        ],
        STEEL,
      ),
      makeRod(0.0265, 0.0335, 0.005, STEEL),
    ],
  },
  gyroscope: {
    name: "gyroscope",
    frame: 0.039, // outer radius, by which a cup holds a balanced one on a turntable
    solids: [
      ...makeGyroscope([0, 0, 0.05], 2),
      makeSolid(
        [
          [0, 0],
          [0.002, 0.002],
          [0.006, 0.003],
          [0.012, 0.003],
          [0.012, 0],
        ],
        STEEL,
      ),
      makeSolid(
        [
          [0.088, 0],
          [0.088, 0.003],
          [0.094, 0.003],
          [0.097, 0.002],
          [0.097, 0],
        ],
        STEEL,
      ),
    ],
  },
  compass: {
    name: "gyrocompass",
    hangsOn: "arch",
    solids: [...makeGyroscope([0, 0, -0.09], 0), makeRod(-0.052, 0, 0.002, STEEL)],
  },
  wheel: {
    name: "bicycle wheel",
    isRound: true,
    hangsOn: "rope",
    spokes: { count: 28, inner: [0.018, 0.03], outer: 0.297, at: HUB },
    solids: [
      makeHoop(0.325, 0.019, RUBBER, { at: HUB }),
      makeRing(0.297, 0.308, 0.009, PAINT, { at: HUB }),
      makeRod(-0.034, 0.034, 0.018, ALUMINIUM, { at: HUB }),
      makeRod(0, 0.24, 0.006, STEEL),
    ],
  },
  handle: {
    name: "T-handle",
    solids: [
      makeRod(-0.06, 0.06, 0.01, PAINT, { axis: 0 }),
      makeRod(-0.066, -0.009, 0.008, ALUMINIUM),
      ...[0, 1, 2, 3].map((k) => makeHoop(0.008, 0.001, THREAD, { at: [0, 0, -0.04 - 0.006 * k] })),
    ],
  },
  satellite: {
    name: "satellite with a boom",
    solids: [
      makeBlock([0.25, 0.25, 0.3], [0, 0, 0], FOIL),
      ...[-1, 1].map((side) => makeBlock([0.03, 0.45, 0.2], [0, 0.75 * side, 0], CELLS)),
      makeRod(0.3, 2.4, 0.02, { ...STEEL, density: 500 }),
      makeBlock([0.12, 0.12, 0.12], [0, 0, 2.52], PAINT),
    ],
  },
};

// Return volume and mean height of a homogeneous solid of revolution, and the root mean squares of
// the height about it and of the distance from a plane through the axis. Three Gauss points are exact
// for linear pieces. A section that is not closed by the axis ends where it begins.
const GAUSS_POINTS = [-1, 0, 1].map((side) => [
  0.5 + side * Math.sqrt(0.15),
  side ? 5 / 18 : 8 / 18,
]);
export function computeLengths(profile) {
  let [volume, first, second, fourth] = [0, 0, 0, 0];
  profile.slice(1).forEach(([z1, r1], i) => {
    const [z0, r0] = profile[i];
    for (const [at, weight] of GAUSS_POINTS) {
      const [z, r] = [z0 + at * (z1 - z0), r0 + at * (r1 - r0)];
      const part = weight * (z1 - z0) * r * r;
      volume += part;
      first += part * z;
      second += part * z * z;
      fourth += (part * r * r) / 4;
    }
  });
  const mean = first / volume;
  const spread = Math.sqrt(second / volume - mean * mean);
  return { volume: Math.PI * volume, mean, spread, across: Math.sqrt(fourth / volume) };
}
// Return mass and centre of a solid, and the mean squares of its extent about the centre.
function measureSolid({ profile, half, axis, at, density }) {
  if (half)
    return {
      mass: 8 * density * half[0] * half[1] * half[2],
      at,
      squares: half.map((h) => (h * h) / 3),
    };
  const { volume, mean, spread, across } = computeLengths(profile);
  const squares = [0, 1, 2].map((k) => (k === axis ? spread : across) ** 2);
  return { mass: density * volume, at: at.map((x, k) => (k === axis ? x + mean : x)), squares };
}
// Return mass, centre and the root mean squares of the extent of solids, whose principal axes at the
// centre are the coordinate axes.
export function measureSolids(solids) {
  const all = solids.map(measureSolid);
  const mass = all.reduce((sum, solid) => sum + solid.mass, 0);
  const average = (value) =>
    [0, 1, 2].map((k) => all.reduce((sum, s) => sum + s.mass * value(s, k), 0) / mass);
  const centre = average(({ at }, k) => at[k]);
  const squares = average((s, k) => s.squares[k] + (s.at[k] - centre[k]) ** 2);
  return { mass, centre, lengths: squares.map(Math.sqrt) };
}
// Fit a thing to a cuboid with the half edges `half`: return along which edges its axes lie and in
// which direction, how it is stretched along them, and its centre. The third axis is that of a
// revolution, if there is one. A wheel has its axis and its moment, in units of the mass.
export function fitThing({ solids }, half, revolution) {
  const { axis = 2, up = 1 } = revolution ?? {};
  const { mass, centre, lengths } = measureSolids(solids);
  const edges = [1, 2, 0].map((k) => (axis + k) % 3);
  const stretch = edges.map((k, i) => half[k] / Math.sqrt(3) / lengths[i]);
  return { edges, signs: [1, up, up], stretch, centre, wheel: measureWheel(solids, stretch, mass) };
}
function measureWheel(solids, stretch, whole) {
  const parts = solids.filter((solid) => solid.isWheel);
  if (!parts.length) return null;
  const [{ axis }] = parts;
  const { mass, lengths } = measureSolids(parts);
  const moment = [0, 1, 2].reduce(
    (sum, k) => sum + (k === axis ? 0 : (lengths[k] * stretch[k]) ** 2),
    0,
  );
  return { axis, moment: (moment * mass) / whole };
}
// Return the body of a thing as a cuboid, with five digits. It is held at the origin of the solids,
// or at `pivot`, which is measured from their centre.
export function makeThingBody({ thing, pivot }) {
  const { mass, centre, lengths } = measureSolids(THINGS[thing].solids);
  const round = (x) => (Math.abs(x) < 1e-9 ? 0 : +x.toPrecision(5));
  const half = lengths.map((length) => round(Math.sqrt(3) * length));
  const density = round(mass / (8 * half[0] * half[1] * half[2]));
  return { half, pivot: pivot ?? centre.map((x) => round(-x)), density };
}
