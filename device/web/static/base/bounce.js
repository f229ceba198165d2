// A finger in a glove bounces: it touches twice where once was meant. What the first touch has brought under the finger is
// not what it was put there for, so a second one there does nothing; deliberate touches are at other places, or later.

const BOUNCE_MS = 600;
const NEAR_PX = 40; // about as wide as a fingertip
const NONE = { at: -Infinity, x: 0, y: 0, node: null };
let first = NONE;

/** What a click acts on; one on a label's words comes again from the box in it. */
const actsOn = (target) => target.closest("button, a, label") ?? target;

function isBounce(event, once) {
  const [node, { clientX: x, clientY: y }] = [actsOn(event.target), event];
  if (node === first.node) return node === once && event.detail > 1;
  const isSoonAndNear = performance.now() - first.at < BOUNCE_MS && Math.hypot(x - first.x, y - first.y) < NEAR_PX;
  return isSoonAndNear && !isStillThere(first);
}

/** Whether nothing else has come under the finger: who types fast on the page's keys means the next one, too. */
function isStillThere({ x, y, node }) {
  const found = document.elementFromPoint(x, y);
  return found !== null && actsOn(found) === node;
}

/** Ignore the second touch of a finger that bounces onto another thing; onto the button `once`, also when it is the same. */
export function ignoreBounces(once) {
  function click(event) {
    if (event.detail === 0) return; // a key
    if (isBounce(event, once)) {
      event.preventDefault();
      event.stopImmediatePropagation();
    } else {
      first = { at: performance.now(), x: event.clientX, y: event.clientY, node: actsOn(event.target) };
    }
  }
  addEventListener("click", click, { capture: true });
  addEventListener("keydown", () => { first = NONE; }, { capture: true }); // typed or scanned in between: no bounce
}
