// What a visitor can take along: files, and a link.
import { plain } from "./scene.js";
import { toToml } from "./words.js";

function save(name, ...content) {
  const a = document.createElement("a");
  a.href = URL.createObjectURL(new Blob(content));
  a.download = name;
  a.click();
  setTimeout(() => URL.revokeObjectURL(a.href), 10000);
}
// Makes the page as it came, with another scene inside. Each "<" is written as an escape, for one
// might end the script element early.
const pageWith = (source, scene) =>
  source.replace(
    /(<script type="application\/json" id="scene">)[^]*?(<\/script>)/,
    (_, open, close) => open + JSON.stringify(scene).replace(/</g, "\\u003c") + close,
  );

// Returns a scene without what `complete` would fill in again, for a shorter link.
function shortened(scene) {
  const isOwn = ([key, value]) =>
    key === "version" || JSON.stringify(value) !== JSON.stringify(plain[key]);
  return Object.fromEntries(Object.entries(scene).filter(isOwn));
}

// Returns the buttons by their names, each with what it does and its key.
export function fileButtons(page, view, charts, source) {
  const link = () => {
    try {
      const scene = encodeURIComponent(JSON.stringify(shortened(page.scene)));
      history.replaceState(null, "", `#scene=${scene}`);
      page.say("The address of this page is now a link to this scene");
    } catch {
      page.say("A page in a notebook has no address: save “This page” instead");
    }
  };
  const picture = () => {
    view.dirty = true;
    view.render();
    view.canvas.toBlob((blob) => save("kreisel.png", blob));
  };
  return {
    Picture: [picture, "Control+S"],
    CSV: [() => save("kreisel.csv", charts.csv())],
    JSON: [() => save("kreisel.json", JSON.stringify(page.scene, null, 1))],
    TOML: [() => save("kreisel.toml", toToml(page.scene))],
    "This page": [() => save("kreisel.html", pageWith(source, page.scene))],
    Link: [link],
    ...video(view),
  };
}

function video(view) {
  const { canvas } = view;
  const type = ["video/mp4", "video/webm"].find((type) =>
    globalThis.MediaRecorder?.isTypeSupported(type),
  );
  let recorder = null;
  const click = ({ target }) => {
    if (recorder) return recorder.stop();
    recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: type });
    // It comes in one piece, at the end.
    recorder.ondataavailable = ({ data }) => save(`kreisel.${type.slice(6)}`, data);
    recorder.onstop = () => {
      recorder = null;
      view.recording = false;
      target.textContent = "Video";
    };
    recorder.start();
    view.recording = view.dirty = true; // or a picture that stands still gives no film
    target.textContent = "End video";
  };
  return type && canvas.captureStream ? { Video: [click] } : {};
}
