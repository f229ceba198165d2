// A keyboard on the screen, for the probe's own panel, which has none: it writes into the field that was touched. A tablet
// or a phone brings its own.

import { button, byId } from "../base/dom.js";
import { isPanel } from "../base/panel.js";
import { language, say } from "../base/words.js";

const LETTERS = {
  en: ["1234567890", "qwertyuiop", "asdfghjkl-", "zxcvbnm./"],
  de: ["1234567890", "qwertzuiop", "asdfghjklö", "yxcvbnmäü-"],
};
const SIGNS = { en: "", de: "./" }; // what the last row of keys has no room for
const box = byId("keys");
let field = null;
let isShifted = false;
let isLocked = false;

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
    if (!isLocked) shift(false);
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

/** Capitals stay in a field of numbers, which wristbands and lists have in capitals, until somebody switches them off. */
function lock(on) {
  isLocked = on && field.dataset.keys === "capitals";
  shift(on);
}

/** Put the keys away; where nothing that is needed is missing, go on as the form's own button does. */
function finish() {
  const needed = [...(field.form?.querySelectorAll("[data-needed]") ?? [])];
  const { form } = field;
  hide();
  if (needed.length && needed.every((one) => one.value.trim())) form.requestSubmit();
}

function hide() {
  box.hidden = true;
  field?.blur();
  field = null;
}

function show(wanted) {
  field = wanted;
  field.inputMode = "none"; // nor does a keyboard of the system cover this one
  (wanted.closest("dialog") ?? box.parentElement).append(box); // what lies above everything must hold its keyboard, too
  box.hidden = false;
  lock(field.dataset.keys === "capitals");
  (wanted.closest("label") ?? wanted).scrollIntoView({ block: "nearest" }); // with the words that say what is asked for
}

const rows = LETTERS[language].map((letters) => [...letters].map(key));
const last = [
  named("key-named key-shift", "⇧", "shift", () => lock(!isShifted)),
  ...[...SIGNS[language]].map(key),
  named("key-named key-space", "␣", "space", () => write(" ")),
  named("key-named", "⌫", "erase", erase),
  named("key-named key-done", "✓", "done", finish),
];
box.append(...rows.flat(), ...last);
box.addEventListener("mousedown", (event) => event.preventDefault()); // so the field stays chosen

/** Give the text fields of the page this keyboard, where the page is the panel's: a kiosk may fill it after the load. */
export function useKeyboard() {
  for (const one of document.querySelectorAll("input[data-keys]")) {
    one.addEventListener("focus", () => { if (isPanel()) show(one); });
  }
  for (const dialog of document.querySelectorAll("dialog")) dialog.addEventListener("close", () => { box.hidden = true; });
}
