// An exam and a picture as they stand in a list: on the page that asks whose exam it is, beside the press, in the history.

import { button, element } from "../base/dom.js";
import { imageUrl } from "../base/probe.js";
import { moment } from "../base/words.js";
import { placeWords, whoWords } from "./current.js";

/** A row of an exam, which calls `act` with it. */
export function examRow(exam, act) {
  const node = button("recent", "", () => act(exam));
  node.append(element("strong", "", whoWords(exam)), element("span", "", placeWords(exam)), element("small", "", moment(exam.made_at)));
  return node;
}

/** The small picture of a measurement; its words stand beside it. */
export function thumbnail({ id }) {
  const image = element("img", "thumbnail");
  Object.assign(image, { src: imageUrl(id), alt: "", loading: "lazy" });
  return image;
}
