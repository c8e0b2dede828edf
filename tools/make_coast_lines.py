"""Make core/world/coast_lines.npz, the world's coast lines for maps, from Natural Earth's land at
1:110,000,000.

    .venv/bin/python tools/make_coast_lines.py land-110m.json

The source is the file of that name in the npm package world-atlas 2.0.2: Natural Earth's physical
land (public domain) as TopoJSON. Kept are its lines in steps of 0.01°, without the ones that only
close polygons along the date line and at the South Pole.
"""

import argparse
import json
from pathlib import Path

import numpy as np

TARGET = Path(__file__).resolve().parent.parent / "core" / "world" / "coast_lines.npz"
STEP = 0.01  # [°]
EDGE = 179.99  # [°] of longitude, and 89.9° S: edges of the map, not coasts
POLE = -89.9


def main():
    """Read the source, write the file, say its size."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("source", type=Path, help="land-110m.json")
    parser.add_argument("--out", type=Path, default=TARGET)
    options = parser.parse_args()
    lines = [
        part
        for arc in read_arcs(json.loads(options.source.read_text("utf-8")))
        for part in cut_edges(arc)
    ]
    points = np.round(np.concatenate(lines) / STEP).astype(np.int16)
    length = np.array([len(line) for line in lines], np.int16)
    np.savez_compressed(options.out, points=points, length=length)
    print(
        f"{options.out}: {len(lines)} lines, {len(points)} points, "
        f"{options.out.stat().st_size / 1e3:.0f} kB"
    )


def read_arcs(topology):
    """Lines of a quantised TopoJSON: yields (k, 2) longitude and latitude [°]."""
    scale, origin = (np.array(topology["transform"][name]) for name in ("scale", "translate"))
    for arc in topology["arcs"]:
        yield np.cumsum(arc, axis=0) * scale + origin


def cut_edges(line):
    """Parts of a line that run neither along the edges of the map nor across it: list of (k, 2), k
    > 1.
    """
    east, north = np.abs(line[:, 0]) > EDGE, line[:, 1] < POLE
    along = (
        (east[1:] & east[:-1]) | (north[1:] & north[:-1]) | (np.abs(np.diff(line[:, 0])) > 180.0)
    )
    return [part for part in np.split(line, np.flatnonzero(along) + 1) if len(part) > 1]


if __name__ == "__main__":
    main()
