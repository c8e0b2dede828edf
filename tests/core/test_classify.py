"""Kinds, orientations and eligibility at and around every bound of the rule."""

import numpy as np
import pytest

from citypv.core.city.classify import classify, measure_tilt


def kind_of(tilt, azimuth=180.0, area=10.0, thematic=""):
    kind, orientation, eligible = classify([area], [tilt], [azimuth], [thematic])
    return str(kind[0]), str(orientation[0]), bool(eligible[0])


@pytest.mark.parametrize(
    ("tilt", "kind"),
    [(0, "flat"), (14.99, "flat"), (15, "roof"), (60, "roof"), (60.01, "steep"), (89, "steep"), (89.01, "facade"),
     (90, "facade"), (91, "facade"), (91.01, "downward"), (180, "downward")],
)  # fmt: skip
def test_kind_by_tilt(tilt, kind):
    assert kind_of(tilt)[0] == kind


@pytest.mark.parametrize(
    ("azimuth", "orientation"),
    [(0, "north"), (30, "north"), (30.01, "none"), (59.99, "none"), (60, "east"), (90, "east"), (120, "east"),
     (150, "south"), (210, "south"), (240, "west"), (300, "west"), (329.99, "none"), (330, "north"), (359.9, "north")],
)  # fmt: skip
@pytest.mark.parametrize("tilt", [40, 75, 90])
def test_orientation_bounds_are_inclusive(azimuth, orientation, tilt):
    assert kind_of(tilt, azimuth)[1] == orientation


@pytest.mark.parametrize("tilt", [5, 170])
def test_level_surfaces_face_nowhere(tilt):
    assert kind_of(tilt, 180.0)[1] == "none"


def test_eligible():
    assert kind_of(90, 180, 6.25)[2]
    assert not kind_of(90, 180, 6.249)[2]
    assert not kind_of(90, 45)[2]
    assert not kind_of(75, 180)[2]
    assert not kind_of(5, 180)[2]
    assert not kind_of(90, 180, thematic="ClosureSurface")[2]
    assert kind_of(30, 180, thematic="WallSurface")[2]  # the rule is tilt, not the class in the file


def test_ground_is_what_faces_up_and_terrain():
    assert kind_of(180, thematic="GroundSurface")[0] == "downward"
    assert kind_of(0, thematic="GroundSurface")[0] == "ground"
    assert kind_of(90, thematic="GroundSurface") == ("ground", "none", False)
    assert kind_of(30, thematic="TINRelief")[0] == "ground"


def test_tilt_and_azimuth_of_normals():
    root = np.sqrt(0.5)
    normal = np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0], [-root, 0, root], [0, 1, 0], [0, 0, -1], [-1e-17, 1, 0]])
    tilt, azimuth = measure_tilt(normal)
    assert tilt == pytest.approx([0, 90, 90, 45, 90, 180, 90])
    assert azimuth == pytest.approx([0, 180, 90, 270, 0, 0, 0])
    assert azimuth.max() < 360
