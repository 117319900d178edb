// The room: the floor, the lights and soft shadows. A shadow is the body projected onto the floor
// from several points of a wide lamp: sharp near the contact and soft farther up. The picture is
// seen from the support: about a turntable, which stands still in the picture, the room turns, unless
// the camera turns with the room. Turning ground and the centre of an orbit are shown as a globe.
import * as THREE from "three";

const LAMP = new THREE.Vector3(2.2, -2.6, 7); // direction to the lamp and to the main light
const POINTS = 9; // of the lamp
const WIDTH = 0.07; // of the lamp [rad]
const EXTENT = 11; // radius of the floor, which fades out
const LIFT = 4e-3; // height of shadows above the floor, against flicker
export const NORTH = "#c37801"; // colour of the mark of the room
const EDGE = "#5b6675"; // colour of the rim and the mark of a turntable
const STRIPE = 0.05; // half the breadth of the marks of table and room
const BEYOND = 0.8; // from the rim of a turntable to the letter N in the room

function addLights(room) {
  const sun = new THREE.DirectionalLight("#fff3df", 2.4);
  const rim = new THREE.DirectionalLight("#cfe0ff", 0.9);
  sun.position.copy(LAMP);
  rim.position.set(-6, 5, 3);
  room.add(new THREE.HemisphereLight("#ffffff", "#a79c90", 1.5), sun, rim);
}

// Make a disc that becomes transparent towards its rim.
function makeGround() {
  const shape = new THREE.RingGeometry(0, EXTENT, 48, 16);
  const places = shape.attributes.position;
  const shades = new Float32Array(4 * places.count).fill(1);
  for (let i = 0; i < places.count; i++) {
    const out = Math.hypot(places.getX(i), places.getY(i)) / EXTENT;
    shades[4 * i + 3] = (1 - out) ** 2 * (1 + 2 * out);
  }
  shape.setAttribute("color", new THREE.BufferAttribute(shades, 4));
  const paint = { vertexColors: true, transparent: true, depthWrite: false };
  return new THREE.Mesh(shape, new THREE.MeshBasicMaterial(paint));
}

// Make a turntable of radius 1: a disc, its rim, and a stripe from its middle to its rim.
function makeTable() {
  const disc = makeMark(new THREE.CircleGeometry(1, 96));
  const rim = makeMark(new THREE.RingGeometry(0.95, 1, 96), EDGE);
  return new THREE.Group().add(disc, rim, makeStripe(0.95, EDGE));
}
// Make a globe of radius 1 about its axis, whose northern end is marked.
const AXLE = 1.35; // from the centre to an end of the axis
const NET = 1.003; // radius of the meridians and parallels, every 30 degrees
function makeGlobe() {
  const paint = new THREE.MeshPhongMaterial({ color: "#7fa6cf", shininess: 10 });
  const ball = new THREE.Mesh(new THREE.SphereGeometry(1, 48, 32), paint);
  const look = { color: "#ffffff", transparent: true, opacity: 0.7 };
  const places = [];
  const add = (longitude, latitude) => {
    const [out, up] = [NET * Math.cos(latitude), NET * Math.sin(latitude)];
    places.push(out * Math.cos(longitude), out * Math.sin(longitude), up);
  };
  const step = Math.PI / 48;
  for (let k = 0; k < 12; k++)
    for (let i = -24; i < 24; i++) for (const j of [i, i + 1]) add((k * Math.PI) / 6, j * step);
  for (let k = -2; k <= 2; k++)
    for (let i = 0; i < 96; i++) for (const j of [i, i + 1]) add(j * step, (k * Math.PI) / 6);
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.Float32BufferAttribute(places, 3));
  const net = new THREE.LineSegments(shape, new THREE.LineBasicMaterial(look));
  const axle = new THREE.CylinderGeometry(0.02, 0.02, 2 * AXLE, 12).rotateX(Math.PI / 2);
  const axis = new THREE.Mesh(axle, new THREE.MeshBasicMaterial({ color: NORTH }));
  const turning = new THREE.Group().add(ball, net);
  return Object.assign(new THREE.Group().add(turning, axis), { turning, axis });
}
// Make a flat mark on the floor, drawn in the order of the marks and below the shadows.
const makeMark = (shape, color = "#ffffff") => {
  const paint = new THREE.MeshBasicMaterial({ color, transparent: true, depthWrite: false });
  return Object.assign(new THREE.Mesh(shape, paint), { renderOrder: -2 });
};
const makeStripe = (length, color) =>
  makeMark(new THREE.PlaneGeometry(2 * STRIPE, length).translate(0, -length / 2, 0), color);

export class Floor {
  constructor(world) {
    this.room = new THREE.Group();
    addLights(this.room);
    this.group = new THREE.Group();
    this.ground = makeGround();
    const grid = new THREE.PolarGridHelper(8, 24, 8, 96).rotateX(Math.PI / 2);
    const look = { color: "#808894", transparent: true, opacity: 0.22, depthWrite: false };
    grid.material = new THREE.LineBasicMaterial(look);
    grid.position.z = LIFT / 2;
    [this.ground.renderOrder, grid.renderOrder] = [-3, -2];
    this.shadows = new THREE.Group();
    this.table = makeTable();
    this.north = Object.assign(makeStripe(1, NORTH), { renderOrder: -2.5 });
    this.globe = makeGlobe();
    this.group.add(this.ground, grid, this.north, this.shadows);
    world.add(this.room.add(this.group), this.table, this.globe);
  }
  set visible(on) {
    this.group.visible = on;
  }
  // Show the mark N beyond a radius at an angle about the vertical, unless it is null, and a turntable
  // with this radius.
  showTable(radius, isTable, north) {
    this.table.visible = isTable;
    this.north.visible = north !== null;
    this.table.scale.set(radius, radius, 1);
    this.north.scale.y = radius + BEYOND;
    this.north.rotation.z = north ?? 0;
  }
  // Show a globe of a radius below the floor, which turns about `axis`, or the floor without one.
  showGlobe(radius, axis, hasAxis) {
    const { globe, height } = this;
    globe.visible = !!axis;
    this.group.visible &&= !axis;
    if (!axis) return;
    globe.position.z = height - radius;
    globe.scale.setScalar(radius);
    globe.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), axis);
    globe.axis.visible = hasAxis;
  }
  // Return the end of the mark of the room, towards which tops lean that start by angles, or the
  // northern end of the axis of the globe.
  findNorth() {
    if (this.globe.visible) return this.globe.localToWorld(new THREE.Vector3(0, 0, AXLE));
    return this.north.localToWorld(new THREE.Vector3(0, -1, 0));
  }
  // Set the height and the colours of the floor.
  setHeight(height, isDark) {
    this.height = height;
    this.group.position.z = height;
    this.table.position.z = height + LIFT / 2;
    this.ground.material.color.set(isDark ? "#2b3342" : "#ffffff");
    this.table.children[0].material.color.set(isDark ? "#3f4957" : "#b3bcc8");
    this.strength = isDark ? 0.55 : 0.3;
  }
  // Make the shadows of all bodies and rods.
  castShadows(tops) {
    for (const shadow of this.shadows.children) shadow.material.dispose();
    this.shadows.clear();
    const opacity = 1 - (1 - this.strength) ** (1 / POINTS);
    const look = { color: "#0c1018", transparent: true, opacity, depthWrite: false };
    // Each point of the lamp darkens each place once.
    const once = {
      stencilWrite: true,
      stencilFunc: THREE.NotEqualStencilFunc,
      stencilZPass: THREE.ReplaceStencilOp,
    };
    for (let k = 0; k < POINTS; k++) {
      const dark = new THREE.MeshBasicMaterial({ ...look, ...once, side: 2, stencilRef: k + 1 });
      for (const top of tops)
        for (const body of [...top.solid.shadowCasters, top.rod]) {
          const shadow = new THREE.Mesh(body.geometry, dark);
          const order = { renderOrder: k / POINTS - 1 };
          Object.assign(shadow, { matrixAutoUpdate: false, frustumCulled: false, ...order });
          shadow.userData = {
            caster: body,
            projection: makeProjection(k),
            isRod: body === top.rod,
          };
          this.shadows.add(shadow);
        }
    }
  }
  // Show the shadows of bodies, of rods, or of both.
  showShadows(ofBodies, ofRods) {
    for (const shadow of this.shadows.children)
      shadow.visible = shadow.userData.isRod ? ofRods : ofBodies;
  }
  // Move the shadows to the current positions.
  updateShadows() {
    const toFloor = this.group.matrixWorld.clone().invert();
    for (const { matrix, userData } of this.shadows.children) {
      matrix
        .multiplyMatrices(toFloor, userData.caster.matrixWorld)
        .premultiply(userData.projection);
    }
  }
}
// Return the projection onto the floor from point `k` of the lamp. The points lie on a Fermat
// spiral.
function makeProjection(k) {
  const [out, turn] = [WIDTH * Math.sqrt((k + 0.5) / POINTS), 2.39996 * k];
  const x = LAMP.x / LAMP.z + out * Math.cos(turn);
  const y = LAMP.y / LAMP.z + out * Math.sin(turn);
  return new THREE.Matrix4().set(1, 0, -x, 0, 0, 1, -y, 0, 0, 0, 0, LIFT, 0, 0, 0, 1);
}
