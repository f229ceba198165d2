// The page's only ways to write: text, never markup, and only what changed, since 10 to 20 statuses arrive a second.

export const byId = (id) => document.getElementById(id);

export function setText(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

export function setAttribute(node, name, value) {
  if (node.getAttribute(name) !== String(value)) node.setAttribute(name, value);
}

/** A new element with a class and, if given, a text. */
export function element(tag, className, text = "") {
  const node = document.createElement(tag);
  node.className = className;
  node.textContent = text;
  return node;
}

/** A new button that does something. */
export function button(className, text, act) {
  const node = element("button", className, text);
  node.type = "button";
  node.addEventListener("click", act);
  return node;
}

const SVG = "http://www.w3.org/2000/svg";

/** A new element of a drawing, with its attributes. */
export function drawn(tag, attributes, text = "") {
  const node = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.textContent = text;
  return node;
}

/** Write "9.8 mm" so that the unit can be set smaller than the figure. */
export function setQuantity(node, figure, unit) {
  if (node.textContent === `${figure} ${unit}`) return;
  node.replaceChildren(figure, element("span", "unit", ` ${unit}`));
}

/** Disable a button without taking the focus away from it, as the attribute `disabled` would. */
export function setEnabled(node, isEnabled) {
  setAttribute(node, "aria-disabled", !isEnabled);
}

export const isEnabled = (node) => node.getAttribute("aria-disabled") !== "true";
