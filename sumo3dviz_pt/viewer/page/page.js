// Small words for the page's elements.

/** The element of an id. */
export const $ = (id) => document.getElementById(id);

/** A new element with properties. */
export function make(tag, properties = {}) {
  return Object.assign(document.createElement(tag), properties);
}

/** Fill a select with choices, texts or [value, text], and choose one of them. */
export function fill(select, choices, chosen) {
  select.replaceChildren(...choices.map((choice) => {
    const [value, text] = Array.isArray(choice) ? choice : [choice, choice];
    return make("option", { value, textContent: text });
  }));
  select.value = chosen;
  if (select.selectedIndex < 0) select.selectedIndex = 0;
}

/** Do something once the browser is about to draw; a page that nobody sees draws nothing. */
export const soon = (act) => (document.hidden ? setTimeout(act) : requestAnimationFrame(act));

/** A number as people write it, with a real minus. */
export const number = (value, digits) => value.toFixed(digits).replace("-", "−");

/** Seconds as h:mm:ss. */
export function hours(seconds) {
  const whole = Math.floor(Math.abs(seconds));
  const two = (value) => String(value).padStart(2, "0");
  const text = `${Math.floor(whole / 3600)}:${two(Math.floor(whole / 60) % 60)}:${two(whole % 60)}`;
  return seconds < 0 ? `−${text}` : text;
}

/** Set a control's value unless somebody is about to change it. */
export function settle(control, value) {
  if (document.activeElement !== control && control.value !== String(value)) control.value = value;
}
