// Speaks to the server: one request at a time for what drags, errors as words.

import {told} from "./web/words.js";

// A tab keeps its name when it is loaded again.
const tab = sessionStorage.getItem("tab") ?? String(crypto.getRandomValues(new Uint32Array(2)));
sessionStorage.setItem("tab", tab);
let token = "", seen = "";

export class Refused extends Error {
  constructor(status, answer) {
    super([answer.message, answer.hint].filter(Boolean).map(told).join(" "));
    this.status = status;
    this.otherTab = Boolean(answer.other_tab);
  }
}

async function ask(path, value) {
  const options = value === undefined ? {} : {
    method: "POST",
    headers: {"Content-Type": "application/json", "X-Geofield-Token": token, "X-Geofield-Tab": tab, "X-Geofield-Seen": seen},
    body: JSON.stringify(value),
  };
  let response;
  try {
    response = await fetch(path, options);
  } catch {
    throw new Refused(0, {message: "gone"});
  }
  const answer = await response.json();
  if (!response.ok) throw new Refused(response.status, answer);
  // An edit is one of the state that this page shows: a tab that was doubled may show an older one.
  seen = answer.stamp ?? seen;
  return answer;
}

export async function open() {
  const state = await ask("/api/state");
  token = state.token;
  const {yours} = await ask("/api/take", {});
  return {...state, yours};
}

export const takeOver = () => ask("/api/take", {force: true});
export const edit = command => ask("/api/edit", command);
export const save = name => ask("/api/save", name ? {name} : {});
export const reload = () => ask("/api/reload", {});
export const openPlan = plan => ask("/api/open", {plan});
export const stop = () => ask("/api/stop", {});
export const exportAs = format => ask("/api/export", {format});

let drag = 0, waiting = null, flying = false;

// While a person drags, only the newest place counts: one request flies, one waits. Answers
// that come after the drag has ended are of no use to anybody.
export function preview(command, show, refused) {
  waiting = {command, show, refused, drag};
  if (!flying) fly();
}

async function fly() {
  flying = true;
  while (waiting) {
    const one = waiting;
    waiting = null;
    try {
      const answer = await ask("/api/preview", one.command);
      if (one.drag === drag) one.show(answer);
    } catch (error) {
      if (one.drag === drag) one.refused(error);
    }
  }
  flying = false;
}

export function endPreview() {
  drag++;
  waiting = null;
}
