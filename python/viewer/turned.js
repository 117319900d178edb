// A symmetric body as what comes off a lathe. The cuboid that stands for a body (core.js) tells its
// three lengths: how far its mass lies from the axis and from the centre, as mean squares, and how
// high the centre is. A homogeneous turned solid of any profile, stretched along and across, has
// just these, and so with the body's mass all its moments. The axle is drawn thin and weighs
// nothing.
import { LatheGeometry, Vector2 } from "three";

// Half profiles, as [height, radius]: a top's, and for bodies too long for that, a drum's.
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

// Returns the mean height of a homogeneous turned solid, the root of the mean square distance from
// it, and that of the mean square distance from a plane through the axis. Three points are exact on
// a straight piece of the profile (Gauss).
const POINTS = [-1, 0, 1].map((side) => [0.5 + side * Math.sqrt(0.15), side ? 5 / 18 : 8 / 18]);
function lengthsOf(profile) {
  let [volume, first, second, fourth] = [0, 0, 0, 0];
  profile.slice(1).forEach(([z1, r1], i) => {
    const [z0, r0] = profile[i];
    for (const [at, weight] of POINTS) {
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

const SOLIDS = [TOP, CONE, DRUM].map((profile) => [profile, lengthsOf(profile)]);

// Two lengths that differ by less are equal, as those of a body given by its numbers.
const CLOSE = 1e-6;
// Finds the turned solid for a body's cuboid: which of the cuboid's edges is the axis and whether
// it points up along it, the height of the centre, and the profile as seen from the fixed point.
// null if the body is not symmetric.
export function turnedOf({ half, centre }) {
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
  // The first that does not reach below the fixed point, on which a top stands.
  const [top, cone, drum] = SOLIDS.map(fit);
  const stands = ([[tip]]) => tip >= -CLOSE * size;
  const profile = !height || stands(top) ? top : stands(cone) ? cone : drum;
  return { axis, up, height, profile };
}

// What casts the shadow is a simpler solid without hollows, from the tip on: pressed flat, it
// covers each place once.
export function hull({ profile, height }) {
  const wide = Math.max(...profile.map(([, r]) => r));
  const rim = profile.filter(([, r]) => r > 0.99 * wide);
  const top = profile.filter(([, r]) => r > 0.1 * wide).at(-1);
  const low = height ? Math.min(0, profile[0][0]) : profile[0][0];
  return { profile: [[low, 0], rim[0], rim.at(-1), top, [top[0], 0]], height };
}
// Makes the surface over a part of the whole turn, from `from` on, about the y axis and with the
// centre in the middle.
export function surface({ profile, height }, from, part) {
  const points = profile.map(([z, r]) => new Vector2(r, z - height));
  const pieces = Math.max(6, Math.round(64 * part));
  return new LatheGeometry(points, pieces, 2 * Math.PI * from, 2 * Math.PI * part);
}
