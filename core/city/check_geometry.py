"""Refuse polygons and terrain that cannot be used: each error names the array, the place in it and the cure."""

import numpy as np

from ..check_arrays import UNIT, check_array, check_triangles
from ..errors import InputError

WIDEST = 400e3  # [m] beyond it the tracer's float32 does not know places to a few centimetres


def check_rings(points, ring_start, polygon_start, name_surface=None):
    """Refuse polygons whose rings do not follow each other, or have points that are no numbers.

    Parameters
    ----------
    points : array, (m, 3) float [m]
    ring_start : array, (r + 1,) int into points
    polygon_start : array, (n + 1,) int into ring_start
    name_surface : callable, optional
        `name_surface(point)`: identifier of the surface a point belongs to, for the message.

    Raises
    ------
    InputError
    """
    check_starts("ring_start", ring_start, len(points))
    check_starts("polygon_start", polygon_start, len(ring_start) - 1, least=1)
    check_array("points", points, ("m", 3), row="point", name_row=name_surface)


def check_starts(name, starts, last, least=0):
    """Refuse starts that do not run from 0 to the last one, upwards.

    Parameters
    ----------
    name : str
    starts : array, (k + 1,) int
    last : int
    least : int
        Fewest members of each.
    """
    starts = check_array(name, starts, ("k + 1",), kind="i", most=np.inf, least=-np.inf)
    if not len(starts) or starts[0] != 0 or starts[-1] != last:
        ends = f"runs from {starts[0]} to {starts[-1]}" if len(starts) else "is empty"
        raise InputError(name, ends, f"let it run from 0 to {last}")
    short = np.diff(starts) < least
    if short.any():
        first = int(np.flatnonzero(short)[0])
        raise InputError(name, f"row {first} has {np.diff(starts)[first]} members", f"give each {least} or more")


def check_city(city):
    """Refuse a city without polygons, with columns of different length, or with points that are no numbers.

    Parameters
    ----------
    city : City

    Raises
    ------
    InputError
        Names the surface.
    """
    count = len(city.surface_id)
    if not count:
        raise InputError("city", "no polygon in it", "give at least one")
    for name in ("building_id", "thematic"):
        if len(getattr(city, name)) != count:
            raise InputError(name, f"{len(getattr(city, name))} rows for {count} surfaces", "give one for each")
    if city.material is not None and len(city.material) != count:
        raise InputError("material", f"{len(city.material)} rows for {count} surfaces", "give one for each, or none")
    if len(city.polygon_start) != count + 1:
        problem = f"{len(city.polygon_start)} rows for {count} surfaces"
        raise InputError("polygon_start", problem, "give one more than surfaces")
    check_rings(city.points, city.ring_start, city.polygon_start, lambda point: surface_of_point(city, point))


def surface_of_point(city, point):
    """Identifier of the surface that a point belongs to."""
    ring = np.searchsorted(city.ring_start, point, side="right") - 1
    return city.surface_id[int(np.searchsorted(city.polygon_start, ring, side="right")) - 1]


def check_parts(city, points, surfaces, footprint):
    """Refuse points, surfaces and footprints that are not those of a city.

    Parameters
    ----------
    city : City
    points : array, (m, 3) float [m]
    surfaces : Surfaces
    footprint : array, (n,) bool

    Raises
    ------
    InputError
    """
    check_rings(points, city.ring_start, city.polygon_start)
    count = len(city.polygon_start) - 1
    check_array("surface_tilt", surfaces.surface_tilt, (count,), least=0, most=180)
    check_array("normal", surfaces.normal, (count, 3), least=-1 - UNIT, most=1 + UNIT)
    check_array("footprint", footprint, (count,), kind="b")


def check_patch_size(patch_size):
    """Refuse what is no length."""
    if patch_size is not None and not patch_size > 0:
        raise InputError("--patch-size", f"{patch_size} is not a length", "give metres above 0")


def check_extent(city):
    """Refuse a city that is too wide for the tracer's numbers, as where one polygon stands at 0, 0 by mistake.

    Parameters
    ----------
    city : City

    Raises
    ------
    InputError
        Names the surface that stands furthest away from the others.
    """
    span = float(np.ptp(city.points, axis=0).max())
    if span > WIDEST:
        away = np.abs(city.points - np.median(city.points, axis=0)).max(axis=1)
        furthest = int(away.argmax())
        name = surface_of_point(city, furthest)
        source = city.report.files[0] if city.report.files else "city"
        problem = (
            f"{span / 1e3:,.0f} km wide; surface {name!r} stands {away[furthest] / 1e3:,.0f} km away from the middle"
        )
        raise InputError(source, problem, "take out what stands elsewhere, or correct its coordinates")


def check_terrain(terrain):
    """Refuse terrain without triangles, or with some that cannot be used.

    Parameters
    ----------
    terrain : Terrain

    Raises
    ------
    InputError
        Names the terrain's source.
    """
    for layer in terrain.layers:
        try:
            check_triangles(layer.points, layer.triangles)
        except InputError as error:
            problem = f"{error.source}: {error.problem}"
            raise InputError(terrain.source, problem, f"{error.cure}; where there is no height, leave a gap") from error
    if not any(len(layer.triangles) for layer in terrain.layers):
        raise InputError(terrain.source, "no triangle in it", "give terrain of the city's place")
