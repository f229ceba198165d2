// A keyboard on the screen, for the probe's own panel, which has none: it writes into the field that was touched. A tablet
// or a phone brings its own.

import { button, byId } from "../base/dom.js";
import { language, say } from "../base/words.js";

const LOCAL = new Set(["127.0.0.1", "localhost", "[::1]"]);
const LETTERS = {
  en: ["1234567890", "qwertyuiop", "asdfghjkl-", "zxcvbnm./"],
  de: ["1234567890", "qwertzuiop", "asdfghjklö", "yxcvbnmäü-"],
};
/** Whether this is the probe's own panel: a touch screen on the probe itself. */
const isNeeded = LOCAL.has(location.hostname) && matchMedia("(pointer: coarse)").matches;
const box = byId("keys");
let field = null;
let isShifted = false;

function write(text) {
  field.setRangeText(text, field.selectionStart, field.selectionEnd, "end");
  field.dispatchEvent(new Event("input", { bubbles: true }));
}

function erase() {
  const [start, end] = [field.selectionStart, field.selectionEnd];
  field.setRangeText("", start === end ? Math.max(start - 1, 0) : start, end, "end");
  field.dispatchEvent(new Event("input", { bubbles: true }));
}

function key(letter) {
  return button("key", letter, (event) => {
    write(event.currentTarget.textContent);
    shift(false);
  });
}

function named(className, sign, name, act) {
  const node = button(`key ${className}`, sign, act);
  node.setAttribute("aria-label", say(`keys.${name}`));
  return node;
}

function shift(on) {
  isShifted = on;
  for (const one of box.querySelectorAll(".key:not(.key-named)")) {
    one.textContent = on ? one.textContent.toUpperCase() : one.textContent.toLowerCase();
  }
  box.querySelector(".key-shift")?.setAttribute("aria-pressed", on);
}

function hide() {
  box.hidden = true;
  field?.blur();
  field = null;
}

function show(wanted) {
  field = wanted;
  (wanted.closest("dialog") ?? box.parentElement).append(box); // what lies above everything must hold its keyboard, too
  box.hidden = false;
  shift(false);
  (wanted.closest("label") ?? wanted).scrollIntoView({ block: "nearest" }); // with the words that say what is asked for
}

const rows = LETTERS[language].map((letters) => [...letters].map(key));
const last = [
  named("key-named key-shift", "⇧", "shift", () => shift(!isShifted)),
  named("key-named key-space", "␣", "space", () => write(" ")),
  named("key-named", "⌫", "erase", erase),
  named("key-named key-done", "✓", "done", hide),
];
box.append(...rows.flat(), ...last);
box.addEventListener("mousedown", (event) => event.preventDefault()); // so the field stays chosen

/** Give the text fields of the page this keyboard, where the page is the probe's own. */
export function useKeyboard() {
  if (!isNeeded) return;
  for (const one of document.querySelectorAll("input[data-keys]")) {
    one.inputMode = "none";
    one.addEventListener("focus", () => show(one));
  }
  for (const dialog of document.querySelectorAll("dialog")) dialog.addEventListener("close", () => { box.hidden = true; });
}
