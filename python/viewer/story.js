// The story: why a top does not fall, in five scenes with a sentence each. Each has a link, as
// "#story=2", and leads to the next one. The last link leads to the whole page.
import { html, render } from "lit-html";
import { findPreset, makeExerciseScene } from "./exercises.js";
import presets from "./presets.json";

const [{ name, story }] = presets;

// Render a sentence. Words in brackets, as "[weight]", have the colour of their arrow.
const renderWords = (text) =>
  text.split(/\[(.*?)\]/).map((words, i) => (i % 2 ? html`<b class=${words}>${words}</b>` : words));

export class Story {
  constructor(place, choosePreset) {
    Object.assign(this, { place, choosePreset });
  }
  // Show the scene of a link, or close the story for other links. Return whether it is open.
  follow(hash) {
    const [isOpen, number = "1"] = /^#story(?:=(\d))?$/.exec(hash) ?? [];
    const [at, last] = [Math.min(+number || 1, story.length), story.length];
    document.body.classList.toggle("story", !!isOpen);
    render(isOpen ? this.renderBeat(at, last) : "", this.place);
    if (isOpen) this.choosePreset(makeExerciseScene(findPreset({ name }), story[at - 1]));
    return !!isOpen;
  }
  renderBeat(at, last) {
    const back = at > 1 ? html`<a class="beat" href="#story=${at - 1}" aria-keyshortcuts="PageUp">◂ Back</a>` : "";
    const next =
      at < last
        ? html`<a class="beat" href="#story=${at + 1}" aria-keyshortcuts="PageDown">Next ▸</a>`
        : html`<a class="beat" href="#" aria-keyshortcuts="PageDown">Your turn ▸</a>`;
    return html`<p>${renderWords(story[at - 1].text)}</p>
      <nav aria-label="Story">${back} ${at} of ${last} ${next}</nav>`;
  }
}
