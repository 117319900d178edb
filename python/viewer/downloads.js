// Files to download.
import { toToml } from "./text_export.js";

export function saveFile(name, ...content) {
  const a = document.createElement("a");
  a.href = URL.createObjectURL(new Blob(content));
  a.download = name;
  a.click();
  setTimeout(() => URL.revokeObjectURL(a.href), 10000);
}
// Return the source of the viewer with another scene. Escape each "<", which could end the script
// element.
const insertScene = (source, scene) =>
  source.replace(
    /(<script type="application\/json" id="scene">)[^]*?(<\/script>)/,
    (_, open, close) => open + JSON.stringify(scene).replace(/</g, "\\u003c") + close,
  );

// Return the buttons by name, each with its action and its key.
export function listDownloads(page, view, charts, source) {
  const savePicture = () => {
    view.isDirty = true;
    view.render();
    view.canvas.toBlob((blob) => saveFile("kreisel.png", blob));
  };
  return {
    Picture: [savePicture, "Control+S"],
    CSV: [() => saveFile("kreisel.csv", charts.formatCsv())],
    JSON: [() => saveFile("kreisel.json", JSON.stringify(page.scene, null, 1))],
    TOML: [() => saveFile("kreisel.toml", toToml(page.scene))],
    "This page": [() => saveFile("kreisel.html", insertScene(source, page.scene))],
    ...makeVideoButton(view),
  };
}

function makeVideoButton(view) {
  const { canvas } = view;
  const type = ["video/mp4", "video/webm"].find((type) =>
    globalThis.MediaRecorder?.isTypeSupported(type),
  );
  let recorder = null;
  const toggleRecording = ({ target }) => {
    if (recorder) return recorder.stop();
    recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: type });
    // The whole film arrives in one event, at the end.
    recorder.ondataavailable = ({ data }) => saveFile(`kreisel.${type.slice(6)}`, data);
    recorder.onstop = () => {
      recorder = null;
      view.recording = false;
      target.textContent = "Video";
    };
    recorder.start();
    view.recording = view.isDirty = true; // without a new frame the film would be empty
    target.textContent = "End video";
  };
  return type && canvas.captureStream ? { Video: [toggleRecording] } : {};
}
