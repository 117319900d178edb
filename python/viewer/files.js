// What can be taken along: files, a link, text to copy.
import { toLink, toPython, toToml } from "./scene.js";

const $ = (id) => document.getElementById(id);

export function save(name, content, type = "text/plain") {
  const a = document.createElement("a");
  a.href = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  a.download = name;
  a.click();
  setTimeout(() => URL.revokeObjectURL(a.href), 10000);
}
function say(title, text) {
  $("title").textContent = title;
  $("text").value = text;
  $("dialog").showModal();
  $("text").select();
}
// The page as it came, with another scene inside. What would end the script element early is written as an escape.
export const pageWith = (source, scene) =>
  source.replace(
    /(<script type="application\/json" id="scene">)[^]*?(<\/script>)/,
    (_, open, close) => open + JSON.stringify(scene).replace(/</g, "\\u003c") + close,
  );

export function offerFiles(page, view, charts, source) {
  const offers = {
    png: () => {
      view.dirty = true;
      view.render();
      view.canvas.toBlob((blob) => save("kreisel.png", blob));
    },
    csv: () => save("kreisel.csv", charts.csv(), "text/csv"),
    json: () => save("kreisel.json", JSON.stringify(page.scene, null, 1), "application/json"),
    toml: () => save("kreisel.toml", toToml(page.scene)),
    html: () => save("kreisel.html", pageWith(source, page.scene), "text/html"),
    link: () => say("Link to this scene", `${location.href.split("#")[0]}#scene=${toLink(page.scene)}`),
    python: () => say("The same in Python", toPython(page.scene)),
  };
  for (const [id, offer] of Object.entries(offers)) $(id).addEventListener("click", offer);
  $("copy").addEventListener("click", () => {
    $("text").select();
    navigator.clipboard?.writeText($("text").value).catch(() => document.execCommand("copy"));
  });
  offerVideo(view);
  return { say };
}

function offerVideo(view) {
  const type = ["video/mp4", "video/webm"].find((kind) => globalThis.MediaRecorder?.isTypeSupported(kind));
  const button = $("video");
  button.hidden = !type || !view.canvas.captureStream;
  let recorder = null;
  button.addEventListener("click", () => {
    if (recorder) return recorder.stop();
    const parts = [];
    recorder = new MediaRecorder(view.canvas.captureStream(30), { mimeType: type });
    recorder.ondataavailable = (event) => parts.push(event.data);
    recorder.onstop = () => {
      recorder = null;
      button.textContent = "Video";
      save(`kreisel.${type.slice(6)}`, new Blob(parts, { type }));
    };
    recorder.start();
    button.textContent = "End video";
  });
}
