// How outline, tracks and obstacles look; the colours come from geofield's theme.

import {t} from "./words.js";

export let theme;
export function setTheme(given) { theme = given; }

export const stroke = (color, width, lineDash) => new ol.style.Stroke({color, width, lineDash});

// A dark line below a light one can be read on any ground.
export const cased = (color, width, dash) => [
  new ol.style.Style({stroke: stroke("rgba(0,0,0,0.55)", width + 2)}),
  new ol.style.Style({stroke: stroke(color, width, dash)}),
];

export function fade(color, alpha) {
  const value = parseInt(color.slice(1), 16);
  return `rgba(${value >> 16},${(value >> 8) & 255},${value & 255},${alpha})`;
}

const lettering = (text, font, color, placement, offsetX = 0, zIndex = 0) => new ol.style.Style({zIndex, text: new ol.style.Text({
  text, font, placement, offsetX, overflow: true, fill: new ol.style.Fill({color}), stroke: stroke("#000", 3)})});

export const frameStyle = () => [new ol.style.Style({stroke: stroke("#fff", 4)}),
  new ol.style.Style({stroke: stroke("#000", 4, [10, 10])})];

export const gapStyle = () => new ol.style.Style({stroke: stroke(theme.gap, 1.4, [3, 5])});

// Styles are made once, not for each of a thousand lines in each frame.
const made = {};
const once = (name, make) => made[name] ??= make();

export function trackStyle(feature, resolution) {
  const lines = once("track", () => cased(theme.track, 1.6));
  if (resolution >= 0.35 || feature.get("no") === undefined) return lines;
  return [...lines, lettering(String(feature.get("no")), "italic 12px system-ui, sans-serif", theme.track, "line")];
}

export const turnStyle = feature => feature.get("fits")
  ? once("turn", () => cased(theme.turn, 1.4)) : once("unfit", () => cased(theme.unfit, 8));

// Which way a segment is driven, and as which of all: an arrow at its middle.
export function driveStyle(feature, resolution) {
  if (resolution > 1.2) return [];
  return [new ol.style.Style({image: new ol.style.RegularShape({points: 3, radius: 8, rotateWithView: true,
      rotation: Math.PI / 2 - feature.get("turned"), scale: [0.7, 1.15],
      fill: new ol.style.Fill({color: theme.turn}), stroke: stroke("#000", 1.2)})}),
    ...(resolution < 0.2 ? [lettering(String(feature.get("order")), "600 11px system-ui, sans-serif", "#fff", "point", 16)] : [])];
}

export function obstacleStyle(feature, resolution, chosen) {
  const status = feature.get("status"), look = theme.status[status];
  const faint = status === "rejected" || status === "possible";
  const styles = [
    new ol.style.Style({stroke: stroke(chosen ? "#ffffff" : "rgba(0,0,0,0.5)", chosen ? 7 : 4),
                        fill: new ol.style.Fill({color: fade(look.color, faint ? 0.05 : 0.22)})}),
    new ol.style.Style({stroke: stroke(look.color, 2.2, look.dash)}),
  ];
  if (resolution < 0.6 || chosen) styles.push(lettering(String(feature.getId()), "600 13px system-ui, sans-serif", "#fff", "point", 0, chosen ? 2 : 1));
  return styles;
}

export const outlineColor = field => field.certainty !== null && field.doubts.length ? theme.doubt : theme.outline;

export const line = (xy, values = {}) => new ol.Feature({geometry: new ol.geom.LineString(xy), ...values});
export const closed = rings => new ol.geom.Polygon(rings.map(ring => [...ring, ring[0]]));

export const trackFeatures = rows => rows.map(([no, xy]) => line(xy, {no}));
export const gapFeatures = rows => rows.map(([xy, cause]) => line(xy, {cause}));

export const driveFeatures = rows => rows.map(([x, y, turned], i) =>
  new ol.Feature({geometry: new ol.geom.Point([x, y]), turned, order: i + 1}));

export function obstacleFeature(row) {
  const feature = new ol.Feature({geometry: closed(row.rings), status: row.status, row});
  feature.setId(row.no);
  return feature;
}

// Longitude and latitude by parabolas through 3 x 3 places that were computed exactly.
export function lonlatOf(places, [x, y]) {
  const u = weights(places.x, x), v = weights(places.y, y);
  const at = table => table.reduce((sum, row, i) => sum + v[i] * row.reduce((s, value, j) => s + u[j] * value, 0), 0);
  return [(at(places.lon) + 540) % 360 - 180, at(places.lat)];
}

function weights([a, b, c], x) {
  return [(x - b) * (x - c) / ((a - b) * (a - c)), (x - a) * (x - c) / ((b - a) * (b - c)),
          (x - a) * (x - b) / ((c - a) * (c - b))];
}

export function legend() {
  const rows = [["l_outline", theme.outline], ["l_doubt", theme.doubt], ["l_frame", "#000", true], ["l_track", theme.track],
    ["l_gap", theme.gap, true], ["l_headland", theme.headland], ["l_turn", theme.turn], ["l_unfit", theme.unfit], ["l_drive", theme.turn],
    ...Object.entries(theme.status).map(([status, look]) => [status, look.color, Boolean(look.dash)])];
  return rows.map(([name, color, dashed]) => {
    const item = document.createElement("li"), mark = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    const set = (node, values) => { for (const [key, value] of Object.entries(values)) node.setAttribute(key, value); };
    set(mark, {width: 34, height: 12, "aria-hidden": "true"});
    for (const [width, paint, dash] of [[6, "#000", ""], [3.5, color === "#000" ? "#fff" : color, dashed ? "5 4" : ""]]) {
      const bar = document.createElementNS("http://www.w3.org/2000/svg", "line");
      set(bar, {x1: 1, x2: 33, y1: 6, y2: 6, stroke: paint, "stroke-width": width, "stroke-dasharray": dash});
      mark.append(bar);
    }
    if (name === "l_drive") {
      const arrow = document.createElementNS("http://www.w3.org/2000/svg", "path");
      set(arrow, {d: "M10 1l14 5-14 5z", fill: color, stroke: "#000"});
      mark.replaceChildren(arrow);
    }
    item.append(mark, t(name));
    return item;
  });
}
