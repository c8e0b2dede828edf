"""A shed in CityGML at any place, in any system: 10 m from west to east, 8 m from south to north.

Its roof of 10 × 10 m rises from 4 m in the south to 10 m in the north.
"""

import numpy as np
import pyproj
import pytest
from citygml_text import HEAD, building, members, polygon, surface

from citypv.core.run.study import make_scene, read_buildings
from citypv.core.settings.request import Request

SHED = {  # corners by name: east, north, up [m]; outwards
    "GroundSurface": [(0, 0, 0), (0, 8, 0), (10, 8, 0), (10, 0, 0)],
    "RoofSurface": [(0, 0, 4), (10, 0, 4), (10, 8, 10), (0, 8, 10)],
    "south": [(0, 0, 0), (10, 0, 0), (10, 0, 4), (0, 0, 4)],
    "north": [(10, 8, 0), (0, 8, 0), (0, 8, 10), (10, 8, 10)],
    "west": [(0, 8, 0), (0, 0, 0), (0, 0, 4), (0, 8, 10)],
    "east": [(10, 0, 0), (10, 8, 0), (10, 8, 10), (10, 0, 4)],
}
AREAS = {
    ("roof", "south"): 100,
    ("facade", "south"): 40,
    ("facade", "north"): 100,
    ("facade", "east"): 56,
}
AREAS |= {("facade", "west"): 56}


def write_shed(
    path, crs, latitude, longitude, *, order="registered", srs_name=None, thematic=True, envelope=""
):
    """A shed at a place in a system, its coordinates in the registered order or the other one:
    path.
    """
    system = pyproj.CRS.from_user_input(crs)
    plane = system.sub_crs_list[0] if system.is_compound else system
    turn = pyproj.Transformer.from_pipeline(
        f"+proj=pipeline +step +inv +proj=tmerc +lat_0={latitude} +lon_0={longitude} +ellps=GRS80"
    )
    # NTF in degrees from Greenwich
    own = "EPSG:4275" if crs == "EPSG:27572" else plane.geodetic_crs.to_2d()
    away = pyproj.Transformer.from_crs(own, plane)
    unit = plane.axis_info[0].unit_conversion_factor if plane.is_projected else 1.0
    texts = []
    for name, corners in SHED.items():
        east, north, up = np.array(corners, float).T
        lon, lat = turn.transform(east, north, radians=False)
        places = np.column_stack(away.transform(lat, lon))
        places = places if order == "registered" else places[:, ::-1]
        digits = 10 if plane.is_geographic else 5
        points = [
            (f"{x:.{digits}f}", f"{y:.{digits}f}", f"{z / unit:.5f}")
            for (x, y), z in zip(places, up, strict=True)
        ]
        kind = (
            (name if name.endswith("Surface") else "WallSurface") if thematic else "ClosureSurface"
        )
        drawn = polygon(name, points)
        texts.append(surface(members(drawn), kind) if thematic else drawn)
    inside = "".join(texts)
    if not thematic:
        inside = (
            f"<bldg:lod2MultiSurface><gml:MultiSurface>{members(*texts)}"
            "</gml:MultiSurface></bldg:lod2MultiSurface>"
        )
    named = (
        "<gml:boundedBy><gml:Envelope "
        f'srsName="{srs_name or crs}"{envelope}</gml:Envelope></gml:boundedBy>'
    )
    path.write_text(HEAD + named + building(inside) + "</CityModel>\n")
    return path


def stand(path, **settings):
    """City and scene of a file."""
    request = Request(patch_size=None, ground="none", **settings)
    city = read_buildings([path], request)
    return city, make_scene(city, request)


def check_shed(scene, latitude, longitude, rel=2e-4):
    surfaces = scene.surfaces
    found = {}
    for kind, orientation, area in zip(
        surfaces.kind, surfaces.orientation, surfaces.area, strict=True
    ):
        if kind in ("roof", "facade"):
            found[kind, orientation] = found.get((kind, orientation), 0) + area
    assert found == pytest.approx(AREAS, rel=rel)
    assert (scene.site.latitude, scene.site.longitude) == pytest.approx(
        (latitude, longitude), abs=2e-4
    )


CLOSED = "><gml:lowerCorner>0 0 0</gml:lowerCorner><gml:upperCorner>1 1 1</gml:upperCorner>"
