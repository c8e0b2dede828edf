"""Join the contents of several files in one coordinate reference system in metres."""

from dataclasses import replace
from functools import partial

import numpy as np

from ..settings.errors import InputError
from ..settings.progress import report_part, report_polygons, silent
from .assemble_city import assemble_city
from .axis_order import PlaceHints, middle_of, note_order, order_axes
from .city import ImportReport
from .edit_city import join_cities
from .extrude_footprints import extrude_footprints
from .judge_sizes import judge_unit
from .name_crs import choose_crs, hash_plane, pick_crs, with_zone
from .strays import STRAY_TREE, is_on_earth
from .transform_crs import LOCAL, UNITS, Grid, choose_plane, plane_of

OFF_GROUND = (
    "implicit geometry in a coordinate reference system whose axes are not metres east and north"
)
JOINING = "joining polygons"  # name of the stage


def join_contents(contents, lod=None, unit="m", *, orient="auto", progress=silent, hints=None):
    """One City from the contents of files.

    Parameters
    ----------
    contents : list of FileContent
    lod : str, optional
    unit : {'m', 'ft', 'us-ft', 'mm', 'cm', 'in', 'auto'}
        If no file gives a coordinate reference system.
    orient : {'auto', 'as-drawn'}
        See `assemble_city`.
    progress : callable, optional
        See `core.settings.progress`.
    hints : PlaceHints, optional
        What the user tells of the place.

    Returns
    -------
    City

    Raises
    ------
    InputError
        The unit is unknown, the files use different coordinate reference systems, or their points
        have no place on Earth.
    """
    if unit not in (*UNITS, "auto"):
        raise InputError("--unit", f"{unit!r} is not known", f"choose one of {', '.join(UNITS)}")
    # All files in one system of reference, trees and buildings each in one list.
    count = sum(
        len(content.polygons) + (len(content.footprints.points) if content.footprints else 0)
        for content in contents
    )
    progress(JOINING, 0, count, "polygons")
    for content in contents:
        _read_system(content)
    hints = hints or PlaceHints()
    crs = _common_crs(contents, hints.like)
    _join_trees(contents)
    # Files without a system: their unit is given, or judged by size. With one: the order of their
    # axes is found, and a plane in true metres.
    grid = Grid()
    if unit == "auto":
        unit, notes = judge_unit(contents) if crs is None else ("m", [])
        contents[0].notes += notes
    if crs is None:
        contents[0].notes += (
            [] if unit == "m" else [f"Coordinates converted from {unit} to metres."]
        )
    else:
        _order_contents(contents, crs, hints)
        grid = _choose_grid(contents, crs, hints.like)
    # Points of each file move there.
    for content in contents:
        own = replace(grid, crs=content.crs, axes=content.axes, plane=_plane_for(content.crs, grid))
        _move_content(content, own.to_plane if crs else lambda points: points * UNITS[unit])
    brought = 0.1  # share of the time until all are in one coordinate reference system
    progress(JOINING, brought * count, count, "polygons")

    report_share = partial(
        report_part, partial(report_polygons, progress, JOINING, count), brought, 1.0
    )
    # Then one city is made of all: polygons as they are drawn, footprints drawn up to blocks. Trees
    # at heights that the Earth does not have are left out, unless the city has such heights.
    trees = [tree for content in contents for tree in content.trees]
    flat = [content for content in contents if content.footprints is not None]
    solid = [content for content in contents if content.footprints is None]
    city = assemble_city(solid, grid.crs, lod, orient, report_share) if solid else None
    if flat:
        extruded = _extrude(flat, grid, hints.find_ground)
        city = extruded if city is None else _join_with_report(city, extruded)
        report_share(1.0)
    city.report.unit, city.report.up = (
        unit,
        next((content.up for content in contents if content.up != "z"), "z"),
    )
    trees = _leave_out_strays(city, trees)
    return replace(city, trees=trees, axes=grid.axes, plane=grid.plane)


def _extrude(contents, grid, find_ground):
    """City of files of footprints, which stand in the plane of a grid."""

    def draw(ground_height=None):
        report = ImportReport(
            files=[str(content.path) for content in contents],
            notes=[note for content in contents for note in content.notes],
            attributions=list(
                dict.fromkeys(text for content in contents for text in content.attributions)
            ),
        )
        for content in contents:
            for reason, names in content.skipped.items():
                report.skip(reason, names)
        city = extrude_footprints(contents, grid.crs, report, ground_height)
        return replace(city, axes=grid.axes, plane=grid.plane)

    city = draw()
    return city if find_ground is None else draw(find_ground(city))


def _join_with_report(city, extruded):
    """Both cities as one, with what both reports say."""
    report, more = city.report, extruded.report
    for name in ("files", "notes", "attributions"):
        getattr(report, name).extend(getattr(more, name))
    for name in ("building_count", "part_count"):
        setattr(report, name, getattr(report, name) + getattr(more, name))
    for name in ("lods_met", "lods_chosen", "height_sources"):
        met = getattr(report, name)
        for lod, count in getattr(more, name).items():
            met[lod] = met.get(lod, 0) + count
    for reason, names in more.repaired.items():
        report.repair(reason, names)
    for reason, names in more.skipped.items():
        report.skip(reason, names, more.skipped_area.get(reason))
    joined = join_cities(replace(city, axes=extruded.axes, plane=extruded.plane), extruded)
    joined.report = report
    return joined


def _read_system(content):
    """Find the coordinate reference system of a file among the names in it, and note the ones that
    are not known.
    """
    drawn = [*content.polygons, *(polygon for tree in content.trees for polygon in tree.polygons)]
    places = [polygon.rings[0][0, :2] for polygon in drawn if len(polygon.rings[0])][:1]
    places += [content.footprints.points[0]] if content.footprints else []
    easting = next((float(np.abs(place).max()) for place in places), None)
    named, unknown = choose_crs(content.srs_names, easting, content.path)
    content.crs = with_zone(named, easting, content.path)
    if content.crs != named:
        content.notes.append(
            f"{content.path}: eastings begin with the number of the zone; read as {content.crs}, "
            f"not {named}."
        )
    for srs_name, line in unknown.items():
        content.notes.append(
            f"{content.path}, line {line}: srsName {srs_name!r} is not known to PROJ."
        )


def _order_contents(contents, crs, hints):
    """Give each file its system and the order of its coordinates; an order that one file proves
    holds for files that leave it open, too.
    """
    orders = []
    for content in contents:
        content.crs = content.crs or crs
        # Formats of outlines have easting or longitude first; only a place outside the area of use
        # of their system, or the user, tells otherwise.
        flat = content.footprints is not None
        own = replace(hints, is_land=None) if flat else hints
        order = order_axes(middle_of(content), content.crs, own, None if flat else content)
        orders.append(replace(order, registered="xy", doubtful=False) if flat else order)
        if flat and not order.reason:
            orders[-1] = replace(orders[-1], axes="xy")
    known = next((order.axes for order in orders if order.reason), hints.like and hints.like.axes)
    for content, order in zip(contents, orders, strict=True):
        content.axes = order.axes if order.reason or not known else known
    if not known or any(order.reason for order in orders):
        notes = [
            note for order in orders if order.reason or not known for note in note_order(order, crs)
        ]
        contents[0].notes += list(dict.fromkeys(notes))


def _choose_grid(contents, crs, like):
    """The plane of all files: another city's, or one around the middle of all points."""
    if like is not None:
        return Grid(like.crs, like.axes, like.plane)
    bounds = []
    for content in contents:
        points = np.concatenate([np.empty((0, 3)), *_rings_of(content)])
        if content.crs != crs and content.crs and hash_plane(content.crs) != hash_plane(crs):
            continue  # is brought to the system of the others
        if len(points):
            ends = np.stack([points.min(axis=0), points.max(axis=0)])
            bounds.append(ends if content.axes == contents[0].axes else ends[:, [1, 0, 2]])
    points = np.concatenate([np.empty((0, 3)), *bounds])
    grid, note = choose_plane(crs, contents[0].axes, points, contents[0].path)
    contents[0].notes += [note] if note else []
    if grid.plane is not None and plane_of(grid.plane)[0].name == LOCAL:
        for content in contents:
            _leave_out_implicit(content)
    return grid


def _plane_for(crs, grid):
    """Plane that points of a system are brought to, None where it is their own."""
    if grid.crs is None or crs is None:
        return None
    return grid.plane or (None if hash_plane(crs) == hash_plane(grid.crs) else grid.crs)


def _rings_of(content):
    rings = [ring for polygon in content.polygons for ring in polygon.rings]
    rings += [ring for tree in content.trees for polygon in tree.polygons for ring in polygon.rings]
    if content.footprints is not None:
        points = content.footprints.points
        rings.append(np.column_stack([points, np.zeros(len(points))]))
    return rings + [tree.place[None] for tree in content.trees if tree.place is not None]


def _move_content(content, move):
    """Move all points of a file."""
    rings = _rings_of(content)
    points = move(np.concatenate([np.empty((0, 3)), *rings]))
    if not np.isfinite(points).all():
        raise InputError(
            content.path, "has points where its system does not hold", "correct the srsName"
        )
    ends = np.cumsum([len(ring) for ring in rings]) if rings else []
    pieces = iter(np.split(points, ends[:-1]) if rings else [])
    trees = [polygon for tree in content.trees for polygon in tree.polygons]
    for polygon in [*content.polygons, *trees]:
        polygon.rings = [next(pieces) for _ in polygon.rings]
    if content.footprints is not None:
        content.footprints.points = next(pieces)[:, :2].copy()
    for tree in content.trees:
        if tree.place is not None:
            tree.place = next(pieces)[0]


def _leave_out_strays(city, trees):
    """Trees of a city without those at heights that the Earth does not have, where the city has
    none such.
    """
    if not is_on_earth(city.points):
        return trees
    feet = (np.empty((0, 3)) if tree.place is None else tree.place[None] for tree in trees)
    corners = [
        np.concatenate([*(polygon.rings[0] for polygon in tree.polygons), foot])
        for tree, foot in zip(trees, feet, strict=True)
    ]
    near = [is_on_earth(points) for points in corners]
    city.report.skip(
        STRAY_TREE, [tree.name for tree, known in zip(trees, near, strict=True) if not known]
    )
    return [tree for tree, known in zip(trees, near, strict=True) if known]


def _join_trees(contents):
    """Leave out trees that an earlier file has, too: neighbouring tiles may hold the same one."""
    seen = set()
    for content in contents:
        before, content.trees = content.trees, []
        for tree in before:
            shape = tuple(ring.tobytes() for polygon in tree.polygons for ring in polygon.rings)
            key = tree.name, None if tree.place is None else tree.place.tobytes(), hash(shape)
            if key in seen:
                content.skip("tree already read", tree.name)
                continue
            seen.add(key)
            content.trees.append(tree)


def _leave_out_implicit(content):
    """Leave out implicit geometry: its metres cannot be added to a reference point in another unit
    or scale.
    """
    for polygon in content.polygons:
        if polygon.implicit:
            content.skip(OFF_GROUND, polygon.surface_id or f"line {polygon.line}")
    content.polygons = [polygon for polygon in content.polygons if not polygon.implicit]
    for tree in [
        tree for tree in content.trees if any(polygon.implicit for polygon in tree.polygons)
    ]:
        content.skip(OFF_GROUND, tree.name)
        tree.polygons = []
        if tree.height is None:
            content.trees.remove(tree)


def _common_crs(contents, like=None):
    """The one system of all files, or of the city `like` where it is given; None where no file
    names one.
    """
    # With a given city all must be in its system; without, all in one system, up to the plane that
    # they lie in. Outlines are brought to the system of the others, since GeoJSON has degrees only;
    # where no other file names one, the first system that is named counts.
    binding = [content for content in contents if content.footprints is None]
    if like is None and not any(content.crs for content in binding):
        binding = [content for content in contents if content.crs][:1]
    named = {content.crs: content for content in binding if content.crs}
    if like is not None:
        for crs, content in named.items():
            # Results of earlier versions name the plane that feet and degrees were brought to, not
            # the system.
            if like.crs is None or (
                hash_plane(crs) != hash_plane(like.crs) and not like.crs.startswith("+proj")
            ):
                raise InputError(
                    content.path,
                    f"it is in {crs}, the city in {like.crs or 'no known system'}",
                    "give it in the system of the city",
                )
    grids = {hash_plane(crs): crs for crs in named}
    if len(grids) > 1:
        first, second = list(grids.values())[:2]
        raise InputError(
            named[second].path,
            f"is in {second}, but {named[first].path} in {first}",
            "convert all files to one coordinate reference system",
        )
    # Files that name none are taken to be in it.
    crs = pick_crs(named) or (like.crs if like is not None else None)
    for content in contents:
        if crs and content.crs is None:
            content.notes.append(
                f"{content.path} has no coordinate reference system; {crs} is assumed."
            )
    return crs
