// Prints the error of the attitude of a tumbling cuboid after 10 s: node tumble.mjs step.wasm
import { readFile } from "node:fs/promises";

const { instance } = await WebAssembly.instantiate(await readFile(process.argv[2]));
const { memory, __heap_base, kr_step, kr_step_momentum } = instance.exports;

/** A body with its numbers in the memory of the module. */
class Body {
  constructor(address, moments, velocity) {
    const place = (index, length) => new Float64Array(memory.buffer, address + 8 * index, length);
    this.moments = place(0, 3);
    this.attitude = place(3, 4); // w, x, y, z; from the principal axes to space
    this.momentum = place(7, 3); // in space [kg m^2 / s]
    this.impulse = place(10, 3);
    this.moments.set(moments);
    this.attitude.set([1, 0, 0, 0]);
    this.impulse.set(velocity);
    kr_step_momentum(...this.addresses("moments", "attitude", "impulse", "momentum"));
    this.impulse.fill(0);
  }
  addresses(...names) {
    return names.map((name) => this[name].byteOffset);
  }
  step(seconds) {
    kr_step(...this.addresses("moments", "attitude", "momentum", "impulse"), seconds, 4);
  }
}

const body = new Body(__heap_base.value, [0.1 / 3, 0.26 / 3, 0.34 / 3], [3, 1, 2]);
for (let i = 0; i < 600; i++) body.step(1 / 60);
// The closed form
const truth = [-0.0710009187614268, 0.42939487137885635, 0.866475553493763, 0.24453840018746675];
const error = 2 * Math.hypot(...truth.map((x, i) => x - body.attitude[i]));
console.log(`error after 10 s: ${error.toExponential(1)} rad`);
