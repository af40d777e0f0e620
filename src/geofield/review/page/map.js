// The map: picture, outline, tracks and obstacles in the plan's own metric CRS.

import * as symbols from "./web/symbols.js";
import {number} from "./web/words.js";

const source = () => new ol.source.Vector();
export const sources = {
  outline: source(), frame: source(), tracks: source(), gaps: source(), headland: source(),
  turns: source(), unfit: source(), drive: source(), obstacles: source(), handle: source(), sketch: source(),
};
export let map, view;
let picture, pictureFacts, places;

export function build(state, chosen) {
  symbols.setTheme(state.theme);
  places = state.places;
  const projection = new ol.proj.Projection({code: "plan", units: "m", extent: state.bounds});
  view = new ol.View({projection, extent: grown(state.bounds, 0.5), constrainOnlyCenter: true,
                      minResolution: 0.01, maxResolution: 400, enableRotation: false});
  pictureFacts = state.picture;
  const layers = [];
  if (pictureFacts) layers.push(picture = new ol.layer.Tile({className: "picture", extent: state.bounds, preload: 1,
    source: tiles(state, "colour", projection)}));
  const add = (name, style, more = {}) => layers.push(new ol.layer.Vector({source: sources[name], style, ...more,
    updateWhileInteracting: true, updateWhileAnimating: true}));
  add("tracks", symbols.trackStyle, {declutter: true});
  add("headland", symbols.cased(state.theme.headland, 1.6));
  add("gaps", symbols.gapStyle());
  add("turns", symbols.turnStyle);
  add("unfit", symbols.turnStyle);
  add("drive", symbols.driveStyle);
  add("outline", feature => symbols.cased(feature.get("color"), 3));
  add("frame", symbols.frameStyle());
  add("obstacles", (feature, resolution) => symbols.obstacleStyle(feature, resolution, feature.getId() === chosen()), {declutter: true});
  add("handle", new ol.style.Style({image: new ol.style.RegularShape({points: 4, radius: 9, angle: Math.PI / 4,
    fill: new ol.style.Fill({color: "#fff"}), stroke: symbols.stroke("#000", 2)})}));
  add("sketch", symbols.cased(state.theme.outline, 2, [6, 6]));
  // The page is the map: it moves whatever has the focus.
  const interactions = ol.interaction.defaults.defaults({onFocusOnly: false, altShiftDragRotate: false, pinchRotate: false});
  interactions.push(new ol.interaction.KeyboardPan({pixelDelta: 8, duration: 0, condition: ol.events.condition.shiftKeyOnly}));
  // A hand that trembles while it clicks moves nothing.
  map = new ol.Map({target: "map", moveTolerance: 4, layers, view, interactions, controls: ol.control.defaults.defaults({rotate: false, attribution: false, zoomOptions: {zoomInTipLabel: "", zoomOutTipLabel: ""}})
    .extend([new ol.control.ScaleLine({minWidth: 90})]), keyboardEventTarget: document.getElementById("map")});
  for (const way of ["in", "out"]) document.querySelector(`.ol-zoom-${way}`).dataset.label = `zoom_${way}`;
  // The scale bar knows no CRS of its own making: true metres on the ground come from the server.
  ol.proj.addProjection(projection);
  projection.getMetersPerUnit = () => state.scale;
  projection.setGetPointResolution(resolution => resolution);
  view.fit(state.bounds);
}

function grown([left, bottom, right, top], share) {
  const x = (right - left) * share, y = (top - bottom) * share;
  return [left - x, bottom - y, right + x, top + y];
}

function tiles({bounds, plan}, show, projection) {
  return new ol.source.TileImage({
    projection, interpolate: true, transition: 0,
    tileGrid: new ol.tilegrid.TileGrid({extent: bounds, origin: [bounds[0], bounds[3]],
      resolutions: pictureFacts.resolutions, tileSize: 512}),
    tileUrlFunction: ([z, x, y]) => `tile/${show}/${plan}/${z}/${x}/${y}?${pictureFacts.reading}`,
  });
}

export function showInfrared(on, state) {
  picture?.setSource(tiles(state, on ? "infrared" : "colour", view.getProjection()));
}

export const setOpacity = value => picture?.setOpacity(value);

export const setContrast = value => map.getTargetElement().style.setProperty("--picture", `contrast(${value})`);

function fill(name, features) {
  sources[name].clear(true);
  sources[name].addFeatures(features);
}

// While they follow a hand, tracks are one shape: drawn many times faster than hundreds with numbers.
export function showTracks(answer, moving = false) {
  fill("tracks", moving ? together(answer.tracks.map(([, xy]) => xy)) : symbols.trackFeatures(answer.tracks));
  fill("gaps", together(answer.gaps.map(([xy]) => xy)));
  fill("headland", together(answer.headland));
  fill("drive", symbols.driveFeatures(answer.drive));
  for (const fits of [true, false])
    fill(fits ? "turns" : "unfit", together(answer.route.filter(turn => turn.fits === fits).map(turn => turn.line), {fits}));
}

const together = (lines, values = {}) =>
  lines.length ? [new ol.Feature({geometry: new ol.geom.MultiLineString(lines), ...values})] : [];

// What a hand holds, an obstacle's number or the outline, stays as the hand has it, whatever answer comes meanwhile.
let inHand = null;
export const hold = what => { inHand = what; };

export function showOutline(field) {
  if (inHand !== "outline") fill("outline", [new ol.Feature({geometry: symbols.closed(field.rings), color: symbols.outlineColor(field)})]);
  fill("frame", field.frame.map(xy => symbols.line(xy)));
}

// Another outline that was found, while a person thinks about it.
export function showOther(rings) {
  fill("sketch", rings ? [new ol.Feature(symbols.closed(rings))] : []);
}

// A hand that drags changes the shape itself, until the edit is made or refused.
const shapeOf = feature => `${ol.util.getUid(feature.getGeometry())} ${feature.getGeometry().getRevision()}`;

// Only what is not as it was drawn before is drawn anew.
export function showObstacles(rows) {
  const old = sources.obstacles, left = new Set(rows.map(row => row.no));
  for (const feature of old.getFeatures()) if (!left.has(feature.getId())) old.removeFeature(feature);
  for (const row of rows) {
    if (row.no === inHand) continue;
    const text = JSON.stringify(row), before = old.getFeatureById(row.no);
    if (before?.get("text") === text && before.get("shape") === shapeOf(before)) continue;
    if (before) old.removeFeature(before);
    const feature = symbols.obstacleFeature(row);
    feature.setProperties({text, shape: shapeOf(feature)}, true);
    old.addFeature(feature);
  }
}

export function showHandle(row) {
  if (inHand !== null) return;
  sources.handle.clear(true);
  if (!row || row.radius_m === null) return;
  const [x, y] = row.centre, reach = row.radius_m + row.buffer_m;
  // On a small circle the handle would lie over its middle, by which it is moved.
  if (reach / view.getResolution() < 24) return;
  sources.handle.addFeature(new ol.Feature({geometry: new ol.geom.Point([x + reach, y])}));
}

export function showCorner(place) {
  sources.handle.clear(true);
  sources.handle.addFeature(new ol.Feature(new ol.geom.Point(place)));
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

export const sees = row => ol.extent.containsCoordinate(view.calculateExtent(map.getSize()), row.centre);

export function zoomTo(row) {
  // Below a hand that drags, the map stands still: what is dragged would go with it.
  if (map.getViewport().matches(":active")) return;
  const size = Math.max(...row.rings[0].map(([x, y]) => Math.hypot(x - row.centre[0], y - row.centre[1])));
  view.setCenter(row.centre);
  if (view.getResolution() > 0.25 || view.getResolution() < 0.02)
    view.setResolution(Math.max(0.06, Math.min(0.25, size / 30)));
}

export const lonlat = place => symbols.lonlatOf(places, place);

export const metres = value => `${number(value, value < 100 ? 2 : 0)} m`;
