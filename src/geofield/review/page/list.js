// The list of obstacles: one stop of the keyboard; the arrow keys go from row to row.

import {number, t} from "./web/words.js";

const list = document.getElementById("list");

export const node = (tag, text) => Object.assign(document.createElement(tag), {textContent: text});

// The number of the obstacle whose row has the focus.
export const focused = () => document.activeElement?.dataset.no;

export function fill(obstacles, choose) {
  list.replaceChildren(...obstacles.map(each => {
    const item = Object.assign(document.createElement("li"), {role: "option", onclick: () => choose(each.no)});
    item.dataset.no = each.no;
    const size = each.radius_m === null ? t("other") : t("radius", {m: number(each.radius_m, 1)});
    const sure = each.confidence === null ? "" : ` · ${number(100 * each.confidence)} %`;
    const cost = each.lost_m ? ` · ${t("lost", {m: number(each.lost_m)})}` : "";
    item.append(node("b", each.no), node("span", t(each.status)), node("small", `${size}${sure}${cost}`));
    return item;
  }));
}

// The stop is at the chosen row, else where the focus was.
export function mark(chosen, before = focused()) {
  const rows = [...list.children], of = no => rows.find(each => each.dataset.no === String(no));
  const now = of(chosen), stop = now ?? of(before) ?? rows[0];
  for (const each of rows) Object.assign(each, {ariaSelected: String(each === now), tabIndex: each === stop ? 0 : -1});
  now?.scrollIntoView({block: "nearest"});
  if (before) stop?.focus({preventScroll: true});
}

// The number some rows away from the one that has the focus.
export function away(by) {
  const rows = [...list.children], place = rows.indexOf(document.activeElement);
  return Number(rows[Math.max(0, Math.min(place + by, rows.length - 1))].dataset.no);
}
