// A city's solar map: tiles of 3D Tiles, written by core/results/tile_tree.py, and shards of an index of buildings.
//
// TILES is the bundle of 3d-tiles-renderer. Everything is read from the folder of the page.

const CLOSE = 150; // [m] to which a click on what is drawn from afar goes
NOTES.file =
  "A browser reads no map from files. Put this folder on a web server, or type in it: python3 -m http.server";
NOTES.lost = "The map's files could not be read. Is the folder whole?";

const MOST_OFF = 10; // pixels that what is drawn may be off: lower walls are left out

let header; // of map.json
let tiles; // of 3d-tiles-renderer
let found = []; // rows of the table
const loaded = new Map(); // of each tile that is loaded: its columns and what is drawn
const worn = new Map(); // modules of each tile of modules that is loaded
const known = new Map(); // rows of buildings by their number
const shards = new Map(); // of the index, as far as they were read

async function readJson(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
}

// ---- Tiles

async function readColumn(parser, { values, stringOffsets }, { type, componentType, noData }) {
  const data = await parser.getDependency("bufferView", values);
  if (type === "STRING") {
    const offsets = new Uint32Array(await parser.getDependency("bufferView", stringOffsets));
    const bytes = new Uint8Array(data);
    return [...offsets.subarray(1)].map((end, k) => new TextDecoder().decode(bytes.subarray(offsets[k], end)));
  }
  if (type === "ENUM" || componentType === "UINT8") return new Uint8Array(data);
  if (componentType === "UINT32") return new Uint32Array(data);
  return new Float32Array(data).map((number) => (number === noData ? NaN : number));
}

async function readColumns(parser) {
  const { schema, propertyTables } = parser.json.extensions.EXT_structural_metadata;
  const [table] = propertyTables;
  const columns = Object.create(header);
  for (const [name, place] of Object.entries(table.properties)) {
    columns[name] = await readColumn(parser, place, schema.classes.surface.properties[name]);
  }
  return addEnergy(columns);
}

function shadesOf({ tilt, azimuth, hours }) {
  const rad = Math.PI / 180;
  return Array.from(hours, (_, k) => {
    const level = tilt ? Math.sin(rad * tilt[k]) : 0;
    const turn = azimuth && Number.isFinite(azimuth[k]) ? rad * azimuth[k] : 0;
    const upward = tilt ? Math.cos(rad * tilt[k]) : 1;
    return shadeOf(new THREE.Vector3(level * Math.sin(turn), level * Math.cos(turn), upward));
  });
}

async function addTile({ scene, tile }) {
  const columns = await readColumns(tile.engineData.metadata.parser);
  let mesh;
  scene.traverse((part) => {
    if (part.geometry?.getAttribute("_feature_id_0")) mesh = part;
    else if (part.isMesh) {
      view.grounds.push(part.material);
      if (header.basemap) wearBasemap(part);
      part.material.color.set(groundColour(part.material));
    }
  });
  const owner = mesh.geometry.getAttribute("_feature_id_0").array;
  if (mesh.userData.modules) {
    const surfaces = Array.from({ length: owner.length / 4 }, (_, k) => owner[4 * k]);
    worn.set(tile, { mesh: wearModules(mesh), surfaces, columns });
    paintModules();
    draw();
    return;
  }
  const corners = mesh.geometry.getAttribute("position").count;
  const colours = new THREE.BufferAttribute(new Uint8Array(3 * corners), 3, true);
  mesh.geometry.setAttribute("color", colours);
  mesh.material = new THREE.MeshBasicMaterial(lookOfSurfaces());
  const record = { columns, mesh, colours, owner, shades: shadesOf(columns) };
  loaded.set(tile, record);
  mesh.userData.record = record;
  if (columns.building) mesh.add(buildLines(findEdges(record), LOOK_OF_EDGES));
  const layer = currentLayer();
  paintTile(record, layer, layer.stops.map(readColour), readColour(city.missing));
  if (chosen.surface < 0 && chosen.building >= 0 && columns.building?.includes(chosen.building)) showChosen();
  draw();
}

// Ends of the edges that one triangle of a surface has alone, of all surfaces or one.
function findEdges({ mesh, owner }, surface = -1) {
  const { index, attributes } = mesh.geometry;
  const lone = new Map();
  for (let k = 0; k < index.count; k++) {
    const [from, to] = [index.getX(k), index.getX(k % 3 === 2 ? k - 2 : k + 1)];
    if (surface >= 0 && owner[from] !== surface) continue;
    const key = Math.min(from, to) * owner.length + Math.max(from, to);
    if (!lone.delete(key)) lone.set(key, [from, to]);
  }
  const { position } = attributes;
  return [...lone.values()].flat().flatMap((k) => [position.getX(k), position.getY(k), position.getZ(k)]);
}

function paintTile({ columns, colours, owner, shades }, layer, stops, missing) {
  const before = city;
  city = columns;
  const own = { ...layer, values: columns[layer.name] };
  const seen = shades.map((shade, surface) => colourOf(surface, own, stops, missing).map((part) => part * shade));
  owner.forEach((surface, corner) => colours.array.set(seen[surface], 3 * corner));
  colours.needsUpdate = true;
  city = before;
}

function paintPicture(layer, stops, missing) {
  for (const record of loaded.values()) paintTile(record, layer, stops, missing);
}

function paintModules() {
  for (const { mesh, surfaces, columns } of worn.values()) fillModules(mesh, surfaces, columns);
}

// ---- The picture

function buildView() {
  const started = startView();
  tiles = new TILES.TilesRenderer(new URL("tiles/tileset.json", location).href);
  const inverse = new THREE.Matrix4().fromArray(header.frame).invert();
  inverse.decompose(tiles.group.position, tiles.group.quaternion, tiles.group.scale);
  // All of a town is a few MB, of which the first view may have every wall.
  tiles.errorTarget = header.buildings > 1000 ? MOST_OFF : MOST_OFF / 2;
  tiles.setCamera(started.camera);
  started.scene.add(tiles.group);
  started.scene.updateMatrixWorld(true);
  tiles.addEventListener("load-model", addTile);
  tiles.addEventListener("dispose-model", ({ tile }) => loaded.delete(tile) || worn.delete(tile));
  if (header.modules) show("modules-label");
  for (const event of ["needs-update", "tiles-load-end"]) tiles.addEventListener(event, draw);
  const [lower, upper] = [0, 3].map((first) => new THREE.Vector3().fromArray(header.box, first));
  const update = () => {
    started.camera.updateMatrixWorld();
    tiles.setResolutionFromRenderer(started.camera, started.renderer);
    tiles.update();
  };
  return { ...started, mark: null, all: [header.box], box: { lower, upper }, update };
}

function visitCorners(boxes, visit) {
  const corner = new THREE.Vector3();
  for (const box of boxes) {
    for (let k = 0; k < 8; k++) visit(corner.set(...[0, 1, 2].map((axis) => box[axis + 3 * ((k >> axis) & 1)])));
  }
}

function choosePicked(caster) {
  caster.firstHitOnly = true;
  const hits = [];
  tiles.raycast(caster, hits);
  const [hit] = hits.sort((one, other) => one.distance - other.distance);
  const record = hit?.object.userData.record;
  chosen.record = record?.columns.building ? record : null;
  city = chosen.record?.columns ?? header;
  if (record && !chosen.record) {
    const { x, y, z } = hit.point;
    const direction = view.camera.position.clone().sub(view.controls.target);
    fly([[x - CLOSE, y - CLOSE, z, x + CLOSE, y + CLOSE, z + 1]], direction);
  } else chooseSurface(chosen.record ? record.owner[hit.face.a] : -1);
}

function showMark() {
  if (view.mark) {
    view.mark.removeFromParent();
    view.mark.geometry.dispose();
  }
  view.mark = chosen.surface < 0 ? null : buildLines(findEdges(chosen.record, chosen.surface), {
        ...LOOK_OF_MARK,
        color: scheme.mark,
      });
  if (view.mark) chosen.record.mesh.add(view.mark);
}

// ---- Buildings

function namedSums([area, kwp, mwh, hours]) {
  return { area, kwp, mwh, hours };
}

function readRow([id, building, box, counted, flat, mwh, kwp, ...texts]) {
  const parts = counted.map(([kind, ...sums]) => ({ kind, ...namedSums(sums) }));
  const beside = flat ? namedSums(flat) : null;
  const name = id ?? say("Building {number}", { number: building + 1 });
  const sums = { ...addParts(parts), kwp, mwh, hours: (1000 * mwh) / kwp, flatKwp: beside?.kwp ?? 0 };
  const row = { id: name, building, shape: [box], parts, beside, ...sums };
  TEXTS.forEach((text, k) => (row[text] = texts[k] ?? ""));
  known.set(building, row);
  return row;
}

// The row of a building with its surfaces, as far as a tile that has them is loaded.
function rowOf(building) {
  const holds = ({ columns }) => columns.building?.includes(building);
  const record = chosen.record && holds(chosen.record) ? chosen.record : [...loaded.values()].find(holds);
  if (!record) return known.get(building);
  chosen.record = record;
  city = record.columns;
  const surfaces = [...city.hours.keys()].filter((surface) => city.building[surface] === building);
  const id = city.building_id?.[surfaces[0]] ?? say("Building {number}", { number: building + 1 });
  return { id, building, shape: [header.box], ...known.get(building), surfaces };
}

function partsOf(row) {
  return row.parts ? { counted: row.parts, flat: row.beside } : sumKinds(row.surfaces);
}

function findRows() {
  return [...found];
}

// Shards stand in the order of what they begin with: those that may hold texts with a beginning.
function shardsOf(beginning) {
  const last = header.shards.findLastIndex((first) => first.slice(0, beginning.length) <= beginning);
  const before = header.shards.findLastIndex((first) => first < beginning);
  return [...header.shards.keys()].slice(Math.max(before, 0), last + 1);
}

// Entries of some files of the index: of each what is searched, and the row of its building.
async function readShards(names) {
  for (const name of names) {
    const read = (entries) => entries.map(([key, ...row]) => ({ key, row: readRow(row) }));
    if (!shards.has(name)) shards.set(name, readJson(`buildings/${name}.json`).then(read));
  }
  return (await Promise.all(names.map((name) => shards.get(name)))).flat();
}

async function searchBuildings() {
  const wanted = plain(byId("search").value.trim());
  const entries = await readShards(wanted ? shardsOf(wanted).slice(0, 3) : ["largest"]);
  if (wanted !== plain(byId("search").value.trim())) return; // more was typed meanwhile
  // A building whose name and address both begin so stands in the list once.
  const hits = entries.filter(({ key }) => !wanted || key.startsWith(wanted));
  found = [...new Map(hits.map(({ row }) => [row.building, row])).values()];
  showTable();
}

// Number of a building by its id, −1 if there is none.
async function findBuilding(id) {
  if (!header.shards.length) return Number(/\d+$/.exec(id) ?? 0) - 1; // ids are numbers on a private map
  const entries = await readShards(shardsOf(plain(id)));
  return entries.find(({ row }) => row.id === id)?.row.building ?? -1;
}

// ---- The page of a building

const pages = new Map(); // of each file of pages, a hundred buildings, as far as they were read

async function loadPlace(building) {
  const file = Math.floor(building / 100);
  if (!pages.has(file)) pages.set(file, readJson(`buildings/page_${file}.json`).catch(() => []));
  return (await pages.get(file))[building % 100];
}

// Wait until a tile that has the building is there; the picture is on its way to it.
async function loadSurfaces(building) {
  while (view && !rowOf(building)?.surfaces) await new Promise((done) => setTimeout(done, 100));
}

// ---- Beginning

async function beginMap() {
  if (location.protocol === "file:") {
    note(NOTES.file);
    return;
  }
  header = await readJson("page/map.json");
  city = header;
  byId("search").placeholder = say("Beginning of street, name or id");
  byId("search").parentElement.hidden = !header.shards.length;
  dropColumns((name) => header.filled.includes(name));
  listenToSearch(searchBuildings);
  view = tryView(buildView);
  await searchBuildings();
  showPage();
}

beginMap().catch(() => note(NOTES.lost));
