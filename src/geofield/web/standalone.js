// A plan on a page that is one file: picture, layers, what each thing is, legend.

import {heading, label, number, t, told} from "./words.js";
import {cased, closed, driveFeatures, driveStyle, frameStyle, gapFeatures, gapStyle, legend, line, lonlatOf, obstacleFeature, obstacleStyle,
  outlineColor, setTheme, trackFeatures, trackStyle, turnStyle} from "./js";

const plan = JSON.parse(document.getElementById("plan").textContent);
setTheme(plan.theme);

const node = (tag, text = "", values = {}) => Object.assign(document.createElement(tag), {textContent: text}, values);
const projection = new ol.proj.Projection({code: "plan", units: "m", extent: plan.bounds});
const view = new ol.View({projection, minResolution: 0.01, maxResolution: 400, enableRotation: false});
const layers = [];
if (plan.picture) layers.push(new ol.layer.Image({source: new ol.source.ImageStatic({
  url: plan.picture, imageExtent: plan.bounds, projection, interpolate: true})}));
const add = (features, style, name, declutter = false) => {
  const layer = new ol.layer.Vector({source: new ol.source.Vector({features}), style, declutter});
  layer.set("name", name);
  layers.push(layer);
  return layer;
};
const field = plan.field;
const shown = {
  tracks: add(trackFeatures(plan.tracks), trackStyle, "track", true),
  headland: add(plan.headland.map(xy => line(xy)), cased(plan.theme.headland, 1.6), "headland"),
  gaps: add(gapFeatures(plan.gaps), gapStyle(), "gap"),
  turns: add(plan.route.map(turn => line(turn.line, {fits: turn.fits})), turnStyle, "turn"),
  drive: add(driveFeatures(plan.drive), driveStyle, "drive"),
  outline: add([new ol.Feature(closed(field.rings))], cased(outlineColor(field), 3), "outline"),
  frame: add(field.frame.map(xy => line(xy)), frameStyle(), "frame"),
  obstacles: add(plan.obstacles.map(obstacleFeature), obstacleStyle, "obstacle", true),
};
const popup = new ol.Overlay({element: document.getElementById("popup"), positioning: "bottom-center", offset: [0, -12],
                              stopEvent: true, autoPan: {margin: 20}});
const map = new ol.Map({target: "map", layers, view, overlays: [popup],
  interactions: ol.interaction.defaults.defaults({onFocusOnly: false, altShiftDragRotate: false, pinchRotate: false}),
  controls: ol.control.defaults.defaults({rotate: false, attribution: false}).extend([new ol.control.ScaleLine({minWidth: 90})])});
projection.getMetersPerUnit = () => plan.scale;
projection.setGetPointResolution(resolution => resolution);
view.fit(shown.outline.getSource().getExtent(), {padding: [30, 30, 30, 30]});

function describe(feature, name) {
  if (name === "obstacle") {
    const row = feature.get("row"), size = row.radius_m === null ? t("other") : t("radius", {m: number(row.radius_m, 1)});
    const rows = [`${t("obstacle")} ${row.no}`, t(row.status), `${t(row.kind)}, ${size}`];
    if (row.confidence !== null) rows.push(`${number(100 * row.confidence)} %`);
    if (row.lost_m) rows.push(t("lost", {m: number(row.lost_m)}));
    return rows;
  }
  if (name === "track") return [`${t("l_track")} ${feature.get("no")}`, `${number(feature.getGeometry().getLength() * plan.scale, 1)} m`];
  if (name === "gap") return [t("l_gap"), feature.get("cause")];
  if (name === "turn") return [t(feature.get("fits") ? "l_turn" : "l_unfit")];
  return null;
}

map.on("singleclick", event => {
  let found = null;
  map.forEachFeatureAtPixel(event.pixel, (feature, layer) => {
    const words = describe(feature, layer.get("name"));
    if (words && !found) found = words;
  }, {hitTolerance: 6});
  popup.getElement().replaceChildren(...(found ?? []).map((text, i) => node(i ? "div" : "b", text)));
  popup.setPosition(found ? event.coordinate : undefined);
});
map.on("pointermove", ({coordinate}) => {
  const [lon, lat] = lonlatOf(plan.places, coordinate);
  document.getElementById("place").textContent = `${lat.toFixed(6)}, ${lon.toFixed(6)}`;
});

const f = plan.figures;
const facts = [["area", `${number(plan.area_ha, 2)} ha`]];
if (f.tracks !== undefined) facts.push(["length", `${f.tracks} · ${number(f.length_m / 1000, 2)} km`]);
if (f.heading_deg != null) facts.push(["coverage", `${number(f.coverage_percent, 1)} %`], ["heading", heading(f.heading_deg)]);
if (f.turns) facts.push(["turns", String(f.turns)]);
if (plan.obstacles.length) {
  // Those that tracks go around; the others are no obstacles to a driver.
  const idle = ["possible", "rejected"].map(status => [status, plan.obstacles.filter(row => row.status === status).length]);
  const around = plan.obstacles.length - idle.reduce((sum, [, count]) => sum + count, 0);
  facts.push(["obstacles", String(around)], ...idle.filter(([, count]) => count).map(([status, count]) => [status, String(count)]));
}
document.getElementById("facts").replaceChildren(...facts.flatMap(([name, text]) => [node("dt", t(name)), node("dd", text)]));
const doubts = [...[...field.doubts, ...plan.doubts].map(told),
  ...(f.turns_that_do_not_fit ? [t("unfit", {n: f.turns_that_do_not_fit})] : [])];
document.getElementById("doubts").replaceChildren(
  ...(field.certainty === null ? [] : [node("li", t("sure", {p: number(100 * field.certainty)}))]), ...doubts.map(text => node("li", text)));
document.getElementById("legend").replaceChildren(...legend());
label();
document.body.dataset.ready = "yes";
