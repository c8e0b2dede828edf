"""Place on Earth and meridian convergence against pyproj's own factors, a formula and known
places.
"""

import numpy as np
import pyproj
import pytest

from citypv.core.city.axis_order import PlaceHints, order_axes
from citypv.core.city.locate_site import locate_site, note_outside_use
from citypv.core.city.name_crs import name_crs
from citypv.core.city.transform_crs import choose_plane
from citypv.core.settings.errors import InputError


def bring_to_metres(points, crs):
    """Points of a file in the plane of its city, that plane, and what was done."""
    grid, note = choose_plane(crs, order_axes(points[0, :2], crs, PlaceHints()).axes, points)
    return grid.to_plane(points), grid.plane or crs, note


PLACES = [
    ("EPSG:25833", 391490.0, 5817850.0),
    ("EPSG:28992", 78595.0, 457904.0),
    ("EPSG:31256", 3325.0, 340488.0),
    ("EPSG:32756", 334000.0, 6251000.0),  # Sydney, southern hemisphere
    ("EPSG:7415", 84586.0, 447015.0),  # compound
]


@pytest.mark.parametrize(("crs", "east", "north"), PLACES)
def test_convergence_equals_the_projections_own(crs, east, north):
    latitude, longitude, convergence = locate_site(crs, (east, north, 0.0))
    system = pyproj.CRS.from_user_input(crs)
    plane = system.sub_crs_list[0] if system.is_compound else system
    projection = pyproj.Proj(plane)
    # The projection's factors are taken on its own datum; PROJ counts convergence from grid north
    # to true north.
    own = projection.get_factors(*projection(east, north, inverse=True)).meridian_convergence
    assert convergence == pytest.approx(own, abs=2e-4)
    assert (latitude, longitude) == pytest.approx(
        projection(east, north, inverse=True)[::-1], abs=1e-6
    )


def test_user_overrides_the_place_but_not_the_grid():
    """13.4° E in zone 33 (15° E), on a sphere tan(c) = tan(lon - lon0) sin(lat): grid north lies
    west of true north.
    """
    latitude, longitude, convergence = locate_site("EPSG:25833", (391490, 5817850), latitude=10.0)
    assert latitude == 10.0
    assert longitude == pytest.approx(13.4015, abs=1e-3)
    assert convergence == pytest.approx(-1.268, abs=1e-3)


def test_no_system_at_all():
    assert locate_site(None, (0, 0)) == (None, None, 0.0)
    assert locate_site(None, (0, 0), 52.5, 13.4) == (52.5, 13.4, 0.0)
    with pytest.raises(InputError, match="give both --latitude"):
        locate_site(None, (0, 0), latitude=52.5)


def test_point_outside_of_the_projection():
    with pytest.raises(InputError, match="lies outside"):
        locate_site("EPSG:25833", (1e8, 1e8))
    assert locate_site("EPSG:25833", (1e8, 1e8), 52.5, 13.4) == (
        52.5,
        13.4,
        0.0,
    )  # as the message advises


@pytest.mark.parametrize(
    ("spelling", "crs"),
    [
        ("EPSG:25833", "EPSG:25833"),
        ("urn:ogc:def:crs:EPSG::25833", "EPSG:25833"),
        ("urn:ogc:def:crs:EPSG:6.12:31466", "EPSG:31466"),
        ("urn:adv:crs:ETRS89_UTM32*DE_DHHN2016_NH*GCG2016", "EPSG:25832"),
        ("urn:adv:crs:DE_DHDN_3GK3*DE_DHHN92_NH", "EPSG:31467"),
        ("http://www.opengis.net/def/crs/EPSG/0/6697", "EPSG:6697"),
        ("http://www.opengis.net/gml/srs/epsg.xml#28992", "EPSG:28992"),
        ("urn:ogc:def:crs,crs:EPSG:6.12:3068,crs:EPSG:6.12:5783", "EPSG:3068+5783"),
        ("EPSG:25833+7837", "EPSG:25833+7837"),
        ("CH1903", "EPSG:21781"),
        ("CH1903+", "EPSG:2056"),
        ("my own grid", None),
        ("EPSG:99999", None),
        ("", None),
    ],
)
def test_spellings(spelling, crs):
    easting = {"CH1903": 683270.0, "CH1903+": 2683270.0}.get(spelling)
    assert name_crs(spelling, easting) == crs


def test_new_york_in_feet_becomes_metres_at_the_same_place():
    feet = np.array([[987604.042, 212111.083, 45.689], [987704.042, 212111.083, 145.689]])
    points, crs, note = bring_to_metres(feet, "EPSG:2263")
    assert points[1] - points[0] == pytest.approx([100 * 1200 / 3937, 0, 100 * 1200 / 3937])
    here = pyproj.Transformer.from_crs("EPSG:2263", "EPSG:4269", always_xy=True).transform(
        *feet[0, :2]
    )
    latitude, longitude, _ = locate_site(crs, points[0])
    assert (longitude, latitude) == pytest.approx(here, abs=1e-9)
    assert "US survey foot" in note


def test_degrees_become_metres_true_to_scale():
    # One second of latitude and longitude at 35.26° N, 139.74° E; expected from the geodesic, not
    # from a projection.
    second = 1 / 3600
    degrees = np.array(
        [[35.26, 139.74, 2.0], [35.26 + second, 139.74, 2.0], [35.26, 139.74 + second, 7.0]]
    )
    points, crs, _ = bring_to_metres(degrees, "EPSG:6697")
    geod = pyproj.Geod(ellps="GRS80")
    north = geod.inv(139.74, 35.26, 139.74, 35.26 + second)[2]
    east = geod.inv(139.74, 35.26, 139.74 + second, 35.26)[2]
    assert points[1] - points[0] == pytest.approx([0, north, 0], abs=1e-3)
    assert points[2] - points[0] == pytest.approx([east, 0, 5], abs=1e-3)
    latitude, longitude, convergence = locate_site(crs, points[0])
    assert (latitude, longitude) == pytest.approx((35.26, 139.74), abs=1e-8)
    assert convergence == pytest.approx(0, abs=1e-3)
    # The other order of axes is recognised by the area of use.
    turned, _, _ = bring_to_metres(degrees[:, [1, 0, 2]], "EPSG:6697")
    assert turned == pytest.approx(points, abs=1e-6)


def test_degrees_half_a_world_apart_are_refused():
    points = np.array([[0.0, 0, 0], [0, -1, 0], [0, 161, 0]])
    with pytest.raises(
        InputError, match=r"WGS 84: longitudes and latitudes of -1 to 161 and 0 to 0: too far apart"
    ):
        bring_to_metres(points, "EPSG:4326")


@pytest.mark.parametrize(
    ("crs", "latitude", "longitude", "outside"),
    [
        ("EPSG:28992", 52.0, 4.4, None),
        (
            "EPSG:28992",
            47.975,
            3.314,
            50.75 - 47.975,
        ),  # false origin of the Dutch grid, where local coordinates end up
        ("EPSG:7415", 47.975, 3.314, 50.75 - 47.975),
        ("EPSG:25832", 51.04, 5.87, None),  # North Rhine-Westphalia is in zone 32, from 5.87° E on
        ("EPSG:2193", -44.0, -176.5, 183.5 - 178.63),  # across the date line
        ("EPSG:3832", -18.1, 178.4, None),  # an area of use that crosses it
        ("EPSG:4979", 89.0, 10.0, None),
        (None, 47.975, 3.314, None),
        ("EPSG:28992", None, None, None),
    ],
)
def test_a_city_far_outside_the_area_of_its_system_is_noted(crs, latitude, longitude, outside):
    """Areas of use as the EPSG registry gives them."""
    notes = note_outside_use(crs, latitude, longitude)
    assert len(notes) == (outside is not None)
    assert outside is None or f" lies {outside:.1f}° outside the area of use of {crs} (" in notes[0]
