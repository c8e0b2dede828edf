"""Where a city stands: axes, scale and systems of files, against a shed whose sizes and directions
are known.
"""

import re

import numpy as np
import pyproj
import pytest
from citygml_text import HEAD
from pyproj.enums import PJType
from sheds import CLOSED, check_shed, stand, write_shed

from citypv.core.city.name_crs import name_crs
from citypv.core.run.study import read_buildings
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

pytestmark = pytest.mark.every_python

PLACES = [
    ("EPSG:25833", 52.5, 13.4),
    ("EPSG:3857", 52.5, 13.4),  # Web Mercator: 1.64 times as long
    ("EPSG:3857", -33.9, 18.4),
    ("EPSG:5513", 50.08, 14.42),  # southing, westing
    ("EPSG:5514", 50.08, 14.42),
    ("EPSG:2180", 52.2, 21.0),  # northing first
    ("EPSG:2193", -41.3, 174.8),
    ("EPSG:2393", 60.2, 25.0),
    ("EPSG:31466", 51.2, 6.8),
    ("EPSG:31467", 48.8, 9.2),
    ("EPSG:31468", 48.1, 11.6),
    ("EPSG:31469", 51.0, 13.7),
    ("EPSG:3035", 52.5, 13.4),
    ("EPSG:3035", 38.7, -9.1),
    ("EPSG:3034", 52.5, 13.4),  # 3.5 % off in scale
    ("EPSG:2048", -33.9, 18.4),  # South Africa, westing and southing
    ("EPSG:2053", -29.85, 31.0),
    ("EPSG:6677", 35.68, 139.76),
    ("EPSG:2263", 40.75, -73.99),  # feet of the US survey
    ("EPSG:2229", 34.05, -118.25),
    ("EPSG:2926", 47.6, -122.3),
    ("EPSG:27572", 48.85, 2.35),  # grads from Paris
    ("EPSG:4326", 52.08, 4.3),
    ("EPSG:4326", -33.87, 151.2),
    ("EPSG:4326", -22.9, -43.2),
    ("EPSG:4258", 48.2, 16.4),
    ("EPSG:3068", 52.5, 13.4),
    ("EPSG:4647", 52.4, 9.7),
]


@pytest.mark.parametrize("order", ["registered", "other"])
@pytest.mark.parametrize(("crs", "latitude", "longitude"), PLACES)
def test_a_shed_stands_where_it_stands(tmp_path, crs, latitude, longitude, order):
    """Roof to the south, true areas, the place, and the coordinates of the file to the millimetre
    on the way back.
    """
    path = write_shed(tmp_path / "shed.gml", crs, latitude, longitude, order=order, envelope=CLOSED)
    city, scene = stand(path)
    # A plane of the survey is up to 0.1 % off in lengths, and stays as it is.
    check_shed(scene, latitude, longitude, 2e-3 if city.plane is None else 3e-4)
    assert scene.site.crs == crs
    text, degrees = path.read_text(), pyproj.CRS(crs).is_geographic
    first = np.array(text.split("<gml:posList>")[1].split()[:3], float)
    back = city.grid.to_files(city.points)
    assert np.abs(back - first).max(axis=1).min() < (1e-8 if degrees else 1e-3)


def test_open_orders_are_said_and_given(tmp_path):
    """Where both orders lie within the area, on land, and surfaces have no classes: as registered,
    unless told.
    """
    for order, first in (("registered", "yx"), ("other", "xy")):
        how = {"order": order, "thematic": False, "envelope": CLOSED}
        path = write_shed(tmp_path / f"{order}.gml", "EPSG:2180", 52.2, 21.0, **how)
        city, _ = stand(path)
        assert city.axes == "yx"
        assert any("--axes xy" in note for note in city.report.notes)
        for hints in ({"axes": first}, {"latitude": 52.0, "longitude": 21.3}):
            city, scene = stand(path, **hints)
            assert city.axes == first
            assert sum(scene.surfaces.area) == pytest.approx(80 + 352, rel=2e-3)
            assert ("axes" not in hints) or not any("--axes" in note for note in city.report.notes)


def test_surfaces_inside_out_do_not_exchange_axes(tmp_path):
    """Washington in US feet, registered east first: both orders lie within its area."""
    path = write_shed(
        tmp_path / "shed.gml", "EPSG:2925", 47.6, -122.3, order="other", envelope=CLOSED
    )
    city, _ = stand(path)
    assert city.axes == "xy"
    assert any("--axes yx" in note for note in city.report.notes)
    check_shed(stand(path, axes="yx")[1], 47.6, -122.3, 2e-3)


@pytest.mark.parametrize(
    ("labels", "axes"), [("N E H", "yx"), ("Easting Northing H", "xy"), ("x y z", "yx")]
)
def test_envelopes_that_name_their_axes(tmp_path, labels, axes):
    """Without classes, an envelope around the shed tells the order; x and y tell nothing, so as
    registered.
    """
    corners = (
        "<gml:lowerCorner>4e5 5e5 0</gml:lowerCorner><gml:upperCorner>6e5 7e5 1</gml:upperCorner>"
    )
    path = write_shed(
        tmp_path / "shed.gml",
        "EPSG:2180",
        52.2,
        21.0,
        thematic=False,
        envelope=f' axisLabels="{labels}">{corners}',
    )
    assert stand(path)[0].axes == axes


@pytest.mark.parametrize(
    ("spelling", "crs"),
    [
        ("urn:ogc:def:crs,crs:EPSG::5783,crs:EPSG::25832", "EPSG:25832+5783"),  # heights first
        ("urn:adv:crs:DE_DHDN_3GK2_NW177*DE_DHHN92_NH", "EPSG:31466"),
        ("DE_DHDN_3GK4_BY120", "EPSG:31468"),
        ("urn:adv:crs:DE_42-83_3GK4", "EPSG:2398"),
        ("urn:adv:crs:DE_RD-83_3GK5", "EPSG:3399"),
        ("urn:adv:crs:DE_PD-83_3GK3", "EPSG:3396"),
        ("urn:adv:crs:ETRS89_Lat-Lon", "EPSG:4258"),
        ("ETRS89_UTM33", "EPSG:25833"),
        ("EPSG:5709", None),
        ("EPSG:5800", None),
        ('LOCAL_CS["x",UNIT["metre",1]]', None),
    ],
)
def test_names_of_systems(spelling, crs):
    assert name_crs(spelling) == crs


@pytest.mark.parametrize(
    ("srs_name", "words"),
    [
        ("EPSG:5709", "'EPSG:5709' is a system without a plane (vertical)"),
        pytest.param(
            "EPSG:5800",
            "'EPSG:5800' is a system without a plane (engineering)",
            marks=pytest.mark.skipif(
                "5800" not in pyproj.get_codes("EPSG", PJType.ENGINEERING_CRS),
                reason="PROJ knows it from 9.6 on",
            ),
        ),
        ("EPSG:4978", "geocentric coordinates are not supported"),
    ],
)
def test_systems_without_a_plane_are_one_line(tmp_path, srs_name, words):
    path = write_shed(
        tmp_path / "shed.gml", "EPSG:25832", 51.4, 9.0, srs_name=srs_name, envelope=CLOSED
    )
    with pytest.raises(InputError, match=re.escape(words)):
        stand(path)


def test_zones_before_eastings(tmp_path):
    """ETRS89 / UTM 32 whose eastings begin with 32 is EPSG:4647; of another UTM the line says what
    it is.
    """
    how = {"srs_name": "EPSG:25832", "envelope": CLOSED}
    city, scene = stand(write_shed(tmp_path / "zone.gml", "EPSG:4647", 52.4, 9.7, **how))
    check_shed(scene, 52.4, 9.7, 2e-3)
    assert city.crs == "EPSG:4647"
    with pytest.raises(
        InputError, match="begin with the number of the zone, 32; subtract 32,000,000"
    ):
        stand(
            write_shed(
                tmp_path / "other.gml", "EPSG:4647", 52.4, 9.7, **how | {"srs_name": "EPSG:32632"}
            )
        )


def test_one_grid_in_two_spellings(tmp_path):
    """EPSG:5555 is EPSG:25832 with heights."""
    files = []
    for name, srs_name, latitude in (("a", "EPSG:25832", 51.4), ("b", "EPSG:5555", 51.401)):
        how = {"srs_name": srs_name, "envelope": CLOSED}
        files.append(write_shed(tmp_path / f"{name}.gml", "EPSG:25832", latitude, 9.0, **how))
    city = read_buildings(files, Request())
    assert (city.crs, len(set(city.building_id))) == ("EPSG:5555", 1)
    assert np.ptp(city.points[:, 1]) == pytest.approx(0.001 * 111_250 + 8, abs=0.5)


def test_points_of_attributes_and_buildings_of_extensions(tmp_path):
    """A point in another system in a property tells nothing of the surfaces; a subclass of Building
    is a building.
    """
    path = write_shed(tmp_path / "shed.gml", "EPSG:25832", 51.4, 9.0, envelope=CLOSED)
    text = path.read_text()
    point = (
        '<x:at xmlns:x="urn:x"><gml:Point srsName="EPSG:4326"><gml:pos>51.4 9 '
        "0</gml:pos></gml:Point></x:at>"
    )
    path.write_text(
        text.replace('<bldg:Building gml:id="house">', '<bldg:Building gml:id="house">' + point)
    )
    assert stand(path)[0].crs == "EPSG:25832"
    own = '<x:Mill xmlns:x="urn:x" gml:id="house">'
    path.write_text(
        text.replace('<bldg:Building gml:id="house">', own).replace("</bldg:Building>", "</x:Mill>")
    )
    city, scene = stand(path)
    check_shed(scene, 51.4, 9.0, 2e-3)
    assert "1 Mill (of an extension) read as buildings." in city.report.notes


def test_a_namespace_declared_on_a_member(tmp_path):
    path = write_shed(tmp_path / "shed.gml", "EPSG:25832", 51.4, 9.0, envelope=CLOSED)
    text = (
        path.read_text()
        .replace(HEAD, '<c xmlns:gml="http://www.opengis.net/gml">')
        .replace("CityModel>", "c>")
    )
    own = ' xmlns="http://www.opengis.net/citygml/2.0" xmlns:bldg="http://www.opengis.net/citygml/building/2.0"'
    path.write_text(text.replace("<cityObjectMember", f"<cityObjectMember{own}"))
    check_shed(stand(path)[1], 51.4, 9.0, 2e-3)
