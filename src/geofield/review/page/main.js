// The page: puts server, map, tools, list and keys together.

import * as api from "./api.js";
import * as list from "./list.js";
import * as maps from "./map.js";
import * as tools from "./tools.js";
import * as view from "./view.js";
import {legend} from "./web/symbols.js";
import {listen, keyTable} from "./keys.js";
import {say, speak} from "./voice.js";
import {currentLanguage, heading, label, number, plain, setLanguage, t, told} from "./web/words.js";

const $ = id => document.getElementById(id);
let state, chosen = null, ended = false;
const row = no => state.obstacles.find(each => each.no === no);
const waits = each => each.status === "detected" || each.status === "possible";

// -- saying ------------------------------------------------------------------------------

const named = each => `${t("obstacle")} ${each.no}: ${t(each.status)}`;

// What an edit, or taking one back, did: to obstacles, else to the field as a whole.
function speakOf(command, before) {
  if (command.do === "undo" || command.do === "redo") speak(t(`${command.do}ne`));
  const old = new Map(before.map(each => [each.no, each])), now = new Set(state.obstacles.map(each => each.no));
  const changed = state.obstacles.filter(each => old.get(each.no)?.status !== each.status).map(named);
  const gone = before.filter(each => !now.has(each.no)).map(each => `${t("obstacle")} ${each.no}: ${t("deleted")}`);
  const told = [...changed, ...gone];
  if (told.length && told.length < 5) told.forEach(speak);
  else speak($("figures").textContent);
}

function refused(error) {
  if (ended) return;
  if (error.otherTab) say(error.message, true, {text: t("take"), act: takeOver});
  else if (error.status === 409) say(error.message, true, {text: t("reload"), act: reload});
  else say(error.status === 0 ? t("gone") : error.message, true);
}

// What the other tab did meanwhile to the plan that is shown here is shown first; what is typed here stays.
const takeOver = () => act(() => api.takeOver().then(() => api.openPlan(state.plan)), () => {
  const values = inputs().filter(input => input.value !== input.dataset.shown).map(({name, value}) => [name, value]);
  sessionStorage.setItem("typed", JSON.stringify({plan: state.plan, values}));
  again();
});

function typeAgain() {
  const {plan, values} = JSON.parse(sessionStorage.getItem("typed") ?? "{}");
  sessionStorage.removeItem("typed");
  if (plan === state.plan) for (const [name, value] of values) $("settings").elements[name].value = value;
}

const reload = () => applied(() => act(() => api.reload(), again));

function again() {
  ended = true;
  location.reload();
}

async function act(work, after) {
  try {
    const answer = await work();
    after?.(answer);
    return true;
  } catch (error) {
    refused(error);
    return false;
  }
}

// -- showing -----------------------------------------------------------------------------

// What does nothing now says so; the keyboard stays on it, as it would not on one that is `disabled`.
const able = (name, can) => { $(name).ariaDisabled = String(!can); };

function show(answer) {
  state = {...state, ...answer};
  if (chosen !== null && !row(chosen)) chosen = null;
  maps.showOutline(state.field);
  maps.showObstacles(state.obstacles);
  showTracks(state);
  maps.showHandle(chosen === null ? null : row(chosen));
  showList();
  showField();
  for (const input of inputs()) {
    const value = inWords(state.settings[input.name]);
    // What is typed and was not applied yet stays beside other edits.
    if (input.dataset.shown !== value) input.value = input.dataset.shown = value;
  }
  for (const [name, can] of [["undo", state.can_undo], ["redo", state.can_redo], ["save", unsaved()]]) able(name, can);
  $("title").textContent = state.name;
  // The list of a farm's fields says it, too.
  $("title").classList.toggle("spoken", state.plans.length > 1 && state.plans[state.plan].startsWith(state.name));
  $("unsaved").textContent = state.edited ? t("unsaved") : "";
  if (state.unnoted && state.edited) say(t("unnoted", {why: state.unnoted}), true);
  document.title = `${state.edited ? "* " : ""}${state.name} – geofield`;
}

function showTracks(answer, moving = false) {
  maps.showTracks(answer, moving);
  const f = answer.figures;
  $("notes").replaceChildren(...answer.notes.map(text => list.node("li", told(text))));
  if (f.tracks === undefined) {
    $("figures").replaceChildren();
    $("facts").replaceChildren();
    return;
  }
  const unfit = f.turns_that_do_not_fit ? ` · ${t("unfit", {n: f.turns_that_do_not_fit})}` : "";
  const waits = answer.route_waits ?? state.settings.route !== "none" ? ` · ${t("route_waits")}` : "";
  $("figures").textContent = `${number(f.area_ha, 2)} ha · ${t(f.tracks === 1 ? "one_track" : "n_tracks", {n: f.tracks})} · ${number(f.length_m / 1000, 2)} km · ${t("covered", {p: number(f.coverage_percent, 1)})}${unfit}${waits}`;
  const facts = [["area", `${number(f.area_ha, 4)} ha`], ["length", `${f.tracks} · ${number(f.length_m)} m`], ["segments", number(f.segments)],
    ["coverage", `${number(f.coverage_percent, 1)} %`], ["overlap", `${number(f.overlap_percent, 1)} %`],
    ["heading", heading(f.heading_deg)], ["lost_all", `${number(f.lost_m)} m`]];
  if (f.turns !== null) facts.push(["turns", number(f.turns)]);
  $("facts").replaceChildren(...facts.flatMap(([name, value]) => [list.node("dt", t(name)), list.node("dd", value)]));
}

function showField() {
  const field = state.field;
  $("certainty").textContent = field.certainty !== null ? t("sure", {p: number(100 * field.certainty)})
    : t(["drawn", "boundary", "chosen"].includes(field.method) ? field.method : "unknown");
  const doubts = [...field.doubts, ...state.doubts].map(told);
  $("doubts").replaceChildren(...doubts.map(text => list.node("li", text)));
  const shown = JSON.stringify(field.rings);
  const choice = field.alternatives.some(other => JSON.stringify(other.rings) !== shown) ? field.alternatives : [];
  const focused = [...$("alternatives").querySelectorAll("button")].indexOf(document.activeElement);
  $("alternatives").replaceChildren(...choice.map((other, i) => {
    const item = document.createElement("li");
    const press = list.node("button", t("outline_no", {n: i + 1, p: number(100 * other.certainty)}));
    press.setAttribute("aria-pressed", String(JSON.stringify(other.rings) === shown));
    press.onclick = () => commit({do: "choose", no: i + 1});
    press.onmouseenter = () => maps.showOther(other.rings);
    press.onfocus = () => press.matches(":focus-visible") && maps.showOther(other.rings);
    press.onmouseleave = press.onblur = () => maps.showOther(null);
    item.append(press);
    return item;
  }));
  $("alternatives").querySelectorAll("button")[focused]?.focus();
}

// The most doubtful first; those with a person's word last.
function ordered() {
  const doubt = each => waits(each) ? 1 - Math.abs(1 - 2 * (each.confidence ?? 0.5)) : -1;
  return [...state.obstacles].sort((a, b) => doubt(b) - doubt(a) || a.no - b.no);
}

function showList() {
  const all = state.obstacles.length, left = state.obstacles.filter(waits).length;
  $("left").textContent = !all ? t(state.detected_from === null ? "unsearched" : "no_obstacles") : t("left", {n: left, all});
  const focused = list.focused();
  list.fill(ordered(), no => inTurn(() => row(no) && choose(no, true)));
  for (const name of ["previous", "next"]) able(name, all > 0);
  showChosen(focused);
}

function showChosen(focused) {
  list.mark(chosen, focused);
  for (const name of ["confirm", "reject"]) able(name, chosen !== null);
}

function choose(no, zoom) {
  chosen = no;
  showChosen();
  maps.sources.obstacles.changed();
  maps.showHandle(no === null ? null : row(no));
  if (no === null) return;
  if (zoom) maps.zoomTo(row(no));
  if (!list.focused()) speak(named(row(no)));  // else the row is read that has the focus
}

function step(forth) {
  const rows = ordered(), waiting = rows.filter(waits), pool = waiting.length ? waiting : rows;
  if (!pool.length) return;
  const place = pool.findIndex(each => each.no === chosen);
  const next = place < 0 ? (forth ? 0 : pool.length - 1) : (place + (forth ? 1 : -1) + pool.length) % pool.length;
  choose(pool[next].no, true);
}

// -- doing -------------------------------------------------------------------------------

// What a person does is done one after the other: a key that is pressed before the answer to the
// last one is there speaks of what is chosen then.
let turn = Promise.resolve(), undone = 0, slow;
function inTurn(work) {
  if (!undone++) slow = setTimeout(() => document.body.classList.add("busy"), 300);
  return turn = turn.then(work).catch(refused).finally(() => {
    if (--undone) return;
    clearTimeout(slow);
    document.body.classList.remove("busy");
  });
}

const commit = command => inTurn(() => make(command));

async function make(command) {
  const before = state.obstacles;
  const done = await act(() => api.edit(command), show);
  if (!done) {
    show({});
    return false;
  }
  settled();
  speakOf(command, before);
  const fresh = state.obstacles.find(each => before.every(({no}) => no !== each.no));
  if (fresh) choose(fresh.no, false);
  else if (command.do === "undo" || command.do === "redo") goBack(before);
  return true;
}

// What was undone is seen, and the next key speaks of it.
function goBack(before) {
  const looks = each => JSON.stringify([each.status, each.rings]);
  const old = new Map(before.map(each => [each.no, looks(each)]));
  const changed = state.obstacles.filter(each => old.get(each.no) !== looks(each));
  if (changed.length === 1) choose(changed[0].no, !maps.sees(changed[0]));
}

// A refusal that no longer holds is not left standing.
function settled() {
  if ($("message").classList.contains("bad") && !state.unnoted) say("");
}

async function verdict(status) {
  const no = chosen;
  if (no === null) return step(true);  // a word is said of what is seen
  const rows = ordered().filter(waits), place = rows.findIndex(each => each.no === no);
  const following = rows[(place + 1) % rows.length]?.no;
  const done = await make({do: "status", no, status});
  if (done && !waits({status}) && place >= 0 && following !== undefined && following !== no) choose(following, true);
}

// What was merely possible is not driven around when a person has no word on it any more.
function takeBack() {
  const each = row(chosen);
  if (!each || waits(each) || each.status === "added") return;
  // Where confidences are told, what has none was drawn.
  if (each.confidence === null) return verdict(state.detected_from === 0 ? "detected" : "added");
  return verdict(each.confidence < state.detected_from ? "possible" : "detected");
}

// Where there is nothing to undo, nothing was undone.
const through = way => inTurn(() => state[`can_${way}`] && make({do: way}));
const ifChosen = work => inTurn(() => chosen !== null && work(chosen));
const nudge = (dx, dy) => tools.nudgeCorner(dx, dy) ?? (chosen !== null && ifChosen(no => make({do: "move", no, dx_m: dx, dy_m: dy})));

function resize(factor) {
  const each = row(chosen);
  if (each) return make({do: "radius", no: chosen, radius_m: Math.max(0.3, Math.round(each.radius_m * factor * 100) / 100)});
}

const inputs = () => [...$("settings").elements].filter(input => input.name);

// A direction that has a name is shown in the language of the page, and may be typed in either.
const inWords = value => state.directions.includes(value) ? t(value) : String(value);
const direction = text => state.directions.find(each => t(each) === text) ?? text;

// Settings as they are typed where they are others.
function typed() {
  const given = {};
  for (const {name, value} of inputs()) {
    const before = state.settings[name], text = plain(value.trim());
    const meant = typeof before === "number" && /^[-+]?(\d+\.?\d*|\.\d+)$/.test(text) ? Number(text) : name === "direction" ? direction(text) : text;
    if (String(meant) !== String(before)) given[name] = meant;
  }
  return given;
}

const unsaved = () => state.edited || Object.keys(typed()).length > 0;

async function apply() {
  const settings = typed();
  if (Object.keys(settings).length) return make({do: "tracks", settings});
  settled();
  return true;
}

// What is typed goes along, or nothing is done: the form says what counts.
const applied = work => inTurn(async () => await apply() && work());

const save = name => applied(() => act(() => api.save(name), answer => {
  show(answer);
  say(t("saved", {name: answer.saved_as}));
}));

const ACTIONS = {
  next: () => tools.stepCorner(1) || inTurn(() => step(true)), previous: () => tools.stepCorner(-1) || inTurn(() => step(false)),
  confirm: () => inTurn(() => verdict("confirmed")), reject: () => inTurn(() => verdict("rejected")),
  reset: () => inTurn(takeBack), undo: () => through("undo"), redo: () => through("redo"), save: () => save(),
  help: () => $("keys").showModal(), more: () => $("menu").showModal(), smaller: () => inTurn(() => resize(1 / 1.1)), larger: () => inTurn(() => resize(1.1)),
  remove: () => tools.removeCorner() || ifChosen(no => make({do: "delete", no})), tool: name => { tools.use(name); speak(t(`t_${name}`)); }, here: tools.clickHere, nudge, row: by => inTurn(() => list.focused() && choose(list.away(by), true)),
  move: () => { ACTIONS.tool("select"); $("map").focus(); },
  busy: () => undone > 0, onward: () => goTo((state.plan + 1) % state.plans.length),
  escape: () => { if (tools.current() === "select") inTurn(() => choose(null)); tools.use("select"); },
};

// Edits stay with their plan on the server: nothing is lost by going to another one.
async function goTo(plan) {
  if (plan === state.plan || await applied(() => act(() => api.openPlan(plan), again))) return;
  $("plans").value = state.plan;  // refused: what is shown stays
}

// -- beginning ---------------------------------------------------------------------------

function toolButtons() {
  $("tools").replaceChildren(...tools.TOOLS.map(name => {
    const press = list.node("button", t(`t_${name}`));
    press.dataset.tool = name;
    press.onclick = () => tools.use(name);
    return press;
  }), Object.assign(list.node("button", t("t_delete")), {id: "remove", onclick: ACTIONS.remove}));
  pressed();
}

function pressed() {
  for (const press of $("tools").querySelectorAll("[data-tool]"))
    press.setAttribute("aria-pressed", String(press.dataset.tool === tools.current()));
}

function words() {
  label();
  toolButtons();
  keyTable($("key-table"));
  $("directions").replaceChildren(...state.directions.map(name => new Option(inWords(name))));
  $("legend").replaceChildren(...legend());
}

async function start() {
  label();
  state = await api.open();
  maps.build(state, () => chosen);
  show(state);
  // On a telephone it would lie below the list, unseen.
  if ($("doubts").hasChildNodes()) $("panel").prepend($("outline-h").parentElement);
  tools.begin({chosen: () => chosen, row, choose: (no, zoom) => inTurn(() => choose(no, zoom)), commit, inTurn, make, speak: (word, values) => speak(t(word, values)), again: () => show({}), showTracks, refused, explain: word => say(t(word)), scale: () => state.scale,
    measured: text => { $("measure").textContent = text; }, changed: pressed});
  words();
  listen(ACTIONS);
  view.begin(state);
  $("credit").textContent = state.picture?.credit ?? "";
  $("export-format").replaceChildren(...state.formats.map(([name, title]) => new Option(title, name)));
  $("language").value = currentLanguage();
  $("plans-row").hidden = state.plans.length < 2;
  $("plans").replaceChildren(...state.plans.map((name, i) => new Option(name, i, i === state.plan, i === state.plan)));
  $("onward").hidden = $("plans-row").hidden;
  $("plans").onchange = ({target}) => goTo(Number(target.value));
  for (const name of ["next", "previous", "confirm", "reject", "undo", "redo", "save", "help", "more", "onward"])
    $(name).onclick = () => $(name).ariaDisabled === "true" || ACTIONS[name]();
  $("language").onchange = ({target}) => { setLanguage(target.value); words(); show({}); };
  $("settings").oninput = () => { able("save", unsaved()); };
  $("settings").onsubmit = event => {
    event.preventDefault();
    inTurn(apply);
  };
  $("export").onclick = () => applied(() => act(() => api.exportAs($("export-format").value),
    ({files, notes, state: now}) => { show(now); say([t("exported", {files: files.join(", ")}), ...notes.map(text => told(text))].join("\n")); }));
  $("save-as").onclick = async () => {
    const name = $("save-name").value.trim();
    if (!name) $("save-name").focus();
    else if (await save(name)) $("menu").close();
  };
  for (const dialog of document.querySelectorAll("dialog")) dialog.onclose = () => document.body.append($("message"));
  $("reload").onclick = reload;
  $("stop").onclick = () => applied(() => act(() => api.stop(), ({noted}) => { ended = true; $("menu").close(); say(`${noted ? t("left_noted") : ""} ${t("stopped")}`.trim(), false, {text: t("close"), act: () => window.close()}); }));
  maps.map.on("pointermove", ({coordinate}) => {
    const [lon, lat] = maps.lonlat(coordinate);
    $("place").textContent = `${lat.toFixed(6)}, ${lon.toFixed(6)}`;
  });
  window.addEventListener("beforeunload", event => { if ((unsaved() || undone) && !ended) event.preventDefault(); });
  // When all around the map has its size.
  maps.map.updateSize();
  maps.view.fit(maps.sources.outline.getExtent(), {padding: [30, 30, 30, 30]});
  typeAgain();
  able("save", unsaved());
  if (!state.yours) say(t("second"), true, {text: t("take"), act: takeOver});
  else tellWhatCameBack();
  document.body.dataset.ready = "yes";
}

// Once, however often the page is loaded again; what names the file of edits that were not made again
// stays until it was read.
function tellWhatCameBack() {
  const words = state.brought_back, heard = `told ${state.stamp.split(".")[0]}`;
  if (!words || sessionStorage.getItem(heard)) return;
  const note = () => sessionStorage.setItem(heard, "yes");
  const stays = /\.jsonl\.\d/.test(words);
  if (!stays) note();
  say(told(words), false, stays ? {text: t("close"), act: () => { note(); say(""); }} : null);
}

start().catch(refused);
