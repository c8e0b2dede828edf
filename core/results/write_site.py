"""A city's solar map as a static site: 3D Tiles 1.1, an index of its buildings, and a page that
shows them.

Nothing but the files of the site is read by the page, and nothing but its own scripts runs in it.
Pieces of the city are read, sorted into squares on disk and written one after the other.
"""

import json
import re
import shutil
import tempfile
from contextlib import ExitStack
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path

import numpy as np
import pandas as pd

from ..city.building_facts import FACTS
from ..city.classify import ORIENTATIONS
from ..energy.pv_system import KINDS
from ..settings.errors import InputError, id_of_cell
from ..settings.version import __version__
from .compare_runs import layout_of, list_differences
from .describe_buildings import compose_building, describe_buildings
from .describe_run import attributions_of, describe_assumptions
from .group_sums import compose_sums
from .headline import compose_headline
from .output_folder import SITE_FILES, SITE_NAMES, whole_folder
from .page import fill_template, paragraph, section, table
from .read_pieces import frame_of, join_pieces, read_pieces
from .read_results import in_order, read_summary, town_of
from .site_store import Store
from .surfaces_file import GIVE_RESULTS, open_surfaces, zone_of_hours
from .tile_tree import SIDE, bound, join_squares, write_square, write_tileset
from .viewer_columns import describe_view, list_layers, measure_faces, sum_counting
from .words import WEB, read_html, say, speaking, words_as_data
from .write_report import (
    compose_errors,
    compose_totals,
    describe_origin,
    list_warnings,
)

SCRIPTS = ("three.js", "tiles.js", "viewer.js", "supply.js", "building.js", "basemap.js", "map.js")
NO_LICENCE = (
    "The licence of the city model is not stated. Whoever publishes this map has to see to it."
)


def write_site(
    folders,
    out,
    *,
    title="",
    attribution="",
    private=False,
    language="en",
    districts=None,
    basemap="",
    overwrite=False,
):
    """Write a solar map of one or more result folders.

    Parameters
    ----------
    folders : list of path-like
        Of `citypv simulate` or `citypv yield`, computed with the same weather and settings.
    out : path-like
        Folder of the site; written completely or not at all.
    title : str
        By default with the town of most addresses, where the files tell them.
    attribution : str
        Licence and source of the city model; "": as its files say.
    private : bool
        Leave out the ids of surfaces and buildings, and the search.
    language : str
        Of `words.list_languages`.
    districts : str, optional
        FILE or FILE:COLUMN of districts, in place of those that the runs were given.
    basemap : str
        Address of map tiles with {z}, {x} and {y}, which the page asks for; "": it asks for none.
    overwrite : bool
        Replace a site in a folder that is not empty.

    Returns
    -------
    dict
        Number of buildings and surfaces, and of files and bytes of the site.

    Raises
    ------
    InputError
        A folder holds no results, or they do not belong together.
    """
    # Refused where the basemap's address is none of map tiles.
    host = _host_of(basemap)
    # Only folders with results; a folder that holds something else is never overwritten.
    folders = [Path(folder) for folder in folders]
    for folder in folders:
        if not (folder / "summary.json").is_file():
            raise InputError(folder / "summary.json", "there is no such file", GIVE_RESULTS)
    if (
        overwrite
        and Path(out).is_dir()
        and any(Path(out).iterdir())
        and not Path(out, "page", "map.json").is_file()
    ):
        raise InputError(out, "holds something else than a map", "choose another --out")
    summary = _join_summaries(folders)
    # Licences that the files themselves ask to be named, where nothing else is given.
    attribution = attribution or "; ".join(summary["attributions"])
    site = summary["input"]["site"]
    frame = frame_of(site["latitude"], site["longitude"])
    # Surfaces of all folders are sorted by place in a database on disk, so that no city is too
    # large.
    with whole_folder(out, overwrite, SITE_NAMES) as work, ExitStack() as stack:
        stack.enter_context(speaking(language))
        scratch = stack.enter_context(tempfile.TemporaryDirectory(dir=work))
        store = Store(Path(scratch) / "city.sqlite")
        stack.callback(store.base.close)
        count, view = _sort_surfaces(store, folders, frame, summary)
        for folder in folders:
            store.keep_pages(describe_buildings(folder))
        # Tiles by level of detail, then what the map searches and shows, then the page.
        look = {
            "level": next(layer["range"] for layer in view["layers"] if layer["name"] == "hours"),
            "enums": {
                "kind": [kind["name"] for kind in view["kinds"]],
                "orientation": view["sides"],
                "reason": ["counts", *view["reasons"][1:]],
            },
            "copyright": attribution,
        }
        frame, box = _write_tiles(work, store, frame, look=look, private=private)
        total = store.base.execute("SELECT count(*) FROM building").fetchone()[0]
        worn = any((work / "tiles").glob("*_modules*.glb"))
        header = {
            "modules": worn,
            "frame": frame.ravel().tolist(),
            "box": box.round(2).tolist(),
            "buildings": total,
        }
        town = town_of(store.addresses)
        header |= {"filled": sorted(store.filled), "town": town, "basemap": basemap}
        _write_index(work, store, header | view, private)
        heading = say("Solar map of {town}", town=town) if town else say("Solar map")
        sums = compose_sums(folders, districts)
        _write_page(work, summary, title or heading, attribution, sums, host=host)
        # Names of what was written, so that the next run may replace just these.
        paths = [path.relative_to(work) for path in work.rglob("*") if path.is_file()]
        listed = sorted(path.as_posix() for path in paths if path.parts[0] in SITE_NAMES)
        (work / SITE_FILES).write_text("\n".join([*listed, SITE_FILES]), "utf-8", newline="\n")
    files = [path for path in Path(out).rglob("*") if path.is_file()]
    return {
        "buildings": total,
        "surfaces": count,
        "files": len(files),
        "bytes": sum(path.stat().st_size for path in files),
    }


def _join_summaries(folders):
    """The first summary, with sums, the largest errors and the latest date of all; refuse what does
    not agree: dict.
    """
    first = None
    for folder in folders:
        summary, path = read_summary(folder / "summary.json"), folder / "summary.json"
        summary["date"] = path.stat().st_mtime
        summary["attributions"] = attributions_of(summary)
        if first is None:
            first = summary
            with open_surfaces(folder) as file:
                first["zone"] = zone_of_hours(file)
            continue
        # Sources are joined; a folder with another weather, setting or layout is refused.
        first["attributions"] += [
            text for text in summary["attributions"] if text not in first["attributions"]
        ]
        apart = list_differences(first, summary)
        apart += ["--layout"] * (layout_of(first) != layout_of(summary))
        if apart:
            raise InputError(
                folder,
                f"differs from {folders[0].name} in {', '.join(apart)}",
                "compute both with the same, by citypv yield if the light is there",
            )
        first["date"] = max(first["date"], summary["date"])
        first["input"]["surfaces"] += summary["input"]["surfaces"]
        first["totals"] = _add_totals(first["totals"], summary["totals"])
        first["edge"] = None  # of each folder, not of all
        first["error_budget"] = _worse(first["error_budget"], summary["error_budget"])
    return first


def _add_totals(one, other):
    """Sums of two folders: numbers are added, means follow from sums, and what can be neither is
    left out, such as poor years.
    """
    both = {}
    for name in dict.fromkeys([*one, *other]):
        own, more = one.get(name), other.get(name)
        if isinstance(own or more, dict):
            both[name] = _add_totals(own or {}, more or {})
        elif name in ("layout", "unit", "area_per_kwp", "counted"):
            both[name] = own
        elif isinstance(own or more, (int, float)) and name[:4] not in ("p50_", "p90_"):
            both[name] = (own or 0) + (more or 0)
    for end in ("", "_dc"):
        if f"mwh{end}_per_year" in both and f"full_load_hours{end}" in both:
            energy = 1000 * both[f"mwh{end}_per_year"]
            both[f"full_load_hours{end}"] = energy / both["kwp"] if both["kwp"] else None
    if "string_shade" in both:  # its shares are of the energy of each
        energies = [part["mwh_per_year"] for part in (one, other)]
        shares = [(part.get("string_shade") or {}).get("percent") for part in (one, other)]
        both["string_shade"] |= {"kinds": {}, "groups": {}, "percent": None}
        if None not in shares and sum(energies):
            both["string_shade"]["percent"] = np.average(shares, weights=energies)
    return both


def _worse(one, other):
    """The larger of each of two errors, None where one is not known."""
    if isinstance(one, dict) and isinstance(other, dict):
        return {name: _worse(one[name], other.get(name)) for name in one}
    if not isinstance(one, (int, float)) or not isinstance(other, (int, float)):
        return None
    return max(one, other, key=abs)


def _sort_surfaces(store, folders, frame, summary):
    """Keep all surfaces by their squares: their number, and what the page must know to
    show them.
    """
    # The scales of the legends follow from about 100,000 surfaces.
    step = 1 + summary["input"]["surfaces"] // 100_000
    sampled, kinds, sides, count, supply = [], set(), set(), 0, 0
    for number, folder in enumerate(folders):
        _keep_texts(store, folder / "buildings.csv")
        for found in read_pieces(folder, frame):
            piece = store.add_piece(found, number, folder)
            kinds, sides = kinds | set(piece.faces["kind"]), sides | set(piece.faces["orientation"])
            count += len(piece.faces)
            mounted, values = measure_faces(piece.faces, piece.months)
            supply = supply + sum_counting(piece.faces["kind"].to_numpy(str), values)
            sampled.append(np.column_stack([*values.values()])[mounted.index][::step])
    if not count:
        raise InputError(folders[0] / "faces.csv", "has no surfaces with shapes", GIVE_RESULTS)
    sampled = dict(zip(values, np.concatenate(sampled).T, strict=True))
    layers = list_layers(sampled, pd.DataFrame(index=range(len(sampled["hours"]))))
    words = in_order(kinds, KINDS), in_order(sides, ORIENTATIONS)
    return count, describe_view(*words, layers, supply, summary["totals"])


def _keep_texts(store, path):
    """Keep texts and sums of buildings.csv, where it is there, some rows at a time."""
    if not path.is_file():
        return
    wanted = ("building_id", "kwp", "mwh_per_year", *FACTS)
    tables = pd.read_csv(
        path,
        dtype=str,
        keep_default_na=False,
        usecols=lambda name: name in wanted,
        chunksize=50_000,
    )
    with tables:
        for table in tables:
            names = table.pop("building_id").map(id_of_cell)
            store.keep_texts(table.set_index(names))


def _write_tiles(work, store, frame, *, look, private):
    """Write all tiles and their tree, from the squares of one tile to the next, so that few tiles
    are held at a time.

    Returns
    -------
    (4, 4) float64
        The frame with its origin at the south-western corner of all squares, as in the tiles.
    (6,) float64 [m]
        Box around the city in it.
    """
    # Squares that have buildings, in levels of twice the length each, up to one that holds all.
    tiles = work / "tiles"
    tiles.mkdir()
    squares, boxes = np.array(store.base.execute("SELECT DISTINCT x, y FROM piece").fetchall()), []
    low = squares.min(axis=0)
    origin = np.append(low, 0) * SIDE
    frame[3, :3] += origin @ frame[:3, :3]
    top = max(1, int((squares - low).max()).bit_length())
    there = [set(map(tuple, (squares - low >> level).tolist())) for level in range(top)]

    # From the whole down to single squares, so that each is written once what it holds is written.
    def write_below(level, x, y):
        if level:
            places = [(2 * x + east, 2 * y + north) for east in (0, 1) for north in (0, 1)]
            parts = [
                (place, write_below(level - 1, *place))
                for place in places
                if place in there[level - 1]
            ]
            return join_squares(tiles, (level, x, y), parts, look, top=level == top)
        # A square at the lowest level: its surfaces from the store, with columns as the map wants
        # them; what is told of its buildings goes back to the store. Ids are left out of a private
        # map.
        piece = join_pieces(store.pieces((int(x + low[0]), int(y + low[1]))))
        for shapes in (piece.shapes, piece.modules):
            shapes.corners -= origin
        boxes.append(bound(piece.shapes.corners, piece.modules.corners))
        columns = _tabulate_columns(piece, look["enums"])
        store.describe_buildings(_list_buildings(store, piece, columns, private))
        if not private:
            columns |= {
                name: piece.faces[name].to_numpy(object) for name in ("surface_id", "building_id")
            }
        return write_square(tiles, (x, y), piece, columns, look)

    # The tree in one file, with the place of the map's frame on Earth.
    whole = write_below(top, 0, 0)
    write_tileset(tiles / "tileset.json", whole.tile | {"transform": frame.ravel().tolist()})
    return frame, bound(np.reshape(boxes, (-1, 3)))


def _tabulate_columns(piece, enums):
    """Columns of the surfaces' tile: dict of arrays."""
    values = measure_faces(piece.faces, piece.months)[1]
    places = {
        "kind": [enums["kind"].index(kind) for kind in piece.faces["kind"]],
        "orientation": [enums["orientation"].index(side) for side in piece.faces["orientation"]],
        "reason": values.pop("reason"),
    }
    columns = {"building": piece.faces["building"].to_numpy(np.uint32)}
    columns |= {name: np.asarray(numbers, np.uint8) for name, numbers in places.items()}
    return columns | {name: numbers.astype(np.float32) for name, numbers in values.items()}


def _list_buildings(store, piece, columns, private):
    """What the index says of the buildings of a square: yields lists of id or None, number, box,
    parts, part of flat roofs, energy [MWh], power [kWp] and the texts.

    A part has its kind, area that counts [m²], power [kWp], energy [MWh] and full load hours [h].
    Energy and power of the whole are read from buildings.csv, where the folder has it.
    """
    of_corner = columns["building"][piece.shapes.feature]
    numbers = {name: columns[name].astype(float) for name in ("counted", "kwp", "hours")}
    for building in np.unique(columns["building"]):
        rows = np.flatnonzero(columns["building"] == building)
        corners = piece.shapes.corners[of_corner == building]
        if not len(corners):
            continue
        parts, flat = [], None
        for reason in (0, 1):
            counting = rows[columns["reason"][rows] == reason]
            for kind in np.unique(columns["kind"][counting]):
                own = counting[columns["kind"][counting] == kind]
                area, kwp, hours = (numbers[name][own] for name in ("counted", "kwp", "hours"))
                sums = [area.sum(), kwp.sum(), kwp @ hours / 1000, area @ hours / area.sum()]
                part = [int(kind), *(float(f"{value:.6g}") for value in sums)]
                parts, flat = ([*parts, part], flat) if reason == 0 else (parts, part[1:])
        name = piece.faces["building_id"].iloc[rows[0]]
        told = store.texts_of(name)
        energy = float(told.get("mwh_per_year") or sum(part[3] for part in parts))
        power = float(told.get("kwp") or sum(part[2] for part in parts))
        texts = ["" if private else told.get(text, "") for text in FACTS]
        box = bound(corners).round(1).tolist()
        name = None if private else name
        yield [name, int(building), box, parts, flat, energy, power, *texts]


def _write_index(work, store, header, private, *, shard=1000):
    """Write the index of buildings: the largest, all by id, and what the page must know of both.

    `shards` of the header are what the files of the index begin with, as `words.plain` writes it.
    """
    (work / "buildings").mkdir()
    (work / "page").mkdir()

    def write_shard(name, entries):
        path = work / "buildings" / f"{name}.json"
        path.write_text(f"[{','.join(entries)}]", "ascii", newline="\n")

    # `shard`: entries in a file of the index, and buildings in the file of the largest.
    write_shard("largest", store.largest(shard))
    entries, begins = iter(()) if private else store.entries(), []
    while some := list(islice(entries, shard)):
        write_shard(len(begins), [entry for _, entry in some])
        begins.append(some[0][0])
    header["shards"] = begins
    # What the pages of buildings say, by number, 100 in a file as in web/map.js.
    pages = store.pages()
    for name, some in enumerate(iter(lambda: list(islice(pages, 100)), [])):
        write_shard(f"page_{name}", some)
    (work / "page" / "map.json").write_text(
        json.dumps(header, separators=(",", ":")), "ascii", newline="\n"
    )


def _host_of(basemap):
    """Scheme and host of the address of map tiles, as a Content-Security-Policy names it; "" of
    none.
    """
    if not basemap:
        return ""
    host = re.match(r"https?://[\w.-]+(:\d+)?(?=/)", basemap, re.ASCII)
    if host is None or not all(name in basemap for name in ("{z}", "{x}", "{y}")):
        raise InputError(
            "--basemap",
            f"{basemap} is no address of map tiles",
            "give one such as https://tiles.example.org/{z}/{x}/{y}.png",
        )
    return host[0]


def _write_page(work, summary, title, attribution, sums, *, host):
    """Write index.html and what it needs: its own scripts are all that it runs, and its own files
    all that it reads, but tiles of a basemap from a `host`.

    Below the map stand what the numbers rest on, and how far they hold.
    """
    # Scripts stand beside the page, as it may load nothing from elsewhere; the basemap's only where
    # a host is given.
    names = [name for name in SCRIPTS if host or name != "basemap.js"]
    for name in names:
        shutil.copyfile(WEB / name, work / "page" / name)
    shutil.copyfile(WEB / "three.LICENSES.txt", work / "page" / "LICENSES.txt")
    # How much and how sure, the map, then what its numbers mean, and how far they hold.
    written = datetime.fromtimestamp(summary["date"], UTC)
    origin = describe_origin(summary, written, attribution, host.partition("//")[2])
    # Without a source and licence of the city model a warning stands below the map.
    body = [
        origin,
        *(paragraph(text, "warning") for text in list_warnings(summary)),
        compose_headline(summary),
        read_html("viewer.html"),
        "" if attribution else paragraph(say(NO_LICENCE), "warning"),
        compose_totals(summary),
        sums,
        read_html("viewer_tables.html"),
        compose_errors(summary),
        section(say("What was assumed"), table((), describe_assumptions(summary))),
        paragraph(say("Made by CityPV {version}.", version=__version__), "small"),
        compose_building(origin, summary["zone"]),
    ]
    scripts = [words_as_data(), *(f'<script src="page/{name}"></script>' for name in names)]
    # A picture that is printed is data.
    allowed = f"script-src 'self'; connect-src 'self'; img-src data: {host}".strip()
    page = fill_template(title, "\n".join(body), scripts, allowed)
    (work / "index.html").write_text(page, "utf-8", newline="\n")
