// A USB scanner types a code faster than any hand, and ends it with Enter. So a burst of keys is told from typing, also
// while nothing is chosen, and its Enter presses no button.

const GAP_MS = 40; // between two keys of a scanner; a fast typist needs twice as long
const LEAST = 3;
let burst = "";
let lastAt = -Infinity;
let caught = null; // the field that the burst goes into, and what stood in it before

const isText = (node) => node instanceof HTMLElement && node.matches('input[type="text"], textarea');

/** What the burst that begins now may be typed into. */
function fieldNow() {
  const field = document.activeElement;
  return isText(field) ? { field, before: field.value, at: [field.selectionStart, field.selectionEnd] } : null;
}

/** Take the burst out of its field again: what stood there was no part of the code. */
function takeOut({ field, before, at }) {
  field.value = before;
  field.setSelectionRange(...at);
  field.dispatchEvent(new Event("input", { bubbles: true }));
}

/** Call onScan with every code that a scanner types, and with the field that had the focus, if any; it stays as it was. */
export function followScanner(onScan) {
  function key(event) {
    const isFast = event.timeStamp - lastAt <= GAP_MS;
    lastAt = event.timeStamp;
    if (event.key === "Enter") {
      const code = burst.trim();
      burst = "";
      if (!isFast || code.length < LEAST) return;
      event.preventDefault();
      event.stopImmediatePropagation();
      if (caught) takeOut(caught);
      onScan(code, caught?.field ?? null);
      return;
    }
    if (event.key.length !== 1 || event.ctrlKey || event.metaKey || event.altKey) return;
    if (!isFast) [burst, caught] = ["", fieldNow()];
    burst += event.key;
    if (burst.length > 1 && !isText(document.activeElement)) event.preventDefault();
  }
  addEventListener("keydown", key, { capture: true });
}
