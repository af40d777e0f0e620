// The page's words in English and German.

import {SAID} from "./said.js";

const WORDS = {
  en: {
    undo: "Undo", redo: "Redo", save: "Save", more: "More", keys: "Keys", tools: "Tools", map: "Map",
    panel: "Findings", plan: "Plan", obstacles: "Obstacles", obstacle: "Obstacle", previous: "Previous", next: "Next", confirm: "Confirm",
    reject: "Reject", outline: "Outline", tracks: "Tracks", spacing: "Spacing, m", headland: "Headland, m",
    direction: "Direction or heading", last_strip: "Last strip", route: "Route", apply: "Apply", view: "View",
    opacity: "Picture", contrast: "Contrast", infrared: "Near infrared", legend: "Legend", close: "Close", zoom_in: "Nearer", zoom_out: "Farther away",
    keys_on: "Single keys are on", export_for: "For my terminal", export: "Export", save_as: "Save as",
    reload: "Reload the file", stop: "End the session", language: "Language",
    t_select: "Select", t_circle: "Add circle", t_polygon: "Add shape", t_outline: "Edit outline",
    t_anew: "Draw outline anew", t_direction: "Turn tracks", t_measure: "Measure", t_delete: "Delete",
    t_ground: "Ground belongs", t_notground: "Ground does not",
    left: "Waiting for your word: {n} of {all}", no_obstacles: "None found", unsearched: "Nobody searched for any",
    detected: "detected", possible: "possible: not driven around", confirmed: "confirmed", rejected: "rejected",
    added: "added by hand", other: "not round", radius: "radius {m} m", tree: "tree", lost: "costs {m} m of track",
    sure: "{p} % certain", drawn: "Drawn by a person", boundary: "A parcel of your own", chosen: "Chosen by a person", unknown: "Nobody measured its certainty",
    area: "Area", length: "Tracks", segments: "Segments", coverage: "Covered", one_track: "1 track", n_tracks: "{n} tracks", covered: "{p} % covered",
    overlap: "Worked twice", heading: "Heading", lost_all: "Lost to obstacles", turns: "Turns",
    unfit: "turns that do not fit: {n}", route_waits: "route planned on saving", saved: "Saved in {name}", exported: "Written: {files}",
    unnoted: "The disk takes no notes ({why}): what is not saved would be lost with a power cut. Save soon, here or elsewhere.",
    unsaved: "not saved", gone: "geofield has ended or cannot be reached. Your edits lie in the journal beside the plan.",
    second: "This plan is being edited in another tab.", take: "Edit here instead", stopped: "The session has ended. You may close this page.",
    left_noted: "What was not saved is noted beside the plan: the next review has it again.",
    l_track: "Track", l_gap: "Gap in a track", l_headland: "Headland track", l_turn: "Turn", l_unfit: "Turn that does not fit", l_drive: "Way and order of driving",
    l_outline: "Outline", l_doubt: "Outline in doubt", l_frame: "Picture's frame: the field goes on",
    k_next: "Next obstacle, the most doubtful first; on the map next corner of an outline that is edited", k_prev: "Previous obstacle or corner", k_confirm: "Confirm", k_reject: "Reject",
    k_reset: "Take your word back", k_add: "Add a circle: press at its middle and drag", k_turn: "Turn the tracks: press and drag the way they run", k_move: "To the map: move by the arrow keys",
    k_smaller: "Smaller", k_larger: "Larger", k_outline: "Edit the outline's corners", k_ground: "Click ground that belongs to the field", k_notground: "Click ground that does not",
    onward: "Next field", k_onward: "Next field or plan, where there are several",
    v_overrun: "over the border", v_leave: "left out", v_shift: "moved inside", v_spread: "spacing evened",
    v_none: "none", v_boustrophedon: "one by one", v_skip: "skipping some", v_shortest: "shortest",
    outline_no: "Outline {n} · {p} %", alternatives: "Other outlines", k_arrows: "Move the selected obstacle or corner by 0.5 m (Shift: 0.1 m), else the map; in the list from row to row",
    corner: "Corner {n} of {all}", undone: "Undone", redone: "Redone", deleted: "deleted", k_here: "Where the map has the focus: a click in its middle; for a shape corner after corner, and the last one twice",
    Delete: "Del", Escape: "Esc", k_delete: "Delete", k_undo: "Undo", k_redo: "Redo", k_save: "Save", k_help: "This list", k_esc: "Stop what you are doing",
  },
  de: {
    undo: "Rückgängig", redo: "Wiederholen", save: "Speichern", more: "Mehr", keys: "Tasten", tools: "Werkzeuge", map: "Karte",
    panel: "Ergebnisse", plan: "Plan", obstacles: "Hindernisse", obstacle: "Hindernis", previous: "Voriges", next: "Nächstes", confirm: "Bestätigen",
    reject: "Verwerfen", outline: "Feldgrenze", tracks: "Fahrspuren", spacing: "Spurabstand, m", headland: "Vorgewende, m",
    direction: "Richtung oder Kurs", last_strip: "Letzter Streifen", route: "Fahrweg", apply: "Anwenden", view: "Ansicht",
    opacity: "Bild", contrast: "Kontrast", infrared: "Nahes Infrarot", legend: "Legende", close: "Schließen", zoom_in: "Vergrößern", zoom_out: "Verkleinern",
    keys_on: "Kürzel mit einzelnen Tasten sind an", export_for: "Für mein Terminal", export: "Exportieren", save_as: "Speichern unter",
    reload: "Datei neu laden", stop: "Sitzung beenden", language: "Sprache",
    t_select: "Auswählen", t_circle: "Kreis zeichnen", t_polygon: "Fläche zeichnen", t_outline: "Grenze ändern",
    t_anew: "Grenze neu zeichnen", t_direction: "Spuren drehen", t_measure: "Messen", t_delete: "Löschen",
    t_ground: "Gehört dazu", t_notground: "Gehört nicht dazu",
    left: "Noch zu prüfen: {n} von {all}", no_obstacles: "Keine gefunden", unsearched: "Danach wurde nicht gesucht",
    detected: "gefunden", possible: "möglich: wird nicht umfahren", confirmed: "bestätigt", rejected: "verworfen",
    added: "von Hand ergänzt", other: "nicht rund", radius: "Radius {m} m", tree: "Baum", lost: "kostet {m} m Fahrspur",
    sure: "{p} % sicher", drawn: "Von Hand gezeichnet", boundary: "Ihre eigene Feldgrenze", chosen: "Von Hand gewählt", unknown: "Wie sicher sie ist, ist nicht bekannt",
    area: "Fläche", length: "Fahrspuren", segments: "Abschnitte", coverage: "Bearbeitet", one_track: "1 Fahrspur", n_tracks: "{n} Fahrspuren", covered: "{p} % bearbeitet",
    overlap: "Doppelt bearbeitet", heading: "Kurs", lost_all: "Durch Hindernisse verloren", turns: "Wendungen",
    unfit: "Wendungen, die nicht passen: {n}", route_waits: "Fahrweg wird beim Speichern geplant", saved: "Gespeichert in {name}", exported: "Geschrieben: {files}",
    unnoted: "Änderungen lassen sich nicht zwischenspeichern ({why}): Ungespeichertes ginge bei einem Stromausfall verloren. Speichern Sie bald, hier oder anderswo.",
    unsaved: "nicht gespeichert", gone: "geofield läuft nicht mehr oder ist nicht zu erreichen. Ihre Änderungen liegen im Journal neben dem Plan.",
    second: "Dieser Plan wird in einem anderen Fenster bearbeitet.", take: "Stattdessen hier bearbeiten", stopped: "Die Sitzung ist beendet. Sie können die Seite schließen.",
    left_noted: "Was nicht gespeichert ist, liegt neben dem Plan: die nächste Sitzung stellt es wieder her.",
    l_track: "Fahrspur", l_gap: "Lücke in einer Fahrspur", l_headland: "Fahrspur im Vorgewende", l_turn: "Wendung", l_unfit: "Wendung, die nicht passt", l_drive: "Richtung und Reihenfolge der Fahrt",
    l_outline: "Feldgrenze", l_doubt: "Zweifelhafte Feldgrenze", l_frame: "Bildrand: das Feld geht weiter",
    k_next: "Nächstes Hindernis, das zweifelhafteste zuerst; auf der Karte nächste Ecke beim Ändern der Feldgrenze", k_prev: "Voriges Hindernis, vorige Ecke", k_confirm: "Bestätigen", k_reject: "Verwerfen",
    k_reset: "Bestätigen oder Verwerfen zurücknehmen", k_add: "Kreis: in der Mitte drücken und ziehen", k_turn: "Spuren drehen: drücken und in ihrer Richtung ziehen", k_move: "Auf die Karte: mit den Pfeiltasten verschieben",
    k_smaller: "Kleiner", k_larger: "Größer", k_outline: "Ecken der Feldgrenze ändern", k_ground: "Boden anklicken, der dazugehört", k_notground: "Boden anklicken, der nicht dazugehört",
    dominant: "wie der meiste Rand", longest_edge: "längste Kante", hough: "Linien nach Hough", fewest: "wenigste Spuren", fewest_turns: "wenigste Wendungen",
    onward: "Nächstes Feld", k_onward: "Nächstes Feld oder nächster Plan, wenn es mehrere sind",
    v_overrun: "über den Rand", v_leave: "auslassen", v_shift: "hineinrücken", v_spread: "Abstand anpassen",
    v_none: "keiner", v_boustrophedon: "Spur für Spur", v_skip: "mit Auslassen", v_shortest: "kürzester",
    outline_no: "Grenze {n} · {p} %", alternatives: "Andere Feldgrenzen", k_arrows: "Gewähltes Hindernis oder gewählte Ecke um 0,5 m verschieben (Umschalt: 0,1 m), sonst die Karte; in der Liste von Zeile zu Zeile",
    corner: "Ecke {n} von {all}", undone: "Rückgängig gemacht", redone: "Wiederholt", deleted: "gelöscht", k_here: "Wenn die Karte den Fokus hat: ein Klick in ihre Mitte; für eine Fläche Ecke um Ecke, die letzte zweimal",
    Ctrl: "Strg", Shift: "Umschalt", Delete: "Entf", k_delete: "Löschen", k_undo: "Rückgängig", k_redo: "Wiederholen", k_save: "Speichern", k_help: "Diese Liste", k_esc: "Abbrechen",
  },
};

let language = remembered() || (navigator.language || "en").slice(0, 2);
if (!(language in WORDS)) language = "en";

function remembered() {
  try { return localStorage.getItem("language"); } catch { return null; }
}

export function t(name, values = {}) {
  const text = WORDS[language][name] ?? WORDS.en[name] ?? name;
  return text.replace(/\{(\w+)\}/g, (_, key) => values[key]);
}

// As it stands on a keyboard of the language.
export const keyName = keys => keys.split("+").map(key => t(key)).join("+");

const SENTENCES = Object.fromEntries(Object.keys(WORDS).map(name => [
  name, [...(SAID.page[name] ?? []), ...(SAID[name] ?? [])].map(([pattern, text]) => [new RegExp(`^${pattern}$`), text]),
]));

// What the program says, where it is known in the page's language: as a whole, or its sentences.
export function told(text) {
  const sentences = text.split(/(?<=\.) (?=[A-Z])/);
  for (let n = sentences.length; n > 0; n--) {
    const first = sentences.slice(0, n).join(" "), rest = sentences.slice(n).join(" ");
    const found = SENTENCES[language].find(([pattern]) => pattern.test(first));
    if (found) return [local(first.replace(...found)), ...(rest ? [told(rest)] : [])].join(" ");
  }
  return sentences.length < 2 ? text : `${sentences[0]} ${told(sentences.slice(1).join(" "))}`;
}

// Numbers with a point, as the program writes them; not those of a file's name.
const local = text => language === "de" ? text.replace(/(?<![\w./-])(\d+)\.(\d+)(?= (?:m|m²|ha|km|%)(?!\w)|\)|[,;.]? |$)/g, "$1,$2") : text;

export const currentLanguage = () => language;

export function setLanguage(name) {
  language = name;
  try { localStorage.setItem("language", name); } catch { /* private window */ }
  label();
}

export const number = (value, digits = 0) =>
  value === null || value === undefined ? "–"
    : value.toLocaleString(language, {minimumFractionDigits: digits, maximumFractionDigits: digits});

// A number as it is typed, with a point: of 1,000 a comma in English makes thousands, else it is what the keyboard has.
export const plain = text =>
  language === "en" && /^\d{1,3}(,\d{3})+$/.test(text) ? text : text.replace(/^([-+]?\d*),(\d+)$/, "$1.$2");

// A track's heading, from 0.0 to 179.9: 179.97 is north, as 0 is.
export const heading = degrees => `${number(Math.round(degrees * 10) / 10 % 180, 1)}°`;

// Writes the words into everything that has a data-t or data-label attribute.
export function label(root = document) {
  document.documentElement.lang = language;
  for (const node of root.querySelectorAll("[data-t]")) node.textContent = t(node.dataset.t);
  for (const node of root.querySelectorAll("[data-label]")) node.setAttribute("aria-label", t(node.dataset.label));
  for (const node of root.querySelectorAll("button[data-key]")) node.title = `${node.textContent} (${keyName(node.dataset.key)})`;
}
