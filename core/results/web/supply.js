// Which surfaces pay: the supply curve of a city, and a slider that takes away what has fewer full load hours.
//
// Between viewer.js and report.js or map.js. The curve, city.supply, was summed up by core/results/supply_curve.py: power
// and energy of facades and roofs with at least 0, step, 2 · step … hours.

const LINES = [
  { name: "Facades", look: "facades", sides: ["facades"] },
  { name: "Roofs", look: "roofs", sides: ["roofs"] },
  { name: "All", look: "all", sides: ["facades", "roofs"] },
];
const CURVES = [
  { name: "mwh", title: "Energy in a year [MWh]" },
  { name: "kwp", title: "Power [kWp]" },
];
const FRAME = { width: 480, height: 250, left: 64, right: 26, top: 12, bottom: 40 }; // of a chart

const markers = []; // of the charts, where the slider stands

// Sums of a line at a step of the curve; behind its end nothing is left.
function left({ sides }, name, step) {
  return sides.reduce((sum, side) => sum + (city.supply[side][name][step] ?? 0), 0);
}

function drawn(tag, attributes, text = "") {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = text;
  return element;
}

// Round numbers from 0 to the highest: at most six steps of 1, 2 or 5 times a power of ten.
function listTicks(most) {
  const power = 10 ** Math.floor(Math.log10(most / 6));
  const step = [1, 2, 5, 10].map((factor) => factor * power).find((length) => length * 6 >= most);
  return Array.from({ length: Math.floor(most / step + 1e-9) + 1 }, (_, k) => k * step);
}

function drawChart({ name, title }) {
  const { width, height, left: west, right, top, bottom } = FRAME;
  const steps = city.supply.facades[name].length;
  const longest = city.supply.step * (steps - 1);
  const most = left(LINES[2], name, 0);
  const x = (hours) => west + (hours / longest) * (width - west - right);
  const y = (value) => height - bottom - (value / most) * (height - top - bottom);
  const label = say("{title} that is left by least hours; the table below has the numbers", { title: say(title) });
  const chart = drawn("svg", { viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
  for (const value of listTicks(most)) {
    chart.append(drawn("line", { x1: west, x2: width - right, y1: y(value), y2: y(value), class: "grid" }));
    const text = format(value, value % 1 ? 1 : 0);
    chart.append(drawn("text", { x: west - 6, y: y(value) + 4, "text-anchor": "end" }, text));
  }
  for (const hours of listTicks(longest)) {
    const place = { x: x(hours), y: height - bottom + 16, "text-anchor": "middle" };
    chart.append(drawn("text", place, format(hours, 0)));
  }
  const below = { x: (west + width - right) / 2, y: height - 6, "text-anchor": "middle" };
  chart.append(drawn("text", below, say("at least so many full load hours")));
  for (const line of LINES) {
    const place = (step) => [x(step * city.supply.step), y(left(line, name, step))].map((part) => part.toFixed(1));
    const points = Array.from({ length: steps }, (_, step) => place(step).join(",")).join(" ");
    chart.append(drawn("polyline", { points, class: line.look }));
  }
  const marker = drawn("line", { y1: top, y2: height - bottom, class: "marker" });
  markers.push({ marker, place: x });
  chart.append(marker);
  const figure = make("figure", "", make("figcaption", say(title)));
  figure.append(chart);
  return figure;
}

function showLeft() {
  const step = Math.round(least / city.supply.step);
  for (const { marker, place } of markers) {
    marker.setAttribute("x1", place(least));
    marker.setAttribute("x2", place(least));
  }
  byId("least-hours").textContent = format(least, 0);
  byId("least").setAttribute("aria-valuetext", say("{hours} hours", { hours: format(least, 0) }));
  const rows = LINES.map((line) => {
    const [kwp, mwh, all] = [left(line, "kwp", step), left(line, "mwh", step), left(line, "mwh", 0)];
    const texts = [say(line.name), format(kwp, 0), format(mwh, mwh < 100 ? 1 : 0), format((1000 * mwh) / kwp, 0)];
    return [...texts, all ? `${format((100 * mwh) / all, 0)} %` : "–"];
  });
  const [, kwp, mwh, , share] = rows[2];
  byId("left").textContent = say("{kwp} kWp and {mwh} MWh a year are left, {share} of the energy", { kwp, mwh, share });
  const body = rows.map((texts, k) => {
    const row = tableRow("td", texts);
    const key = make("i");
    key.className = LINES[k].look;
    row.firstChild.prepend(key);
    return row;
  });
  byId("sums").tBodies[0].replaceChildren(...body);
}

// The slider and the curve, where anything carries modules.
function showSupply() {
  const steps = city.supply.facades.kwp.length - 1;
  if (!steps) return;
  const slider = byId("least");
  slider.step = city.supply.step;
  slider.max = steps * city.supply.step;
  slider.value = 0;
  slider.addEventListener("input", () => {
    least = Number(slider.value);
    showLeft();
    paint();
  });
  byId("curves").replaceChildren(...CURVES.map(drawChart));
  show("paying", "supply");
  showLeft();
}
