// The focus is never lost: when what has it goes out of reach, the main button has it, or the heading of the page that lies
// above everything.

let last = null;
addEventListener("focusin", ({ target }) => { last = target; });

const isOutOfReach = (node) => !node.isConnected || !node.checkVisibility() || node.closest("[inert]") !== null;

/** Give the focus to what comes instead of what had it, if that is gone; who has clicked beside everything keeps that. */
export function keepFocus(instead) {
  const nobody = document.activeElement === null || document.activeElement === document.body;
  if (!nobody || last === null || !isOutOfReach(last)) return;
  const heading = [...document.querySelectorAll("dialog[open] h2")].at(-1);
  if (heading) heading.tabIndex = -1;
  (heading ?? instead).focus({ preventScroll: true });
}

/** Follow every act of the person: what an act hides must not take the focus with it. */
export function followFocus(instead) {
  for (const act of ["click", "close"]) addEventListener(act, () => requestAnimationFrame(() => keepFocus(instead)), { capture: true });
}
