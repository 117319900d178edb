// A symmetric body as a solid of revolution. A cuboid (core.js) determines mass, moments and height
// of the centre. A homogeneous solid of any profile has the same ones after scaling along and
// across its axis. The axle is massless.
import { LatheGeometry, Vector2, Vector3 } from "three";
import { toQuaternion } from "./scene.js";
import { computeLengths, fitThing } from "./things.js";

// Half profiles as [height, radius, colour of the following pieces]: of a turned top with foot and
// stem, whose colour is that of the top where none is given, of a cone and of a drum.
const TOP = [
  [-1.42, 0, "wood"],
  [-1.4, 0.035],
  [-1.08, 0.085],
  [-1.03, 0.15],
  [-0.95, 0.17],
  [-0.87, 0.14],
  [-0.8, 0.16, "paint"],
  [-0.66, 0.3],
  [-0.5, 0.5],
  [-0.33, 0.72],
  [-0.17, 0.9],
  [-0.05, 0.98],
  [0.03, 1],
  [0.1, 0.985],
  [0.16, 0.93, "mark"],
  [0.2, 0.84, "paint"],
  [0.24, 0.68],
  [0.27, 0.48],
  [0.3, 0.32, "wood"],
  [0.34, 0.2],
  [0.4, 0.13],
  [0.6, 0.105],
  [0.78, 0.11],
  [0.88, 0.15, "paint"],
  [0.95, 0.155],
  [1, 0.12],
  [1.02, 0.06],
  [1.025, 0],
];
const CONE = [
  [0, 0],
  [0.999, 0.999],
  [1, 1],
  [1, 0.995],
  [1, 0],
];
const DRUM = [
  [-1, 0],
  [-1, 0.995],
  [-0.995, 1],
  [0.995, 1],
  [1, 0.995],
  [1, 0],
];

const SOLIDS = [TOP, CONE, DRUM].map((profile) => [profile, computeLengths(profile)]);

// Relative difference below which two lengths are equal.
const CLOSE = 1e-6;
// Fit a solid of revolution to the cuboid of a body: index and direction of its axis, height of the
// centre, and profile seen from the fixed point. Returns null if the body is not symmetric.
export function fitRevolution({ half, centre: described, turn }) {
  const back = toQuaternion(turn).conjugate();
  const centre = new Vector3(...described).applyQuaternion(back).toArray(); // along the edges
  const size = Math.max(...half, ...centre.map(Math.abs));
  const near = (a, b) => Math.abs(a - b) < CLOSE * size;
  const isAxis = (k) => {
    const [i, j] = [(k + 1) % 3, (k + 2) % 3];
    return near(half[i], half[j]) && near(centre[i], 0) && near(centre[j], 0);
  };
  const axis = [2, 1, 0].find(isAxis);
  if (axis === undefined) return null;
  const [height, up] = [Math.abs(centre[axis]), centre[axis] < 0 ? -1 : 1];
  const fit = ([shape, { mean, spread, across }]) => {
    const along = half[axis] / Math.sqrt(3) / spread;
    const wide = half[(axis + 1) % 3] / Math.sqrt(3) / across;
    return shape.map(([z, r, ...look]) => [height + along * (z - mean), wide * r, ...look]);
  };
  // Take the top for a body held at its centre, else the first solid that does not reach below the
  // fixed point, or the drum.
  const [top, cone, drum] = SOLIDS.map(fit);
  const stands = ([[tip]]) => tip >= -CLOSE * size;
  const profile = !height || stands(top) ? top : stands(cone) ? cone : drum;
  return { axis, up, height, profile };
}
// Return a revolution with the corners of a round thing, whose mesh is made from its solids.
export function fitRoundThing(thing, revolution, half) {
  const { stretch, centre } = fitThing(thing, half, revolution);
  const fit = ({ profile, at }) =>
    profile.map(([z, r]) => [
      revolution.height + stretch[2] * (z + at[2] - centre[2]),
      stretch[0] * r,
    ]);
  return { ...revolution, profile: thing.solids.flatMap(fit) };
}
// Return the tilt at which the rim meets a floor at the height of the fixed point, or null if the
// body does not stand on its tip.
const LEAST_ANGLE = 0.05; // of the body with the floor [rad]
export function computeContact({ profile }) {
  const angle = Math.min(...profile.filter(([, r]) => r > 0).map(([z, r]) => Math.atan2(z, r)));
  return angle > LEAST_ANGLE ? angle : null;
}

// Make the surface about y, with pieces round the axis and the centre at 0. Its `looks` name the colour of each corner. Sharp
// corners, and those at which the colour changes, are doubled.
const SHARP = 0.6; // [rad]
export function makeSurface({ profile, height }, pieces) {
  const [points, looks] = [[], []];
  const add = (z, r, look) => (points.push(new Vector2(r, z - height)), looks.push(look));
  const findAngle = ([z0, r0], [z1, r1]) => Math.atan2(r1 - r0, z1 - z0);
  let now = profile[0][2] ?? "paint";
  profile.forEach(([z, r, look = now], i) => {
    const [before, after] = [profile[i - 1], profile[i + 1]];
    const bend = before && after ? findAngle(before, [z, r]) - findAngle([z, r], after) : 0;
    add(z, r, now);
    if (look !== now || Math.cos(bend) < Math.cos(SHARP)) add(z, r, (now = look));
  });
  return Object.assign(new LatheGeometry(points, pieces), { looks });
}
