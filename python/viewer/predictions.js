// Predict, then run: an exercise waits at its start and asks for a prediction. After the reader's
// choice the film runs, and then the answer stands beside the prediction. Answers are computed from
// the closed form.
import { html, render } from "lit-html";
import { collectFacts, fillIn, findLimits, findPreset, hasQuestions, makeExerciseScene } from "./exercises.js";
import { simulation, TICKS } from "./core.js";
import { completeScene } from "./scene.js";

const [NEAR, FAR] = [Math.PI / 360, Math.PI / 18]; // angles that count as equal, as a fall [rad]
const SAME = 1.25; // ratio of times that count as about the same
const SECONDS = 3; // of the film before the answer
const compare = (x, y, most) => (x < y - most ? 0 : x > y + most ? 2 : 1);

// Questions by name, with their choices. `find` returns the number of the true one from the limits of
// all tops, those before the exercise, and the tilt at the start.
const QUESTIONS = {
  way: {
    text: "Which way will the axis go first?",
    choices: ["down", "only sideways", "up", "nowhere"],
    find([{ motionType, least, greatest }], before, tilt) {
      if (motionType === "resting") return 3;
      return greatest - least < NEAR ? 1 : tilt - least < greatest - tilt ? 0 : 2;
    },
  },
  depth: {
    text: "How deep will the axis fall? Before: {lowest before}.",
    choices: ["less deep", "as deep", "deeper"],
    find: ([{ greatest }], before) => compare(greatest, before.greatest, NEAR),
  },
  round: {
    text: "How long will once round take? Before: {round before} s.",
    choices: ["less", "about the same", "more"],
    find: ([{ precession }], before) =>
      compare(Math.log(Math.abs(before.precession / precession)), 0, Math.log(SAME)),
  },
  curve: {
    text: "What will the axis draw?",
    choices: ["loops", "cusps", "waves", "a level circle"],
    find: ([{ motionType }]) => ["loops", "cusps", "waves", "steady"].indexOf(motionType),
  },
  fall: {
    text: "Which of the two will fall?",
    choices: ["only the left one", "only the right one", "both", "none"],
    find([left, right]) {
      const [one, other] = [left, right].map(({ greatest }) => greatest > FAR);
      return one ? (other ? 2 : 0) : other ? 1 : 3;
    },
  },
  rise: {
    text: "Will the axis reach the top?",
    choices: ["yes", "no, it turns back before", "no, it falls at once"],
    find: ([{ least }], before, tilt) => (least < NEAR ? 0 : tilt - least > NEAR ? 1 : 2),
  },
};

export class Predictions {
  isOn = false; // whether exercises ask
  asked = null; // the question of the current exercise
  constructor(place, page, choosePreset) {
    Object.assign(this, { place, page, choosePreset });
  }
  toggle() {
    this.isOn = !this.isOn;
    this.page.onChange();
  }
  // Open an exercise: at rest and with its question, or running. The trace would tell the answer.
  open(preset, exercise) {
    const { page } = this;
    const scene = makeExerciseScene(preset, exercise);
    const question = this.isOn && QUESTIONS[exercise.ask];
    if (!question) return this.choosePreset(scene);
    this.choosePreset({ ...scene, show: { ...scene.show, trace: false } });
    const limits = page.tops.filter(({ role }) => role === "thick").map((top) => top.limits);
    const { nutation } = simulation.measureTop(0);
    const answer = question.find(limits, findLimits(completeScene(preset)), nutation);
    this.asked = { ...question, scene, answer, chosen: null };
    page.setRunning(false);
    this.place.querySelector("button")?.focus();
  }
  choose(chosen) {
    this.asked.chosen = chosen;
    this.page.load(this.asked.scene);
    this.page.setRunning(true);
  }
  draw() {
    const { page, asked } = this;
    if (asked && asked.scene.about !== page.scene.about) this.asked = null; // another scene
    const isOpen = this.asked && asked.chosen === null;
    document.body.classList.toggle("asking", !!this.asked && !this.isAnswered);
    const renderNow = () => (isOpen ? this.renderQuestion(asked) : this.renderAnswer(asked));
    render(this.asked ? renderNow() : this.renderInvitation(), this.place);
  }
  // Whether the film has run long enough after the reader's choice.
  get isAnswered() {
    const { clock, scene } = this.page;
    return this.asked.chosen !== null && clock >= SECONDS * scene.speed * TICKS;
  }
  renderInvitation() {
    if (!this.isOn || !hasQuestions(findPreset(this.page.scene))) return "";
    return html`<p>Choose one under “Try this”. It asks before it runs.</p>`;
  }
  renderQuestion({ text, choices }) {
    const renderChoice = (words, i) => html`<button @click=${() => this.choose(i)}>${words}</button>`;
    return html`<p>${fillIn(text, collectFacts(this.page.scene))}</p>
      <div class="row" role="group" aria-label="Your prediction">${choices.map(renderChoice)}</div>`;
  }
  renderAnswer({ choices, chosen, answer }) {
    const words = html`${chosen === answer ? "✓" : "✗"} The top: <b>${choices[answer]}</b>.`;
    return html`<p>You: <b>${choices[chosen]}</b>. ${this.isAnswered ? words : "Watch …"}</p>`;
  }
}
