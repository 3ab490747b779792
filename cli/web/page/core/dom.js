// Small helpers for elements and for what is remembered in this browser.

/**
 * An element: `h("button.big", {onclick, title}, "Stop")`. Keys that are properties are set as such, others as
 * attributes.
 */
export function h(name, attributes = {}, ...children) {
  const [tag, ...classes] = name.split(".");
  const element = document.createElement(tag);
  if (classes.length) element.className = classes.join(" ");
  for (const [key, value] of Object.entries(attributes)) {
    if (value === undefined || value === false) continue;
    if (key in element && !key.startsWith("aria") && key !== "list") element[key] = value;
    else element.setAttribute(key, value === true ? "" : value);
  }
  element.append(...children.flat().filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

export function svg(name, attributes = {}, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children.flat());
  return element;
}

/** The element of this page with that selector. */
export function find(selector) {
  return /** @type {HTMLElement} */ (document.querySelector(selector));
}

/** A drawn sign, for buttons: no font has to have it. */
export function icon(path) {
  return svg(
    "svg",
    { viewBox: "0 0 16 16", width: 16, height: 16, class: "icon", "aria-hidden": "true" },
    svg("path", { d: path, fill: "currentColor" }),
  );
}

/** What was stored under this name in this browser, or the default. */
export function recall(name, otherwise) {
  try {
    return JSON.parse(localStorage.getItem(`robactor.${name}`)) ?? otherwise;
  } catch {
    return otherwise;
  }
}

export function remember(name, value) {
  try {
    localStorage.setItem(`robactor.${name}`, JSON.stringify(value));
  } catch {
    // a browser that stores nothing still works
  }
}

/** Whether the person is writing: keys are then theirs. */
export function writing(event) {
  return (
    event.target instanceof HTMLElement &&
    event.target.closest("input:not([type=range], [type=checkbox]), textarea, select, [contenteditable]") !== null
  );
}

/** A number in few characters. */
export function brief(value, digits = 3) {
  if (typeof value !== "number") return String(value);
  if (!Number.isFinite(value)) return String(value);
  return Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-3)
    ? value.toExponential(2)
    : String(Number(value.toFixed(digits)));
}

/** A message line that is read out when it changes. */
export function note(name = "p.note") {
  const element = h(name, { role: "status" });
  return {
    element,
    say(text, bad = false) {
      element.textContent = text;
      element.classList.toggle("bad", bad);
    },
  };
}
