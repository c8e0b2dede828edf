"""Kinds, orientations and eligibility at and around every bound of the rule, and of all
azimuths.
"""

from dataclasses import replace

import numpy as np
import pytest
from cities import box, make_city
from transfers import unshaded_transfer

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.classify import ORIENTATIONS, classify, measure_tilt
from citypv.core.city.grid_cells import Outlines, split_into_cells
from citypv.core.energy.counted_area import classify_again
from citypv.core.sun.sky_grid import sky_grid_suns


def kind_of(tilt, azimuth=180.0, area=10.0, thematic="", sectors="8"):
    kind, orientation, eligible = classify([area], [tilt], [azimuth], [thematic], sectors)
    return str(kind[0]), str(orientation[0]), bool(eligible[0])


@pytest.mark.parametrize(
    ("tilt", "kind"),
    [
        (0, "flat"),
        (14.99, "flat"),
        (15, "roof"),
        (60, "roof"),
        (60.01, "steep"),
        (89, "steep"),
        (89.01, "facade"),
        (90, "facade"),
        (91, "facade"),
        (91.01, "downward"),
        (180, "downward"),
    ],
)
def test_kind_by_tilt(tilt, kind):
    """Level surfaces face nowhere."""
    assert kind_of(tilt)[:2] == (kind, "none" if kind in ("flat", "downward") else "south")


@pytest.mark.parametrize(
    ("azimuth", "orientation"),
    [
        (0, "north"),
        (30, "north"),
        (30.01, "none"),
        (59.99, "none"),
        (60, "east"),
        (90, "east"),
        (120, "east"),
        (150, "south"),
        (210, "south"),
        (240, "west"),
        (300, "west"),
        (329.99, "none"),
        (330, "north"),
        (359.9, "north"),
    ],
)
def test_bounds_of_the_papers_sectors_are_inclusive(azimuth, orientation):
    assert {kind_of(tilt, azimuth, sectors="paper")[1] for tilt in (40, 75, 90)} == {orientation}


def test_each_azimuth_has_the_direction_that_it_is_nearest_to():
    azimuth = np.append(np.random.default_rng(1).uniform(0, 360, 999), 360.0)
    turn, points = np.radians(azimuth), np.radians(45 * np.arange(8))
    nearest = (
        np.outer(np.sin(turn), np.sin(points)) + np.outer(np.cos(turn), np.cos(points))
    ).argmax(axis=1)
    for tilt in (40, 75, 90):
        _, orientation, eligible = classify(
            np.full(1000, 10), np.full(1000, tilt), azimuth, [""] * 1000
        )
        assert orientation.tolist() == [ORIENTATIONS[k] for k in nearest] and eligible.all()
    # A bound belongs to the sector before it, also where the azimuth is not exact.
    assert [kind_of(90, one)[1] for one in (22.5 + 1e-9, 22.51, 337.5 + 1e-9)] == [
        "north",
        "northeast",
        "northwest",
    ]


def house(turn, cut=()):
    """A house of 12 × 8 m with a ridge along its length, turned; its longer walls drawn twice where
    asked for.
    """
    gable = [(0, 0, 0), (0, 8, 0), (0, 8, 6), (0, 4, 9), (0, 0, 6)]
    wall = [(0, 0, 0), (12, 0, 0), (12, 0, 6), (0, 0, 6)]
    roof = [(0, 0, 6), (12, 0, 6), (12, 4, 9), (0, 4, 9)]
    again = [[(x, y - 0.004, z) for x, y, z in wall]] * len(cut)
    half = [("house", "", [ring]) for ring in (wall, *again, roof, gable[::-1])]
    other = [(name, "", [[(12 - x, 8 - y, z) for x, y, z in ring]]) for name, _, (ring,) in half]
    shed = box("shed", 30, 0, 6, 5, 0, 3, semantics=False)
    cosine, sine = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    turned = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    parts = [
        (name, what, [np.array(ring) @ turned for ring in rings])
        for name, what, rings in [*half, *other, *shed]
    ]
    return make_city(parts)


@pytest.mark.parametrize("turn", [0, 10, 22.5, 30, 45, 60, 77, 90])
def test_a_house_counts_whichever_way_it_is_turned(turn):
    surfaces = build_scene(house(turn), 50.0, 8.0, ground="none").surfaces
    area = {
        kind: surfaces.area[surfaces.eligible & (surfaces.kind == kind)].sum()
        for kind in set(surfaces.kind)
    }
    walls = 2 * 12 * 6 + 2 * (8 * 6 + 8 * 3 / 2) + 2 * (6 + 5) * 3
    assert area == pytest.approx({"facade": walls, "roof": 2 * 12 * 5, "flat": 30, "downward": 0})


@pytest.mark.parametrize(("turn", "grid_size"), [(45, None), (0, 2.0)])
def test_a_transfer_of_the_papers_sectors_is_classified_again(turn, grid_size):
    """What was drawn twice stays out, also where the paper's sectors did not ask; and so in the
    other direction.
    """
    city, scenes = house(turn, cut=("twice",)), {}
    for sectors in ("8", "paper"):
        options = SceneOptions(grid_size=grid_size, sectors=sectors)
        scenes[sectors] = build_scene(city, 50.0, 8.0, ground="none", options=options)
    cells = city if grid_size is None else split_into_cells(city, grid_size)[0]
    for before, after in (("paper", "8"), ("8", "paper")):
        surfaces, expected = scenes[before].surfaces, scenes[after].surfaces
        transfer = unshaded_transfer(
            sky_grid_suns(16), surfaces.surface_tilt, surfaces.surface_azimuth
        )
        request = {"grid_size": grid_size} | ({"sectors": before} if before == "8" else {})
        outlines = Outlines.of(cells, surfaces, scenes[before].site)
        record = replace(transfer.record, request=request)
        transfer = replace(transfer, surfaces=surfaces, outlines=outlines, record=record)
        found = classify_again(transfer, after).surfaces
        for name in ("kind", "orientation", "eligible"):
            assert getattr(found, name).tolist() == getattr(expected, name).tolist()
        assert classify_again(transfer, before) is transfer
    counted, single = (
        scenes["8"].surfaces,
        build_scene(house(turn), 50.0, 8.0, ground="none").surfaces,
    )
    assert counted.area[counted.eligible].sum() == pytest.approx(
        single.area[single.eligible].sum(), rel=1e-6
    )


def test_eligible():
    assert kind_of(90, 180, 6.25)[2]
    assert not kind_of(90, 180, 6.249)[2]
    for tilt, azimuth in ((90, 45), (75, 180), (5, 180)):
        assert kind_of(tilt, azimuth)[2] and not kind_of(tilt, azimuth, sectors="paper")[2]
    assert not kind_of(90, 180, thematic="ClosureSurface")[2]
    assert kind_of(30, 180, thematic="WallSurface")[
        2
    ]  # the rule is tilt, not the class in the file


def test_ground_is_what_faces_up_and_terrain():
    assert kind_of(180, thematic="GroundSurface")[0] == "downward"
    assert kind_of(0, thematic="GroundSurface")[0] == "ground"
    assert kind_of(90, thematic="GroundSurface") == ("ground", "none", False)
    assert kind_of(30, thematic="TINRelief")[0] == "ground"


def test_tilt_and_azimuth_of_normals():
    root = np.sqrt(0.5)
    normal = np.array(
        [[0, 0, 1], [0, -1, 0], [1, 0, 0], [-root, 0, root], [0, 1, 0], [0, 0, -1], [-1e-17, 1, 0]]
    )
    tilt, azimuth = measure_tilt(normal)
    assert tilt == pytest.approx([0, 90, 90, 45, 90, 180, 90])
    assert azimuth == pytest.approx([0, 180, 90, 270, 0, 0, 0])
    assert azimuth.max() < 360
