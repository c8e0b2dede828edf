// A basemap on the ground of a city's solar map, of the tiles whose address core/results/write_site.py was given.
//
// It alone asks another server, which the page's Content-Security-Policy names then. Before map.js.

const BASEMAP_TILES = 8; // along the longer side of the city

let basemap = null; // texture and the part of the world that it shows

// Place of a point from the Earth's centre in the square of Web Mercator, from 0 to 1 eastward and southward.
function mercatorOf({ x, y, z }) {
  const [axis, square] = [6378137, 0.0066943799901414]; // [m], and its eccentricity, of the ellipsoid WGS 84
  const across = Math.hypot(x, y);
  let latitude = Math.atan2(z, across * (1 - square));
  // Latitude follows from the height above the ellipsoid, and that from the latitude: three turns are exact to 1 mm.
  for (let turn = 0; turn < 3; turn++) {
    const radius = axis / Math.sqrt(1 - square * Math.sin(latitude) ** 2);
    const height = across / Math.cos(latitude) - radius;
    latitude = Math.atan2(z, across * (1 - (square * radius) / (radius + height)));
  }
  return [Math.atan2(y, x) / (2 * Math.PI) + 0.5, 0.5 - Math.asinh(Math.tan(latitude)) / (2 * Math.PI)];
}

// One picture of all tiles below the city and a margin, which fills as they arrive.
function startBasemap() {
  const [west, south, low, east, north] = header.box;
  const margin = 0.2 * Math.max(east - west, north - south);
  const frame = new THREE.Matrix4().fromArray(header.frame);
  const ends = [
    mercatorOf(new THREE.Vector3(west - margin, north + margin, low).applyMatrix4(frame)),
    mercatorOf(new THREE.Vector3(east + margin, south - margin, low).applyMatrix4(frame)),
  ];
  const size = Math.max(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
  const zoom = Math.min(Math.floor(Math.log2(BASEMAP_TILES / size)), 18);
  const [first, last] = ends.map((place) => place.map((part) => Math.floor(part * 2 ** zoom)));
  const count = [0, 1].map((axis) => last[axis] - first[axis] + 1);
  const canvas = make("canvas");
  [canvas.width, canvas.height] = count.map((tiles) => 256 * tiles);
  const paper = canvas.getContext("2d");
  paper.fillStyle = "#dededa";
  paper.fillRect(0, 0, canvas.width, canvas.height);
  const texture = new THREE.Texture(canvas);
  texture.flipY = false;
  for (let x = 0; x < count[0]; x++) {
    for (let y = 0; y < count[1]; y++) {
      const values = { z: zoom, x: first[0] + x, y: first[1] + y };
      const picture = new Image();
      picture.crossOrigin = "anonymous";
      picture.addEventListener("load", () => {
        paper.drawImage(picture, 256 * x, 256 * y, 256, 256);
        texture.needsUpdate = true;
        draw();
      });
      picture.src = header.basemap.replace(/\{([xyz])\}/g, (_, name) => values[name]);
    }
  }
  return { texture, first, count, zoom };
}

function wearBasemap(part) {
  basemap ??= startBasemap();
  const { position } = part.geometry.attributes;
  const places = new Float32Array(2 * position.count);
  const corner = new THREE.Vector3();
  const toEarth = new THREE.Matrix4();
  for (let node = part; node && node !== tiles.group; node = node.parent) {
    node.updateMatrix();
    toEarth.premultiply(node.matrix);
  }
  for (let k = 0; k < position.count; k++) {
    const place = mercatorOf(corner.fromBufferAttribute(position, k).applyMatrix4(toEarth));
    for (const axis of [0, 1]) {
      places[2 * k + axis] = (place[axis] * 2 ** basemap.zoom - basemap.first[axis]) / basemap.count[axis];
    }
  }
  part.geometry.setAttribute("uv", new THREE.BufferAttribute(places, 2));
  part.material.map = basemap.texture;
  part.material.needsUpdate = true;
}
