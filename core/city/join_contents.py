"""Join the contents of several files in one coordinate reference system in metres."""

from dataclasses import replace
from functools import partial

import numpy as np
import pyproj

from ..settings.errors import InputError
from ..settings.progress import report_part, report_polygons, silent
from .assemble_city import assemble_city
from .transform_crs import choose_crs, convert_to_metres

IN_DEGREES = "implicit geometry in a coordinate reference system in degrees"
JOINING = "joining polygons"  # name of the stage
BROUGHT = 0.1  # share of the time until all are in one coordinate reference system


def join_contents(contents, lod=None, unit="m", orient="auto", progress=silent):
    """One City from the contents of files.

    Parameters
    ----------
    contents : list of FileContent
    lod : str, optional
    unit : {'m', 'ft', 'us-ft'}
        If no file gives a coordinate reference system.
    orient : {'auto', 'as-drawn'}
        See `assemble_city`.
    progress : callable, optional
        See `core.progress`.

    Returns
    -------
    City

    Raises
    ------
    InputError
        The files use different coordinate reference systems.
    """
    count = sum(len(content.polygons) for content in contents)
    progress(JOINING, 0, count, "polygons")
    for content in contents:
        drawn = [*content.polygons, *(polygon for tree in content.trees for polygon in tree.polygons)]
        easting = next((polygon.rings[0][0, 0] for polygon in drawn if len(polygon.rings[0])), None)
        content.crs, unknown = choose_crs(content.srs_names, easting, content.path)
        for srs_name, line in unknown.items():
            content.notes.append(f"{content.path}, line {line}: srsName {srs_name!r} is not known to PROJ.")
        if content.crs and pyproj.CRS.from_user_input(content.crs).is_geographic:
            leave_out_degrees(content)
    crs = _common_crs(contents)
    trees = join_trees(contents)
    polygons = [polygon for content in contents for polygon in content.polygons]
    polygons += [polygon for tree in trees for polygon in tree.polygons]
    placed = [tree for tree in trees if tree.place is not None]
    rings = [ring for polygon in polygons for ring in polygon.rings] + [tree.place[None] for tree in placed]
    points = np.concatenate([np.empty((0, 3)), *rings])
    points, crs, note = convert_to_metres(points, crs, unit)
    if note:
        contents[0].notes.append(note)
    ends = np.cumsum([len(ring) for ring in rings]) if rings else []
    pieces = iter(np.split(points, ends[:-1]) if rings else [])
    for polygon in polygons:
        polygon.rings = [next(pieces) for _ in polygon.rings]
    for tree in placed:
        tree.place = next(pieces)[0]
    progress(JOINING, BROUGHT * count, count, "polygons")

    report_share = partial(report_part, partial(report_polygons, progress, JOINING, count), BROUGHT, 1.0)
    return replace(assemble_city(contents, crs, lod, orient, report_share), trees=trees)


def join_trees(contents):
    """Trees of all files, each once: a neighbouring tile may hold the same one. List of Tree."""
    seen, trees = set(), []
    for content in contents:
        for tree in content.trees:
            shape = tuple(ring.tobytes() for polygon in tree.polygons for ring in polygon.rings)
            key = tree.name, None if tree.place is None else tree.place.tobytes(), hash(shape)
            if key in seen:
                content.skip("tree already read", tree.name)
                continue
            seen.add(key)
            trees.append(tree)
    return trees


def leave_out_degrees(content):
    """Leave out implicit geometry: its coordinates in metres cannot be added to a reference point in degrees."""
    for polygon in content.polygons:
        if polygon.implicit:
            content.skip(IN_DEGREES, polygon.surface_id or f"line {polygon.line}")
    content.polygons = [polygon for polygon in content.polygons if not polygon.implicit]
    for tree in [tree for tree in content.trees if any(polygon.implicit for polygon in tree.polygons)]:
        content.skip(IN_DEGREES, tree.name)
        tree.polygons = []
        if tree.height is None:
            content.trees.remove(tree)


def _common_crs(contents):
    named = {content.crs: content for content in contents if content.crs}
    if len({crs.split("+")[0] for crs in named}) > 1:
        first, second = list(named)[:2]
        problem = f"is in {second}, but {named[first].path} in {first}"
        raise InputError(named[second].path, problem, "convert all files to one coordinate reference system")
    for content in contents:
        if named and content.crs is None:
            content.notes.append(f"{content.path} has no coordinate reference system; {max(named)} is assumed.")
    return max(named, key=len, default=None)
