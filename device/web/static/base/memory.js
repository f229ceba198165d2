// What this browser remembers between loads: language, colours, sound, who examines, and whose exam is open. A browser
// that keeps nothing is as good, for one load.

const PREFIX = "tsis.";

export function remembered(name) {
  try {
    return localStorage.getItem(PREFIX + name);
  } catch {
    return null;
  }
}

export function remember(name, value) {
  try {
    if (value === null) localStorage.removeItem(PREFIX + name);
    else localStorage.setItem(PREFIX + name, value);
  } catch {
    // nothing is kept: the choice holds until the page is loaded again
  }
}
