// Scenes to begin with, each with one line of what to look at.
import { makeBody } from "./core.js";
import { plain } from "./scene.js";

const preset = (name, about, scene) => ({ name, about, ...scene });
const shape = "lagrange";
const [, i1] = makeBody(plain.body);
const torque = 5.12; // mass, gravity 1, height 1 of the thesis' body
const critical = Math.sqrt(4 * i1 * torque); // above it the upright top stands: m3^2 = 4 I1 M g l
const [awake, asleep] = [0.85, 1.15].map((part) => [0.3, 0, part * critical]);

// Steady precession at the rate W and the tilt whose cosine is 0.6: I1 W^2 cos - m3 W + M g l = 0.
const W = 0.5;
const axial = (i1 * W * W * 0.6 + torque) / W;
const around = [0, -0.8 * axial + i1 * W * 0.8 * 0.6, 0.6 * axial + i1 * W * 0.64];

const plate = { half: [1, 0.6, 0.2], pivot: [0, 0, 0], density: 1 };
const [, p1, p2] = makeBody(plate);
const asym = (root) => ({ half: [0.8 * Math.sqrt(root), 0.8, 0.4], pivot: [0, 0, -0.4], density: 1 });
const fourth = { methods: ["strang"], chart: "fourth" };

export const presets = [
  preset("Lagrange's top", "The thesis' top, begun upright: its apex nutates in loops between two circles.", { shape }),
  preset(
    "Compare four",
    "Bobenko-Suris in red and, with 20 times the step, blue; extrapolation in yellow and green. Blue's energy swings " +
      "and comes back; green's error is small and only grows.",
    { shape, methods: ["bobenko_suris", "extrap"], eps: [0.01, 0.2] },
  ),
  preset("Kowalewski", "The apex looks lawless, yet a fourth integral K stays: see it in the chart.", {
    ...fourth,
    ...{ shape: "kowalewski", body: asym(3) },
  }),
  preset(
    "Goryachev-Chaplygin",
    "Integrable while m has no vertical part: G stays. Lift the green tip, and it is lost.",
    { ...fourth, shape: "goryachev_chaplygin", body: asym(7), momentum: [0.172, -1.862, 0] },
  ),
  preset("Dzhanibekov's nut", "No gravity, spun about the middle axis: it turns over, again and again.", {
    body: plate,
    gravity: 0,
    methods: ["strang"],
    momentum: [0.002 * p1, 3 * p2, 0],
  }),
  preset(
    "Sleeping top",
    "Left just above the critical spin: it sleeps, upright. Right just below: it falls, and rises again.",
    { shape, methods: ["bobenko_suris2", "bobenko_suris2"], momentum: asleep, second: awake },
  ),
  preset(
    "Steady precession",
    "Spin and tilt matched: the apex goes round on a level circle. Nudge the green tip, and it nods.",
    { shape, methods: ["bobenko_suris2"], attitude: [Math.sqrt(0.8), Math.sqrt(0.2), 0, 0], momentum: around },
  ),
  preset("Elastic rod", "Kirchhoff: the axis of the top, followed in time, is the shape of a bent and twisted rod.", {
    shape,
    attitude: [0.5, Math.sqrt(0.75), 0, 0],
    momentum: [0.8, 2.2, -4.6],
    show: { rod: true, trace: false },
  }),
];
