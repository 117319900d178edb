// Answer the question at the top of the page with the fastest measured run of each program.
const question = document.getElementById("question");
if (question) {
  const answers = JSON.parse(document.getElementById("answers").textContent);
  const choices = [...question.querySelectorAll("select")];
  const line = question.querySelector(".take code"), button = question.querySelector("button");
  const LONGEST = 100; // times the fastest run, at which bars are cut off
  const select = count => answers.filter(answer =>
    choices.slice(0, count).every(choice => answer[choice.name] === choice.value));
  const make = (tag, text, name = "") => {
    const element = document.createElement(tag);
    element.textContent = text;
    element.className = name;
    return element;
  };
  const format = ms => {
    const [factor, unit] = ms < 1 ? [1e3, "\u00b5s"] : ms < 1e3 ? [1, "ms"] : [1e-3, "s"];
    return `${Number((factor * ms).toPrecision(2))} ${unit}`;
  };
  const drawRow = (answer, longest) => {
    const row = make("tr", "", answer.code ? "own" : ""), bar = make("td", "", "left");
    if (answer.ms === null) {
      row.append(make("td", answer.program), bar, make("td", "no measured run reaches the error", "left"));
      return row;
    }
    const strip = make("span", "", "bar");
    strip.style.width = `${Math.min(96, 96 * answer.ms / longest)}%`;
    bar.append(strip, answer.ms > longest ? "\u2192" : "");
    const compiling = answer.setup ? `, after ${format(answer.setup)} of compilation` : "";
    row.append(make("td", answer.program), bar, make("td", format(answer.ms) + compiling, "left"));
    return row;
  };
  const update = () => {
    for (const [i, choice] of choices.entries()) {
      const values = [...new Set(select(i).map(answer => answer[choice.name]))];
      const chosen = values.includes(choice.value) ? choice.value : values.find(v => v === "1e-9 rad");
      choice.replaceChildren(...values.map(value => new Option(value)));
      choice.value = chosen ?? values[0];
    }
    const rows = select(choices.length).sort((one, other) => (one.ms ?? 1e99) - (other.ms ?? 1e99));
    const own = rows.find(answer => answer.code);
    line.textContent = own ? own.code : "no method of kreisel in doubles; try kr.solve(scene, t, digits=20)";
    button.hidden = !own;
    button.textContent = "Copy";
    const longest = Math.min(Math.max(...rows.map(answer => answer.ms ?? 0)), LONGEST * rows[0].ms);
    question.querySelector("table").replaceChildren(...rows.map(answer => drawRow(answer, longest)));
  };
  button.addEventListener("click", () => {
    getSelection().selectAllChildren(line);
    navigator.clipboard?.writeText(line.textContent).then(() => { button.textContent = "Copied"; });
  });
  question.addEventListener("change", update);
  question.hidden = false;
  update();
}
