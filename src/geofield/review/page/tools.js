// What the pointer does: select, move, resize, draw, edit corners, turn the tracks, measure.

import * as maps from "./map.js";
import {preview, endPreview} from "./api.js";

export const TOOLS = ["select", "circle", "polygon", "ground", "notground", "outline", "anew", "direction", "measure"];
// What is done by a drag; the others take clicks, and two fingers between them.
const DRAGGED = ["select", "circle", "outline", "direction"];
let desk, touched = null, active = "select", held = [], way = [];
// Pixels around a thing that count as the thing: fingers are wide.
const reach = matchMedia("(pointer: coarse)").matches ? 16 : 6;
const at = coordinate => coordinate.map(value => Math.round(value * 1000) / 1000);
const ring = geometry => geometry.getCoordinates()[0].slice(0, -1).map(at);

// `desk`: {chosen(), row(no), choose(no), commit(command), inTurn(work), make(command), again(), showTracks(answer, moving), refused(error), explain(word), speak(word, values), measured(text), scale(), changed()}
export function begin(given) {
  desk = given;
  maps.map.on("singleclick", event => {
    if (active === "select") desk.choose(maps.obstacleAt(event.pixel), false);
    else if (active === "ground" || active === "notground")
      commit({do: "ground", place: at(event.coordinate), belongs: active === "ground"});
  });
  maps.map.on("pointermove", event => {
    if (event.dragging || active !== "select") return;
    maps.map.getTargetElement().style.cursor = maps.obstacleAt(event.pixel) === null ? "" : "pointer";
  });
  maps.map.getViewport().addEventListener("pointerdown", event => {
    if (event.isPrimary) touched = maps.map.getEventCoordinate(event);
    // Two fingers move the map: what one of them has begun to drag goes back, until the next one touches.
    if (!DRAGGED.includes(active)) return;
    if (!event.isPrimary) rest();
    else if (!held.length) use(active);
  }, true);
  maps.view.on("change:resolution", () => maps.showHandle(desk.row(desk.chosen())));
  use("select");
}

// The corner that was touched last: fingers have no Alt key, and keys go from one to the next.
function corner() {
  const near = 16 * maps.view.getResolution();
  let best = null;
  for (const one of corners()) {
    const away = touched ? Math.hypot(one.place[0] - touched[0], one.place[1] - touched[1]) : Infinity;
    if (away < near && (!best || away < best.away)) best = {...one, away};
  }
  return best;
}

const corners = () => outline().flatMap((places, ring) => places.map((place, index) => ({place, ring, index})));

// The outline with other places than a corner; it is the one that the last answer has left.
const reshape = places => desk.inTurn(async () => {
  const one = corner(), rings = outline();
  if (!one) return;
  const put = places(one);
  rings[one.ring].splice(one.index, 1, ...put);
  // A hole of three corners goes as a whole; of the field itself three must stay, which the server tells.
  const made = await desk.make({do: "outline", rings: rings.filter((left, ring) => ring === 0 || left.length > 2)});
  if (made && put.length) take(put.at(-1));
});

export function removeCorner() {
  if (active === "outline") reshape(() => []);
  return active === "outline";
}

// Where the map has the focus, the keys that speak of obstacles speak of the corners of an outline that is edited.
const ofCorners = () => active === "outline" && document.activeElement === maps.map.getTargetElement();

function take(place) {
  touched = place;
  maps.view.setCenter(place);
  maps.showCorner(place);
}

export function stepCorner(by) {
  if (!ofCorners()) return false;
  const all = corners(), here = corner(), before = here ? all.findIndex(one => one.ring === here.ring && one.index === here.index) : Math.min(0, -by);
  const n = (before + by + all.length) % all.length;
  take(all[n].place);
  desk.speak("corner", {n: n + 1, all: all.length});
  return true;
}

// Whether an arrow key moves a corner (true) or the map (false); else it is for the chosen obstacle.
export function nudgeCorner(dx_m, dy_m) {
  if (document.activeElement !== maps.map.getTargetElement() || ["select", "circle"].includes(active)) return null;
  if (active !== "outline" || !corner()) return false;
  reshape(({place: [x, y]}) => [at([x + dx_m / desk.scale(), y + dy_m / desk.scale()])]);
  return true;
}

// Without a pointer: a click in the middle of the map.
export function clickHere() {
  const place = at(maps.view.getCenter()), [x, y] = place;
  if (active === "select") desk.choose(maps.obstacleAt(maps.map.getPixelFromCoordinate(place)), false);
  else if (active === "circle") commit({do: "circle", x, y, radius_m: 2});
  else if (active === "outline") addCorner(place);
  else if (held.length) drawTo(place, held[0]);
  else commit({do: "ground", place, belongs: active === "ground"});
}

// In the side that is nearest.
function addCorner(place) {
  const away = ({ring, index, place: from}) => ol.coordinate.squaredDistanceToSegment(place, [from, outline()[ring].at((index + 1) % outline()[ring].length)]);
  touched = corners().reduce((best, one) => away(one) < away(best) ? one : best).place;
  reshape(({place: from}) => [from, place]);
}

// Once more at the same place ends a shape, as a double click does; two places give a direction.
function drawTo(place, draw) {
  const last = String(place) === String(way.at(-1));
  if (!last) {
    draw.appendCoordinates([place]);
    desk.speak("corner", {n: way.push(place), all: way.length});
  }
  if (active === "direction" ? way.length < 2 : !last || way.length < (active === "measure" ? 2 : 3)) return;
  way = [];
  draw.finishDrawing();
}

const outline = () => ringsOf(maps.sources.outline.getFeatures()[0]);
const ringsOf = feature => feature.getGeometry().getCoordinates().map(part => part.slice(0, -1).map(at));

export const current = () => active;

export function use(name) {
  active = name;
  way = [];
  rest();
  desk.measured("");
  held = MAKERS[name]();
  for (const one of held) maps.map.addInteraction(one);
  desk.changed();
}

// What a hand still held goes back to where it was.
function rest() {
  const old = held;
  held = [];
  for (const one of old) maps.map.removeInteraction(one);
  maps.sources.sketch.clear(true);
  maps.hold(null);
  endPreview();
  desk.again();
}

const live = command => preview(command, answer => desk.showTracks(answer, true), desk.refused);

function commit(command) {
  endPreview();
  return desk.commit(command);
}

const MAKERS = {
  select: () => [mover(), resizer()],
  circle() {
    const draw = new ol.interaction.Draw({source: maps.sources.sketch, type: "Circle", freehand: true});
    const command = geometry => ({do: "circle", x: at(geometry.getCenter())[0], y: at(geometry.getCenter())[1],
                                  radius_m: Math.max(0.3, Math.round(geometry.getRadius() * desk.scale() * 1000) / 1000)});
    draw.on("drawstart", ({feature}) => feature.getGeometry().on("change", ({target}) => live(command(target))));
    // A click, or a hand that went back to where it began, draws nothing: how it is done is told.
    const explain = () => {
      endPreview();
      desk.again();
      if (held.includes(draw)) desk.explain("k_add");
    };
    draw.on("drawabort", explain);
    draw.on("drawend", async ({feature}) => {
      if (feature.getGeometry().getRadius() < reach / 3 * maps.view.getResolution()) explain();
      else await commit(command(feature.getGeometry()));
      maps.sources.sketch.clear();
    });
    return [draw];
  },
  ground: () => [],
  notground: () => [],
  polygon: () => [shape("Polygon", geometry => ({do: "polygon", ring: ring(geometry)}))],
  anew: () => [shape("Polygon", geometry => ({do: "outline", ring: ring(geometry)}), true)],
  outline() {
    const modify = new ol.interaction.Modify({source: maps.sources.outline, pixelTolerance: 2 * reach});
    // The shape under the hand counts: the answer to the edit before may draw the outline anew meanwhile.
    const command = ({features}) => ({do: "outline", rings: ringsOf(features.item(0))});
    let listening = null;
    modify.on("modifystart", event => {
      maps.hold("outline");
      listening = event.features.item(0).getGeometry().on("change", () => live(command(event)));
    });
    modify.on("modifyend", event => {
      ol.Observable.unByKey(listening);
      maps.hold(null);
      commit(command(event));
    });
    return [modify];
  },
  direction() {
    // Whatever way the hand takes: its two ends count.
    const straight = (way, line) => {
      const ends = [way[0], way.at(-1)];
      if (!line) return new ol.geom.LineString(ends);
      line.setCoordinates(ends);
      return line;
    };
    const draw = new ol.interaction.Draw({source: maps.sources.sketch, type: "LineString", freehand: true, geometryFunction: straight});
    const command = geometry => ({do: "direction", a: at(geometry.getFirstCoordinate()), b: at(geometry.getLastCoordinate())});
    draw.on("drawstart", ({feature}) => feature.getGeometry().on("change", ({target}) => {
      if (target.getLength() > 2) live(command(target));
    }));
    draw.on("drawabort", () => held.includes(draw) && desk.explain("k_turn"));
    draw.on("drawend", async ({feature}) => {
      await commit(command(feature.getGeometry()));
      doneWith(draw);
    });
    return [draw];
  },
  measure() {
    const draw = new ol.interaction.Draw({source: maps.sources.sketch, type: "LineString"});
    const tell = geometry => desk.measured(maps.metres(geometry.getLength() * desk.scale()));
    draw.on("drawstart", ({feature}) => {
      maps.sources.sketch.clear(true);
      feature.getGeometry().on("change", ({target}) => tell(target));
    });
    draw.on("drawend", ({feature}) => tell(feature.getGeometry()));
    return [draw];
  },
};

// A person who took another tool before the answer was there keeps it.
function doneWith(draw) {
  if (held.includes(draw)) use("select");
}

function shape(type, command, back = false) {
  const draw = new ol.interaction.Draw({source: maps.sources.sketch, type});
  draw.on("drawend", async ({feature}) => {
    await commit(command(feature.getGeometry()));
    maps.sources.sketch.clear();
    if (back) doneWith(draw);
  });
  return draw;
}

// A press that was no drag changes nothing.
function letGo(command) {
  maps.hold(null);
  if (command) commit(command);
  else desk.again();
}

// The chosen obstacle follows the pointer; others must be chosen first, so that none is moved by mistake.
function mover() {
  const translate = new ol.interaction.Translate({
    filter: feature => feature.getId() === desk.chosen(),
    layers: layer => layer.getSource() === maps.sources.obstacles,
    hitTolerance: reach,
  });
  // What the hand took is moved, whatever a key makes the chosen one meanwhile.
  let from = null, no = null, dragged = false;
  const command = event => ({do: "move", no, dx_m: at(event.coordinate)[0] - from[0], dy_m: at(event.coordinate)[1] - from[1]});
  translate.on("translatestart", event => {
    from = at(event.startCoordinate ?? event.coordinate);
    no = desk.chosen();
    dragged = false;
    maps.sources.handle.clear();
    maps.hold(no);
  });
  translate.on("translating", event => {
    dragged = true;
    live(command(event));
  });
  translate.on("translateend", event => letGo(dragged && command(event)));
  return translate;
}

function resizer() {
  const translate = new ol.interaction.Translate({
    layers: layer => layer.getSource() === maps.sources.handle, hitTolerance: reach,
  });
  // Wherever the hand took the square, its way counts; what is shown may be ahead of the answer.
  let row = null, grip = 0, before_m = 0, dragged = false;
  const away = ([x, y]) => Math.hypot(x - row.centre[0], y - row.centre[1]);
  const command = ({coordinate}) => ({do: "radius", no: row.no,
    radius_m: Math.max(0.3, Math.round((before_m + (away(coordinate) - grip) * desk.scale()) * 1000) / 1000)});
  translate.on("translatestart", ({coordinate, features}) => {
    row = desk.row(desk.chosen());
    grip = away(coordinate);
    before_m = away(features.item(0).getGeometry().getCoordinates()) - row.buffer_m;
    dragged = false;
    maps.hold(row.no);
  });
  translate.on("translating", event => {
    dragged = true;
    const wanted = command(event);
    maps.sources.obstacles.getFeatureById(row.no)?.setGeometry(
      ol.geom.Polygon.fromCircle(new ol.geom.Circle(row.centre, wanted.radius_m + row.buffer_m), 64));
    live(wanted);
  });
  translate.on("translateend", event => letGo(dragged && command(event)));
  return translate;
}
