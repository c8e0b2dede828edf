// The page of one building, at #building=… of report and map: facts, sums, charts and surfaces, to be printed on one page.
//
// Between viewer.js and report.js or map.js, which define loadPlace (what core/results/describe_buildings.py says of a
// building) and loadSurfaces (which waits until a map has them). Events of viewer.js begin it.

const SVG = "http://www.w3.org/2000/svg";
const MOST_BUILDINGS = 50; // in the table of a printed report
const MOST_PRINTED = 12; // rows of surfaces that fit on one page of paper
const LEVEL = 0.5; // [°] tilt below which a surface has no azimuth
const PARTS = [
  { part: "facade_", title: "Facades" },
  { part: "roof_", title: "Pitched roofs" },
  { part: "flat_roof_", title: "Flat roofs" },
  { part: "", title: "Together" },
];

const seat = document.createComment(""); // where the picture stands when no page is open
let opened = false; // whether the page of a building is
const titleOfCity = document.title;
let asked = ""; // the link that was followed last

function part(name) {
  return document.getElementById(`building-${name}`);
}

// ---- The link

function linkTo(id) {
  return `#building=${encodeURIComponent(id)}`;
}

function nameInLink() {
  const match = /^#building=(.+)$/.exec(location.hash);
  try {
    return match ? decodeURIComponent(match[1]) : "";
  } catch {
    return match[1]; // a percent sign that begins no letter
  }
}

// Follow the address: to the page of a building, or back to the city.
async function followLink() {
  const name = nameInLink();
  asked = name;
  if (!name) {
    closePage();
    return;
  }
  const building = await findBuilding(name);
  if (asked !== name) return; // another one was asked for meanwhile
  if (building < 0) {
    closePage();
    note(say("There is no building {name} here.", { name }));
    return;
  }
  const place = await loadPlace(building);
  if (asked !== name) return;
  if (!place) {
    closePage();
    note(say("These results have no page for {name}: compute them again.", { name }));
    return;
  }
  openPage(rowOf(building) ?? { id: name }, place);
  // On a map the building's surfaces come with a tile, when the picture is near.
  if (rowOf(building)) chooseBuilding(building);
  lookAt(rowOf(building)?.shape ?? [place.box]);
  await loadSurfaces(building);
  if (asked !== name) return;
  const row = rowOf(building);
  if (row) chooseBuilding(building);
  showSurfaces(row?.surfaces ?? [], place);
}

// The picture moves from the city to the page.
function openPage(row, place) {
  const picture = byId("picture");
  if (!opened) picture.before(seat);
  opened = true;
  document.body.classList.add("of-building");
  document.getElementById("building").hidden = false;
  part("picture").append(picture);
  part("picture").hidden = !view;
  showFacts(row, place);
  showSums(place);
  showHours(place);
  window.scrollTo(0, 0);
  part("title").focus({ preventScroll: true });
}

function lookAt(shape) {
  if (!view) return;
  fitCanvas();
  fly(shape, new THREE.Vector3(-0.5, -1, 0.8), { room: 1.3, slowly: false });
}

function closePage() {
  if (!opened) return;
  opened = false;
  document.body.classList.remove("of-building");
  document.getElementById("building").hidden = true;
  seat.replaceWith(byId("picture"));
  document.title = titleOfCity;
}

// ---- Numbers

// Decimals with which an error has two digits.
function digitsOf(error) {
  return error > 0 ? Math.min(Math.max(1 - Math.floor(Math.log10(error)), 0), 3) : 2;
}

function pair(value, error, digits) {
  return Number.isFinite(error) ? `${format(value, digits)} ± ${format(error, digits)}` : format(value, digits);
}

function fillFacts(list, facts) {
  const entries = facts.filter(([, value]) => value).map(([title, value]) => make("div", "", make("dt", title), make("dd", value)));
  list.replaceChildren(...entries);
}

function showFacts(row, place) {
  const { id } = row;
  const title = titleOf(row);
  part("title").textContent = title;
  document.title = title;
  const degrees = (value) => `${format(value, 5)}°`;
  const where = Number.isFinite(place.latitude) ? `${degrees(place.latitude)}, ${degrees(place.longitude)}` : "";
  fillFacts(part("facts"), [
    [say("Address"), row.address === title ? "" : row.address],
    [say("Name"), row.name === title ? "" : row.name],
    [say("Use"), row.function],
    [say("Built"), row.year],
    [say("Latitude, longitude"), where],
    [say("Id"), id === title ? "" : id],
  ]);
  const { kwp, mwh_per_year: mwh, mwh_standard_error: error } = place;
  const cards = [
    [say("Modules"), format(place.module_count, 0), ""],
    [say("Power"), format(kwp, 1), "kWp"],
    [say("Energy in a year"), pair(mwh, error, digitsOf(error)), "MWh"],
    [say("Full load hours"), kwp ? hoursOf(mwh, error, kwp) : "–", "h"],
  ].map(([name, value, unit]) => {
    const figure = make("dd", value, make("small", ` ${unit}`));
    figure.className = "figure";
    const card = make("div", "", make("dt", name), figure);
    card.className = "card";
    return card;
  });
  part("numbers").replaceChildren(...cards);
}

function hoursOf(mwh, error, kwp) {
  return pair((1000 * mwh) / kwp, (1000 * error) / kwp, 1);
}

// The sums of buildings.csv; modules that lie flat, where the totals leave them out, stand behind these.
function showSums(place) {
  const digits = digitsOf(place.mwh_standard_error || place.flat_roof_mwh_standard_error);
  const beside = place.mwh_per_year < place.facade_mwh_per_year + place.roof_mwh_per_year + 0.5 * place.flat_roof_mwh_per_year;
  const parts = PARTS.filter(({ part: own }) => !own || place[`${own}kwp`] > 0);
  if (beside) parts.push(...parts.splice(parts.findIndex(({ part: own }) => own === "flat_roof_"), 1));
  const lines = parts.map(({ part: own, title }) => {
    const [area, kwp, mwh, error] = ["module_area", "kwp", "mwh_per_year", "mwh_standard_error"].map((name) => place[own + name]);
    const words = own === "flat_roof_" && beside ? "In addition flat roofs, modules lying flat" : title;
    const texts = [format(area, 1), format(kwp, 2), pair(mwh, error, digits), kwp ? hoursOf(mwh, error, kwp) : "–"];
    const line = tableRow("td", [say(words), ...texts]);
    if (!own) line.className = "sum";
    return line;
  });
  fillTable("sums", ["", "Area of modules [m²]", "Power [kWp]", "Energy in a year [MWh]", "Full load hours [h]"], lines);
}

function fillTable(name, head, lines) {
  part(name).tHead.replaceChildren(tableRow("th", head.map((title) => title && say(title))));
  part(name).tBodies[0].replaceChildren(...lines);
}

// ---- Surfaces

// PVGIS counts azimuths from the south, east negative: 180° less than from the north.
function linkToPvgis(surface, place) {
  const [tilt, azimuth] = [city.tilt[surface], city.azimuth[surface]];
  const loss = place.mwh_dc_per_year > 0 ? 100 * (1 - place.mwh_per_year / place.mwh_dc_per_year) : 0;
  const asking = {
    lat: place.latitude.toFixed(5),
    lon: place.longitude.toFixed(5),
    peakpower: city.kwp[surface].toFixed(2),
    loss: loss.toFixed(1),
    angle: Math.min(tilt, 90).toFixed(1),
    aspect: (Number.isFinite(azimuth) && tilt >= LEVEL ? azimuth - 180 : 0).toFixed(1),
    mountingplace: "building",
    outputformat: "json",
  };
  const link = make("a", "PVGIS");
  link.href = `https://re.jrc.ec.europa.eu/api/v5_3/PVcalc?${new URLSearchParams(asking)}`;
  link.rel = "noreferrer";
  link.setAttribute("aria-label", say("{surface} in PVGIS", { surface: nameSurface(surface) }));
  return link;
}

// Of what lies level none.
function azimuthOf(surface) {
  return city.tilt[surface] < LEVEL ? "–" : format(city.azimuth[surface], 0);
}

function showSurfaces(surfaces, place) {
  const energy = (surface) => city.kwp[surface] * city.hours[surface];
  const worn = surfaces.filter(carries).sort((a, b) => energy(b) - energy(a));
  const placed = Number.isFinite(place.latitude);
  const lines = worn.map((surface, k) => {
    const [kwp, hours, error] = [city.kwp[surface], city.hours[surface], city.error[surface]];
    const texts = [format(city.area[surface], 1), format(city.tilt[surface], 0), azimuthOf(surface)];
    texts.push(format(city.modules[surface], Number.isInteger(city.modules[surface]) ? 0 : 1), format(kwp, 2));
    const line = tableRow("td", [nameSurface(surface), ...texts, pair(kwp * hours, kwp * error, kwp * error < 0.95 ? 1 : 0), pair(hours, error, 1)]);
    line.append(make("td", "", ...(placed ? [linkToPvgis(surface, place)] : [])));
    if (k >= MOST_PRINTED) line.className = "beyond";
    return line;
  });
  const rest = worn.slice(MOST_PRINTED);
  if (rest.length) {
    const sum = (values) => rest.reduce((total, surface) => total + values(surface), 0);
    const words = say("and {count} more", { count: format(rest.length, 0) });
    const sums = [format(sum((k) => city.area[k]), 1), "", "", format(sum((k) => city.modules[k]), 0)];
    sums.push(format(sum((k) => city.kwp[k]), 2), format(sum(energy), 0), "", "");
    const line = tableRow("td", [words, ...sums]);
    line.className = "rest";
    lines.push(line);
  }
  const head = ["Surface", "Area [m²]", "Tilt [°]", "Azimuth [°]", "Modules", "Power [kWp]", "Energy in a year [kWh]"];
  fillTable("surfaces", [...head, "Full load hours [h]", "PVGIS"], lines);
  part("surfaces").closest("section").hidden = !surfaces.length; // of a map without WebGL
  part("pvgis").hidden = !placed || !worn.length;
  part("bare").textContent = describeBare(surfaces.filter((surface) => !carries(surface)));
  showMonths(surfaces, place);
}

// How many surfaces carry no modules, and why.
function describeBare(surfaces) {
  if (!surfaces.length) return "";
  const counts = new Map();
  for (const surface of surfaces) counts.set(city.reason[surface], (counts.get(city.reason[surface]) ?? 0) + 1);
  const why = [...counts].map(([reason, count]) => `${format(count, 0)} ${say(city.reasons[reason]) || "–"}`).join("; ");
  return say("Without modules: {why}.", { why });
}

// ---- Charts

function draw2d(tag, attributes, text = "") {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = text;
  return element;
}

// Energy of the months. Their errors add up to no more than the year's, by squares: they are the year's by the root of the share.
function showMonths(surfaces, place) {
  const counted = surfaces.filter((surface) => carries(surface) && city.reason[surface] === 0);
  const ofMonth = (k) => {
    const hours = city[`month_${String(k + 1).padStart(2, "0")}`];
    return hours ? counted.reduce((sum, surface) => sum + city.kwp[surface] * hours[surface], 0) : NaN;
  };
  const values = city.months.map((_, k) => ofMonth(k));
  const year = values.reduce((sum, value) => sum + value, 0);
  const errors = values.map((value) => 1000 * place.mwh_standard_error * Math.sqrt(Math.max(value, 0) / year));
  part("months").parentElement.hidden = !(year > 0);
  if (!(year > 0)) return;
  const most = Math.max(...values.map((value, k) => value + (errors[k] || 0)));
  const large = most > 9999; // [kWh]
  const unit = large
    ? { scale: 1000, digits: most > 99999 ? 1 : 2, name: "MWh" }
    : { scale: 1, digits: most < 1000 ? 1 : 0, name: "kWh" };
  part("unit").textContent = unit.name;
  const write = (value) => format(value / unit.scale, unit.digits);
  const told = values.map((value, k) => `${say(city.months[k])} ${write(value)} ± ${write(errors[k])} ${unit.name}`).join(", ");
  const chart = draw2d("svg", { viewBox: "0 0 480 216", role: "img", "aria-label": told });
  values.forEach((value, k) => {
    const [x, top] = [20 + 40 * k, (height) => 180 - (155 * height) / most];
    chart.append(draw2d("rect", { x: x - 14, y: top(value), width: 28, height: 180 - top(value), class: "bar" }));
    if (errors[k] > 0) {
      const line = `M${x} ${top(value - errors[k])}V${top(value + errors[k])}`;
      chart.append(draw2d("path", { d: line, class: "error" }));
    }
    chart.append(draw2d("text", { x, y: top(value + (errors[k] || 0)) - 5 }, write(value)));
    chart.append(draw2d("text", { x, y: 194 }, say(city.months[k])));
    chart.append(draw2d("text", { x, y: 208, class: "less" }, `± ${write(errors[k])}`));
  });
  part("months").replaceChildren(chart);
}

// Mean power in each hour of the day of each month, in the colours of the city's scale; nothing is drawn at night.
function showHours({ peak, hours }) {
  part("day").hidden = !(peak > 0);
  if (!(peak > 0)) return;
  const shares = Uint8Array.from(atob(hours), (letter) => letter.charCodeAt(0));
  const best = shares.indexOf(255);
  const told = say("Highest in {month} from {from} to {to} h, {power} kW", {
    month: say(city.months[Math.floor(best / 24)]),
    from: best % 24,
    to: (best % 24) + 1,
    power: format(peak, 1),
  });
  const chart = draw2d("svg", { viewBox: "0 0 480 216", role: "img", "aria-label": told });
  const stops = city.layers.find(({ name }) => name === "hours").stops.map(readColour);
  for (let k = 0; k < 288; k++) {
    if (!shares[k]) continue;
    const [month, hour] = [Math.floor(k / 24), k % 24];
    const fill = `rgb(${colourAt(shares[k] / 255, stops).map(Math.round).join(" ")})`;
    chart.append(draw2d("rect", { x: 36 + 18 * hour, y: 4 + 14 * month, width: 18, height: 14, fill }));
  }
  city.months.forEach((month, k) => {
    chart.append(draw2d("text", { x: 30, y: 15 + 14 * k, class: "end" }, say(month)));
  });
  for (let hour = 0; hour <= 24; hour += 6) {
    chart.append(draw2d("text", { x: 36 + 18 * hour, y: 187 }, `${hour} h`));
  }
  for (let k = 0; k < 60; k++) {
    const fill = `rgb(${colourAt(k / 59, stops).map(Math.round).join(" ")})`;
    chart.append(draw2d("rect", { x: 147 + 3.7 * k, y: 196, width: 4, height: 8, fill }));
  }
  chart.append(draw2d("text", { x: 140, y: 205, class: "end" }, "0"));
  chart.append(draw2d("text", { x: 376, y: 205, class: "start" }, `${format(peak, peak < 10 ? 2 : 0)} kW`));
  part("hours").replaceChildren(chart);
}

function colourAt(share, stops) {
  const place = share * (stops.length - 1);
  const low = Math.min(Math.floor(place), stops.length - 2);
  return stops[low].map((value, k) => value + (place - low) * (stops[low + 1][k] - value));
}

// ---- Paper

// A browser prints no picture of WebGL: a copy of it stands in its place.
function copyPicture() {
  if (!view) return;
  wearScheme();
  view.renderer.render(view.scene, view.camera);
  const copy = make("img");
  copy.className = "printed";
  copy.src = view.canvas.toDataURL();
  view.canvas.after(copy);
}

const unfolded = []; // by the print
let shownBefore = 0; // rows of the table of buildings; 0 while nothing is printed

// On paper all is light, unfolded, and more buildings stand in the table.
function beforePrint() {
  afterPrint();
  document.documentElement.classList.add("paper");
  copyPicture();
  shownBefore = order.shown;
  order.shown = Math.max(order.shown, MOST_BUILDINGS);
  showTable();
  for (const folded of document.querySelectorAll("details:not([open])")) {
    folded.open = true;
    unfolded.push(folded);
  }
}

function afterPrint() {
  document.documentElement.classList.remove("paper");
  if (view) wearScheme();
  for (const copy of document.querySelectorAll("img.printed")) copy.remove();
  for (const folded of unfolded.splice(0)) folded.open = false;
  if (!shownBefore) return;
  order.shown = shownBefore;
  shownBefore = 0;
  showTable();
}

// ---- Beginning

document.addEventListener("city-ready", () => {
  window.addEventListener("hashchange", followLink);
  window.addEventListener("beforeprint", beforePrint);
  window.addEventListener("afterprint", afterPrint);
  part("print").addEventListener("click", () => window.print());
  followLink();
});

// Beside the numbers of a chosen building stands the link to its page; from page to page leads a click on the picture.
document.addEventListener("city-chosen", ({ detail: { row } }) => {
  if (!row) return;
  if (opened && row.id !== asked) location.hash = linkTo(row.id);
  const link = make("a", say("Page of this building, to print or to share"));
  link.href = linkTo(row.id);
  byId("chosen").append(make("p", "", link));
});
