// The words of one language, from words/LANGUAGE.json, and numbers and times as that language writes them. What the
// daemon says in English (words/sentences.json) is recognised by its form, and said in the operator's words.

import { remembered, rememberChoice } from "./memory.js";

export const LANGUAGES = { en: "English", de: "Deutsch" };

const LOCALES = { en: "en-GB", de: "de-DE" };
const wanted = [remembered("language"), ...navigator.languages.map((one) => one.slice(0, 2)), "en"];
export const language = wanted.find((one) => one in LANGUAGES);
const locale = LOCALES[language];

const load = async (name) => (await fetch(`/static/words/${name}.json`)).json();
const [words, sentences] = await Promise.all([load(language), load("sentences")]);

export async function chooseLanguage(chosen) {
  await rememberChoice("language", chosen);
  location.reload();
}

const filled = (text, values) => text.replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);

/** A figure and its unit stay on one line. */
const together = (text) => text.replace(/([\d}]) (?=(?:%|mm|kPa|N|s)(?![\w]))/g, "$1\u00a0");

/** The words of a key with its {values}; a key without words is shown itself, and a test finds it. */
export const say = (key, values = {}) => together(filled(words[key] ?? key, values));
export const isSaid = (key) => key in words;

/** Fill the page's own texts: data-say, data-say-label, data-say-title and data-say-alt hold keys. */
export function sayPage(root = document) {
  document.documentElement.lang = language;
  for (const node of root.querySelectorAll("[data-say]")) node.textContent = say(node.dataset.say);
  for (const node of root.querySelectorAll("[data-say-label]")) node.setAttribute("aria-label", say(node.dataset.sayLabel));
  for (const node of root.querySelectorAll("[data-say-title]")) node.title = say(node.dataset.sayTitle);
  for (const node of root.querySelectorAll("[data-say-alt]")) node.alt = say(node.dataset.sayAlt);
}

/** A number with so many decimals, as the language writes it. */
export function figure(number, decimals) {
  const text = number.toLocaleString(locale, { minimumFractionDigits: decimals, maximumFractionDigits: decimals, useGrouping: false });
  return /[1-9]/.test(text) ? text : text.replace(/^[-\u2212]/, "");
}

/** A number as it was computed, with four digits at least, as the language writes it. */
export const exact = (number) => number.toLocaleString(locale, Number.isInteger(number) ? { useGrouping: false } : { maximumSignificantDigits: 4, useGrouping: false });

const DAY = { year: "numeric", month: "2-digit", day: "2-digit" };
const MINUTE = { hour: "2-digit", minute: "2-digit" };

/** A moment (RFC 3339) in local time with its zone. */
export const moment = (at) => new Date(at).toLocaleString(locale, { ...DAY, ...MINUTE, timeZoneName: "short" });
/** The same with the day of the week and without the zone, as people speak of it. */
export const spokenMoment = (at) => new Date(at).toLocaleString(locale, { weekday: "long", ...DAY, ...MINUTE });
export const day = (at) => new Date(at).toLocaleDateString(locale, DAY);
export const clock = (at) => new Date(at).toLocaleTimeString(locale, MINUTE);

const DICOM_TIME = /^(\d{4})(\d{2})(\d{2})[ T]?(?:(\d{2})(\d{2}))?/;

/** A day as DICOM writes it, YYYYMMDD, as the language does; what is none stays as it is. */
export function dicomDay(text) {
  const [, year, month, date] = DICOM_TIME.exec(text) ?? [];
  return year ? new Date(year, month - 1, date).toLocaleDateString(locale, DAY) : text;
}

/** The hour and minute of a moment as DICOM writes it, "" where it has none. */
export function dicomTime(text) {
  const [, year, month, date, hour, minute] = DICOM_TIME.exec(text) ?? [];
  return hour ? new Date(year, month - 1, date, hour, minute).toLocaleTimeString(locale, MINUTE) : "";
}

const asPattern = (text) => text.replace(/[.*+?^$()|[\]\\]/g, "\\$&").replace(/\{(\w+)\}/g, "(?<$1>.+?)");
const isRemedy = ([key]) => key.startsWith("remedy.");
const isKept = ([key]) => key.startsWith("kept.");
const known = Object.entries(sentences);
const patterns = known.filter((one) => !isRemedy(one) && !isKept(one)).map(([key, text]) => [key, new RegExp(`^${asPattern(text)}(?=\\s|$)`)]);
const remedies = known.filter(isRemedy).map(([key, text]) => [key, new RegExp(`^${asPattern(text)}$`)]);

/** A number that the daemon wrote, as the language writes it; what is none stays as it is. */
export function spokenNumber(value) {
  const number = /^(-?\d+(?:\.(\d+))?)( ?%?)$/.exec(value);
  return number ? figure(Number(number[1]), number[2]?.length ?? 0) + (number[3] ? "\u00a0%" : "") : value;
}

function spokenValue(value) {
  if (spokenNumber(value) !== value) return spokenNumber(value);
  return value.split(" and ").map((part) => words[`value.${part}`] ?? part).join(` ${words.and} `);
}

const firstOf = (kinds, text) => kinds.map(([key, pattern]) => [key, pattern.exec(text)]).find(([, hit]) => hit) ?? [];
const valuesOf = (hit, spoken) => Object.fromEntries(Object.entries(hit.groups ?? {}).map(([name, value]) => [name, spoken(value)]));

/** What the daemon's sentences say: {do, why}, each a sentence or "", or null when one of them is not known. */
export function understand(text) {
  const said = { do: "", why: [] };
  let rest = text.trim();
  while (rest) {
    const [key, hit] = firstOf(patterns, rest);
    if (!hit) return null;
    const values = valuesOf(hit, spokenValue);
    said.do = say(`reason.${key}.do`, values) || said.do;
    said.why.push(say(`reason.${key}.why`, values));
    rest = rest.slice(hit[0].length).trim();
  }
  return { do: said.do, why: said.why.join(" ") };
}

/** What to do about a check that was not passed, or null when the daemon's sentence is not known. */
export function understandRemedy(text) {
  const [key, hit] = firstOf(remedies, text);
  return hit ? say(key, valuesOf(hit, spokenNumber)) : null;
}

/** A reason as it is kept, in English whoever gives it, so that each language can say it again. */
export const reasonToKeep = (name) => sentences[`kept.${name}`];

/** A reason that was kept; what somebody has written freely stays as it is. */
export function keptReason(text) {
  const [key] = known.filter(isKept).find(([, kept]) => kept === text) ?? [];
  return key ? say(key.replace("kept.", "void.")) : text;
}

const REMEDIES = { E211: /^Wait (?<s>\d+) s:/ };

/** What to do about a fault that ends by itself, with how long that takes; null where the daemon does not say it. */
export function understandRest(code, remedy) {
  const hit = REMEDIES[code]?.exec(remedy);
  return hit ? say(`fault.${code}.do_s`, hit.groups) : null;
}
