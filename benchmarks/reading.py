"""Time and memory of reading, compared with plain lxml, on files of 3 to 50 MB.

    python benchmarks/reading.py [--runs 5] [--megabytes 3 12 50]

The Berlin tile of examples/ is repeated side by side, with own identifiers and shifted coordinates,
until the file has the size asked for. Each run is a process of its own. Printed per size, as
medians: seconds and megabytes per second of `read_city` (polygons cleaned, oriented, named and
checked); the same for plain lxml, which builds the whole tree and turns every gml:posList into
numbers, and does nothing more; memory that reading adds to a process that has imported everything,
as a multiple of the polygons' part of the file. With --cityjson FILE, also a CityJSON file against
`json`, and against cjio where it is installed.
"""

import argparse
import json
import os
import re
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
TILE = ROOT / "examples" / "berlin" / "berlin_3910_5817.gml"
STEP = 1100.0  # [m] from one copy to the next
POSITIONS = re.compile(rb"(<gml:posList[^>]*>)([^<]*)(</gml:posList>)")
IDENTIFIERS = re.compile(rb'(gml:id="|xlink:href="#)')
MEMBER = re.compile(rb"<(?:\w+:)?cityObjectMember.*</(?:\w+:)?cityObjectMember>", re.DOTALL)
POLYGON = re.compile(rb"<gml:Polygon.*?</gml:Polygon>", re.DOTALL)

HEAD = """
import json, sys, time
from citypv.core.read.read_city import read_city
from citypv.core.results.write_summary import peak_memory
from lxml import etree
import numpy as np
path, started, before = sys.argv[1], time.perf_counter(), peak_memory()
"""
TAIL = """
grown = peak_memory() - before
print(json.dumps({"seconds": time.perf_counter() - started, "grown": grown, "count": count}))
"""
READERS = {
    "citypv": "count = len(read_city(path))",
    "lxml": """
tree = etree.parse(path)
rings = [np.array(one.text.split(), float) for one in tree.iter("{*}posList")]
count = len(rings)
""",
    "json": """
with open(path, encoding="utf-8") as stream: model = json.load(stream)
count = len(np.array(model["vertices"]))
""",
    "cjio": """
from cjio import cityjson
started, before = time.perf_counter(), peak_memory()
with open(path, encoding="utf-8") as stream: model = cityjson.reader(stream)
model.decompress()
count = len(model.j["vertices"])
""",
}


def write_tiles(path, megabytes):
    """Repeat the tile until the file has the size; return the bytes of its polygons."""
    tile = TILE.read_bytes()
    found = MEMBER.search(tile)
    copies = max(1, round((megabytes * 1e6 - len(tile) + len(found.group())) / len(found.group())))
    with path.open("wb") as file:
        file.write(tile[: found.start()])
        for copy in range(copies):
            file.write(shift_copy(found.group(), copy))
        file.write(tile[found.end() :])
    return copies * sum(len(polygon) for polygon in POLYGON.findall(found.group()))


def shift_copy(members, copy):
    """Objects of the tile, shifted east and north, with unique ids."""
    if not copy:
        return members
    east, north = STEP * (copy % 8), STEP * (copy // 8)

    def move(positions):
        numbers = positions.group(2).split()
        for first, step in ((0, east), (1, north)):
            numbers[first::3] = [b"%.3f" % (float(number) + step) for number in numbers[first::3]]
        return positions.group(1) + b" ".join(numbers) + positions.group(3)

    return POSITIONS.sub(move, IDENTIFIERS.sub(rb"\g<1>c%d_" % copy, members))


def run_once(reader, path):
    """Read once in a separate process: seconds, bytes grown, count; None if the peer is not
    installed.
    """
    command = [sys.executable, "-c", HEAD + READERS[reader] + TAIL, str(path)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=path.parent)
    if reader == "cjio" and "ModuleNotFoundError" in done.stderr:
        return None
    if done.returncode:
        raise SystemExit(done.stderr)
    return json.loads(done.stdout)


def compare(path, readers, runs, kept):
    """Print medians of several readers on one file, with interleaved runs."""
    results = {reader: [] for reader in readers}
    for _ in range(runs):
        for reader in readers:
            if (result := run_once(reader, path)) is not None:
                results[reader].append(result)
    size = path.stat().st_size / 1e6
    for reader, rows in results.items():
        if rows:
            seconds = statistics.median(row["seconds"] for row in rows)
            grown = statistics.median(row["grown"] for row in rows)
            of_kept = f"{grown / kept:5.1f} x polygons, " if kept else ""
            print(
                f"{path.name:>16} {size:6.1f} MB  {reader:<7} {seconds:6.2f} s  "
                f"{1000 * seconds / size:6.0f} ms/MB  "
                f"memory +{grown / 1e6:6.0f} MB ({of_kept}{grown / 1e6 / size:.1f} x file)  "
                f"{rows[0]['count']:,} read"
            )


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--megabytes", type=float, nargs="+", default=[3, 12, 50])
    parser.add_argument("--cityjson", type=Path, help="a CityJSON file to read as well")
    options = parser.parse_args()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.1f}, medians of {options.runs}")
    with tempfile.TemporaryDirectory() as work:
        for megabytes in options.megabytes:
            path = Path(work) / f"berlin_{megabytes:g}.gml"
            kept = write_tiles(path, megabytes)
            compare(path, ("citypv", "lxml"), options.runs, kept)
        if options.cityjson:
            compare(options.cityjson.resolve(), ("citypv", "json", "cjio"), options.runs, None)


if __name__ == "__main__":
    main()
