"""Size, time, memory and first picture of the solar map of a large city.

    python benchmarks/site.py RESULTS WORK [--copies 1800] [--step 236] [--block 6] [--keep]

RESULTS is a result folder, such as that of the Berlin tile. Its buildings are copied side by side,
with identifiers of their own, into folders of BLOCK × BLOCK copies each, STEP metres from one copy
to the next; steps smaller than the city let copies overlap, which makes buildings as dense as one
wants. `citypv site` runs in a process of its own. The map is then opened in Chromium, from a server
on this machine that does not compress: as a whole, and at a building.
"""

import argparse
import gzip
import json
import resource
import shutil
import subprocess
import sys
import threading
import time
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import h5netcdf
import numpy as np
import pandas as pd

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "core"))
from browser import Browser, find_chromium

from citypv.core.read.netcdf_file import netcdf_file
from citypv.core.results.netcdf_variables import write_variables

IDS = ("surface_id", "building_id")
READY = "tiles.visibleTiles.size > 0"
SETTLED = "tiles.stats.queued + tiles.stats.downloading + tiles.stats.parsing === 0"
BYTES = "performance.getEntriesByType('resource').reduce((sum, one) => sum + one.transferSize, 0)"
NAMES = "[...tiles.visibleTiles].map((tile) => tile.content.uri)"  # of tiles that are seen
FRAME = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"


def copy_block(source, folder, numbers, shifts, origin):
    """Write a result folder of some copies, each shifted by metres to east and north."""
    folder.mkdir()
    faces = pd.read_csv(source / "faces.csv", dtype=str, keep_default_na=False)
    tables = [
        faces.assign(**{name: faces[name] + f"_{number}" for name in IDS}) for number in numbers
    ]
    pd.concat(tables).to_csv(folder / "faces.csv", index=False)
    summary = json.loads((source / "summary.json").read_text("utf-8"))
    site = summary["input"]["site"]
    site["origin"] = [
        site["origin"][0] + origin[0],
        site["origin"][1] + origin[1],
        site["origin"][2],
    ]
    (folder / "summary.json").write_text(json.dumps(summary), "utf-8")
    with h5netcdf.File(source / "surfaces.nc") as file:
        points, months = file["outline_points"][:], file["full_load_hours_by_month"][:]
        rings, start = file["outline_ring_start"][:], file["outline_surface_start"][:]
        suns = file["direction"][:]
    ids = np.concatenate([table["surface_id"].to_numpy(object) for table in tables])
    offsets = [np.array([*shift, 0], np.float32) for shift in shifts]
    found = {
        "surface_id": ("surface", ids),
        "direction": (("sun", "axis"), suns),
        "full_load_hours_by_month": (("surface", "month"), np.tile(months, (len(numbers), 1))),
        "outline_points": (
            ("corner", "axis"),
            np.concatenate([points + offset for offset in offsets]),
        ),
        "outline_ring_start": (("ring_bound",), repeat_starts(rings, len(numbers))),
        "outline_surface_start": (("surface_bound",), repeat_starts(start, len(numbers))),
    }
    with netcdf_file(folder / "surfaces.nc") as stream, h5netcdf.File(stream, "w") as file:
        file.attrs["title"] = "CityPV surfaces 1"
        write_variables(file, found)


def repeat_starts(start, count):
    """Where things start in `count` copies one after the other."""
    parts = [start[:-1].astype(np.int64) + number * int(start[-1]) for number in range(count)]
    return np.append(np.concatenate(parts), count * int(start[-1])).astype(np.int32)


def write_blocks(source, work, copies, step, block):
    """Result folders of all copies: list of Path."""
    side = int(np.ceil(np.sqrt(copies)))
    places = [(k % side, k // side) for k in range(copies)]
    blocks = {}
    for number, (x, y) in enumerate(places):
        blocks.setdefault((x // block, y // block), []).append((number, x, y))
    folders = []
    for (x, y), own in blocks.items():
        folder = work / f"block_{x}_{y}"
        shifts = [((a - x * block) * step, (b - y * block) * step) for _, a, b in own]
        copy_block(
            source,
            folder,
            [number for number, _, _ in own],
            shifts,
            (x * block * step, y * block * step),
        )
        folders.append(folder)
    return folders


class Quiet(SimpleHTTPRequestHandler):
    """Serves files, with open connections, in silence."""

    protocol_version = "HTTP/1.1"

    def log_message(self, *_):
        """Nothing."""


def wait_for(page, condition):
    """Seconds until an expression holds."""
    started = time.perf_counter()
    while not page.run(condition):
        time.sleep(0.01)
    page.run(FRAME)
    return time.perf_counter() - started


def measure_page(web, picture):
    """Seconds and MB of the first picture, of all that it sees, and of a building flown
    to: dict.
    """
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=web))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    page = Browser(find_chromium())
    found, started = {}, time.perf_counter()
    try:
        page.call("Page.navigate", url=f"http://127.0.0.1:{server.server_port}/index.html")
        wait_for(page, f"typeof tiles === 'object' && {READY}")
        found["first picture [s]"] = time.perf_counter() - started
        found["first picture [MB]"] = page.run(BYTES) / 1e6
        wait_for(page, SETTLED)
        found["whole city, all seen [s]"] = time.perf_counter() - started
        found["whole city, all seen [MB]"] = page.run(BYTES) / 1e6
        page.picture(f"{picture}_whole.png")
        wait_for(page, "document.querySelector('#city-buildings td button') !== null")
        before, started = page.run(BYTES), time.perf_counter()
        page.run("performance.setResourceTimingBufferSize(10000)")
        page.run("document.querySelectorAll('#city-buildings td button')[7].click()")
        time.sleep(0.7)  # on the way
        wait_for(page, f"rowOf(chosen.building).surfaces && {SETTLED}")
        found["at a building [s]"] = time.perf_counter() - started
        found["at a building, in addition [MB]"] = (page.run(BYTES) - before) / 1e6
        seen = sum(
            (web / "tiles" / name.rpartition("/")[2]).stat().st_size for name in page.run(NAMES)
        )
        found["at a building, tiles in view [MB]"] = seen / 1e6
        page.picture(f"{picture}_near.png")
        found["complaints"] = len(page.complaints)
    finally:
        page.close()
        server.shutdown()
    return found


def main():
    """Print figures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("results", type=Path)
    parser.add_argument("work", type=Path)
    parser.add_argument("--copies", type=int, default=1800)
    parser.add_argument("--step", type=float, default=236.0)
    parser.add_argument("--block", type=int, default=6)
    parser.add_argument("--keep", action="store_true", help="keep what was written into WORK")
    options = parser.parse_args()
    options.work.mkdir(parents=True)
    folders = write_blocks(
        options.results, options.work, options.copies, options.step, options.block
    )
    web, started = options.work / "web", time.perf_counter()
    command = [sys.executable, "-m", "citypv", "site", *map(str, folders), "--out", str(web)]
    print(subprocess.run(command, check=True, capture_output=True, text=True).stderr.strip())
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    found = {"folders": len(folders), "seconds": time.perf_counter() - started}
    found["processor [s]"] = used.ru_utime + used.ru_stime
    found["peak memory [MB]"] = used.ru_maxrss / 1024
    sizes = [
        (path.stat().st_size, len(gzip.compress(path.read_bytes(), 6)), path)
        for path in web.rglob("*.*")
    ]
    found["files"], found["size [MB]"] = len(sizes), sum(one for one, _, _ in sizes) / 1e6
    found["size after gzip [MB]"] = sum(small for _, small, _ in sizes) / 1e6
    tiles = [(one, small) for one, small, path in sizes if path.suffix == ".glb"]
    found["largest tile [kB]"], found["largest tile after gzip [kB]"] = (
        max(column) / 1000 for column in zip(*tiles, strict=True)
    )
    found |= measure_page(web, options.work / "picture")
    for name, value in found.items():
        print(
            f"| {name} | {value:,.2f} |" if isinstance(value, float) else f"| {name} | {value:,} |"
        )
    if not options.keep:
        for folder in (*folders, web):
            shutil.rmtree(folder)


if __name__ == "__main__":
    main()
