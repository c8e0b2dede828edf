"""The tiles of a solar map and their tree: squares of surfaces, the roofs of each, and mosaics of
roofs from afar.

A square has a tile of its roofs, refined by one or more tiles of all its surfaces. Four squares
have a mosaic above them, four mosaics another, up to one for the whole. A pixel of a mosaic has the
means of the roofs in it, and is drawn as large as these. Every few levels a tile heads a file of
its own, so that a page reads what it sees.
"""

import gzip
import json
from dataclasses import dataclass

import numpy as np

from .colour_map import MODULES
from .pack_city import BELOW, find_feet, heights_at
from .read_pieces import Shapes
from .write_tile import compose_tile

SIDE = 256.0  # [m] of a square
MOST_BYTES = 500_000  # of a tile after gzip
PIXELS = 64  # along each side of a mosaic
NODES = 9  # of the ground's heights along each side of a tile


@dataclass
class _Node:
    """A tile with what the tile above it needs."""

    tile: dict  # as in the file of the tree
    box: np.ndarray  # (6,) [m] lowest and highest x, y, z
    pixel: np.ndarray  # (p,) int, pixels of the mosaic with roofs; rows from south to north
    # (p, k): roof area, that times roof height and ground height; area that counts, that times
    # values
    sums: np.ndarray


def write_square(folder, place, piece, columns, look):
    """Write the tiles of one square.

    Parameters
    ----------
    folder : pathlib.Path
        Of all tiles.
    place : (int, int)
        Of the square, east and north.
    piece : Piece
        All surfaces of its buildings.
    columns : dict
        Values of each surface, as of `compose_tile`.
    look : dict
        Keywords of `compose_tile`.

    Returns
    -------
    Node
    """
    # A square of the map in 3D: its surfaces in tiles of limited size, and a coarser one from afar.
    # Ground below the buildings of the square, and the box around all.
    low, name = np.array(place) * SIDE, f"0_{place[0]}_{place[1]}"
    shapes, count = piece.shapes, len(piece.faces)
    feet = find_feet(shapes.corners, columns["building"][shapes.feature])
    ground = _lay_ground(low, SIDE, feet)
    middle = np.array([*(low + SIDE / 2), feet[:, 2].min()])
    box = bound(shapes.corners, ground.corners, piece.modules.corners)

    def compose(rows, columns, with_ground):
        values = {key: column[rows] for key, column in columns.items()}
        return compose_tile(
            shapes.take(rows, count), values, ground if with_ground else None, middle, **look
        )

    # Buildings in order, in one tile if it is small enough packed, else halved until each is.
    waiting, tiles = [np.argsort(columns["building"], kind="stable")], []
    while waiting:
        rows = waiting.pop()
        if not np.isin(shapes.feature, rows).any():
            continue  # racks alone, whose numbers are in the sums of their building
        # Only the first tile of the square holds its ground.
        data = compose(rows, columns, not tiles)
        if len(data) > MOST_BYTES and len(rows) > 1 and len(gzip.compress(data, 6)) > MOST_BYTES:
            waiting += reversed(np.split(rows, [_cut_between(columns["building"][rows])]))
            continue
        uri = f"{name}_{len(tiles)}.glb"
        (folder / uri).write_bytes(data)
        tiles.append({"boundingVolume": _box_of(box), "geometricError": 0, "content": {"uri": uri}})
        # Near by it has its modules too: without them it is off by about the size of one.
        values = {name: columns[name] for name in ("hours", "error", "kwp")}
        parts = list(_cut_modules(piece, rows, values, middle, look))
        for number, part in enumerate(parts):
            own = f"{name}_{len(tiles) - 1}_modules{number}.glb"
            (folder / own).write_bytes(part)
            leaf = {"boundingVolume": _box_of(box), "geometricError": 0, "content": {"uri": own}}
            tiles[-1] |= {"geometricError": 2, "refine": "ADD"}
            tiles[-1].setdefault("children", []).append(leaf)
    # Roofs without walls are off by the height of the tallest building.
    tall = _tallest(shapes.corners[:, 2], columns["building"][shapes.feature])
    tile = {
        "boundingVolume": _box_of(box),
        "geometricError": tall,
        "refine": "REPLACE",
        "children": tiles,
    }
    # From afar the square shows its largest roofs alone, with rounded values.
    drawn = np.isin(np.arange(count), shapes.feature[shapes.triangles[:, 0]])
    roofs = np.flatnonzero(np.isin(piece.faces["kind"], ("roof", "flat", "steep", "rack")) & drawn)
    if len(roofs):
        # The tile of a square holds its 4,000 largest roofs.
        largest = np.sort(roofs[np.argsort(-columns["area"][roofs], kind="stable")[:4000]])
        names = [
            "kwp",
            "hours",
            "error",
            "sky",
            "tilt",
            "azimuth",
            *(key for key in columns if key.startswith("month_")),
        ]
        afar = {key: _round_off(columns[key]) for key in names}
        (folder / f"{name}_roofs.glb").write_bytes(compose(largest, afar, True))
        tile["content"] = {"uri": f"{name}_roofs.glb"}
    # The tile goes back with its box, and with sums of its roofs by pixel for coarser tiles.
    return _Node(tile, box, *_sum_pixels(low, shapes.take(roofs, count), roofs, columns, feet))


def _cut_modules(piece, rows, columns, middle, look):
    """Tiles of the modules on some rows of a piece, each small enough packed: yields bytes."""
    waiting = [rows]
    while waiting:
        rows = waiting.pop()
        own = piece.modules.take(rows, len(piece.faces))
        if not len(own.triangles):
            continue
        values = {name: column[rows] for name, column in columns.items()}
        data = compose_tile(own, values, None, middle, colour=MODULES, **look)
        if len(data) > MOST_BYTES and len(rows) > 1 and len(gzip.compress(data, 6)) > MOST_BYTES:
            waiting += reversed(np.split(rows, [len(rows) // 2]))
            continue
        yield data


def _tallest(height, building):
    """Height of the tallest of some buildings [m]: from its lowest corner to its highest."""
    _, number = np.unique(building, return_inverse=True)
    low, high = np.full(number.max() + 1, np.inf), np.full(number.max() + 1, -np.inf)
    np.minimum.at(low, number, height)
    np.maximum.at(high, number, height)
    return float((high - low).max())


def _cut_between(building):
    """Place nearest to the middle at which another building begins, or the middle of a
    single one.
    """
    edges = np.flatnonzero(np.diff(building)) + 1
    half = len(building) // 2
    return edges[np.argmin(np.abs(edges - half))] if len(edges) else half


def _lay_ground(low, side, feet, *, overlap=3.0):
    """A square of ground through feet, a little larger so that none shows a gap to the next: Shapes
    of one feature.
    """
    steps = np.linspace(-overlap, side + overlap, NODES)
    nodes = np.stack(np.meshgrid(low[0] + steps, low[1] + steps), axis=-1).reshape(-1, 2)
    k = np.arange(NODES**2).reshape(NODES, NODES)
    a, b, c, d = (part.ravel() for part in (k[:-1, :-1], k[:-1, 1:], k[1:, 1:], k[1:, :-1]))
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    height = heights_at(nodes, feet) - BELOW
    return Shapes(np.column_stack([nodes, height]), np.zeros(NODES**2, int), triangles)


def _sum_pixels(low, shapes, roofs, columns, feet):
    """What the roofs add to each pixel of a square: `pixel` and `sums` of its Node."""
    a, b, c = (shapes.corners[shapes.triangles[:, k]] for k in range(3))
    area = 0.5 * np.abs(np.cross(b - a, c - a)[:, 2])  # in plan
    # Points of the R2 sequence in each triangle, four for each pixel of it.
    count = np.ceil(4 * area / (SIDE / PIXELS) ** 2).astype(int)
    triangle = np.repeat(np.arange(len(area)), count)
    number = np.arange(len(triangle)) - np.repeat(np.cumsum(count) - count, count)
    u, v = (0.5 + number * 0.7548776662466927) % 1, (0.5 + number * 0.5698402909980532) % 1
    u, v = np.where(u + v > 1, 1 - u, u)[:, None], np.where(u + v > 1, 1 - v, v)[:, None]
    place = a[triangle] + u * (b - a)[triangle] + v * (c - a)[triangle]
    share = (area / np.maximum(count, 1))[triangle]
    row = roofs[shapes.feature[shapes.triangles[:, 0]]][triangle] if len(roofs) else triangle
    # Energy in place of power, for it is that which adds up.
    energy, months = (
        columns["kwp"] * columns["hours"],
        [columns[key] for key in columns if key.startswith("month_")],
    )
    values = np.column_stack(
        [energy, columns["hours"], columns["error"], columns["sky"], *months]
    ).astype(float)[row]
    counted = np.where((columns["kwp"][row] > 0) & np.isfinite(values).all(axis=1), share, 0.0)
    column, line = np.clip((place[:, :2] - low) / SIDE * PIXELS, 0, PIXELS - 1).astype(int).T
    height = [share * place[:, 2], share * heights_at(place[:, :2], feet)]
    weighted = np.where(counted[:, None] > 0, counted[:, None] * values, 0.0)
    return _add_up(line * PIXELS + column, np.column_stack([share, *height, counted, weighted]))


def _add_up(pixel, sums):
    """The different pixels, and the sums over their rows."""
    found, place = np.unique(pixel, return_inverse=True)
    total = np.zeros((len(found), sums.shape[1]))
    np.add.at(total, place, sums)
    return found, total


def join_squares(folder, place, parts, look, top=False):
    """Write the mosaic above up to four squares, or mosaics.

    Parameters
    ----------
    folder : pathlib.Path
    place : (int, int, int)
        Level, and place on that level, east and north.
    parts : list of ((int, int), Node)
        Their places on their level, and what they are.
    look : dict
        Keywords of `compose_tile`.
    top : bool
        Whether it is the whole, which has a file of its own.

    Returns
    -------
    Node
    """
    level, *grid = place
    side, name = SIDE * 2**level, "_".join(map(str, place))
    box = bound(np.reshape([node.box for _, node in parts], (-1, 3)))
    pixels, half = [], PIXELS // 2
    for (x, y), node in parts:
        line, column = np.divmod(node.pixel, PIXELS)
        pixels.append((line // 2 + y % 2 * half) * PIXELS + column // 2 + x % 2 * half)
    pixel, sums = _add_up(np.concatenate(pixels), np.concatenate([node.sums for _, node in parts]))
    error = max(2 * side / PIXELS, *(node.tile["geometricError"] for _, node in parts))
    tile = {"boundingVolume": _box_of(box), "geometricError": error, "refine": "REPLACE"}
    tile["children"] = [node.tile for _, node in parts]
    if len(pixel):
        (folder / f"{name}.glb").write_bytes(
            _compose_mosaic(np.array(grid) * side, side, pixel, sums, look)
        )
        tile["content"] = {"uri": f"{name}.glb"}
    # Three levels lie between files of the tree.
    if top or level % 3 == 0:
        write_tileset(folder / f"{name}.json", tile)
        tile = {key: tile[key] for key in ("boundingVolume", "geometricError")} | {
            "content": {"uri": f"{name}.json"}
        }
    return _Node(tile, box, pixel, sums)


def _compose_mosaic(low, side, pixel, sums, look):
    """Bytes of the tile: a square for each pixel, of the area of its roofs, above the ground."""
    # A square in the middle of each pixel, as large as the area of its roofs, at their mean height.
    # Columns of `sums`: area of roofs, it times their height and the ground's, area that counts,
    # and that area times energy, hours, error, sky and months.
    line, column = np.divmod(pixel, PIXELS)
    step = side / PIXELS
    middle = np.stack([low[0] + (column + 0.5) * step, low[1] + (line + 0.5) * step], axis=1)
    half = 0.5 * step * np.sqrt(np.minimum(sums[:, 0] / step**2, 1))
    heights = sums[:, 1:3] / sums[:, :1]
    around = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    flat = middle[:, None] + around * half[:, None, None]
    corners = np.concatenate(
        [flat, np.broadcast_to(heights[:, None, :1], (*flat.shape[:2], 1))], axis=2
    )
    # Two triangles each; values are means over the area that counts in the pixel, but power: mean
    # energy over mean hours, rounded as all columns.
    first = 4 * np.arange(len(pixel))[:, None]
    triangles = np.concatenate([first + np.array(half) for half in ((0, 1, 2), (0, 2, 3))])
    with np.errstate(invalid="ignore", divide="ignore"):
        energy, *means = (sums[:, 4:] / sums[:, 3:4]).T
        named = [
            "hours",
            "error",
            "sky",
            *(f"month_{number:02d}" for number in range(1, len(means) - 2)),
        ]
        # NaN where nothing of it counts.
        columns = {"kwp": energy / means[0], **dict(zip(named, means, strict=True))}
    columns = {name: _round_off(values) for name, values in columns.items()}
    shapes = Shapes(corners.reshape(-1, 3), np.repeat(np.arange(len(pixel)), 4), triangles)
    ground = _lay_ground(low, side, np.column_stack([middle, heights[:, 1]]))
    return compose_tile(
        shapes, columns, ground, np.array([*(low + side / 2), heights[:, 1].min()]), **look
    )


def _round_off(values):
    """float32 of fewer digits; whole numbers as they are."""
    if values.dtype.kind != "f":
        return values
    # Numbers from afar have fewer digits, so that gzip finds more.
    return (np.ascontiguousarray(values, np.float32).view(np.uint32) & np.uint32(0xFFFFF000)).view(
        np.float32
    )


def bound(*points):
    """Box around points: (6,) lowest and highest x, y, z [m]."""
    points = np.concatenate(points)
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def _box_of(box):
    """Bounding volume of a tile."""
    centre, half = (box[:3] + box[3:]) / 2, (box[3:] - box[:3]) / 2
    return {"box": [*centre.tolist(), *np.diag(half).ravel().tolist()]}


def write_tileset(path, tile, **more):
    """Write a file of the tree."""
    tileset = {
        "asset": {"version": "1.1"},
        "geometricError": 2 * tile["geometricError"],
        "root": tile,
        **more,
    }
    path.write_text(json.dumps(tileset, separators=(",", ":")), "ascii", newline="\n")
