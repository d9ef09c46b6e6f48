// The panels: place, light, key frames, stills.

import { $, make, number, settle } from "./page.js";

/** Let the tool bar's buttons open one panel at a time. */
export function watchPanels() {
  const buttons = [...document.querySelectorAll("[data-panel]")];
  for (const button of buttons) {
    button.addEventListener("click", () => {
      const opened = button.getAttribute("aria-expanded") === "true" ? null : button;
      for (const each of buttons) {
        each.setAttribute("aria-expanded", String(each === opened));
        $(each.dataset.panel).hidden = each !== opened;
      }
      $("panel").hidden = opened === null;
    });
  }
}

/** Place: the eye by numbers, and whom to ride. */
export function watchPlace(say) {
  $("eye").addEventListener("submit", (event) => {
    event.preventDefault();
    const value = (name) => event.target.elements[name].valueAsNumber;
    const position = ["x", "y", "z"].map(value);
    const [heading, pitch, roll, fov] = ["heading", "pitch", "roll", "fov"].map(value);
    say({ do: "eye", position, heading, pitch, roll, fov });
  });
  $("ride-form").addEventListener("submit", (event) => {
    event.preventDefault();
    say({ do: "ride", vehicle: event.target.elements.vehicle.value.trim() });
  });
  $("view-save").addEventListener("submit", (event) => {
    event.preventDefault();
    say({ do: "save", name: event.target.elements.name.value.trim() });
  });
  $("yaml").addEventListener("click", () => say({ do: "yaml" }));
}

/** Offer names for cameras that no camera has. */
export function offerNames(taken) {
  for (const form of [$("view-save"), $("keyframe-save")]) {
    const { name } = form.elements;
    const stem = name.value.trim().replace(/\d+$/, "") || name.defaultValue;
    for (let next = 2; taken.includes(name.value.trim()); next += 1) name.value = `${stem}${next}`;
  }
}

/** Show where the eye is, unless its numbers are being edited. */
export function showPlace({ position, heading, pitch, roll, fov }) {
  const [x, y, z] = position;
  if (!$("place").hidden && !$("eye").contains(document.activeElement)) {
    const values = { x, y, z, heading, pitch, roll, fov };
    for (const [name, value] of Object.entries(values)) {
      settle($("eye").elements[name], Number(value.toFixed(2)));
    }
  }
  $("where").textContent = position.map((value) => number(value, 1)).join(", ") + " m";
  $("whither").textContent = `${number(heading, 0)}°, ${number(pitch, 0)}°`;
}

/** Light: sky, weather, template, exposure. */
export function watchLight(say) {
  $("sky").addEventListener("change", ({ target }) => {
    if (target.value) say({ do: "sky", preset: target.value });
  });
  $("weather").addEventListener("change", ({ target }) => {
    say({ do: "weather", preset: target.value });
  });
  $("template").addEventListener("change", ({ target }) => {
    if (target.value) say({ do: "template", name: target.value });
  });
  $("exposure").addEventListener("input", () => {
    showExposure();
    say({ do: "exposure", ev: $("exposure").valueAsNumber });
  });
}

/** The exposure's value in words. */
export function showExposure() {
  const ev = $("exposure").valueAsNumber;
  const text = `${ev > 0 ? "+" : ""}${number(ev, 2)} EV`;
  $("exposure-value").textContent = text;
  $("exposure").setAttribute("aria-valuetext", text);
}

/** Key frames: dropped, played, saved. */
export function watchKeyFrames(say) {
  const act = (name, more = {}) => say({ do: "keyframe", act: name, ...more });
  $("keyframe-add").addEventListener("click", () => act("add"));
  $("keyframe-clear").addEventListener("click", () => act("clear"));
  $("keyframe-play").addEventListener("click", () => {
    const playing = $("keyframe-play").getAttribute("aria-pressed") === "true";
    act(playing ? "stop" : "play");
  });
  $("keyframe-save").addEventListener("submit", (event) => {
    event.preventDefault();
    act("save", { name: event.target.elements.name.value.trim() });
  });
}

/** Whether the key frames are being played. */
export function showFlight(playing) {
  $("keyframe-play").setAttribute("aria-pressed", String(playing));
  $("keyframe-play").textContent = playing ? "Stop" : "Play";
}

/** List the key frames; each can be gone to and removed. */
export function showKeyFrames(frames, { say, goTo }) {
  $("keyframes").replaceChildren(...frames.map((frame, index) => {
    const [x, y, z] = frame.position.map((value) => number(value, 1));
    const go = make("button", { type: "button", className: "plain grow" });
    go.append(
      make("strong", { textContent: `${number(frame.time, 1)} s` }),
      make("span", { textContent: ` ${x}, ${y}, ${z} m · ${number(frame.heading, 0)}°` }),
    );
    go.title = "Go there";
    go.addEventListener("click", () => goTo(frame));
    const remove = make("button", { type: "button", textContent: "×" });
    remove.ariaLabel = `Remove key frame ${index + 1}`;
    remove.addEventListener("click", () => say({ do: "keyframe", act: "remove", index }));
    const item = make("li", { className: "row" });
    item.append(go, remove);
    return item;
  }));
  $("path-empty").hidden = frames.length > 0;
  $("keyframe-clear").disabled = frames.length === 0;
  $("keyframe-play").disabled = frames.length < 2;
  $("keyframe-save").querySelector("button").disabled = frames.length < 2;
}

/** Add a finished still on top of the list. */
export function showStill({ url, text }) {
  const link = make("a", { href: url, target: "_blank" });
  link.append(make("img", { src: url, alt: "" }), make("span", { textContent: text }));
  const item = make("li");
  item.append(link);
  $("still-list").prepend(item);
}
