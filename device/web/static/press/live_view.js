// What the camera sees while a press is under way, to see dirt, light and where the probe stands. The stream is asked for
// only while its picture is in sight: not between presses, not on a page in the background, not where a warning has its room.

import { byId } from "../base/dom.js";
import { liveUrl } from "../base/probe.js";

const image = byId("live");
const box = byId("live-view");
let isWanted = false;

function follow() {
  box.hidden = !isWanted;
  // A stream that never ends would keep the page loading.
  const isSeen = isWanted && document.readyState === "complete" && document.visibilityState === "visible" && image.checkVisibility();
  if (isSeen && !image.hasAttribute("src")) image.src = liveUrl;
  if (!isSeen && image.hasAttribute("src")) image.removeAttribute("src"); // ends the stream, too
}

/** Show the live picture while the probe takes images. */
export function showLive(mayTakeImages) {
  isWanted = mayTakeImages;
  follow();
}

document.addEventListener("visibilitychange", follow);
addEventListener("resize", follow);
