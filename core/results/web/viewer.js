// A city in 3D, the numbers of a surface or building that is clicked, the search and the table of buildings: what the
// report (report.js) and a city's solar map (map.js) share. supply.js, between them, shows which surfaces pay.
//
// Each of them defines what it does in its own way: paintPicture, paintModules, visitCorners, showMark, choosePicked,
// rowOf, partsOf, findRows and findBuilding. Texts of the data become part of the page by textContent alone. THREE is
// the bundle of three.js. Further scripts join in by two events of the document: "city-ready", when everything stands,
// and "city-chosen" after each choice (detail: building and surface, −1 if none, and the building's row), and choose by
// chooseBuilding(number, true) or chooseSurface(number).
"use strict";

const WORDS = JSON.parse(document.getElementById("words").textContent); // English to the language of the page
const PAGE_OF_ROWS = 10;
const MOST_HITS = 50; // in the list beside the picture
const NOTES = {
  shapes: "There is no picture in 3D here, as this folder has no shapes of the surfaces. The table has all numbers.",
  webgl: "This browser shows no picture in 3D, as WebGL is missing or switched off. The table has all numbers.",
  old: "This browser is too old for the city in 3D and the table of its buildings. All else on this page is there.",
};
const TEXTS = ["address", "name", "function", "year"]; // of a building, where its file has them
let tableColumns = [
  { name: "id", title: "Building" },
  { name: "address", title: "Address" },
  { name: "name", title: "Name" },
  { name: "function", title: "Function" },
  { name: "year", title: "Built" },
  { name: "area", title: "Area [m²]", digits: 0 },
  { name: "kwp", title: "Power [kWp]", digits: 1 },
  { name: "mwh", title: "Energy in a year [MWh]", digits: 2 },
  { name: "hours", title: "Full load hours [h]", digits: 1 },
  { name: "flatKwp", title: "In addition flat roofs [kWp]", digits: 1 },
];

let city; // header and arrays of the data; of a map those of a tile
let least = 0; // [h] of the slider: surfaces with fewer hours are grey
let view = null; // of `startView`; null without WebGL or shapes
const scheme = {}; // colours of the style sheet for what is drawn in 3D: sky, ground, faded, mark
const chosen = { building: -1, surface: -1 };
const order = { name: "mwh", down: true, shown: PAGE_OF_ROWS };

// ---- The page

function byId(name) {
  return document.getElementById(`city-${name}`);
}

function make(tag, text = "", ...children) {
  const element = document.createElement(tag);
  element.textContent = text;
  element.append(...children);
  return element;
}

function button(text, act) {
  const element = make("button", text);
  element.type = "button";
  element.addEventListener("click", act);
  return element;
}

// A text in the language of the page, whose table core/results/words.py brings along; values replace names in braces.
function say(text, values = {}) {
  return (WORDS[text] ?? text).replace(/\{(\w+)\}/g, (_, name) => values[name]);
}

// Numbers as the language writes them, a true minus, never −0; "+" above zero only if asked for.
function format(value, digits, plus = "") {
  if (!Number.isFinite(value)) return "–";
  const rounded = Number(value.toFixed(digits)) || 0;
  const text = rounded.toLocaleString("en-US", { minimumFractionDigits: digits, maximumFractionDigits: digits });
  const signs = say("1,234.5");
  const written = { ",": signs[1], ".": signs.at(-2), "-": "−" };
  return (rounded > 0 ? plus : "") + text.replace(/[,.-]/g, (sign) => written[sign]);
}

// A text as it is searched: small letters without accents, ß as ss; as words.py does for the index of a map.
function plain(text) {
  const letters = text.normalize("NFD").replace(/\p{M}/gu, "").toLowerCase();
  return letters.replace(/[ßæœøłđ]/g, (letter) => ({ ß: "ss", æ: "ae", œ: "oe", ø: "o", ł: "l", đ: "d" })[letter]);
}

function tableRow(tag, texts, firstNumber = 1) {
  const row = make("tr");
  texts.forEach((text, place) => {
    const cell = make(text ? tag : "td", text); // an empty heading is none
    if (place >= firstNumber) cell.className = "number";
    row.append(cell);
  });
  return row;
}

// ---- The data

function carries(surface) {
  return city.kwp[surface] > 0;
}

function sumSurfaces(surfaces) {
  const parts = surfaces.map((surface) => {
    const [area, kwp, hours] = [city.counted[surface], city.kwp[surface], city.hours[surface]];
    return { area, kwp, mwh: (kwp * hours) / 1000, hours };
  });
  return { count: parts.length, ...addParts(parts) };
}

function addEnergy(columns) {
  columns.energy = columns.kwp.map((kwp, surface) => kwp * columns.hours[surface]);
  columns.energy_error = columns.kwp.map((kwp, surface) => kwp * columns.error[surface]);
  return columns;
}

function addParts(parts) {
  const sum = { area: 0, kwp: 0, mwh: 0 };
  for (const { area, kwp, mwh } of parts) {
    sum.area += area;
    sum.kwp += kwp;
    sum.mwh += mwh;
  }
  sum.hours = (1000 * sum.mwh) / sum.kwp; // NaN of nothing
  return sum;
}

// Sums over the kinds of some surfaces that count, and over flat roofs, which stand beside these.
function sumKinds(surfaces) {
  // 0: in the totals, 1: beside them.
  const of = (reason) => surfaces.filter((surface) => city.reason[surface] === reason);
  const counted = city.kinds
    .map((_, kind) => ({ kind, ...sumSurfaces(of(0).filter((surface) => city.kind[surface] === kind)) }))
    .filter((sum) => sum.count);
  return { counted, flat: of(1).length ? sumSurfaces(of(1)) : null };
}

// ---- Colours

function readColour(text) {
  return [1, 3, 5].map((place) => parseInt(text.slice(place, place + 2), 16));
}

function currentLayer() {
  const layer = city.layers[byId("layer").value];
  const [low, high] = layer.shared && byId("shared").checked ? layer.shared : layer.range;
  return { ...layer, low, high, values: city[layer.name] };
}

function colourOf(surface, layer, stops, missing) {
  const value = layer.values[surface];
  let colour = missing;
  if (carries(surface) && Number.isFinite(value) && !(city.hours[surface] < least)) {
    const share = Math.min(Math.max((value - layer.low) / (layer.high - layer.low), 0), 1) * (stops.length - 1);
    const place = Math.min(Math.floor(share), stops.length - 2);
    colour = stops[place].map((part, k) => part + (share - place) * (stops[place + 1][k] - part));
  }
  const faded = chosen.building >= 0 && city.building?.[surface] !== chosen.building;
  return faded ? colour.map((part, k) => 0.3 * part + 0.7 * scheme.faded[k]) : colour;
}

function paint() {
  const layer = currentLayer();
  byId("shared-label").hidden = !layer.shared;
  byId("legend-title").textContent = layer.unit ? `${layer.title} [${layer.unit}]` : layer.title;
  byId("ramp").style.background = `linear-gradient(to right, ${layer.stops.join(", ")})`;
  const ticks = [0, 0.5, 1].map((share) => layer.low + share * (layer.high - layer.low));
  const digits = ticks[2] - ticks[0] >= 10 ? 0 : 2;
  byId("ticks").replaceChildren(...ticks.map((tick) => make("span", format(tick, digits))));
  byId("grey").style.background = city.missing;
  const few = least ? say(" or has less than {hours} h", { hours: format(least, 0) }) : "";
  const fresh = layer.name === "change" ? say("is new, or ") : "";
  byId("grey-words").textContent = fresh + say("does not count") + few;
  if (!view) return;
  paintPicture(layer, layer.stops.map(readColour), readColour(city.missing));
  paintModules();
  draw();
}

// ---- The picture

function startView() {
  const canvas = byId("view");
  THREE.ColorManagement.enabled = false; // colours are shown as they are
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  const scene = new THREE.Scene();
  scene.background = new THREE.Color();
  const camera = new THREE.PerspectiveCamera(35, 1, 1, 1000);
  camera.up.set(0, 0, 1);
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.maxPolarAngle = 0.495 * Math.PI;
  controls.keyPanSpeed = 30;
  controls.listenToKeyEvents(canvas);
  controls.addEventListener("change", draw);
  return { canvas, renderer, scene, camera, controls, grounds: [] };
}

// Colours of the style sheet, light or dark as the reader's system is.
function wearScheme() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["sky", "ground", "basemap", "faded", "mark"]) {
    scheme[name] = style.getPropertyValue(`--${name}`).trim();
  }
  scheme.faded = readColour(scheme.faded);
  if (!view) return;
  view.scene.background.set(scheme.sky);
  for (const material of view.grounds) material.color.set(groundColour(material));
  showMark();
  paint();
}

// A basemap keeps its colours by day, and is darker by night.
function groundColour(material) {
  return material.map ? scheme.basemap : scheme.ground;
}

// Light of a sun in the south-west and of the sky above: faces of a shape differ in brightness alone, by a factor of
// 0.55 to 1, so that their colours stay those of the legend.
function shadeOf(normal) {
  return 0.74 + 0.17 * normal.dot(new THREE.Vector3(-0.35, -0.6, 0.72).normalize()) + 0.09 * normal.z;
}

function lookOfSurfaces() {
  const look = { vertexColors: true, side: THREE.DoubleSide, polygonOffset: true };
  return { ...look, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
}

const LOOK_OF_EDGES = { color: 0x10161f, transparent: true, opacity: 0.3 };
const LOOK_OF_MODULES = { color: 0x14213d, transparent: true, opacity: 0.6, side: 2 }; // seen from both sides
const LOOK_OF_MARK = { depthTest: false, transparent: true }; // what is transparent is drawn last

function buildLines(points, look) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
  const lines = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial(look));
  lines.raycast = () => {}; // a click means a surface
  return lines;
}

// Modules as one mesh before the faces, whose colours show through. Of each its lower left corner and the two edges
// from it.
function buildModules(count, shapeOf) {
  const points = new Float32Array(12 * count);
  for (let k = 0; k < count; k++) {
    const [corner, along, up] = shapeOf(k);
    for (let axis = 0; axis < 3; axis++) {
      const places = [0, along[axis], along[axis] + up[axis], up[axis]];
      places.forEach((place, point) => (points[12 * k + 3 * point + axis] = corner[axis] + place));
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  return wearModules(new THREE.Mesh(geometry));
}

function wearModules(mesh) {
  mesh.material = new THREE.MeshBasicMaterial(LOOK_OF_MODULES);
  mesh.raycast = () => {}; // a click means a surface
  return mesh;
}

// Modules of the faces that pay for the slider; `surfaces` carry them, one after the other.
function fillModules(mesh, surfaces, columns) {
  mesh.visible = byId("modules").checked;
  if (!mesh.visible) return;
  const corners = [];
  surfaces.forEach((surface, k) => {
    if (columns.kwp[surface] > 0 && !(columns.hours[surface] < least)) {
      for (const point of [0, 1, 2, 0, 2, 3]) corners.push(4 * k + point);
    }
  });
  mesh.geometry.setIndex(corners);
}

function boundSurfaces(surfaces) {
  const lower = new THREE.Vector3(Infinity, Infinity, Infinity);
  const upper = lower.clone().negate();
  visitCorners(surfaces, (corner) => {
    lower.min(corner);
    upper.max(corner);
  });
  return { lower, upper };
}

function draw() {
  if (!view || view.waiting) return;
  view.waiting = true;
  requestAnimationFrame(() => {
    view.waiting = false;
    const { camera, controls, renderer, scene } = view;
    const distance = camera.position.distanceTo(controls.target);
    camera.near = Math.max(distance / 100, 0.1);
    camera.far = distance + 2 * view.box.lower.distanceTo(view.box.upper) + 1000;
    camera.updateProjectionMatrix();
    view.update?.();
    renderer.render(scene, camera);
    const north = Math.atan2(camera.position.x - controls.target.x, controls.target.y - camera.position.y);
    byId("north").style.transform = `rotate(${north}rad)`;
  });
}

function fitCanvas() {
  const { clientWidth, clientHeight } = view.canvas.parentElement;
  view.renderer.setSize(clientWidth, clientHeight, false);
  view.camera.aspect = clientWidth / Math.max(clientHeight, 1);
  draw();
}

// Distance from a target, along a direction, at which all corners of some surfaces are in view.
function fitSurfaces(surfaces, target, direction) {
  const { camera } = view;
  const right = new THREE.Vector3().crossVectors(camera.up, direction).normalize();
  const upward = new THREE.Vector3().crossVectors(direction, right);
  const height = Math.tan((Math.PI / 360) * camera.fov);
  let distance = 1;
  visitCorners(surfaces, (corner) => {
    corner.sub(target);
    const across = Math.max(Math.abs(corner.dot(right)) / camera.aspect, Math.abs(corner.dot(upward)));
    distance = Math.max(distance, corner.dot(direction) + (1.05 * across) / height);
  });
  return distance;
}

// Look at surfaces from a direction, so that all are in view with some room; half a second on the way where `slowly`.
function fly(surfaces, direction, { room = 1, slowly = true, centred = false } = {}) {
  const { camera, controls } = view;
  const { lower, upper } = boundSurfaces(surfaces);
  const target = lower.add(upper).multiplyScalar(0.5);
  direction.normalize();
  if (centred) centreTarget(surfaces, target, direction);
  const position = target.clone().addScaledVector(direction, room * fitSurfaces(surfaces, target, direction));
  const from = { position: camera.position.clone(), target: controls.target.clone(), time: performance.now() };
  const calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  const step = (time) => {
    const share = slowly && !calm ? Math.min(Math.max((time - from.time) / 500, 0), 1) : 1;
    const eased = share * share * (3 - 2 * share);
    camera.position.lerpVectors(from.position, position, eased);
    controls.target.lerpVectors(from.target, target, eased);
    controls.update();
    draw();
    if (share < 1) requestAnimationFrame(step);
  };
  step(from.time);
}

// Move a target so that what is seen of surfaces lies in the middle of the picture, though what is near is larger.
function centreTarget(surfaces, target, direction) {
  const right = new THREE.Vector3().crossVectors(view.camera.up, direction).normalize();
  const upward = new THREE.Vector3().crossVectors(direction, right);
  for (let step = 0; step < 4; step++) {
    const distance = fitSurfaces(surfaces, target, direction);
    const ends = { right: [Infinity, -Infinity], upward: [Infinity, -Infinity] };
    visitCorners(surfaces, (corner) => {
      corner.sub(target);
      const scale = distance / (distance - corner.dot(direction));
      for (const [name, axis] of [["right", right], ["upward", upward]]) {
        const place = corner.dot(axis) * scale;
        ends[name] = [Math.min(ends[name][0], place), Math.max(ends[name][1], place)];
      }
    });
    target.addScaledVector(right, (ends.right[0] + ends.right[1]) / 2);
    target.addScaledVector(upward, (ends.upward[0] + ends.upward[1]) / 2);
  }
}

function showWhole(slowly = true) {
  const { x, y } = view.box.upper.clone().sub(view.box.lower);
  const fromSouth = view.camera.aspect > 1 ? x > 0.7 * y : y > 0.7 * x; // the longer side lies across the picture
  const direction = fromSouth ? new THREE.Vector3(-0.3, -1, 1) : new THREE.Vector3(-1, -0.3, 1);
  fly(view.all, direction, { slowly, centred: true });
}

function changeDistance(factor) {
  const { camera, controls } = view;
  camera.position.sub(controls.target).multiplyScalar(factor).add(controls.target);
  controls.update();
  draw();
}

function castRay(event) {
  const frame = view.canvas.getBoundingClientRect();
  const x = (2 * (event.clientX - frame.left)) / frame.width - 1;
  const y = 1 - (2 * (event.clientY - frame.top)) / frame.height;
  const caster = new THREE.Raycaster();
  caster.setFromCamera(new THREE.Vector2(x, y), view.camera);
  return caster;
}

function listenToCanvas() {
  const { canvas } = view;
  let down = null;
  canvas.addEventListener("pointerdown", (event) => {
    down = event.isPrimary && event.button === 0 ? event : null;
  });
  canvas.addEventListener("pointerup", (event) => {
    const moved = down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY);
    if (down && moved < 5) choosePicked(castRay(event));
    down = null;
  });
  const acts = {
    "+": () => changeDistance(0.8),
    "=": () => changeDistance(0.8),
    "-": () => changeDistance(1.25),
    Home: () => showWhole(),
    Escape: () => chooseBuilding(-1),
  };
  canvas.addEventListener("webglcontextrestored", draw);
  canvas.addEventListener("keydown", (event) => {
    if (!acts[event.key] || event.ctrlKey || event.metaKey) return;
    event.preventDefault();
    acts[event.key]();
  });
  byId("home").addEventListener("click", () => showWhole());
  byId("above").addEventListener("click", () => fly(view.all, new THREE.Vector3(0, -1e-3, 1), { centred: true }));
  byId("closer").addEventListener("click", acts["+"]);
  byId("farther").addEventListener("click", acts["-"]);
  new ResizeObserver(fitCanvas).observe(canvas.parentElement);
}

// ---- What was chosen

function nameSurface(surface) {
  const side = city.sides[city.orientation[surface]];
  const kind = city.kinds[city.kind[surface]].single;
  return side === "none" || side === "" ? kind : `${kind}, ${say(side)}`;
}

function monthBars(surface) {
  const hours = city.months.map((_, k) => city[`month_${String(k + 1).padStart(2, "0")}`]?.[surface]);
  if (!hours.every(Number.isFinite)) return [];
  const bars = make("div");
  bars.className = "months";
  bars.setAttribute("role", "img");
  bars.setAttribute("aria-label", hours.map((value, k) => `${city.months[k]} ${format(value, 1)} h`).join(", "));
  const most = Math.max(...hours, 1e-9);
  hours.forEach((value, k) => {
    const bar = make("i");
    bar.style.height = `${(4.6 * value) / most}rem`;
    const number = make("span", format(value, value < 9.5 ? 1 : 0));
    bars.append(make("div", "", number, bar, make("span", city.months[k][0])));
  });
  return [make("p", say("Full load hours of the months [h]")), bars];
}

function writeFact({ name, unit, digits, error, plus }, surface) {
  const more = error ? ` ± ${format(city[error][surface], digits)}` : "";
  return `${format(city[name][surface], digits, plus)}${more}${unit}`;
}

function describeSurface(surface) {
  const found = city.surface_id ? [[say("Surface"), city.surface_id[surface]]] : [];
  for (const column of city.columns) {
    const known = Number.isFinite(city[column.name]?.[surface]);
    if (city[column.name] && (carries(surface) || (known && !column.mounted))) {
      found.push([column.title, known ? writeFact(column, surface) : column.unknown]);
    }
  }
  const reason = city.reasons[city.reason[surface]];
  if (reason) found.push([carries(surface) ? say("Note") : say("Does not count"), reason]);
  const body = make("tbody", "", ...found.map((texts) => tableRow("td", texts, 2)));
  const table = make("table", "", body);
  table.className = "facts";
  return [make("h2", nameSurface(surface)), table, ...(carries(surface) ? monthBars(surface) : [])];
}

// Addresses of a building without the town that most have.
function listAddresses(row) {
  const ends = (place) => city.town && place.endsWith(`, ${city.town}`);
  const places = row.address ? row.address.split("; ") : [];
  return places.map((place) => (ends(place) ? place.slice(0, -2 - city.town.length) : place));
}

// What a reader calls a building: its first address, else its name, else its id.
function titleOf(row) {
  const [first, ...more] = listAddresses(row);
  return first ? first + (more.length ? ` +${more.length}` : "") : row.name || row.id;
}

// What a building is for, if it is told in words: a bare code tells a reader nothing.
function useOf(row) {
  return /\p{L}{3}/u.test(row.function) ? row.function : "";
}

function describeBuilding(row) {
  const { counted, flat } = partsOf(row);
  const parts = counted.map((sum) => ({ ...sum, title: city.kinds[sum.kind].many }));
  if (parts.length > 1) parts.push({ ...row, area: addParts(counted).area, title: say("Together") });
  if (flat) parts.push({ title: say("In addition flat roofs, modules lying flat"), ...flat });
  const cells = (sum) => [sum.title, format(sum.area, 0), format(sum.kwp, 1), format(sum.mwh, 2), format(sum.hours, 1)];
  const body = make("tbody", "", ...parts.map((sum) => tableRow("td", cells(sum))));
  const head = make("thead", "", tableRow("th", ["", "m²", "kWp", "MWh/a", "h"]));
  const sums = parts.length ? make("table", "", head, body) : make("p", say("None of its surfaces counts."));
  const name = make("p", "", button(row.id, () => chooseBuilding(row.building, true)));
  const title = listAddresses(row).join(", ") || row.name || say("Building");
  const texts = [row.name === title ? "" : row.name, useOf(row), row.year].filter((text) => text);
  const known = texts.length ? [make("p", texts.join(" · "))] : [];
  const signed = `${format(row.change, 2, "+")} ± ${format(row.changeError, 2)}`;
  const words = say("Change of its energy in a year: {change} MWh", { change: signed });
  const change = Number.isFinite(row.change) ? [make("p", words)] : [];
  const surfaces = row.surfaces ? [foldSurfaces(row.surfaces)] : [];
  return [make("h2", title), name, ...known, sums, ...change, ...surfaces];
}

function foldSurfaces(surfaces) {
  const list = make("ul");
  const count = say("Its {count} surfaces", { count: format(surfaces.length, 0) });
  const folded = make("details", "", make("summary", count), list);
  folded.addEventListener("toggle", () => {
    const hours = (surface) => (carries(surface) ? `${format(city.hours[surface], 1)} h` : "–");
    const item = (surface) => button(`${nameSurface(surface)}: ${hours(surface)}`, () => chooseSurface(surface));
    list.replaceChildren(...surfaces.map((surface) => make("li", "", item(surface))));
  });
  return folded;
}

function showChosen() {
  const parts = [];
  if (chosen.building >= 0) parts.push(button(say("‹ All buildings"), () => chooseBuilding(-1)));
  if (chosen.surface >= 0) parts.push(...describeSurface(chosen.surface));
  const row = chosen.building >= 0 ? rowOf(chosen.building) : null;
  if (row) parts.push(...describeBuilding(row));
  byId("chosen").replaceChildren(...parts);
  byId("chosen").scrollTop = 0;
  byId("best").hidden = parts.length > 0;
  if (view) showMark();
  paint();
  showTable();
  document.dispatchEvent(new CustomEvent("city-chosen", { detail: { ...chosen, row } }));
}

function chooseSurface(surface) {
  chosen.surface = surface;
  chosen.building = surface < 0 ? -1 : city.building[surface];
  showChosen();
}

function chooseBuilding(building, go = false) {
  chosen.building = building;
  chosen.surface = -1;
  showChosen();
  if (!go) return;
  byId("stage").scrollIntoView({ block: "nearest" });
  if (!view) return;
  const direction = view.camera.position.clone().sub(view.controls.target);
  direction.z = Math.max(direction.z, 0.6 * Math.hypot(direction.x, direction.y)); // from above, over its neighbours
  fly(rowOf(building).shape, direction, { room: 2 });
}

// ---- The table

function isNumber(column) {
  return column.digits !== undefined;
}

function sortRows(found, { name, down }) {
  const sign = down ? -1 : 1;
  const number = (row) => (Number.isFinite(row[name]) ? row[name] : -Infinity);
  const text = (row) => row[name] ?? "";
  if (isNumber(tableColumns.find((column) => column.name === name))) {
    return found.sort((a, b) => (number(a) === number(b) ? 0 : sign * (number(a) - number(b))));
  }
  return found.sort((a, b) => (text(a) === text(b) ? 0 : text(a) < text(b) ? -sign : sign));
}

function showTable() {
  const found = sortRows(findRows(), order);
  const head = tableColumns.map((column, place) => {
    const sorted = column.name === order.name;
    const arrow = order.down ? " ▾" : " ▴";
    const cell = make("th", "", button(say(column.title) + (sorted ? arrow : ""), () => sortBy(place)));
    cell.setAttribute("aria-sort", !sorted ? "none" : order.down ? "descending" : "ascending");
    if (isNumber(column)) cell.className = "number";
    return cell;
  });
  const firstNumber = tableColumns.findIndex(isNumber);
  const body = found.slice(0, order.shown).map((row) => {
    const texts = tableColumns.map(({ name, digits, plus }) => {
      if (digits !== undefined) return format(row[name], digits, plus);
      return name === "id" ? "" : row[name];
    });
    const line = tableRow("td", texts, firstNumber);
    line.firstChild.append(button(row.id, () => chooseBuilding(row.building, true)));
    if (row.building === chosen.building) line.className = "chosen";
    return line;
  });
  const table = byId("buildings");
  table.tHead.rows[0].replaceChildren(...head);
  table.tBodies[0].replaceChildren(...body);
  byId("more").hidden = found.length <= order.shown;
  showHits(found);
}

// The list beside the picture: what was searched, or the buildings with most energy, or with the largest change.
function showHits(found) {
  const wanted = byId("search").value.trim();
  const changes = tableColumns.some(({ name }) => name === "change");
  const { name, digits, plus } = tableColumns.find((column) => column.name === (changes ? "change" : "mwh"));
  const size = (row) => (Number.isFinite(row[name]) ? Math.abs(row[name]) : -1);
  const best = [...found].sort((a, b) => size(b) - size(a)).slice(0, MOST_HITS);
  const count = { count: format(found.length, 0), all: format(city.buildings.length ?? city.buildings, 0) };
  byId("found").textContent = wanted ? say("{count} of {all} buildings", count) : say("{all} buildings", count);
  const changed = say("Largest change of energy in a year");
  const title = changes ? changed : say("Most energy in a year");
  byId("best-title").textContent = found.length ? title : say("Nothing is called so.");
  byId("stage").classList.toggle("searching", wanted !== "" && chosen.building < 0);
  const items = best.map((row) => {
    const item = button("", () => chooseBuilding(row.building, true));
    const energy = make("span", `${format(row[name], digits, plus)} MWh`);
    energy.className = "number";
    const named = listAddresses(row).length ? row.name : "";
    const more = [named, useOf(row), row.year].filter((text) => text);
    const power = say("{kwp} kWp, {hours} h", { kwp: format(row.kwp, 1), hours: format(row.hours, 0) });
    const bar = make("i");
    bar.style.width = `${(100 * Math.max(size(row), 0)) / Math.max(size(best[0]), 1e-9)}%`;
    item.append(make("b", titleOf(row)), energy, make("small", [...more, power].join(" · ")), bar);
    return make("li", "", item);
  });
  byId("hits").replaceChildren(...items);
}

function sortBy(place) {
  const { name } = tableColumns[place];
  order.down = name === order.name ? !order.down : isNumber(tableColumns[place]);
  order.name = name;
  showTable();
  byId("buildings").tHead.rows[0].cells[place].firstChild.focus();
}

// Columns that hold nothing, or only zeros, are not shown.
function dropColumns(holds) {
  const always = ["id", "area", "kwp", "mwh", "hours"];
  tableColumns = tableColumns.filter(({ name }) => always.includes(name) || holds(name));
}

// What is typed shows the list in place of a chosen building; Enter goes to the first that was found.
function listenToSearch(find) {
  byId("search").addEventListener("input", () => {
    order.shown = PAGE_OF_ROWS;
    if (chosen.building >= 0) chooseBuilding(-1);
    find();
  });
  byId("search").addEventListener("keydown", (event) => {
    if (event.key === "Enter") byId("hits").querySelector("button")?.click();
  });
}

// ---- Beginning

function note(words) {
  byId("note").textContent = say(words);
  byId("note").hidden = false;
}

function show(...names) {
  for (const name of names) byId(name).hidden = false;
}

function tryView(build) {
  try {
    return build();
  } catch {
    note(NOTES.webgl);
    return null;
  }
}

function showPage() {
  const options = city.layers.map((layer, place) => {
    const option = make("option", layer.title);
    option.value = place;
    return option;
  });
  byId("layer").append(...options);
  for (const name of ["layer", "shared", "modules"]) byId(name).addEventListener("change", paint);
  byId("more").addEventListener("click", () => {
    order.shown += 4 * PAGE_OF_ROWS;
    showTable();
  });
  show("stage", "table");
  showSupply();
  if (view) {
    show("tools", "help");
    listenToCanvas();
    fitCanvas();
    showWhole(false);
  } else byId("stage").classList.add("alone");
  wearScheme();
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", wearScheme);
  showChosen();
  document.dispatchEvent(new CustomEvent("city-ready"));
}
