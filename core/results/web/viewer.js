// The city of report.html in 3D, the numbers of a surface or building that is clicked, and the table of buildings.
//
// All data lie in the page, packed by core/results/pack_city.py; nothing is fetched. Texts of the data become part of
// the page by textContent alone. THREE is the bundle of three.js in front of this.
"use strict";

const PAGE_OF_ROWS = 25;
const MARK = 0xd5007f; // of the chosen surface
const FADED = [236, 236, 232]; // towards which colours of other buildings go
const NOTES = {
  shapes: "There is no picture in 3D here, as this folder has no shapes of the surfaces. The table has all numbers.",
  webgl: "This browser shows no picture in 3D, as WebGL is missing or switched off. The table has all numbers.",
  old: "This browser is too old for the city in 3D and the table of its buildings. All else on this page is there.",
};
const COLUMNS = [
  { name: "id", title: "Building" },
  { name: "area", title: "Area [m²]", digits: 0 },
  { name: "kwp", title: "Power [kWp]", digits: 1 },
  { name: "mwh", title: "Energy in a year [MWh]", digits: 2 },
  { name: "hours", title: "Full load hours [h]", digits: 1 },
  { name: "flatKwp", title: "In addition flat roofs [kWp]", digits: 1 },
];

let city; // header and arrays of the data
let view = null; // of `buildView`; null without WebGL or shapes
let rows = []; // of the table, a sum for each building
const chosen = { building: -1, surface: -1 };
const order = { column: 3, down: true, shown: PAGE_OF_ROWS };

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

function format(value, digits) {
  if (!Number.isFinite(value)) return "–";
  return value.toLocaleString("en-US", { minimumFractionDigits: digits, maximumFractionDigits: digits });
}

function tableRow(tag, texts, firstNumber = 1) {
  const row = make("tr");
  texts.forEach((text, place) => {
    const cell = make(tag, text);
    if (place >= firstNumber) cell.className = "number";
    row.append(cell);
  });
  return row;
}

// ---- The data

async function unpack(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw"));
  const buffer = await new Response(stream).arrayBuffer();
  const size = new DataView(buffer).getUint32(0, true);
  const found = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  let place = 4 + size;
  for (const entry of found.arrays) {
    found[entry.name] = unpackArray(new Uint8Array(buffer, place, 4 * entry.count), entry);
    place += 4 * entry.count;
  }
  found.energy = found.kwp.map((kwp, surface) => kwp * found.hours[surface]);
  return found;
}

function unpackArray(bytes, { count, whole }) {
  const mixed = new Uint8Array(4 * count);
  for (let plane = 0; plane < 4; plane++) {
    for (let k = 0; k < count; k++) mixed[4 * k + plane] = bytes[plane * count + k];
  }
  if (!whole) return new Float32Array(mixed.buffer);
  const numbers = new Int32Array(mixed.buffer);
  for (let k = 1; k < count; k++) numbers[k] += numbers[k - 1];
  return numbers;
}

function carries(surface) {
  return city.reason[surface] <= 1; // 0: counts, 1: a flat roof, which stands beside the totals
}

function sumSurfaces(surfaces) {
  const sum = { count: 0, area: 0, kwp: 0, mwh: 0, hours: 0 };
  for (const surface of surfaces) {
    sum.count += 1;
    sum.area += city.counted[surface];
    sum.kwp += city.kwp[surface];
    sum.mwh += (city.kwp[surface] * city.hours[surface]) / 1000;
    sum.hours += city.counted[surface] * city.hours[surface];
  }
  sum.hours /= sum.area; // NaN of nothing
  return sum;
}

function sumBuildings() {
  const members = city.buildings.map(() => []);
  city.building.forEach((building, surface) => members[building].push(surface));
  return members.map((surfaces, building) => ({
    id: city.buildings[building],
    building,
    surfaces,
    ...sumSurfaces(surfaces.filter((surface) => city.reason[surface] === 0)),
    flatKwp: sumSurfaces(surfaces.filter((surface) => city.reason[surface] === 1)).kwp,
  }));
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
  if (carries(surface) && Number.isFinite(value)) {
    const share = Math.min(Math.max((value - layer.low) / (layer.high - layer.low), 0), 1) * (stops.length - 1);
    const place = Math.min(Math.floor(share), stops.length - 2);
    colour = stops[place].map((part, k) => part + (share - place) * (stops[place + 1][k] - part));
  }
  const faded = chosen.building >= 0 && city.building[surface] !== chosen.building;
  return faded ? colour.map((part, k) => 0.3 * part + 0.7 * FADED[k]) : colour;
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
  byId("grey-words").textContent = layer.name === "change" ? "is new, or does not count" : "does not count";
  if (!view) return;
  const stops = layer.stops.map(readColour);
  const missing = readColour(city.missing);
  const colours = view.colours.array;
  let surface = -1;
  let colour;
  for (let triangle = 0; triangle < view.owner.length; triangle++) {
    if (view.owner[triangle] !== surface) {
      surface = view.owner[triangle];
      colour = colourOf(surface, layer, stops, missing);
    }
    for (let k = 0; k < 9; k++) colours[9 * triangle + k] = colour[k % 3] * view.shade[triangle];
  }
  view.colours.needsUpdate = true;
  draw();
}

// ---- The picture

function cornerOf(point) {
  const count = city.corners.length / 3;
  return [0, 1, 2].map((axis) => city.corners[axis * count + point] / 1000);
}

function cornersOf(surface) {
  return [city.ring_start[city.surface_start[surface]], city.ring_start[city.surface_start[surface + 1]]];
}

function buildMesh() {
  const { triangles } = city;
  const count = triangles.length / 3;
  const positions = new Float32Array(9 * count);
  const shade = new Float32Array(count);
  const owner = new Int32Array(count);
  const owners = new Int32Array(city.corners.length / 3);
  for (let surface = 0; surface < city.surfaces.length; surface++) owners.fill(surface, ...cornersOf(surface));
  const [a, b, c] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  const light = new THREE.Vector3(-0.35, -0.6, 0.72).normalize(); // from the south-west
  for (let triangle = 0; triangle < count; triangle++) {
    [a, b, c].forEach((corner, k) => {
      corner.set(...cornerOf(triangles[3 * triangle + k]));
      corner.toArray(positions, 9 * triangle + 3 * k);
    });
    const normal = b.sub(a).cross(c.sub(a)).normalize();
    shade[triangle] = 0.87 + 0.13 * normal.dot(light); // so that edges show and colours stay those of the legend
    owner[triangle] = owners[triangles[3 * triangle]];
  }
  const geometry = new THREE.BufferGeometry();
  const colours = new THREE.BufferAttribute(new Uint8Array(9 * count), 3, true);
  geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
  geometry.setAttribute("color", colours);
  const look = { vertexColors: true, side: THREE.DoubleSide, polygonOffset: true };
  const material = new THREE.MeshBasicMaterial({ ...look, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
  return { mesh: new THREE.Mesh(geometry, material), colours, shade, owner };
}

function buildEdges(surfaces, look) {
  const points = [];
  for (const surface of surfaces) {
    for (let ring = city.surface_start[surface]; ring < city.surface_start[surface + 1]; ring++) {
      const [first, last] = [city.ring_start[ring], city.ring_start[ring + 1]];
      for (let k = first; k < last; k++) points.push(...cornerOf(k), ...cornerOf(k + 1 < last ? k + 1 : first));
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
  return new THREE.LineSegments(geometry, new THREE.LineBasicMaterial(look));
}

function buildGround() {
  const [west, east, south, north] = city.plate_bounds;
  const side = Math.round(Math.sqrt(city.plate.length));
  const points = new Float32Array(3 * side * side);
  const corners = [];
  for (let row = 0; row < side; row++) {
    for (let column = 0; column < side; column++) {
      const k = row * side + column;
      points[3 * k] = west + (column / (side - 1)) * (east - west);
      points[3 * k + 1] = south + (row / (side - 1)) * (north - south);
      points[3 * k + 2] = city.plate[k];
      if (row && column) corners.push(k - side - 1, k - side, k, k - side - 1, k, k - 1);
    }
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  geometry.setIndex(corners);
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ color: city.ground, side: THREE.DoubleSide }));
}

function buildView() {
  const canvas = byId("view");
  THREE.ColorManagement.enabled = false; // colours are shown as they are
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
  renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
  const scene = new THREE.Scene();
  scene.background = new THREE.Color(0xe9eef3);
  const camera = new THREE.PerspectiveCamera(35, 1, 1, 1000);
  camera.up.set(0, 0, 1);
  const parts = buildMesh();
  const all = [...city.surfaces.keys()];
  const edges = buildEdges(all, { color: 0x1d2433, transparent: true, opacity: 0.28 });
  scene.add(buildGround(), parts.mesh, edges);
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.maxPolarAngle = 0.495 * Math.PI;
  controls.keyPanSpeed = 30;
  controls.listenToKeyEvents(canvas);
  controls.addEventListener("change", draw);
  return { ...parts, canvas, renderer, scene, camera, controls, mark: null, all, box: boundSurfaces(all) };
}

function visitCorners(surfaces, visit) {
  const corner = new THREE.Vector3();
  for (const surface of surfaces) {
    const [first, last] = cornersOf(surface);
    for (let point = first; point < last; point++) visit(corner.set(...cornerOf(point)));
  }
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
function fly(surfaces, direction, { room = 1, slowly = true } = {}) {
  const { camera, controls } = view;
  const { lower, upper } = boundSurfaces(surfaces);
  const target = lower.add(upper).multiplyScalar(0.5);
  direction.normalize();
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

function showWhole(slowly = true) {
  const { x, y } = view.box.upper.clone().sub(view.box.lower);
  const fromSouth = view.camera.aspect > 1 ? x > 0.7 * y : y > 0.7 * x; // the longer side lies across the picture
  fly(view.all, fromSouth ? new THREE.Vector3(-0.3, -1, 1) : new THREE.Vector3(-1, -0.3, 1), { slowly });
}

function changeDistance(factor) {
  const { camera, controls } = view;
  camera.position.sub(controls.target).multiplyScalar(factor).add(controls.target);
  controls.update();
  draw();
}

function pick(event) {
  const frame = view.canvas.getBoundingClientRect();
  const x = (2 * (event.clientX - frame.left)) / frame.width - 1;
  const y = 1 - (2 * (event.clientY - frame.top)) / frame.height;
  const caster = new THREE.Raycaster();
  caster.setFromCamera(new THREE.Vector2(x, y), view.camera);
  const [hit] = caster.intersectObject(view.mesh);
  return hit ? view.owner[hit.faceIndex] : -1;
}

function listenToCanvas() {
  const { canvas } = view;
  let down = null;
  canvas.addEventListener("pointerdown", (event) => {
    down = event.isPrimary && event.button === 0 ? event : null;
  });
  canvas.addEventListener("pointerup", (event) => {
    if (down && Math.hypot(event.clientX - down.clientX, event.clientY - down.clientY) < 5) chooseSurface(pick(event));
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
  byId("above").addEventListener("click", () => fly(view.all, new THREE.Vector3(0, -1e-3, 1)));
  byId("closer").addEventListener("click", acts["+"]);
  byId("farther").addEventListener("click", acts["-"]);
  new ResizeObserver(fitCanvas).observe(canvas.parentElement);
}

// ---- What was chosen

function nameSurface(surface) {
  const side = city.sides[city.side[surface]];
  const kind = city.kinds[city.kind[surface]].single;
  return side === "none" || side === "" ? kind : `${kind}, ${side}`;
}

function monthBars(surface) {
  const group = `${city.kinds[city.kind[surface]].name} ${city.sides[city.side[surface]]}`;
  const own = city.month_01 && city.months.map((_, k) => city[`month_${String(k + 1).padStart(2, "0")}`][surface]);
  const hours = own ?? city.groups[group];
  if (!hours || !hours.every(Number.isFinite)) return [];
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
  const many = city.kinds[city.kind[surface]].many.toLowerCase();
  const whose = `, mean of all ${many} facing ${city.sides[city.side[surface]]}: this run was without --monthly`;
  return [make("p", `Full load hours of the months [h]${own ? "" : whose}`), bars];
}

function describeSurface(surface) {
  const [hours, error, kwp] = [city.hours[surface], city.error[surface], city.kwp[surface]];
  const found = [
    ["Surface", city.surfaces[surface]],
    ["Tilt", `${format(city.tilt[surface], 1)}°`],
    ["Azimuth", `${format(city.azimuth[surface], 1)}°`],
    ["Area", `${format(city.area[surface], 2)} m²`],
  ];
  if (carries(surface)) {
    found.push(
      ["Area that counts", `${format(city.counted[surface], 2)} m²`],
      ["Power", `${format(kwp, 2)} kWp`],
      ["Full load hours", `${format(hours, 1)} ± ${format(error, 1)} h`],
      ["Energy in a year", `${format(kwp * hours, 0)} ± ${format(kwp * error, 0)} kWh`],
    );
  } else if (Number.isFinite(hours)) found.push(["Full load hours", `${format(hours, 1)} ± ${format(error, 1)} h`]);
  if (city.change) {
    const change = city.change[surface];
    const words = `${change > 0 ? "+" : ""}${format(change, 1)} ± ${format(city.change_error[surface], 1)} h`;
    if (carries(surface)) found.push(["Change of the hours", Number.isFinite(change) ? words : "new"]);
  }
  found.push(["Sky view factor", format(city.sky[surface], 3)]);
  const reason = city.reasons[city.reason[surface]];
  if (reason) found.push([carries(surface) ? "Note" : "Does not count", reason]);
  const body = make("tbody", "", ...found.map((texts) => tableRow("td", texts, 2)));
  const table = make("table", "", body);
  table.className = "facts";
  return [make("h3", nameSurface(surface)), table, ...(carries(surface) ? monthBars(surface) : [])];
}

function describeBuilding({ id, surfaces, building }) {
  const of = (reason) => surfaces.filter((surface) => city.reason[surface] === reason);
  const counted = of(0);
  const parts = city.kinds
    .map(({ many }, kind) => [many, counted.filter((surface) => city.kind[surface] === kind)])
    .map(([title, own]) => ({ title, ...sumSurfaces(own) }))
    .filter((sum) => sum.count);
  if (parts.length > 1) parts.push({ title: "Together", ...sumSurfaces(counted) });
  if (of(1).length) parts.push({ title: "In addition flat roofs, modules lying flat", ...sumSurfaces(of(1)) });
  const texts = (sum) => [sum.title, format(sum.area, 0), format(sum.kwp, 1), format(sum.mwh, 2), format(sum.hours, 1)];
  const body = make("tbody", "", ...parts.map((sum) => tableRow("td", texts(sum))));
  const head = make("thead", "", tableRow("th", ["", "m²", "kWp", "MWh/a", "h"]));
  const list = make("ul");
  const folded = make("details", "", make("summary", `Its ${surfaces.length} surfaces`), list);
  folded.addEventListener("toggle", () => {
    const hours = (surface) => (carries(surface) ? `${format(city.hours[surface], 1)} h` : "–");
    const item = (surface) => button(`${nameSurface(surface)}: ${hours(surface)}`, () => chooseSurface(surface));
    list.replaceChildren(...surfaces.map((surface) => make("li", "", item(surface))));
  });
  const sums = parts.length ? make("table", "", head, body) : make("p", "None of its surfaces counts.");
  const title = make("h3", "Building");
  return [title, make("p", "", button(id, () => chooseBuilding(building, true))), sums, folded];
}

function showChosen() {
  const parts = [];
  if (chosen.surface >= 0) parts.push(...describeSurface(chosen.surface));
  if (chosen.building >= 0) parts.push(...describeBuilding(rows[chosen.building]));
  const hint = "Click on a surface, or on a building in the table below.";
  byId("chosen").replaceChildren(...(parts.length ? parts : [make("p", hint)]));
  if (view) {
    if (view.mark) {
      view.scene.remove(view.mark);
      view.mark.geometry.dispose();
    }
    const look = { color: MARK, depthTest: false, transparent: true }; // what is transparent is drawn last
    view.mark = chosen.surface < 0 ? null : buildEdges([chosen.surface], look);
    if (view.mark) view.scene.add(view.mark);
  }
  paint();
  showTable();
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
  fly(rows[building].surfaces, direction, { room: 2 });
}

// ---- The table

function chooseRows() {
  const wanted = byId("search").value.trim().toLowerCase();
  const holds = (text) => text.toLowerCase().includes(wanted);
  const inSurfaces = (row) => row.surfaces.some((surface) => holds(city.surfaces[surface]));
  const found = wanted ? rows.filter((row) => holds(row.id) || inSurfaces(row)) : [...rows];
  const { name } = COLUMNS[order.column];
  const sign = order.down ? -1 : 1;
  const number = (row) => (Number.isFinite(row[name]) ? row[name] : -Infinity);
  const compare = order.column ? (a, b) => number(a) - number(b) : (a, b) => (a.id < b.id ? -1 : 1);
  return found.sort((a, b) => (number(a) === number(b) && order.column ? 0 : sign * compare(a, b)));
}

function showTable() {
  const found = chooseRows();
  const head = COLUMNS.map((column, place) => {
    const sorted = place === order.column;
    const arrow = order.down ? " ▾" : " ▴";
    const cell = make("th", "", button(column.title + (sorted ? arrow : ""), () => sortBy(place)));
    cell.setAttribute("aria-sort", !sorted ? "none" : order.down ? "descending" : "ascending");
    if (place) cell.className = "number";
    return cell;
  });
  const body = found.slice(0, order.shown).map((row) => {
    const texts = COLUMNS.map(({ name, digits }) => (digits === undefined ? "" : format(row[name], digits)));
    const line = tableRow("td", texts);
    line.firstChild.append(button(row.id, () => chooseBuilding(row.building, true)));
    if (row.building === chosen.building) line.className = "chosen";
    return line;
  });
  const table = byId("buildings");
  table.tHead.rows[0].replaceChildren(...head);
  table.tBodies[0].replaceChildren(...body);
  byId("found").textContent = `${format(found.length, 0)} of ${format(rows.length, 0)}`;
  byId("more").hidden = found.length <= order.shown;
}

function sortBy(place) {
  order.down = place === order.column ? !order.down : place > 0;
  order.column = place;
  showTable();
  byId("buildings").tHead.rows[0].cells[place].firstChild.focus();
}

// ---- Beginning

function note(words) {
  byId("note").textContent = words;
  byId("note").hidden = false;
}

function show(...names) {
  for (const name of names) byId(name).hidden = false;
}

function tryView() {
  if (!city.corners) {
    note(NOTES.shapes);
    return null;
  }
  try {
    return buildView();
  } catch {
    note(NOTES.webgl);
    return null;
  }
}

async function begin() {
  if (!("DecompressionStream" in window)) {
    note(NOTES.old);
    return;
  }
  city = await unpack(byId("data").textContent);
  rows = sumBuildings();
  if (!rows.some((row) => row.flatKwp)) COLUMNS.pop();
  const options = city.layers.map((layer, place) => {
    const option = make("option", layer.title);
    option.value = place;
    return option;
  });
  byId("layer").append(...options);
  for (const name of ["layer", "shared"]) byId(name).addEventListener("change", paint);
  byId("search").addEventListener("input", () => {
    order.shown = PAGE_OF_ROWS;
    showTable();
  });
  byId("more").addEventListener("click", () => {
    order.shown += 4 * PAGE_OF_ROWS;
    showTable();
  });
  show("stage", "table");
  view = tryView();
  if (view) {
    show("tools", "help");
    listenToCanvas();
    fitCanvas();
    showWhole(false);
  } else byId("stage").className = "alone";
  showChosen();
}

begin();
