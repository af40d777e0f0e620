// How the picture is shown, and whether single keys are on: a tab keeps it from field to field.

import * as maps from "./map.js";

const SHOWN = {
  infrared: (on, state) => maps.showInfrared(on && state.picture?.infrared, state),
  opacity: value => maps.setOpacity(Number(value)),
  contrast: maps.setContrast,
  "keys-on": () => {},
};

export function begin(state) {
  document.getElementById("infrared-row").hidden = !state.picture?.infrared;
  for (const row of document.querySelectorAll(".of-picture")) row.hidden = !state.picture;
  for (const [name, show] of Object.entries(SHOWN)) {
    const control = document.getElementById(name);
    const [what, usual] = control.type === "checkbox" ? ["checked", control.defaultChecked] : ["value", control.defaultValue];
    control.oninput = () => {
      sessionStorage.setItem(name, JSON.stringify(control[what]));
      show(control[what], state);
    };
    // Also where the browser has filled in something else by itself.
    control[what] = JSON.parse(sessionStorage.getItem(name)) ?? usual;
    if (control[what] !== usual) show(control[what], state);
  }
}
