// The picture: drawn when it comes, dragged to look around, clicked to ride.

import { soon } from "./page.js";

const CLICK = 4; // px that a hand may tremble

/**
 * @param {HTMLCanvasElement} canvas
 * @param {object} act dragged(dx, dy, width) in CSS pixels, picked(x, y) from 0 to 1
 * @returns {{show: (blob: Blob) => Promise<void>}} show ends when the picture is drawn
 */
export function watchPicture(canvas, act) {
  const context = canvas.getContext("2d", { alpha: false });
  let hold = null; // where the pointer went down, and its way since
  let way = null; // not told yet

  canvas.addEventListener("pointerdown", (event) => {
    if (event.button !== 0 || hold) return;
    canvas.setPointerCapture(event.pointerId);
    hold = { id: event.pointerId, x: event.clientX, y: event.clientY, dragging: false };
  });

  canvas.addEventListener("pointermove", (event) => {
    if (event.pointerId !== hold?.id) return;
    const dx = event.clientX - hold.x;
    const dy = event.clientY - hold.y;
    if (!hold.dragging && Math.hypot(dx, dy) < CLICK) return;
    Object.assign(hold, { dragging: true, x: event.clientX, y: event.clientY });
    canvas.classList.add("dragging");
    // Pointers report more often than anybody can look: one message per refresh.
    if (!way) soon(tell);
    way = { dx: (way?.dx ?? 0) + dx, dy: (way?.dy ?? 0) + dy };
  });

  function tell() {
    if (way) act.dragged(way.dx, way.dy, canvas.clientWidth);
    way = null;
  }

  function release(event) {
    if (event.pointerId !== hold?.id) return;
    const clicked = event.type === "pointerup" && !hold.dragging;
    hold = null;
    tell();
    canvas.classList.remove("dragging");
    if (!clicked) return;
    const box = canvas.getBoundingClientRect();
    act.picked((event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height);
  }
  canvas.addEventListener("pointerup", release);
  canvas.addEventListener("pointercancel", release);

  return {
    async show(blob) {
      const picture = await createImageBitmap(blob);
      if (canvas.width !== picture.width || canvas.height !== picture.height) {
        canvas.width = picture.width;
        canvas.height = picture.height;
      }
      context.drawImage(picture, 0, 0);
      picture.close();
    },
  };
}
