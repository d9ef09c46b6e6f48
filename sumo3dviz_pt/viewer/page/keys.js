// Keys and the buttons on the picture that stand for them.

const MOVES = new Set([
  "KeyW", "KeyA", "KeyS", "KeyD", "KeyR", "KeyF", "KeyI", "KeyJ", "KeyK", "KeyL",
  "ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight", "ShiftLeft", "ShiftRight",
]);

/**
 * Watch the keyboard. Codes name places on the keyboard: WASD is a cross on any layout.
 *
 * @param {HTMLElement} picture keys act while it has the focus, or nothing has
 * @param {HTMLElement} pad holds buttons with data-code
 * @param {(codes: string[]) => void} moved told the held movement keys when they change
 * @param {Object<string, () => void>} commands by code
 */
export function watchKeys(picture, pad, moved, commands) {
  const held = new Set();
  let told = "";

  function tell() {
    const codes = [...held].sort();
    if (codes.join() === told) return;
    told = codes.join();
    moved(codes);
  }

  function release() {
    held.clear();
    tell();
  }

  document.addEventListener("keydown", (event) => {
    const focus = document.activeElement;
    if (event.code === "Escape" && focus !== picture && !focus?.closest("dialog")) {
      picture.focus({ preventScroll: true });
      if (focus !== document.body) return;
    }
    if (focus && focus !== picture && focus !== document.body) return;
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    if (MOVES.has(event.code)) held.add(event.code);
    else if (commands[event.code]) { if (!event.repeat) commands[event.code](); }
    else return;
    event.preventDefault();
    tell();
  });

  document.addEventListener("keyup", (event) => {
    // While a Mac's command key is down, other keys are never reported as released.
    if (event.key === "Meta") release();
    held.delete(event.code);
    tell();
  });

  window.addEventListener("blur", release);
  picture.addEventListener("blur", release);
  document.addEventListener("visibilitychange", release);
  watchPad(pad, held, tell);
  return { release };
}

/** Buttons act while they are held, by pointer, Enter or space. */
function watchPad(pad, held, tell) {
  const press = (button) => { held.add(button.dataset.code); tell(); };
  const lift = (button) => { held.delete(button.dataset.code); tell(); };
  for (const button of pad.querySelectorAll("button")) {
    button.addEventListener("pointerdown", (event) => {
      button.setPointerCapture(event.pointerId);
      press(button);
    });
    for (const end of ["pointerup", "pointercancel", "blur", "keyup"]) {
      button.addEventListener(end, () => lift(button));
    }
    button.addEventListener("keydown", (event) => {
      if (event.code !== "Enter" && event.code !== "Space") return;
      event.preventDefault();
      press(button);
    });
    button.addEventListener("contextmenu", (event) => event.preventDefault());
  }
}
