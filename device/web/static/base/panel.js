// Where this page is shown: at the probe itself, and there on its panel, which has neither keyboard nor a place for files.

const LOCAL = new Set(["127.0.0.1", "localhost", "[::1]"]);

/** Whether this is a browser on the probe itself; on a laptop that runs a simulated probe it is, too. */
export const isOwnScreen = LOCAL.has(location.hostname);

/**
 * Whether this is the probe's own panel: a browser that fills its screen, as a kiosk does for good, or a touch screen
 * alone. Neither a window on a laptop is, nor does it need an address of its own that a drop-in or a link may lose; and a
 * Pi's HDMI counts as a mouse, so the touch screen alone does not tell. Source: cage's issues 422 and 524.
 */
export const isPanel = () => isOwnScreen && matchMedia("(display-mode: fullscreen), (pointer: coarse)").matches;
