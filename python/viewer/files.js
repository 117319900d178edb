// What can be taken along: files, a link, text to copy.
import { toPython, toToml } from "./scene.js";

const $ = (id) => document.getElementById(id);

function save(name, ...content) {
  const a = document.createElement("a");
  a.href = URL.createObjectURL(new Blob(content));
  a.download = name;
  a.click();
  setTimeout(() => URL.revokeObjectURL(a.href), 10000);
}
export function say(title, text) {
  $("title").textContent = title;
  $("text").value = text;
  $("dialog").showModal();
  $("text").select();
}
$("copy").addEventListener("click", () => {
  $("text").select();
  navigator.clipboard?.writeText($("text").value).catch(() => document.execCommand("copy"));
});

// The page as it came, with another scene inside. What would end the script element early is written as an escape.
const pageWith = (source, scene) =>
  source.replace(
    /(<script type="application\/json" id="scene">)[^]*?(<\/script>)/,
    (_, open, close) => open + JSON.stringify(scene).replace(/</g, "\\u003c") + close,
  );

// Each by its name: what it does, and its key.
export function fileButtons(page, view, charts, source) {
  const here = () => `${location.href.split("#")[0]}#scene=${encodeURIComponent(JSON.stringify(page.scene))}`;
  const picture = () => {
    view.dirty = true;
    view.render();
    view.canvas.toBlob((blob) => save("kreisel.png", blob));
  };
  return {
    Picture: [picture, "S"],
    CSV: [() => save("kreisel.csv", charts.csv())],
    JSON: [() => save("kreisel.json", JSON.stringify(page.scene, null, 1))],
    TOML: [() => save("kreisel.toml", toToml(page.scene))],
    "This page": [() => save("kreisel.html", pageWith(source, page.scene))],
    Link: [() => say("Link to this scene", here())],
    Python: [() => say("The same in Python", toPython(page.scene))],
    ...video(view.canvas),
  };
}

function video(canvas) {
  const type = ["video/mp4", "video/webm"].find((kind) => globalThis.MediaRecorder?.isTypeSupported(kind));
  let recorder = null;
  const click = ({ target }) => {
    if (recorder) return recorder.stop();
    recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: type });
    recorder.ondataavailable = ({ data }) => save(`kreisel.${type.slice(6)}`, data); // one piece, at the end
    recorder.onstop = () => {
      recorder = null;
      target.textContent = "Video";
    };
    recorder.start();
    target.textContent = "End video";
  };
  return type && canvas.captureStream ? { Video: [click] } : {};
}
