// A USB scanner types a code faster than any hand, and ends it with Enter. So a burst of keys is told from typing, also
// while nothing is chosen, and its Enter presses no button.

const GAP_MS = 40; // between two keys of a scanner; a fast typist needs twice as long
const LEAST = 3;
let burst = "";
let lastAt = -Infinity;

function isText(node) {
  return node instanceof HTMLInputElement || node instanceof HTMLTextAreaElement;
}

/** Call onScan with every code that a scanner types, and with the field that has caught it, if any. */
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
      onScan(code, isText(document.activeElement) ? document.activeElement : null);
      return;
    }
    if (event.key.length !== 1 || event.ctrlKey || event.metaKey || event.altKey) return;
    burst = isFast ? burst + event.key : event.key;
    if (burst.length > 1 && !isText(document.activeElement)) event.preventDefault();
  }
  addEventListener("keydown", key, { capture: true });
}
