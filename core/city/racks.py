"""Racks: rows of modules on flat roofs, as `--racks` asks for.

Each row is a thin closed slab that shades; its front is a surface with results of its own, called
after its roof.
"""

from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import shapely

from ..settings.errors import InputError, count_of
from .build_scene import DRAWN_TWICE
from .city import whole_of_cell
from .classify import classify, measure_tilt
from .grid_cells import split_into_cells
from .place_rows import THICKNESS, frame_roof, free_area, place_rows
from .plan_geometry import draw_triangles
from .polygons import measure_polygons
from .scene import Surfaces
from .site import MICROMETRE
from .split_edges import refine_triangles

RACK = "rack"  # the kind
MARK = "/rack"  # in names, between the roof's and a number
OPTION = "--racks"
PAIRS = "east-west"
RANGES = {  # key -> smallest and largest value, unit
    "tilt": (0.0, 60.0, "°"),
    "azimuth": (0.0, 360.0, "°"),
    "spacing": (0.1, 100.0, "m"),
    "gcr": (0.01, 1.0, ""),
    "depth": (0.2, 10.0, "m"),
    "rim": (0.0, 20.0, "m"),
    "height": (0.05, 5.0, "m"),
    "area": (0.0, 1e6, "m²"),
    "back-albedo": (0.0, 1.0, ""),
}
# Front, back and the four edges of a slab; the front has corners 0 to 3, and 4 to 7 lie behind
# them.
SLAB = np.array(
    [(0, 1, 2), (0, 2, 3), (4, 6, 5), (4, 7, 6)]
    + [
        triangle
        for i, j in ((0, 1), (1, 2), (2, 3), (3, 0))
        for triangle in ((i, i + 4, j + 4), (i, j + 4, j))
    ]
)


@dataclass(frozen=True)
class Racks:
    """How modules stand on flat roofs."""

    east_west: bool = False  # pairs of rows back to back
    tilt: float = 10.0  # [°] against the roof's plane
    # [°] the rows face, or the first of each pair; None: the equator, pairs the east
    azimuth: float | None = None
    spacing: float | None = None  # [m] from row to row, or pair to pair
    gcr: float | None = None  # ground coverage ratio: depth of the modules over spacing
    depth: float = 1.0  # [m] of a row along its slope
    rim: float = 0.5  # [m] kept free along edges, holes and whatever rises
    height: float = 0.1  # [m] of the lower edges above the roof
    area: float = 20.0  # [m²] of the smallest roof that carries racks
    back_albedo: float = 0.0  # of undersides and edges


def parse_racks(text):
    """Racks from the words of `--racks`.

    Parameters
    ----------
    text : str or None
        Parts joined by commas: ``east-west``, and KEY=VALUE with a key of `RANGES`.

    Returns
    -------
    Racks or None
        None where none are asked for.

    Raises
    ------
    InputError
        A key is unknown or given twice, a value is no number or out of its range, or both spacing
        and gcr are given.
    """
    if not text or text == "none":
        return None
    # One part after the other: a word that stands alone, or a key with a number in its range.
    given = {}
    for part in text.split(","):
        key, _, value = (piece.strip() for piece in part.partition("="))
        name = "east_west" if part.strip() == PAIRS else key.replace("-", "_")
        if name in given:
            raise InputError(OPTION, f"{key} is given twice", "give it once")
        if name == "east_west":
            given[name] = True
            continue
        if key not in RANGES:
            raise InputError(
                OPTION,
                f"{key!r} is not known",
                f"give {PAIRS}, or KEY=VALUE with {', '.join(RANGES)}",
            )
        least, most, unit = RANGES[key]
        with suppress(ValueError):
            given[name] = float(value)
        if not least <= given.get(name, np.nan) <= most:  # also true for NaN
            raise InputError(
                OPTION,
                f"{key}={value} is no number in its range",
                f"give a number from {least:g} to {most:g}{f' [{unit}]' if unit else ''}",
            )
    # The distance of rows follows from either of two numbers, which could disagree: both are
    # refused.
    if "spacing" in given and "gcr" in given:
        raise InputError(
            OPTION, "spacing and gcr are both given", "each follows from the other, give one"
        )
    return Racks(**given)


def roof_of_rack(name):
    """Id of the roof that a rack stands on, as it was before it was cut into cells."""
    return name.rpartition(MARK)[0]


def find_racked_roofs(surface_id, kind):
    """Surfaces that racks stand on, and the cells of such.

    Parameters
    ----------
    surface_id, kind : sequence of str, (n,)

    Returns
    -------
    array, (n,) bool
    """
    roofs = {roof_of_rack(surface_id[rack]) for rack in np.flatnonzero(np.asarray(kind) == RACK)}
    return np.array([name in roofs or whole_of_cell(name) in roofs for name in surface_id], bool)


def lay_racks(scene, city, racks, patch_size=None, sectors="8"):
    """Scene with rows of modules on its flat roofs.

    Rows become surfaces behind all others, called ``id/rack1``, ``id/rack2``, … after their roof;
    they are eligible whichever way they face.

    Parameters
    ----------
    scene : Scene
    city : City
        City that it was built from, not cut into cells.
    racks : Racks
    patch_size : float, optional
        [m] As of `build_scene`.
    sectors : str
        As of `classify`.

    Returns
    -------
    Scene

    Raises
    ------
    InputError
        See `frame_roof`.
    """
    local = replace(city, points=scene.site.from_files(city.points))
    roofs = _find_flat_roofs(scene, local, racks.area)
    corners = np.asarray(scene.vertices, float)[scene.triangles]
    obstacles = corners, shapely.STRtree(draw_triangles(corners))
    fronts, roof_of_row = [np.empty((0, 4, 3))], []
    for roof, normal in roofs:
        rings = local.rings(roof)
        frame = frame_roof(racks, normal, rings[0].mean(axis=0), scene.site.latitude)
        placed_rows = place_rows(racks, frame, free_area(rings, frame, racks.rim, obstacles))
        fronts.append(placed_rows)
        roof_of_row += [roof] * len(placed_rows)
    fronts = np.round(np.concatenate(fronts), MICROMETRE)
    rows = _describe_rows(city, fronts, roof_of_row, sectors)
    scene.report.notes.append(
        f"{count_of(len(rows), 'rack')}, {rows.area.sum():,.0f} m² of modules, on "
        f"{len(set(roof_of_row)):,} of "
        f"{count_of(len(roofs), 'flat roof')} of {racks.area:g} m² or more"
    )
    return _stand_slabs(scene, fronts, rows, patch_size, racks.back_albedo)


def _find_flat_roofs(scene, city, least):
    """Flat roofs that are large enough, as read, of a city in the scene's frame: list of (polygon,
    normal (3,)).

    What closes a building towards its neighbour is none, nor what is drawn twice, nor ground that
    nothing names.
    """
    area, normal = measure_polygons(*city.shape)
    kind = classify(area, *measure_tilt(normal), city.thematic)[0]
    # What is drawn twice, and ground, carries no racks.
    twice = {whole_of_cell(name) for name in scene.report.repaired.get(DRAWN_TWICE, ())}
    ground = np.flatnonzero(scene.surfaces.kind == "ground")
    left_out = twice | {whole_of_cell(scene.surfaces.surface_id[surface]) for surface in ground}
    open_ = (np.array(city.thematic) != "ClosureSurface") & ~np.isin(
        city.surface_id, list(left_out)
    )
    return [
        (roof, normal[roof]) for roof in np.flatnonzero((kind == "flat") & open_ & (area >= least))
    ]


def _describe_rows(city, fronts, roof_of_row, sectors):
    """Surfaces of rows, (k, 4, 3) [m]: Surfaces."""
    count = len(fronts)
    normal = np.cross(fronts[:, 1] - fronts[:, 0], fronts[:, 3] - fronts[:, 0])
    area = np.linalg.norm(normal, axis=1)
    normal /= area[:, None]
    tilt, azimuth = measure_tilt(normal)
    number, names = Counter(), []
    for roof in roof_of_row:
        number[roof] += 1
        names.append(f"{city.surface_id[roof]}{MARK}{number[roof]}")
    return Surfaces(
        surface_id=names,
        building_id=[city.building_id[roof] for roof in roof_of_row],
        thematic=[""] * count,
        kind=np.full(count, RACK),
        orientation=orient_racks(tilt, azimuth, sectors),
        eligible=np.ones(count, bool),
        area=area,
        surface_tilt=tilt,
        surface_azimuth=azimuth,
        normal=normal,
        material=[""] * count,
    )


def orient_racks(tilt, azimuth, sectors):
    """Orientation of racks, (k,) str: as of a roof, however steep or small they are; level ones
    have none.
    """
    count = len(tilt)
    # Racks tilted by less than a millionth of a degree face nowhere.
    return classify(
        np.ones(count), np.where(tilt < 1e-6, 0.0, 30.0), azimuth, [RACK] * count, sectors
    )[1]


def _stand_slabs(scene, fronts, rows, patch_size, back_albedo):
    """The scene with slabs behind `fronts`, (k, 4, 3) [m], whose Surfaces are `rows`. Fronts become
    surfaces; undersides and edges belong to none, `rack_of_back` names their row, and they are
    closure, without light, if black.
    """
    # A slab: the front, and the same behind it by the thickness, as eight corners.
    count = len(fronts)
    behind = fronts - THICKNESS * rows.normal[:, None]
    vertices = np.concatenate([fronts, behind], axis=1).reshape(-1, 3)
    triangles = (SLAB + 8 * np.arange(count)[:, None, None]).reshape(-1, 3)
    row, part = np.divmod(np.arange(len(triangles)), len(SLAB))
    # All sides are cut like surfaces; the pieces keep their row and side.
    if patch_size is not None and count:
        vertices, triangles, parent = refine_triangles(
            vertices, triangles, patch_size, row * 6 + part // 2
        )
        row, part = row[parent], part[parent]
    # Only fronts belong to a surface; undersides and edges are part of a rack, black ones without
    # light.
    back, owner = part >= 2, len(scene.surfaces) + row  # a slab's front has two triangles
    none = np.full(len(scene.triangles), -1, np.int32)
    scene = replace(
        scene, rack_of_back=none if scene.rack_of_back is None else scene.rack_of_back
    ).append_triangles(
        triangles + len(scene.vertices),
        np.where(back, -1, owner),
        closure=back & (back_albedo == 0),
        rack_of_back=np.where(back, owner, -1),
    )
    return replace(
        scene,
        vertices=np.concatenate([scene.vertices, vertices]),
        surfaces=scene.surfaces.join(rows),
        racks=fronts if scene.racks is None else np.concatenate([scene.racks, fronts]),
        back_albedo=back_albedo,
    )


def drawn_city(city, scene, grid_size):
    """City whose polygons are all surfaces of its scene: cut into cells as the scene is, the fronts
    of racks behind its own.

    Parameters
    ----------
    city : City
        As it was read.
    scene : Scene
    grid_size : float [m] or None
        Of the scene.
    """
    city = city if grid_size is None else split_into_cells(city, grid_size)[0]
    if scene.racks is None or not len(scene.racks):
        return city
    first, count = len(city), len(scene.racks)
    corners = scene.site.to_files(scene.racks.reshape(-1, 3))
    names = scene.surfaces.surface_id[first:]
    lod = dict(zip(map(whole_of_cell, city.surface_id), city.lod or [], strict=False))
    return replace(
        city,
        surface_id=[*city.surface_id, *names],
        building_id=[*city.building_id, *scene.surfaces.building_id[first:]],
        thematic=[*city.thematic, *scene.surfaces.thematic[first:]],
        lod=[*city.lod, *(lod.get(roof_of_rack(name), "") for name in names)] if city.lod else None,
        material=[*city.material, *[""] * count] if city.material else None,
        height_source=[*city.height_source, *[""] * count] if city.height_source else None,
        part=[*city.part, *[""] * count] if city.part else None,
        **city.append_shape(corners, 4 * np.arange(count + 1), np.arange(count + 1)),
    )
