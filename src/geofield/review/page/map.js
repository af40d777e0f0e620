// The map: picture, outline, tracks and obstacles in the plan's own metric CRS.

import {number, t} from "./words.js";

const source = () => new ol.source.Vector();
export const sources = {
  outline: source(), frame: source(), tracks: source(), gaps: source(), headland: source(),
  turns: source(), obstacles: source(), handle: source(), sketch: source(),
};
export let map, view, theme;
let picture, pictureFacts, places;

const stroke = (color, width, lineDash) => new ol.style.Stroke({color, width, lineDash});
// A light line below a dark one can be read on any ground.
const cased = (color, width, dash) => [
  new ol.style.Style({stroke: stroke("rgba(0,0,0,0.55)", width + 2)}),
  new ol.style.Style({stroke: stroke(color, width, dash)}),
];

function fade(color, alpha) {
  const value = parseInt(color.slice(1), 16);
  return `rgba(${value >> 16},${(value >> 8) & 255},${value & 255},${alpha})`;
}

export function outlineColor(field) {
  return field.certainty !== null && field.doubts.length ? theme.doubt : theme.outline;
}

function obstacleStyle(feature, chosen) {
  const status = feature.get("status"), look = theme.status[status];
  const close = view.getResolution() < 0.6;
  const styles = [new ol.style.Style({
    stroke: stroke(chosen ? "#ffffff" : "rgba(0,0,0,0.5)", chosen ? 7 : 4),
    fill: new ol.style.Fill({color: fade(look.color, status === "rejected" || status === "possible" ? 0.05 : 0.22)}),
  }), new ol.style.Style({stroke: stroke(look.color, 2.2, look.dash)})];
  if (close || chosen) styles.push(new ol.style.Style({text: new ol.style.Text({
    text: String(feature.getId()), font: "600 13px system-ui, sans-serif", overflow: true,
    fill: new ol.style.Fill({color: "#fff"}), stroke: stroke("#000", 3),
  })}));
  return styles;
}

export function build(state, chosen) {
  theme = state.theme;
  places = state.places;
  const projection = new ol.proj.Projection({code: "plan", units: "m", extent: state.bounds});
  view = new ol.View({projection, extent: grown(state.bounds, 0.5), constrainOnlyCenter: true,
                      minResolution: 0.01, maxResolution: 400, enableRotation: false});
  pictureFacts = state.picture;
  const layers = [];
  if (pictureFacts) layers.push(picture = new ol.layer.Tile({className: "picture", extent: state.bounds, preload: 1,
    source: tiles(state.bounds, "colour", projection)}));
  const trackStyle = feature => {
    const styles = cased(theme.track, 1.6);
    if (view.getResolution() < 0.35) styles.push(new ol.style.Style({text: new ol.style.Text({
      text: String(feature.get("no")), placement: "line", font: "italic 12px system-ui, sans-serif",
      fill: new ol.style.Fill({color: theme.track}), stroke: stroke("#000", 3)})}));
    return styles;
  };
  const add = (name, style) => layers.push(new ol.layer.Vector({source: sources[name], style,
    updateWhileInteracting: true, updateWhileAnimating: true}));
  add("tracks", trackStyle);
  add("headland", cased(theme.headland, 1.6));
  add("gaps", [new ol.style.Style({stroke: stroke(theme.gap, 1.4, [3, 5])})]);
  add("turns", feature => cased(feature.get("fits") ? theme.turn : theme.unfit, feature.get("fits") ? 1.4 : 3));
  add("outline", feature => cased(feature.get("color"), 3));
  add("frame", [new ol.style.Style({stroke: stroke("#fff", 4)}),
                new ol.style.Style({stroke: stroke("#000", 4, [10, 10])})]);
  add("obstacles", feature => obstacleStyle(feature, feature.getId() === chosen()));
  add("handle", new ol.style.Style({image: new ol.style.RegularShape({points: 4, radius: 9, angle: Math.PI / 4,
    fill: new ol.style.Fill({color: "#fff"}), stroke: stroke("#000", 2)})}));
  add("sketch", cased(theme.outline, 2, [6, 6]));
  map = new ol.Map({target: "map", layers, view, controls: ol.control.defaults.defaults({rotate: false, attribution: false})
    .extend([new ol.control.ScaleLine({minWidth: 90})]), keyboardEventTarget: document.getElementById("map")});
  // The scale bar knows no CRS of its own making: true metres on the ground come from the server.
  ol.proj.addProjection(projection);
  projection.getMetersPerUnit = () => state.scale;
  projection.setGetPointResolution(resolution => resolution);
  view.fit(sources.outline.getFeatures().length ? sources.outline.getExtent() : state.bounds, {padding: [30, 30, 30, 30]});
}

function grown([left, bottom, right, top], share) {
  const x = (right - left) * share, y = (top - bottom) * share;
  return [left - x, bottom - y, right + x, top + y];
}

function tiles(bounds, show, projection) {
  return new ol.source.TileImage({
    projection, interpolate: true, transition: 0,
    tileGrid: new ol.tilegrid.TileGrid({extent: bounds, origin: [bounds[0], bounds[3]],
      resolutions: pictureFacts.resolutions, tileSize: 512}),
    tileUrlFunction: ([z, x, y]) => `tile/${show}/${z}/${x}/${y}`,
  });
}

export function showInfrared(on, state) {
  picture?.setSource(tiles(state.bounds, on ? "infrared" : "colour", view.getProjection()));
}

export const setOpacity = value => picture?.setOpacity(value);

export function setContrast(value) {
  const node = document.querySelector("#map .picture");
  if (node) node.style.filter = value === 1 ? "" : `contrast(${value})`;
}

const line = (xy, values = {}) => new ol.Feature({geometry: new ol.geom.LineString(xy), ...values});
const closed = rings => new ol.geom.Polygon(rings.map(ring => [...ring, ring[0]]));

function fill(name, features) {
  sources[name].clear(true);
  sources[name].addFeatures(features);
}

export function showTracks(answer) {
  fill("tracks", answer.tracks.map(([no, x0, y0, x1, y1]) => line([[x0, y0], [x1, y1]], {no})));
  fill("gaps", answer.gaps.map(([x0, y0, x1, y1, cause]) => line([[x0, y0], [x1, y1]], {cause})));
  fill("headland", answer.headland.map(xy => line(xy)));
  fill("turns", answer.route.map(({line: xy, fits}) => line(xy, {fits})));
}

export function showOutline(field) {
  fill("outline", [new ol.Feature({geometry: closed(field.rings), color: outlineColor(field)})]);
  fill("frame", field.frame.map(xy => line(xy)));
}

export function showObstacles(rows) {
  fill("obstacles", rows.map(row => {
    const feature = new ol.Feature({geometry: closed(row.rings), status: row.status, row});
    feature.setId(row.no);
    return feature;
  }));
}

export function showHandle(row) {
  sources.handle.clear(true);
  if (!row || row.radius_m === null) return;
  const [x, y] = row.centre, reach = row.radius_m + row.buffer_m;
  // On a small circle the handle would lie over its middle, by which it is moved.
  if (reach / view.getResolution() < 24) return;
  sources.handle.addFeature(new ol.Feature({geometry: new ol.geom.Point([x + reach, y])}));
}

export function obstacleAt(pixel) {
  let best = null;
  map.forEachFeatureAtPixel(pixel, feature => {
    // The smallest of those that lie over each other can be reached by no other way.
    const area = feature.getGeometry().getArea();
    if (!best || area < best.area) best = {area, no: feature.getId()};
  }, {layerFilter: layer => layer.getSource() === sources.obstacles, hitTolerance: 6});
  return best?.no ?? null;
}

export function zoomTo(row) {
  const size = Math.max(...row.rings[0].map(([x, y]) => Math.hypot(x - row.centre[0], y - row.centre[1])));
  view.setCenter(row.centre);
  if (view.getResolution() > 0.25 || view.getResolution() < 0.02)
    view.setResolution(Math.max(0.06, Math.min(0.25, size / 30)));
}

// Longitude and latitude by parabolas through the 3 x 3 places that the server computed.
export function lonlat([x, y]) {
  const u = weights(places.x, x), v = weights(places.y, y);
  const at = table => table.reduce((sum, row, i) => sum + v[i] * row.reduce((s, value, j) => s + u[j] * value, 0), 0);
  return [at(places.lon), at(places.lat)];
}

function weights([a, b, c], x) {
  return [(x - b) * (x - c) / ((a - b) * (a - c)), (x - a) * (x - c) / ((b - a) * (b - c)),
          (x - a) * (x - b) / ((c - a) * (c - b))];
}

export function legend() {
  const rows = [["l_outline", theme.outline], ["l_doubt", theme.doubt], ["l_frame", "#000", true], ["l_track", theme.track],
    ["l_gap", theme.gap, true], ["l_headland", theme.headland], ["l_turn", theme.turn], ["l_unfit", theme.unfit],
    ...Object.entries(theme.status).map(([status, look]) => [status, look.color, Boolean(look.dash)])];
  return rows.map(([name, color, dashed]) => {
    const item = document.createElement("li"), mark = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    mark.setAttribute("width", 34); mark.setAttribute("height", 12); mark.setAttribute("aria-hidden", "true");
    for (const [width, paint, dash] of [[6, "#000", ""], [3.5, color === "#000" ? "#fff" : color, dashed ? "5 4" : ""]]) {
      const bar = document.createElementNS("http://www.w3.org/2000/svg", "line");
      for (const [key, value] of Object.entries({x1: 1, x2: 33, y1: 6, y2: 6, stroke: paint, "stroke-width": width,
                                                 "stroke-dasharray": dash})) bar.setAttribute(key, value);
      mark.append(bar);
    }
    item.append(mark, t(name));
    return item;
  });
}

export const metres = value => `${number(value, value < 100 ? 2 : 0)} m`;
