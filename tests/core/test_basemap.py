"""A basemap below a solar map: only if its address is given, only from its host, in its place."""

import base64
import json
import threading
from functools import partial
from http.server import BaseHTTPRequestHandler, SimpleHTTPRequestHandler, ThreadingHTTPServer

import numpy as np
import pyproj
import pytest

from citypv.core.commands.command_line import main

RED = base64.b64decode(  # a PNG of one red pixel
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR4nGP4z8DwHwAFAAH/iZk9HQAAAABJRU5ErkJggg=="
)
EARTH = 2 * np.pi * 6378137  # [m] side of the square of Web Mercator


class Tiles(BaseHTTPRequestHandler):
    """Any tile is red."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Access-Control-Allow-Origin", "*")
        self.send_header("Content-Type", "image/png")
        self.end_headers()
        self.wfile.write(RED)

    def log_message(self, *_):
        pass


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture
def serve():
    servers = []

    def start(handler):
        servers.append(ThreadingHTTPServer(("127.0.0.1", 0), handler))
        threading.Thread(target=servers[-1].serve_forever, daemon=True).start()
        return f"http://127.0.0.1:{servers[-1].server_port}"

    yield start
    for server in servers:
        server.shutdown()
        server.server_close()


def mercator(points):
    """Places (n, 3) from the Earth's centre in the square of Web Mercator by PROJ, from 0 to 1
    eastward and southward: (n, 2).
    """
    there = pyproj.Transformer.from_crs("EPSG:4978", "EPSG:4979", always_xy=True)
    flat = pyproj.Transformer.from_crs("EPSG:4326", "EPSG:3857", always_xy=True)
    east, north = flat.transform(*there.transform(*np.transpose(points))[:2])
    return np.stack([east / EARTH + 0.5, 0.5 - north / EARTH], axis=-1)


@pytest.mark.slow
def test_the_ground_has_the_tiles_of_its_place(chromium, serve, small_results, tmp_path):
    host, out = serve(Tiles), tmp_path / "web"
    given = f"{host}/{{z}}/{{x}}/{{y}}.png"
    assert main(["site", str(small_results), "--out", str(out), "--basemap", given, "--quiet"]) == 0
    assert f"img-src data: {host};" in (out / "index.html").read_text("utf-8")
    page = serve(partial(Quiet, directory=out))
    chromium.requests.clear()
    chromium.complaints.clear()
    chromium.call("Page.navigate", url=f"{page}/index.html")
    chromium.wait("document.querySelector('#city-buildings tbody tr') !== null && basemap !== null")
    red = "[...basemap.texture.image.getContext('2d').getImageData(300, 300, 1, 1).data].join()"
    chromium.wait(f"{red} === '255,0,0,255'")
    # Latitude from the Earth's centre is PROJ's, in the mountains and in the south too.
    globe = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    places = [(13.4, 52.5, 40.0), (-70.6, -33.4, 2500.0), (-150.0, 0.0, 0.0), (178.0, 78.2, 9.0)]
    earth = np.array([globe.transform(*place) for place in places])
    found = chromium.run(
        f"{earth.tolist()}.map(([x, y, z]) => mercatorOf(new THREE.Vector3(x, y, z)))"
    )
    assert found == pytest.approx(mercator(earth), abs=1e-2 / EARTH)
    # Each corner of the ground has its place in the picture of all tiles.
    corners, uv, first, count, zoom = chromium.run(
        """(() => { const corners = [], uv = [];
        tiles.group.updateMatrixWorld(true);
        tiles.group.traverse((part) => {
            if (!part.isMesh || part.material.map !== basemap.texture) return;
            const { position, uv: own } = part.geometry.attributes;
            for (let k = 0; k < position.count; k++) {
                const corner = new THREE.Vector3().fromBufferAttribute(position, k);
                corners.push(corner.applyMatrix4(part.matrixWorld).toArray());
                uv.push([own.getX(k), own.getY(k)]);
            }
        });
        return [corners, uv, basemap.first, basemap.count, basemap.zoom]; })()"""
    )
    header = json.loads((out / "page" / "map.json").read_text("utf-8"))
    frame = np.reshape(header["frame"], (4, 4))
    there = mercator(np.array(corners) @ frame[:3, :3] + frame[3, :3])
    assert len(corners) >= 4
    shown = (np.array(uv) * count + first) / 2**zoom
    assert shown == pytest.approx(there, abs=0.5 / EARTH)  # half a metre at the equator
    asked = {url for url in chromium.requests if not url.startswith(("data:", page))}
    assert len(asked) == np.prod(count) and all(url.startswith(f"{host}/{zoom}/") for url in asked)
    assert chromium.complaints == []


@pytest.mark.slow
def test_a_map_without_a_basemap_asks_nobody_and_a_wrong_address_is_refused(
    small_results, tmp_path, refused
):
    assert main(["site", str(small_results), "--out", str(tmp_path / "web"), "--quiet"]) == 0
    assert not (tmp_path / "web" / "page" / "basemap.js").exists()
    policy = (tmp_path / "web" / "index.html").read_text("utf-8").partition("content=")[2]
    assert "http" not in policy.partition('">')[0]
    for address in (
        "https://tiles.example.org/{z}/{x}.png",
        "tiles/{z}/{x}/{y}.png",
        "https://a.org; script-src */{z}/{x}/{y}",
        "javascript://a.org/{z}/{x}/{y}",
    ):
        said = refused("site", small_results, "--out", tmp_path / "no", "--basemap", address)
        assert "--basemap" in said and "is no address of map tiles" in said
    assert not (tmp_path / "no").exists()
