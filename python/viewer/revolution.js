// A symmetric body as a solid of revolution. A cuboid (core.js) determines mass, moments and height
// of the centre. A homogeneous solid of any profile has the same ones after scaling along and
// across its axis. The axle is massless.
import { LatheGeometry, Vector2, Vector3 } from "three";
import { toQuaternion } from "./scene.js";

// Half profiles as [height, radius].
const TOP = [
  [-1.18, 0],
  [-1.17, 0.03],
  [-1.0, 0.1],
  [-0.72, 0.34],
  [-0.45, 0.6],
  [-0.25, 0.8],
  [-0.12, 0.92],
  [-0.04, 0.98],
  [0.03, 1],
  [0.09, 0.99],
  [0.15, 0.94],
  [0.2, 0.84],
  [0.24, 0.68],
  [0.27, 0.48],
  [0.29, 0.3],
  [0.32, 0.17],
  [0.38, 0.12],
  [0.7, 0.11],
  [0.72, 0.08],
  [0.72, 0],
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

// Return the mean height of a homogeneous solid of revolution, and the root mean squares of the
// height about it and of the distance from a plane through the axis. Three Gauss points are exact
// for linear pieces.
const GAUSS_POINTS = [-1, 0, 1].map((side) => [
  0.5 + side * Math.sqrt(0.15),
  side ? 5 / 18 : 8 / 18,
]);
function computeLengths(profile) {
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
  return [mean, Math.sqrt(second / volume - mean * mean), Math.sqrt(fourth / volume)];
}

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
  const fit = ([shape, [mean, spread, across]]) => {
    const along = half[axis] / Math.sqrt(3) / spread;
    const wide = half[(axis + 1) % 3] / Math.sqrt(3) / across;
    return shape.map(([z, r]) => [height + along * (z - mean), wide * r]);
  };
  // Take the top for a body held at its centre, else the first solid that does not reach below the
  // fixed point, or the drum.
  const [top, cone, drum] = SOLIDS.map(fit);
  const stands = ([[tip]]) => tip >= -CLOSE * size;
  const profile = !height || stands(top) ? top : stands(cone) ? cone : drum;
  return { axis, up, height, profile };
}
// Return the tilt at which the rim meets a floor at the height of the fixed point, or null if the
// body does not stand on its tip.
const LEAST_ANGLE = 0.05; // of the body with the floor [rad]
export function computeContact({ profile }) {
  const angle = Math.min(...profile.filter(([, r]) => r > 0).map(([z, r]) => Math.atan2(z, r)));
  return angle > LEAST_ANGLE ? angle : null;
}

// Return a convex profile for the shadow. Its projection covers each place once.
export function makeShadowProfile({ profile, height }) {
  const wide = Math.max(...profile.map(([, r]) => r));
  const rim = profile.filter(([, r]) => r > 0.99 * wide);
  const top = profile.filter(([, r]) => r > 0.1 * wide).at(-1);
  const low = height ? Math.min(0, profile[0][0]) : profile[0][0];
  return { profile: [[low, 0], rim[0], rim.at(-1), top, [top[0], 0]], height };
}
// Make the surface of a part of a full turn, from `from` on, about y and with the centre at 0.
export function makeSurface({ profile, height }, from, part) {
  const points = profile.map(([z, r]) => new Vector2(r, z - height));
  const pieces = Math.max(6, Math.round(64 * part));
  return new LatheGeometry(points, pieces, 2 * Math.PI * from, 2 * Math.PI * part);
}
