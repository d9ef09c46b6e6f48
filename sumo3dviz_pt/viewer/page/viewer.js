// The page's conductor: what the user does becomes an order, what comes back is shown.

import { watchKeys } from "./keys.js";
import { openLine } from "./line.js";
import { copyText, showBusy, showLine, showNote, showText } from "./notes.js";
import { $, fill, hours, number, settle, soon } from "./page.js";
import {
  offerNames, showExposure, showFlight, showKeyFrames, showPlace, showStill,
  watchKeyFrames, watchLight, watchPanels, watchPlace,
} from "./panels.js";
import { watchPicture } from "./picture.js";

const LEISURE = 1000; // ms between pictures while nobody can see the page
const CALM = 700; // ms for which older pictures do not move the slider back
const SHARED = new Set(["sky", "weather", "template"]);
const STICKY = new Set(["dynamic", "denoise", "exposure", "speed", ...SHARED]);

// For tests and measurements, which read it; the page itself only writes here.
const seen = { frame: null, pictures: 0, latency: [], keyframes: [] };
window.viewer = seen;

let about = null; // the scene, as told last
let original = null; // and at first
let returned = false; // the line was cut, and what the viewer knew of us is lost
let view = ""; // of the ride that was asked for; a camera brings its own
let flight = "off"; // along the key frames: "off", "asked" or "on"
let input = 0; // number of the newest movement
let waiting = null; // the oldest movement that no picture shows yet, with its time
const choices = new Map(); // sticky orders, told again to a viewer that was restarted

const picture = watchPicture($("picture"), {
  dragged: (dx, dy, width) => steer({ do: "drag", dx, dy, width }),
  picked: (x, y) => say({ do: "pick", x, y }),
});

const line = openLine({
  note: hear,
  picture: show,
  state(name, reason) {
    showLine(name, reason);
    if (name === "open") returned = about !== null;
    else keys.release();
  },
});

// Orders ----------------------------------------------------------------------------------

function say(order) {
  if (STICKY.has(order.do)) {
    choices.delete(order.do); // the newest goes last: a template brings a sky of its own
    choices.set(order.do, order);
  }
  if (order.do === "camera") view = "";
  if (order.do === "pick") view = "chase";
  if (order.do === "ride") view = order.view ?? "chase";
  if (order.act === "play") flight = "asked";
  if (["eye", "leave"].includes(order.do)) $("camera").value = "";
  return line.say(order);
}

function steer(order) {
  input += 1;
  waiting ??= { id: input, since: performance.now() };
  $("camera").value = "";
  say({ ...order, id: input });
}

function toCamera(index) {
  const name = about?.cameras[index];
  if (name === undefined) return;
  $("camera").value = name;
  say({ do: "camera", name });
}

function takeStill() {
  say({ do: "still", quality: $("quality").value });
}

function press(button, order) {
  const on = button.getAttribute("aria-pressed") !== "true";
  button.setAttribute("aria-pressed", String(on));
  say({ do: order, on });
}

function help() {
  if ($("help").open) $("help").close();
  else $("help").showModal();
}

const play = () => say({ do: "play", on: !seen.frame?.playing });
// Of a simulation that runs, one step is one of its own.
const step = (count) => say({ do: "step", frames: count * (about?.stride ?? 1) });
const commands = {
  Space: play,
  Comma: () => step(-1),
  Period: () => step(1),
  KeyH: help,
  KeyP: takeStill,
  KeyC: () => say({ do: "yaml" }),
  Enter: () => say({ do: "pick", x: 0.5, y: 0.5 }),
  Escape: () => { if (seen.frame?.riding != null) say({ do: "leave" }); },
};
for (let digit = 1; digit <= 9; digit += 1) {
  commands[`Digit${digit}`] = commands[`Numpad${digit}`] = () => toCamera(digit - 1);
}
const keys = watchKeys($("picture"), $("pad"), (down) => steer({ do: "keys", down }), commands);

// News ------------------------------------------------------------------------------------

async function show(info, blob) {
  try {
    await picture.show(blob);
  } catch {
    showNote("error", "A picture could not be read.");
  }
  // Only now may the next one come.
  const ready = () => line.say({ ack: info.seq });
  if (document.hidden) setTimeout(ready, LEISURE);
  else ready();
  if (waiting && info.id >= waiting.id) {
    seen.latency.push(performance.now() - waiting.since);
    waiting = null;
  }
  if (seen.pictures === 0) showBusy(null);
  seen.frame = info;
  seen.pictures += 1;
  showFrame(info);
}

function showFrame({ spp, error, ms, time, eye, riding, playing, denoised }) {
  $("spp").textContent = denoised ? `${spp}, denoised` : spp;
  if (error != null) $("error").textContent = `±${number(error, error < 10 ? 1 : 0)} of 255`;
  else if (spp === 1) $("error").textContent = "–"; // later ones without keep the last
  $("ms").textContent = `${Math.round(ms)} ms`;
  showTime(time);
  showPlace(eye);
  $("play").setAttribute("aria-label", playing ? "Pause" : "Play");
  $("play").classList.toggle("playing", playing);
  showRide(riding);
  showFlying(playing);
}

function showTime(time) {
  settle($("clock"), Number(time.toFixed(2)));
  if (!dragging && performance.now() > slid + CALM) $("time").value = time;
  const text = hours(time);
  if ($("hours").textContent === text) return;
  $("hours").textContent = text;
  $("time").setAttribute("aria-valuetext", `${text}, ${number(time, 1)} seconds`);
}

function showRide(riding) {
  $("ride").hidden = riding == null;
  $("pad").hidden = riding != null;
  $("ride-who").textContent = riding ?? "";
  settle($("ride-view"), view);
  if (riding != null && view) $("camera").value = "";
}

function showFlying(playing) {
  if (flight === "asked" && playing) flight = "on";
  else if (flight === "on" && !playing) flight = "off";
  showFlight(flight !== "off");
}

function showScene(news) {
  const first = about === null;
  about = news;
  original ??= news;
  document.title = `${about.title} · sumo3dviz_pt`;
  $("title").textContent = $("title").title = about.title;
  $("picture").setAttribute("aria-label", `Picture of ${about.title}`);
  const [width, height] = about.size;
  $("frame").style.setProperty("--ratio", width / height);
  $("time").step = 1 / about.fps;
  showSpan(about);
  showChoices(first);
  offerNames(about.cameras);
  if (returned) restore();
}

/** What can be shown now; of a simulation that runs, also who has entered last. */
function showSpan({ begin, end, running, users, trouble }) {
  Object.assign($("time"), { min: begin, max: end });
  Object.assign($("clock"), { min: begin, max: end });
  if (!running && !users && !trouble) return;
  $("running").hidden = false;
  $("running").textContent = trouble || (running ? `runs, ${number(end, 0)} s` : "has ended");
  $("users").replaceChildren(...(users ?? []).map((name) => new Option(name)));
}

function showChoices(first) {
  const before = first ? about.cameras[0] : $("camera").value;
  const numbered = about.cameras.map((name, k) => [name, k < 9 ? `${k + 1}  ${name}` : name]);
  fill($("camera"), [["", "free"], ...numbered], before ?? "");
  // What the scene file describes in its own words is no preset to go back to.
  const own = [["", "of the scene file"]];
  fill($("sky"), [...(about.sky ? [] : own), ...about.skies], about.sky ?? "");
  fill($("weather"), [...own, ...about.weathers], about.weather);
  fill($("template"), [...(about.template ? [] : own), ...about.templates], about.template ?? "");
  $("template").disabled = about.templates.length === 0;
  fill($("ride-view"), [["", "its own view"], ...about.views], view);
  if (!first) return;
  fill($("quality"), about.qualities, "standard");
  showExposure();
}

/** Bring a restarted viewer, which knows nothing of us, to where we were. */
function restore() {
  returned = false;
  waiting = null;
  const { frame, keyframes } = seen;
  // Sky, weather and template are everybody's: only a viewer that has lost them is told again.
  const lost = [...SHARED].every((name) => about[name] === original[name]);
  for (const order of choices.values()) if (lost || !SHARED.has(order.do)) line.say(order);
  for (const key of keyframes) {
    goTo({ fov: frame?.eye.fov, ...key });
    line.say({ do: "keyframe", act: "add" });
  }
  if (!frame) return;
  goTo({ time: frame.time, ...frame.eye });
  if (frame.riding != null) line.say({ do: "ride", vehicle: frame.riding, view: view || "chase" });
}

/** Stand at a key frame's place and time. */
function goTo({ time, position, heading, pitch, roll = 0, fov = 50 }) {
  line.say({ do: "time", value: time });
  line.say({ do: "eye", position, heading, pitch, roll, fov });
}

function hear(news) {
  const kinds = {
    scene: () => showScene(news),
    span: () => showSpan(news),
    note: () => showNote(news.level, news.text),
    busy: () => showBusy(news.text),
    yaml: () => (news.why ? showText(news.text, `Not saved: ${news.why}.`) : copyText(news.text)),
    keyframes: () => {
      seen.keyframes = news.frames;
      showKeyFrames(news.frames, { say, goTo });
    },
    still: () => showStill(news),
  };
  kinds[news.kind]?.();
}

// Controls --------------------------------------------------------------------------------

let dragging = false; // the time slider
let slid = -CALM; // when it was moved
let wanted = null; // time asked for, told once per refresh
let pointing = false; // the last input was a pointer's

$("time").addEventListener("input", () => {
  slid = performance.now();
  if (wanted === null) {
    soon(() => { say({ do: "time", value: wanted }); wanted = null; });
  }
  wanted = $("time").valueAsNumber;
});
$("time").addEventListener("pointerdown", () => { dragging = true; });
for (const end of ["pointerup", "pointercancel"]) {
  $("time").addEventListener(end, () => { dragging = false; toPicture(); });
}
$("clock").addEventListener("change", () => {
  if ($("clock").value !== "") say({ do: "time", value: $("clock").valueAsNumber });
});
$("clock").addEventListener("keydown", (event) => {
  if (event.code === "Enter") toPicture();
});
$("camera").addEventListener("change", () => {
  if ($("camera").value) say({ do: "camera", name: $("camera").value });
});
$("traffic").addEventListener("click", () => press($("traffic"), "dynamic"));
$("denoise").addEventListener("click", () => press($("denoise"), "denoise"));
$("play").addEventListener("click", play);
$("speed").addEventListener("change", () => {
  say({ do: "speed", factor: Number($("speed").value) });
});
$("back").addEventListener("click", () => step(-1));
$("on").addEventListener("click", () => step(1));
$("still").addEventListener("click", takeStill);
$("ride-view").addEventListener("change", () => {
  const wanted = $("ride-view").value;
  if (wanted) say({ do: "ride", vehicle: seen.frame.riding, view: wanted });
});
$("ride-leave").addEventListener("click", () => say({ do: "leave" }));
$("help-open").addEventListener("click", help);
$("help").addEventListener("keydown", (event) => {
  if (event.code !== "KeyH") return;
  event.stopPropagation(); // closed by now: the picture would open it again
  help();
});

// Who works with the pointer keeps the keys in the picture; who tabs keeps the focus.
const toPicture = () => $("picture").focus({ preventScroll: true });
addEventListener("pointerdown", () => { pointing = true; }, true);
addEventListener("keydown", () => { pointing = false; }, true);
addEventListener("mousedown", (event) => {
  if (event.target.closest("button") && !event.target.closest("dialog")) event.preventDefault();
});
addEventListener("change", (event) => {
  if (pointing && event.target.matches("select, input[type=range]")) toPicture();
});

watchPanels();
watchPlace(say);
watchLight(say);
watchKeyFrames(say);
