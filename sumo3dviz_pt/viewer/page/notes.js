// What is said to the user: notes, busy, the line's state, and text to copy.

import { $, make } from "./page.js";

const STAY = 6000; // ms; warnings and errors stay until they are put away
const MOST = 4; // at once

/** A sentence begins with a capital, but no name of a file or a key does. */
const sentence = (text) => text.replace(/^[a-z](?=[a-z]* )/, (letter) => letter.toUpperCase());

/** Show a note; screen readers read it out in its turn. */
export function showNote(level, text) {
  const notes = $("notes");
  const note = make("div", { className: `note ${level}` });
  const close = make("button", { type: "button", textContent: "×", ariaLabel: "Put away" });
  close.addEventListener("click", () => note.remove());
  note.append(make("p", { textContent: sentence(text) }), close);
  notes.append(note);
  while (notes.childElementCount > MOST) notes.firstElementChild.remove();
  if (level === "info") fade(note);
}

/** Remove a note after a while, but not under somebody's pointer or focus. */
function fade(note) {
  setTimeout(() => (note.matches(":hover, :focus-within") ? fade(note) : note.remove()), STAY);
}

/** Say what keeps the viewer busy; null: nothing. */
export function showBusy(text) {
  $("busy").hidden = !text;
  $("busy").textContent = sentence(text ?? "");
  // Progress behind the colon is for eyes: read out, it would not stop.
  const said = sentence((text ?? "").split(":")[0]);
  if ($("busy-said").textContent !== said) $("busy-said").textContent = said;
}

/** Say plainly whether the viewer is there. */
export function showLine(state, reason) {
  const texts = {
    away: `${reason || "The viewer does not answer."} This page goes on by itself when it is back`
      + " at the same address.",
    gone: "The address has changed: the viewer was started anew. Open the address that it"
      + " printed.",
  };
  document.body.dataset.line = state;
  $("away").hidden = state === "open";
  $("away-text").textContent = texts[state] ?? "";
  if (state !== "open") showBusy(null);
}

/** Copy text; where the browser forbids it, show it for copying by hand. */
export async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
    showNote("info", "Camera copied as YAML. Paste it under “cameras” in the scene file.");
  } catch {
    showText(text, "The browser does not let this page copy.");
  }
}

/** Show text for copying by hand, and why. */
export function showText(text, why) {
  $("text-why").textContent = `${why} The text is selected: press Ctrl+C, or ⌘C on a Mac.`;
  $("text-content").value = text;
  $("text").showModal();
  $("text-content").select();
}
