// The keys that map editors and labelling tools taught people.

import {keyName, t} from "./web/words.js";

const KEYS = [
  ["j", "k_next", a => a.next()], ["k", "k_prev", a => a.previous()], ["c", "k_confirm", a => a.confirm()],
  ["r", "k_reject", a => a.reject()], ["u", "k_reset", a => a.reset()], ["a", "k_add", a => a.tool("circle")], ["Enter", "k_here", a => a.here()],
  ["m", "k_move", a => a.move()], ["[", "k_smaller", a => a.smaller()], ["]", "k_larger", a => a.larger()],
  ["o", "k_outline", a => a.tool("outline")],
  ["g", "k_ground", a => a.tool("ground")], ["x", "k_notground", a => a.tool("notground")], ["Delete", "k_delete", a => a.remove()],
  ["n", "k_onward", a => a.onward()], ["?", "k_help", a => a.help()], ["Escape", "k_esc", a => a.escape()],
];
// Where a keyboard has them behind Alt, they are brackets all the same.
const BRACKETS = ["[", "]"];
// Held down, these go on; a verdict that was held too long would speak of the next obstacles, too.
const ON_AND_ON = ["j", "k", ...BRACKETS];
// From row to row of the list.
const ROWS = {ArrowUp: -1, ArrowDown: 1, PageUp: -5, PageDown: 5, Home: -Infinity, End: Infinity, ArrowLeft: 0, ArrowRight: 0, Enter: 0, " ": 0};
const ARROWS = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]};

export function listen(actions) {
  // Captured before the map sees them: the map pans by arrows where no obstacle is chosen.
  window.addEventListener("keydown", event => {
    const control = event.ctrlKey || event.metaKey, key = event.key;
    // What is held goes on when the last answer is there, and ends with the hand.
    const waits = event.repeat && actions.busy();
    const done = work => {
      event.preventDefault();
      event.stopPropagation();
      if (!waits) work?.();
    };
    if (control && key.toLowerCase() === "s") return done(actions.save);
    const typing = event.target.matches?.("input:not([type=checkbox]):not([type=range]), select, textarea");
    if (typing || document.querySelector("dialog[open]")) return;
    if (control && key.toLowerCase() === "z") return done(event.shiftKey ? actions.redo : actions.undo);
    if (control && key.toLowerCase() === "y") return done(actions.redo);
    if (control || (event.altKey && !BRACKETS.includes(key))) return;
    if (key in ROWS && event.target.matches?.("[role=option]")) return done(() => actions.row(ROWS[key]));
    // Letters are what may be switched off; the map itself has arrows, Enter and Del all the same.
    const onMap = event.target.id === "map";
    if (!document.getElementById("keys-on").checked && key !== "Escape" && !(onMap && key.length > 1)) return;
    if (key in ARROWS) {
      if (event.target.matches?.("input[type=range]")) return;
      const metres = event.shiftKey ? 0.1 : 0.5, [x, y] = ARROWS[key];
      if (waits || actions.nudge(x * metres, y * metres) !== false) done();
      return;
    }
    // Buttons and lists have their own use for it.
    if (key === "Enter" && !onMap) return;
    const found = KEYS.find(([name]) => name === key || (name.length === 1 && name === key.toLowerCase()));
    if (found) done(() => (event.repeat && !ON_AND_ON.includes(found[0])) || found[2](actions));
  }, true);
}

export function keyTable(table) {
  const rows = [...KEYS, ["← ↑ ↓ →", "k_arrows"],
    ["Ctrl+Z", "k_undo"], ["Ctrl+Shift+Z", "k_redo"], ["Ctrl+S", "k_save"]];
  table.replaceChildren(...rows.map(([key, name]) => {
    const line = document.createElement("tr"), left = document.createElement("td"), right = document.createElement("td");
    const mark = document.createElement("kbd");
    mark.textContent = keyName(key);
    left.append(mark);
    right.textContent = t(name);
    line.append(left, right);
    return line;
  }));
}
