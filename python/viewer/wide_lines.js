// Lines with a width in pixels. Each piece is a flat strip that faces the camera. One mesh holds
// all pieces, because software rendering is slow with instances.
import * as THREE from "three";

const CORNERS = [-1, 1, 1, -1].flatMap((side, k) => [k > 1 ? 1 : 0, side]); // end, side, …
const TRIANGLES = [0, 1, 2, 0, 2, 3]; // corners of the two triangles of a piece
const SHADERS = {
  vertexShader: `
    attribute vec3 start, end, shade;
    attribute vec2 corner;
    uniform vec2 size;
    uniform float width;
    varying vec3 tint;
    void main() {
      mat4 view = projectionMatrix * modelViewMatrix;
      vec4 a = view * vec4(start, 1.0), b = view * vec4(end, 1.0);
      vec2 way = (b.xy / b.w - a.xy / a.w) * size;
      vec2 along = way / max(length(way), 1e-6);
      vec2 away = along * (corner.x - 0.5) + vec2(-along.y, along.x) * corner.y;
      gl_Position = mix(a, b, corner.x);
      gl_Position.xy += 0.5 * width * away / size * gl_Position.w;
      if (min(a.w, b.w) <= 0.0) gl_Position = vec4(0.0, 0.0, 2.0, 1.0); // behind the camera
      tint = shade;
    }`,
  fragmentShader: `
    uniform float opacity;
    varying vec3 tint;
    void main() {
      gl_FragColor = vec4(tint, opacity);
      #include <colorspace_fragment>
    }`,
};
const size = { value: new THREE.Vector2(1, 1) }; // half the size of the picture, in pixels
export const setPictureSize = (w, h) => size.value.set(w / 2, h / 2);

// Make the geometry of a line of up to `points` points. Each point is stored four times in
// `places`, for the corners of the piece that begins there. Its end is the next point.
export function makeStrip(points) {
  const shape = new THREE.BufferGeometry();
  const stored = () => new THREE.InterleavedBuffer(new Float32Array(12 * points), 3);
  const [places, shades] = [stored(), stored()];
  const put = (name, data, offset) =>
    shape.setAttribute(name, new THREE.InterleavedBufferAttribute(data, 3, offset));
  put("start", places, 0);
  put("end", places, 12);
  put("shade", shades, 0);
  const corners = new Float32Array(8 * points);
  const triangles = new Uint32Array(6 * (points - 1));
  for (let k = 0; k < points; k++) corners.set(CORNERS, 8 * k);
  for (let k = 0; k < points - 1; k++) writePiece(k, triangles, k);
  shape.setAttribute("corner", new THREE.BufferAttribute(corners, 2));
  shape.setIndex(new THREE.BufferAttribute(triangles, 1));
  return Object.assign(shape, { places, shades });
}
// Write the triangles of the piece that begins at point `k` as the piece `number` to be drawn.
export function writePiece(k, triangles, number) {
  for (let i = 0; i < 6; i++) triangles[6 * number + i] = 4 * k + TRIANGLES[i];
}
export class Line extends THREE.Mesh {
  constructor(shape, { width = 1, opacity = 1, depthWrite = true } = {}) {
    const uniforms = { size, width: { value: width }, opacity: { value: opacity } };
    const look = { transparent: opacity < 1 || !depthWrite, depthWrite, side: THREE.DoubleSide };
    super(shape, new THREE.ShaderMaterial({ ...SHADERS, ...look, uniforms }));
    this.frustumCulled = false;
  }
  set width(pixels) {
    this.material.uniforms.width.value = pixels;
  }
  // Draw the first pieces only.
  showPieces(pieces) {
    this.geometry.setDrawRange(0, 6 * Math.max(0, pieces));
  }
}
// Write each of the first `n` points four times, as `makeStrip` stores them.
export function writeCorners(points, n, into) {
  for (let k = 0; k < n; k++)
    for (let corner = 0; corner < 4; corner++)
      for (let i = 0; i < 3; i++) into[12 * k + 3 * corner + i] = points[3 * k + i];
}
