// The city of report.html. All data lie in the page, packed by core/results/pack_city.py; nothing is fetched.

let rows = []; // of the table, a sum for each building

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
  return addEnergy(found);
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

function sumBuildings() {
  const members = city.buildings.map(() => []);
  city.building.forEach((building, surface) => members[building].push(surface));
  return members.map((surfaces, building) => ({
    id: city.buildings[building],
    building,
    surfaces,
    shape: surfaces,
    ...Object.fromEntries(TEXTS.map((name) => [name, city.texts[name]?.[building] ?? ""])),
    change: city.building_change?.[building],
    changeError: city.building_change_error?.[building],
    ...sumBuilding(surfaces, building),
    flatKwp: sumSurfaces(surfaces.filter((surface) => city.reason[surface] === 1)).kwp,
  }));
}

// Sums of a building as buildings.csv has them, where it is there.
function sumBuilding(surfaces, building) {
  const sum = sumSurfaces(surfaces.filter((surface) => city.reason[surface] === 0));
  if (!city.building_kwp) return sum;
  const [kwp, mwh] = [city.building_kwp[building], city.building_mwh[building]];
  return { ...sum, kwp, mwh, mwhError: city.building_mwh_error[building], hours: (1000 * mwh) / kwp };
}

function rowOf(building) {
  return rows[building];
}

function partsOf(row) {
  return sumKinds(row.surfaces);
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
  for (let surface = 0; surface < city.surface_id.length; surface++) owners.fill(surface, ...cornersOf(surface));
  const [a, b, c] = [new THREE.Vector3(), new THREE.Vector3(), new THREE.Vector3()];
  for (let triangle = 0; triangle < count; triangle++) {
    [a, b, c].forEach((corner, k) => {
      corner.set(...cornerOf(triangles[3 * triangle + k]));
      corner.toArray(positions, 9 * triangle + 3 * k);
    });
    const normal = b.sub(a).cross(c.sub(a)).normalize();
    shade[triangle] = shadeOf(normal);
    owner[triangle] = owners[triangles[3 * triangle]];
  }
  const geometry = new THREE.BufferGeometry();
  const colours = new THREE.BufferAttribute(new Uint8Array(9 * count), 3, true);
  geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3));
  geometry.setAttribute("color", colours);
  return { mesh: new THREE.Mesh(geometry, new THREE.MeshBasicMaterial(lookOfSurfaces())), colours, shade, owner };
}

function buildEdges(surfaces, look) {
  const points = [];
  for (const surface of surfaces) {
    for (let ring = city.surface_start[surface]; ring < city.surface_start[surface + 1]; ring++) {
      const [first, last] = [city.ring_start[ring], city.ring_start[ring + 1]];
      for (let k = first; k < last; k++) points.push(...cornerOf(k), ...cornerOf(k + 1 < last ? k + 1 : first));
    }
  }
  return buildLines(points, look);
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
  return new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({ side: THREE.DoubleSide }));
}

function paintPicture(layer, stops, missing) {
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
}

function shapeOfModule(k) {
  const count = city.module_surface.length;
  const parts = [city.module_corner, city.module_along, city.module_up];
  return parts.map((part) => [0, 1, 2].map((axis) => part[axis * count + k] / 1000));
}

function paintModules() {
  if (view.modules) fillModules(view.modules, city.module_surface, city);
}

function buildView() {
  const parts = { ...startView(), ...buildMesh(), mark: null, modules: null };
  const all = [...city.surface_id.keys()];
  const ground = buildGround();
  parts.grounds.push(ground.material);
  parts.scene.add(ground, parts.mesh, buildEdges(all, LOOK_OF_EDGES));
  if (city.module_surface?.length) {
    parts.modules = buildModules(city.module_surface.length, shapeOfModule);
    parts.scene.add(parts.modules);
    show("modules-label");
  }
  return { ...parts, all, box: boundSurfaces(all) };
}

function visitCorners(surfaces, visit) {
  const corner = new THREE.Vector3();
  for (const surface of surfaces) {
    const [first, last] = cornersOf(surface);
    for (let point = first; point < last; point++) visit(corner.set(...cornerOf(point)));
  }
}

function choosePicked(caster) {
  const [hit] = caster.intersectObject(view.mesh);
  chooseSurface(hit ? view.owner[hit.faceIndex] : -1);
}

function showMark() {
  if (view.mark) {
    view.scene.remove(view.mark);
    view.mark.geometry.dispose();
  }
  view.mark = chosen.surface < 0 ? null : buildEdges([chosen.surface], { ...LOOK_OF_MARK, color: scheme.mark });
  if (view.mark) view.scene.add(view.mark);
}

// ---- The table

function findRows() {
  const wanted = plain(byId("search").value.trim());
  if (!wanted) return [...rows];
  const textsOf = (row) => [row.id, ...TEXTS.map((name) => row[name]), ...row.surfaces.map((k) => city.surface_id[k])];
  return rows.filter((row) => (row.searched ??= plain(textsOf(row).join("\n"))).includes(wanted));
}

// Number of a building by its id, −1 if there is none.
async function findBuilding(id) {
  return city.buildings.indexOf(id);
}

// ---- The page of a building

async function loadPlace(building) {
  return city.places?.[building];
}

async function loadSurfaces() {} // they are there

// ---- Beginning

async function begin() {
  if (!("DecompressionStream" in window)) {
    note(NOTES.old);
    return;
  }
  city = await unpack(byId("data").textContent);
  rows = sumBuildings();
  dropColumns((name) => rows.some((row) => row[name]));
  if (city.building_change) {
    const place = tableColumns.findIndex(({ name }) => name === "hours");
    tableColumns.splice(place, 0, { name: "change", title: "Change [MWh]", digits: 2, plus: "+" });
    // The largest loss first; where nothing loses, the largest gain.
    Object.assign(order, { name: "change", down: !city.building_change.some((change) => change < 0) });
  }
  listenToSearch(showTable);
  if (city.corners) view = tryView(buildView);
  else note(NOTES.shapes);
  showPage();
}

begin();
