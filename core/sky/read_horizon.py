"""Read the horizon of a scene: from a raster of heights around it, or from a file with angles.

Four formats of angles are told apart by their content:
    azimuth,elevation       two columns, azimuth clockwise from north [°], any order and spacing,
                            header optional;
                            the other way round if the header names them so
    PVGIS printhorizon CSV  columns A and H_hor, A from the south, west positive
    PVGIS printhorizon JSON the same
    PVGIS user horizon      elevations only, equally spaced, from north clockwise
"""

import json
import re
from functools import lru_cache

import numpy as np

from ..city.find_ground import find_ground
from ..read.open_input import open_input
from ..read.read_heights import is_placed_raster, read_heights
from ..settings.errors import InputError, first_true
from .horizon import GEODESIC, STEPS, TerrainHorizon, horizon_of_terrain

OF_PLACE = "pvgis"  # instead of a file: PVGIS is asked
GIVE_ANGLES = "give lines of azimuth,elevation in degrees, or a horizon file of PVGIS"
OF_PVGIS = re.compile(r"\s*A\W+H_hor\b")  # header of its columns


def check_horizon(path):
    """Refuse a file that is neither a raster with a reference system nor a list of angles.

    Raises
    ------
    InputError
    """
    if path == OF_PLACE:
        return
    if not is_placed_raster(path):
        read_horizon_table(path)


def read_horizon(path, scene, *, reach=50_000.0):
    """Horizon as seen from the middle of a scene, and from the corners of the box around its
    buildings.

    Parameters
    ----------
    path : path-like
        GeoTIFF or ASC grid with its reference system, a file of angles as in `read_horizon_table`,
        or "pvgis".
    scene : Scene

    Returns
    -------
    horizon : TerrainHorizon
    corners : list of TerrainHorizon
        Empty for a file of angles, which are the same everywhere, and for PVGIS, which is asked for
        the site only.

    Raises
    ------
    InputError
        The file cannot be used, or does not reach the site.
    """
    # PVGIS is asked, or a file of angles is read, for the site only: without corners.
    if path == OF_PLACE:
        return ask_horizon(scene.site.latitude, scene.site.longitude), []
    if not is_placed_raster(path):
        return read_horizon_table(path), []
    # The box in plan around the city's own surfaces, or around all triangles where it has none: the
    # horizon is seen from its middle and corners.
    own = scene.triangle_surface >= 0
    points = scene.vertices[scene.triangles[own if own.any() else slice(None)].ravel(), :2]
    low, high = points.min(axis=0), points.max(axis=0)
    corners = np.array([(low[0], low[1]), (high[0], low[1]), (high[0], high[1]), (low[0], high[1])])
    posts = [(low + high) / 2, *corners]
    site, places = scene.site, []
    # From metres in the scene to latitude and longitude of each of them, along geodesics.
    for east, north in posts:
        azimuth, distance = np.degrees(np.arctan2(east, north)), np.hypot(east, north)
        places.append(GEODESIC.fwd(site.longitude, site.latitude, azimuth, distance)[1::-1])
    # `reach`: [m] terrain further away is left out: a peak of 2,000 m rises by less than 2.1°
    # beyond it.
    grids = read_heights(path, places[0], reach)
    # Terrain counts from where the scene's own ground ends: what the scene holds is traced, and
    # would count twice. Its ground is its own surfaces, or measured terrain, not what is generated.
    drawn = find_ground(scene) if scene.terrain_laid else find_ground(scene) & own
    model = np.concatenate(
        [scene.vertices[scene.triangles[drawn], :2], corners[[[0, 1, 2], [0, 2, 3]]]]
    )
    horizons = []
    for place, post in zip(places, posts, strict=True):
        # A corner without a height, as in water, takes the height of the middle.
        eye = horizons[0].eye if horizons else np.nan
        horizons.append(
            horizon_of_terrain(grids, place, distance_to_end(post, model), reach, otherwise=eye)
        )
    return horizons[0], horizons[1:]


@lru_cache(maxsize=8)  # of this process: each scene asks several times
def ask_horizon(latitude, longitude, timeout=(5.0, 60.0)):
    """Horizon of a place from PVGIS' server, which has the heights of SRTM (3 arc seconds).

    Parameters
    ----------
    latitude, longitude : float
        [°]
    timeout : tuple of float
        [s] to reach it, and for its answer.

    Returns
    -------
    TerrainHorizon

    Raises
    ------
    InputError
        No network, a refusal, or an answer of another kind.
    """
    import pvlib

    # PVGIS is asked; whatever fails is told with its cure, as no horizon is made up.
    url, place = (
        pvlib.iotools.pvgis.URL,
        (round(latitude, 4), round((longitude + 180) % 360 - 180, 4)),
    )
    cure = "give a file of angles or heights, or leave --horizon out"
    try:
        profile, _ = pvlib.iotools.get_pvgis_horizon(*place, url=url, timeout=timeout)
        azimuth, elevation = profile.index.to_numpy(float), profile.to_numpy(float)
    except OSError as error:  # what requests raises
        words = " ".join(str(error).split())[:120]
        problem = f"{url} was not reached or refused ({type(error).__name__}: {words})"
        raise InputError("--horizon pvgis", problem, cure) from error
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        problem = f"{url} sent no horizon ({type(error).__name__})"
        raise InputError("--horizon pvgis", problem, cure) from error
    return _horizon_of_angles(f"PVGIS {place[0]:g}°, {place[1]:g}°", azimuth, elevation)


def distance_to_end(point, triangles, *, at_once=1 << 16):
    """Distance from a point to the furthest edge of some triangles, for each azimuth of a horizon.

    Parameters
    ----------
    point : (2,) float [m]
    triangles : (g, 3, 2) float64 [m]
        Corners in plan.

    Returns
    -------
    (STEPS,) float64 [m]
        0 where there is none.
    """
    # Edges in portions, with the point as origin.
    furthest, angle = np.zeros(STEPS), 2 * np.pi / STEPS
    # `at_once`: triangles of ground that are looked at together, so that they need little memory.
    for first in range(0, len(triangles), at_once):
        corners = triangles[first : first + at_once] - point
        start, end = corners.reshape(-1, 2), np.roll(corners, -1, axis=1).reshape(-1, 2)
        # Lines of sight that cross each edge.
        one = np.arctan2(start[:, 0], start[:, 1])
        turn = np.arctan2(end[:, 0], end[:, 1]) - one
        turn -= 2 * np.pi * np.rint(turn / (2 * np.pi))  # the way round that the edge takes
        low = np.ceil((one + np.minimum(turn, 0)) / angle).astype(int)
        count = np.maximum(np.floor((one + np.maximum(turn, 0)) / angle).astype(int) - low + 1, 0)
        # Edge and step of each crossing: azimuths from `low` on, `count` of them for each edge.
        edge = np.repeat(np.arange(len(one)), count)
        step = low[edge] + np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count)
        # Where the line of sight meets the edge: by cross products of the ray's direction, the
        # edge's direction and its start.
        ahead, along = np.stack([np.sin(step * angle), np.cos(step * angle)]), (end - start)[edge].T
        across = ahead[0] * along[1] - ahead[1] * along[0]
        offset = start[edge, 0] * along[1] - start[edge, 1] * along[0]
        distance = np.divide(offset, across, out=np.zeros(len(edge)), where=across != 0)
        np.maximum.at(furthest, step % STEPS, distance)
    return furthest


def read_horizon_table(path, *, largest=4_000_000):
    """Horizon from a file of angles.

    Parameters
    ----------
    path : path-like
        Text, plain or gzip-compressed. Elevations below the horizontal count as 0.

    Returns
    -------
    TerrainHorizon

    Raises
    ------
    InputError
        The file is not one of the formats above, or an angle is out of range.
    """
    # A file is JSON of PVGIS, or text; the azimuths of PVGIS count from the south.
    with open_input(path) as stream:
        # `largest`: bytes of a file of angles.
        content = stream.read(largest + 1)
    if len(content) > largest or b"\0" in content:
        raise InputError(path, "is not a horizon file", GIVE_ANGLES)
    text = content.decode("utf-8-sig", errors="replace")
    if text.lstrip().startswith("{"):
        try:
            rows = json.loads(text)["outputs"]["horizon_profile"]
            azimuth, elevation = (
                np.array([(row["A"] + 180, row["H_hor"]) for row in rows], float).reshape(-1, 2).T
            )
        except (ValueError, KeyError, TypeError) as error:
            raise InputError(path, "is not a horizon of PVGIS", GIVE_ANGLES) from error
    else:
        azimuth, elevation = _angles_of_text(path, text)
    return _horizon_of_angles(path, azimuth, elevation)


def _horizon_of_angles(path, azimuth, elevation):
    """TerrainHorizon of azimuths from north and elevations, (n,) [°], of a file or a place for
    messages.
    """
    if len(azimuth) < 3:
        raise InputError(path, f"has {len(azimuth)} angles", "give at least three around the site")
    # Compared so that NaN fails too.
    if (row := first_true(~(np.abs(azimuth) <= 540) | ~(np.abs(elevation) < 90.0))) is not None:
        raise InputError(
            path,
            f"azimuth {azimuth[row]:g}°, elevation {elevation[row]:g}° (entry {row + 1}) is out of "
            "range",
            "give azimuths from 0 to 360° and elevations below 90°",
        )
    # Sorted round the circle and interpolated to the azimuths that a horizon holds.
    order = np.argsort(azimuth % 360, kind="stable")
    around = np.arange(STEPS) * (360.0 / STEPS)
    heights = np.interp(around, (azimuth % 360)[order], elevation[order], period=360.0)
    return TerrainHorizon(np.maximum(heights, 0), str(path))


def _angles_of_text(path, text):
    """Azimuths from north and elevations of a text: two (n,) arrays [°].

    Lines of different lengths, text among or below the numbers (but PVGIS' own below them), and
    tables of other columns are refused.
    """
    # Lines of numbers, all with as many columns; a line that is none may stand above them as a
    # header.
    rows, header = [], ""
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            values = [float(field) for field in re.split(r"[,;\s]+", line.strip()) if field]
        except ValueError:
            if rows and OF_PVGIS.match(header):
                break  # PVGIS explains its columns below them
            if rows:
                raise InputError(
                    f"{path}:{number}", f"{line.strip()[:40]!r} are no numbers", GIVE_ANGLES
                ) from None
            header = line
            continue
        if values and rows and len(values) != len(rows[0]):
            raise InputError(
                f"{path}:{number}", "has more or fewer columns than the lines before", GIVE_ANGLES
            )
        rows += [values] if values else []
    # Which format, by the header and the number of columns: PVGIS' own, two of angles, or
    # elevations alone (one column or one row) that are spread evenly round the circle. Else the
    # text is refused.
    columns = np.array(rows).T
    # PVGIS counts azimuths from south. Of two columns the azimuth is the first, unless the header
    # names the elevation first.
    if OF_PVGIS.match(header) and len(columns) >= 2:
        return columns[0] + 180, columns[1]
    if len(columns) == 2:
        elevation = r"\W*(elev|height|h_hor|horizon|altitude)\w*\W.*\bazi"
        return columns[::-1] if re.match(elevation, header, re.IGNORECASE) else columns
    if len(columns) == 1 or len(rows) == 1:
        values = columns.ravel()
        return np.arange(len(values)) * (360.0 / len(values)), values
    raise InputError(path, "has neither two columns nor one", GIVE_ANGLES)
