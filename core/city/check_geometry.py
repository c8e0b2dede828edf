"""Check polygons and terrain: each error names the array, the row and the cure."""

import numpy as np

from ..settings.errors import UNIT, InputError, check_array, check_triangles, first_true


def check_rings(points, ring_start, polygon_start, name_surface=None):
    """Raise an error if rings are not consecutive or points are not finite.

    Parameters
    ----------
    points : array, (m, 3) float [m]
    ring_start : array, (r + 1,) int into points
    polygon_start : array, (n + 1,) int into ring_start
    name_surface : callable, optional
        `name_surface(point)`: id of the surface a point belongs to, for the message.

    Raises
    ------
    InputError
    """
    for name, given, last, least in (
        ("ring_start", ring_start, len(points), 0),
        ("polygon_start", polygon_start, len(ring_start) - 1, 1),
    ):
        starts = check_array(name, given, ("k + 1",), kind="i", most=np.inf, least=-np.inf)
        if not len(starts) or starts[0] != 0 or starts[-1] != last:
            raise InputError(
                name,
                f"runs from {starts[0]} to {starts[-1]}" if len(starts) else "is empty",
                f"give starts from 0 to {last}",
            )
        members = np.diff(starts)
        if (short := first_true(members < least)) is not None:
            raise InputError(
                name, f"row {short} has {members[short]} members", f"give each at least {least}"
            )
    of_surface = (
        (lambda row: f", of surface {name_surface(row)!r},") if name_surface else (lambda row: "")
    )
    check_array("points", points, ("m", 3), row=lambda row: f"point {row}{of_surface(row)}")


def check_city(city):
    """Raise an error if a city has no polygons, columns of different length, or points that are not
    finite.

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
        raise InputError("city", "contains no polygons", "give at least one")
    for name, more in (
        ("building_id", 0),
        ("thematic", 0),
        ("material", 0),
        ("height_source", 0),
        ("polygon_start", 1),
    ):
        rows = getattr(city, name)
        if rows is not None and len(rows) != count + more:
            raise InputError(
                name,
                f"{len(rows)} rows for {count} surfaces",
                "give one more than surfaces" if more else "give one for each",
            )
    check_rings(*city.shape, lambda point: _surface_of_point(city, point))


def _surface_of_point(city, point):
    """Id of the surface that a point belongs to."""
    ring = np.searchsorted(city.ring_start, point, side="right") - 1
    return city.surface_id[int(np.searchsorted(city.polygon_start, ring, side="right")) - 1]


def check_parts(city, points, surfaces, footprint):
    """Raise an error if points, surfaces or footprints do not match the city.

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
    """Raise an error if a patch size is not a positive length."""
    if patch_size is not None and not patch_size > 0:
        raise InputError("--patch-size", f"{patch_size} is not a length", "give metres above 0")


def check_extent(city):
    """Raise an error if a city is too small to be one, or too wide for float32, as with a polygon
    at 0, 0 by mistake.

    Parameters
    ----------
    city : City

    Raises
    ------
    InputError
        If it is too wide, names the surface furthest away from the others.
    """
    span = float(np.ptp(city.points, axis=0).max())
    source = city.report.files[0] if city.report.files else "city"
    # A city below 0.1 m is in another unit, and a millimetre is no longer small in it.
    if span < 0.1:
        raise InputError(source, f"all of it is only {1000 * span:.2g} mm across", "check --unit")
    # Beyond 400 km the tracer's float32 coordinates err by more than a few centimetres.
    if span > 400e3:
        away = np.abs(city.points - np.median(city.points, axis=0)).max(axis=1)
        furthest = int(away.argmax())
        name = _surface_of_point(city, furthest)
        raise InputError(
            source,
            f"{span / 1e3:,.0f} km wide; surface {name!r} is {away[furthest] / 1e3:,.0f} km away "
            "from the middle",
            "check its coordinates, or remove it",
        )


def check_terrain(terrain):
    """Raise an error if terrain has no triangles or invalid ones.

    Parameters
    ----------
    terrain : Terrain

    Raises
    ------
    InputError
        Names the file of the terrain.
    """
    for layer in terrain.layers:
        try:
            check_triangles(layer.points, layer.triangles)
        except InputError as error:
            raise InputError(
                terrain.source,
                f"{error.source}: {error.problem}",
                f"{error.cure}; leave a gap where there is no height",
            ) from error
    if not any(len(layer.triangles) for layer in terrain.layers):
        raise InputError(
            terrain.source, "contains no triangles", "give terrain that covers the city"
        )
