// The probe's REST interface: the stream of statuses, presses, measurements, exams. Paths and fields: docs of /api/v1.

import { isSaid, say } from "./words.js";

const API = "/api/v1";
const SILENCE_MS = 2000; // a status arrives at least twice a second: after this long the figures are old
const REOPEN_MS = 3000;
const WATCH_MS = 250;
const ANSWER_MS = 5000;
const HOSPITAL_MS = 30000; // another machine answers, or does not
const RELEASE_MS = 600000; // a slow stick
const AGAIN_MS = 60000; // what is asked for again later is another wish

/** Load the page anew when it is no longer the daemon that answers, but what stands in for it and says why. */
async function loadFallback() {
  const response = await fetch("/fallback/state", { signal: AbortSignal.timeout(ANSWER_MS) }).catch(() => null);
  if (response?.ok) location.reload();
}

/** Call onStatus with each status, onChange when exams or measurements have changed, onSilence while nothing arrives. */
export function followStatus(onStatus, onSilence, onChange) {
  let source = null;
  let openedAt = 0;
  let heardAt = performance.now();

  function open() {
    source?.close();
    openedAt = performance.now();
    source = new EventSource(`${API}/events`);
    source.addEventListener("status", (event) => {
      const status = JSON.parse(event.data);
      heardAt = performance.now();
      onStatus(status);
    });
    for (const kind of ["exam", "measurement"]) source.addEventListener(kind, onChange);
  }

  // EventSource gives up for good after an HTTP error and never notices a pulled cable, so the page reopens it itself.
  function watch() {
    const now = performance.now();
    if (now - heardAt <= SILENCE_MS) return;
    onSilence();
    if (now - openedAt <= REOPEN_MS) return;
    loadFallback();
    open();
  }

  open();
  setInterval(watch, WATCH_MS);
}

/** An answer that was none: `message` is the operator's sentence, `service` what the daemon said, `status` HTTP's. */
class Refused extends Error {
  constructor({ code = "", detail = "", remedy = "", title = "" }, status) {
    const known = isSaid(`fault.${code}.do`) ? `${say(`fault.${code}.is`)}. ${say(`fault.${code}.do`)}` : "";
    super(known || say("problem.other", { code: code || status }));
    this.code = code;
    this.status = status;
    this.service = [code, detail || title, remedy].filter(Boolean).join(" ");
  }
}

async function ask(method, path, body, { headers = {}, type = "application/json", withinMs = ANSWER_MS } = {}) {
  const signal = AbortSignal.timeout(withinMs);
  const options = { method, body, headers: { "Content-Type": type, ...headers }, signal };
  const response = await fetch(API + path, options).catch(() => {
    throw new Error(say("no_answer"));
  });
  if (!response.ok) throw new Refused(await response.json().catch(() => ({})), response.status);
  return response;
}

const asJson = async (asked) => (await asked).json();
const post = (path, body, headers) => asJson(ask("POST", path, JSON.stringify(body), { headers }));
const get = (path) => asJson(ask("GET", path));
const of = encodeURIComponent;
const seen = ({ version }) => ({ "If-Match": `"${version}"` });

/** A name for one request; no secure context is needed for it. */
function newKey() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return [...bytes].map((one) => one.toString(16).padStart(2, "0")).join("");
}

const unanswered = new Map(); // by what was asked: the key of a request that nobody has answered, and since when

/** Ask for something to be made: who asks for the same again because no answer came is obeyed once. */
async function postOnce(path, body, headers) {
  const asked = JSON.stringify([path, body]);
  const { key, since } = unanswered.get(asked) ?? {};
  const now = performance.now();
  const sent = now - since < AGAIN_MS ? { key, since } : { key: newKey(), since: now };
  unanswered.set(asked, sent);
  try {
    const made = await post(path, body, { "Idempotency-Key": sent.key, ...headers });
    unanswered.delete(asked);
    return made;
  } catch (error) {
    if (error instanceof Refused) unanswered.delete(asked);
    throw error;
  }
}

/** Start a press, of an exam as it is shown here or of none. */
export function startPress(wish, exam) {
  const body = exam ? { ...wish, exam_id: exam.id } : wish;
  return postOnce("/presses", body, exam ? seen(exam) : {});
}

export const finishScan = (id) => post(`/presses/${of(id)}/finish`, {});
export const cancelPress = (id) => asJson(ask("DELETE", `/presses/${of(id)}`));
export const takeTare = () => post("/tare", {});
export const startSelfTest = (wanted) => post("/self-test", wanted);
export const fetchSelfTest = () => get("/self-test");
export const fetchDevice = () => get("/device");

export const liveUrl = `${API}/live.mjpeg`;
export const imageUrl = (id) => `${API}/measurements/${of(id)}/image.png`;
export const recordingUrl = (id) => `${API}/measurements/${of(id)}/recording.zip`;
export const reportUrl = (examId) => `${API}/exams/${of(examId)}/report.pdf`;
export const tableUrl = (examId) => `${API}/exports/measurements.csv${examId ? `?exam_id=${of(examId)}` : ""}`;
export const fetchForces = async (id) => (await get(`/measurements/${of(id)}/forces`)).frames;
export const fetchMeasurement = (id) => get(`/measurements/${of(id)}`);

const MOST = 200; // measurements of one answer

/** Measurements, newest first, of an exam or of all, older than one of them. */
export async function fetchMeasurements({ examId = null, beforeSeq = null, limit = 50 } = {}) {
  const asked = new URLSearchParams({ limit });
  if (examId) asked.set("exam_id", examId);
  if (beforeSeq) asked.set("before_seq", beforeSeq);
  return (await get(`/measurements?${asked}`)).measurements;
}

/** All measurements of an exam, newest first, however many answers they take. */
export async function fetchMeasurementsOf(examId) {
  const found = [];
  for (;;) {
    const more = await fetchMeasurements({ examId, beforeSeq: found.at(-1)?.seq, limit: MOST });
    found.push(...more);
    if (more.length < MOST) return found;
  }
}

export const moveMeasurement = (one, act) => post(`/measurements/${of(one.id)}/move`, act, seen(one));
export const voidMeasurement = (one, act) => post(`/measurements/${of(one.id)}/void`, act, seen(one));

export const fetchExam = (id) => get(`/exams/${of(id)}`);
/** The press under way or the newest one that was asked for an exam, undefined when there was none. */
export const fetchNewestPress = async (examId) => (await get(`/presses?exam_id=${of(examId)}&limit=1`)).presses[0];
export const makeExam = (content) => postOnce("/exams", content);

/** Begin an exam at another place, of the patient and order of one as it is shown here. */
export const makeExamElsewhere = (exam, content) => postOnce(`/exams/${of(exam.id)}/another-place`, content, seen(exam));

/** Exams of one kind, newest first, of all or of a patient's number: by every issuer, or by one, "" for no known one. */
export async function fetchExams({ kind = "patient", patientRef = null, patientIssuer = null, limit = 20 } = {}) {
  const asked = new URLSearchParams({ kind, limit });
  if (patientRef) asked.set("patient_ref", patientRef);
  if (patientIssuer !== null) asked.set("patient_issuer", patientIssuer);
  return (await get(`/exams?${asked}`)).exams;
}

export const fetchHospital = () => get("/dicom");
export const fetchSent = (examId) => get(`/exams/${of(examId)}/dicom`);
export const sendToArchive = (exam, by) => post(`/exams/${of(exam.id)}/dicom`, { by }, seen(exam));

/** Steps of the hospital's worklist: of a patient, or of this day. */
export async function fetchWorklist(patientRef) {
  const now = new Date();
  const today = [now.getFullYear(), now.getMonth() + 1, now.getDate()].map((part) => String(part).padStart(2, "0")).join("-");
  const asked = new URLSearchParams(patientRef ? { patient_ref: patientRef } : { day: today });
  return (await asJson(ask("GET", `/worklist?${asked}`, undefined, { withinMs: HOSPITAL_MS }))).steps;
}

/** Begin the exam of a step that the worklist has shown. */
export const makeOrderedExam = (content) => postOnce("/worklist/exams", content);

export const fetchUpdates = () => get("/updates");
export const goBack = () => post("/updates/roll-back", {});

/** Send a release file; it goes from the stick to the probe part by part, never whole through the memory. */
export async function sendRelease(file) {
  return (await ask("POST", "/updates", file, { type: "application/octet-stream", withinMs: RELEASE_MS })).json();
}
