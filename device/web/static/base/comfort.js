// What the person at the screen may set for herself: language, light or dark, sound; and a screen that stays awake.

import { byId } from "./dom.js";
import { rememberChoice, remembered } from "./memory.js";
import { LANGUAGES, chooseLanguage, language } from "./words.js";

const COLOURS = ["auto", "light", "dark"];
const sounds = { isOn: remembered("sound") !== "off", context: null };
const TONES_HZ = { step: [660], good: [660, 880], caution: [440, 440], bad: [330, 247] };
const TONE_S = 0.12;
let lock = null;

function pressed(name, values, chosen) {
  for (const value of values) byId(`${name}-${value}`).setAttribute("aria-pressed", value === chosen);
}

function useColours(chosen) {
  document.documentElement.dataset.colours = chosen;
  pressed("colours", COLOURS, chosen);
}

function useSound(isOn) {
  sounds.isOn = isOn;
  pressed("sound", ["on", "off"], isOn ? "on" : "off");
}

/** Sound a step, a good end, a caution or a fault: the operator looks at the probe. */
export function sound(kind) {
  document.documentElement.dataset.sounded = sounds.isOn ? kind : "";
  if (!sounds.isOn || !sounds.context) return;
  TONES_HZ[kind].forEach((pitch, index) => {
    const [tone, volume] = [sounds.context.createOscillator(), sounds.context.createGain()];
    const at = sounds.context.currentTime + index * 1.3 * TONE_S;
    tone.frequency.value = pitch;
    volume.gain.setValueAtTime(0.2, at);
    volume.gain.exponentialRampToValueAtTime(0.001, at + TONE_S);
    tone.connect(volume).connect(sounds.context.destination);
    tone.start(at);
    tone.stop(at + TONE_S);
  });
}

/** Keep the screen awake while a press is under way; where the browser may not, it is as before. */
export async function stayAwake(isWanted) {
  if (isWanted && !lock) {
    lock = "asked";
    lock = await navigator.wakeLock?.request("screen").catch(() => null) ?? null;
    lock?.addEventListener("release", () => { lock = null; });
  }
  if (!isWanted && lock?.release) lock.release();
}

/** Bring the page to what was chosen before, and the menu to what it changes. */
export function useComfort() {
  useColours(COLOURS.includes(remembered("colours")) ? remembered("colours") : "auto");
  useSound(sounds.isOn);
  pressed("language", Object.keys(LANGUAGES), language);
  for (const one of COLOURS) byId(`colours-${one}`).addEventListener("click", () => { useColours(one); rememberChoice("colours", one); });
  for (const one of ["on", "off"]) byId(`sound-${one}`).addEventListener("click", () => { useSound(one === "on"); rememberChoice("sound", one); });
  for (const one of Object.keys(LANGUAGES)) byId(`language-${one}`).addEventListener("click", () => chooseLanguage(one));
  // A browser lets a page sound only after somebody has touched it.
  for (const touch of ["pointerdown", "keydown"]) addEventListener(touch, () => { sounds.context ??= new AudioContext(); }, { once: true });
}
