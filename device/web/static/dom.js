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

/** Write "9.8 mm" so that the unit can be set smaller than the figure. */
export function setQuantity(node, figure, unit) {
  if (node.textContent === `${figure} ${unit}`) return;
  node.replaceChildren(figure, element("span", "unit", ` ${unit}`));
}
