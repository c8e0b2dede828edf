"""Ground that has no name, and measured terrain as a scene: hills, cliffs, edges, other zero
levels, gaps.
"""

from itertools import pairwise

import numpy as np
import pytest
from scenes import run_gather, suns_towards
from scipy.spatial import Delaunay
from towns import city_of_polygons, draw_town, moved

from citypv.core.city.build_scene import SceneOptions, build_scene
from citypv.core.city.find_ground import find_ground
from citypv.core.city.terrain import Layer, Terrain
from citypv.core.commands.plain_scenes import box
from citypv.core.patches.read_albedo import albedo_of_triangles
from citypv.core.settings.errors import InputError
from citypv.core.settings.request import Request

SUNS = suns_towards([[0.3, -0.8, 0.6], [-0.9, 0.1, 0.2], [0, 0, 1]])
ROOF, FLOOR, SOUTH, NORTH, EAST, WEST = range(-6, 0)  # the house's faces stand last
WALLS = [SOUTH, NORTH, EAST, WEST]
LEVEL = 1e-3


def house(low, high):
    """Six rectangles as polygons."""
    return [points[[*faces[0], faces[1][2]]] for points, faces in box(low, high)]


def trace(scene, **settings):
    return run_gather(scene, SUNS, **{"samples": 4096, "shadow_samples": 256} | settings)


# A mesh without a name


def mesh(height, across=4000.0, cells=40):
    """Squares on a grid: polygons of a mesh that looks up."""
    steps = list(pairwise(np.linspace(-across, across, cells + 1)))
    corners = [np.array([[a, c], [b, c], [b, d], [a, d]]) for a, b in steps for c, d in steps]
    return [np.column_stack([places, height(places[:, 0], places[:, 1])]) for places in corners]


def nameless(height, low, high, thematic=""):
    ground, sides = mesh(height), house(low, high)
    names = [thematic] * len(ground) + [""] * 6
    city = city_of_polygons([*ground, *sides], names, [0] * len(ground) + [1] * 6)
    return build_scene(city, 52, 13, ground="none", patch_size=None)


@pytest.mark.slow
@pytest.mark.parametrize(("slope", "thematic"), [(0.0, ""), (0.3, ""), (0.3, "TINRelief")])
def test_a_cellar_under_ground_without_a_name(slope, thematic):
    """Of each wall only what stands above the ground is lit, and no ray leaves into the sky under
    the hill. A flank of
    0.3 hides a sixth of the sky from the wall that looks up it, and none from the one that looks
    down."""
    transfer = trace(nameless(lambda x, y: slope * x, (-5, -5, -4), (5, 5, 6), thematic))
    buried = {EAST: 0.4 + 0.5 * slope, WEST: 0.4 - 0.5 * slope, SOUTH: 0.4, NORTH: 0.4}
    # Half of a wall's sky lies above the plane that rises with the slope: (1 - sin of its angle)/2.
    hidden = np.sin(np.arctan(slope)) / 2
    for side, share in buried.items():
        assert transfer.covered_share[side] == pytest.approx(share, abs=0.02)
    for side, sky in ((EAST, 0.5 - hidden), (WEST, 0.5)):
        assert transfer.sky_view_factor[side] == pytest.approx((1 - buried[side]) * sky, abs=0.012)
    assert transfer.far_ground_view_factor[EAST] < 0.03
    assert transfer.diffuse_relative[FLOOR] == 0
    assert transfer.covered_share[FLOOR] == 1
    assert transfer.visible_share[WEST, 1] == pytest.approx(1 - buried[WEST], abs=0.02)


BLOCK = [house((x, y, 0), (x + 12, y + 12, 9)) for x in (-40, 0, 40) for y in (-40, 0, 40)]
SHEET = [np.array([[-90, -90, 0], [90, -90, 0], [90, 90, 0], [-90, 90, 0.0]])]  # of 180 m
HALL = house((-50, -50, 0), (60, 60, 6))


def sheet(west, south, east, north, rise=(0.0, 0.0)):
    """A rectangle as an object; `rise` are the heights of its south and north."""
    low, high = rise
    return [
        np.array(
            [[west, south, low], [east, south, low], [east, north, high], [west, north, high]],
            float,
        )
    ]


NINE = [sheet(x, y, x + 60, y + 60) for x in (-90, -30, 30) for y in (-90, -30, 30)]
STREETS = [*sheet(-90, -5, 90, 5), *sheet(-5, -90, 5, -5), *sheet(-5, 5, 5, 90)]
LAWNS = [sheet(x, y, x + 85, y + 85, rise=(0.15, 0.15)) for x in (-90, 5) for y in (-90, 5)]
STRIPS = [sheet(-90, y, 90 - y / 9, y + 60, rise=(y / 20, y / 20 + 3)) for y in (-90, -30, 30)]
RING = [
    sheet(-50, -50, 50, -20),
    sheet(-50, 20, 50, 50),
    sheet(-50, -20, -20, 20),
    sheet(20, -20, 50, 20),
]
DECK, DECK_WALLS = sheet(55, -80, 85, -20, rise=(4, 4)), house((55, -80, 0), (85, -20, 4))[2:]
RAMP = sheet(60, -20, 70, 20, rise=(4, 0.01))
ROW_ROOFS = [sheet(x, -10, x + 10, 10, rise=(8, 8)) for x in range(-50, 50, 10)]
ROW_WALLS = house((-50, -10, 0), (50, 10, 8))[2:]
PENTHOUSE, CHIMNEY = house((0, 0, 6), (20, 20, 9)), house((40, 40, 6), (41, 41, 8))
SHEETS = {  # objects, and which of them are ground
    "a sheet under a block": ([SHEET, *BLOCK], {0}),
    "a mesh of squares": ([mesh(lambda x, y: 0 * x, across=90, cells=4), *BLOCK], {0}),
    "on a slope, with cellars": (
        [
            mesh(lambda x, y: 0.05 * x, across=90),
            *([moved(one, [0, 0, -2]) for one in part] for part in BLOCK),
        ],
        {0},
    ),
    "with streets above it": (
        [SHEET, [moved(one, [0, 0, 0.05]) * [1, 0.05, 1] for one in SHEET], *BLOCK],
        {0, 1},
    ),
    "nine sheets": ([*NINE, *BLOCK], set(range(9))),
    "pavements a curb higher": ([STREETS, *LAWNS, *BLOCK], set(range(5))),
    "a slope in strips of other lengths": ([*STRIPS, *BLOCK], set(range(3))),
    "a deck reached by a ramp": ([*NINE, DECK, DECK_WALLS, RAMP, *BLOCK], set(range(9))),
    "a canopy of four sheets": (
        [*([moved(one, [0, 0, 30]) for one in part] for part in LAWNS), *BLOCK],
        set(),
    ),
    "roofs that touch, walls of their own": ([*ROW_ROOFS, ROW_WALLS, PENTHOUSE], set()),
    "around a house with a cellar": ([*RING, house((-20, -20, -3), (20, 20, 12))], set(range(4))),
    "podium of four decks": ([*LAWNS, house((-90, -90, -4), (90, 90, 0.1))[1:], *BLOCK], set()),
    "a roof over everything": ([[moved(one, [0, 0, 30]) for one in SHEET], *BLOCK], set()),
    "beside the town": ([[moved(0.001 * one, [200, 200, 0]) for one in SHEET], *BLOCK], set()),
    "looks both ways": ([[*SHEET, moved(SHEET[0][::-1], [0, 0, -1])], *BLOCK], set()),
    "roof, walls and what stands on the roof, each an object": (
        [HALL[:1], HALL[2:], PENTHOUSE, CHIMNEY],
        set(),
    ),
    "a low slab": ([house((-90, -90, -0.3), (90, 90, 0)), *BLOCK], set()),
    "a podium": ([house((-90, -90, -5), (90, 90, 0)), *BLOCK], set()),
    "the deck of a car park, closed below": ([house((-60, -60, -3), (60, 60, 0)), *BLOCK], set()),
}


@pytest.mark.parametrize("name", SHEETS)
def test_which_sheet_is_the_ground(name):
    """It has the kind of ground, carries no modules and takes the ground's albedo; a flat roof
    stays one.
    """
    objects, expected = SHEETS[name]
    building = [number for number, part in enumerate(objects) for _ in part]
    city = city_of_polygons([face for part in objects for face in part], building=building)
    scene = build_scene(city, 52, 13, ground="none", patch_size=None)
    named = scene.surfaces.kind == "ground"
    assert (
        set(np.array(building)[named]) == expected
        and named[np.isin(building, list(expected))].all()
    )
    assert (
        not scene.surfaces.eligible[named].any()
        and (scene.surfaces.orientation[named] == "none").all()
    )
    assert scene.report.building_count == city.report.building_count - len(expected)
    assert (find_ground(scene) == named[scene.triangle_surface]).all()
    albedo = albedo_of_triangles(scene, Request(albedo=0.4, ground_albedo=0.1))
    assert (albedo == np.where(named, 0.1, 0.4)[scene.triangle_surface]).all()


def test_a_classified_roof_is_never_ground():
    faces = [face for part in (SHEET, *BLOCK) for face in part]
    city = city_of_polygons(faces, ["RoofSurface"] + [""] * 54, [0] + [1] * 54)
    assert not (
        build_scene(city, 52, 13, ground="none", patch_size=None).surfaces.kind == "ground"
    ).any()


# Measured terrain


def terrain(height, low=-400.0, high=400.0, step=20.0, gap=None):
    """A grid of heights as triangles; those of a gap are left out, as readers do with posts without
    data.
    """
    x, y = (axis.ravel() for axis in np.meshgrid(*[np.arange(low, high + step / 2, step)] * 2))
    triangles = Delaunay(np.column_stack([x, y])).simplices
    if gap is not None:
        triangles = triangles[~gap(x[triangles].mean(axis=1), y[triangles].mean(axis=1))]
    return Terrain("hill.asc", [Layer(np.column_stack([x, y, height(x, y)]), triangles)])


def stand(height, low, high, **options):
    """A house on terrain; both keep their places: the city's own origin is taken off by
    the scene.
    """
    city = city_of_polygons(house(low, high), ["", "GroundSurface", "", "", "", ""], [0] * 6)
    return build_scene(city, 52, 13, options=SceneOptions(terrain=terrain(height, **options)))


@pytest.mark.slow
def test_a_house_on_a_steep_hill():
    """45°, analytic: each wall sees the sky above the plane it stands on, weighed by what the plane
    leaves of it.
    """
    scene = stand(lambda x, y: x, (-5, -5, -5), (5, 5, 15))
    transfer = trace(scene, far_ground=False)
    up, down = 1 - 10 / 20, 1.0
    # The wall that looks up the hill stands 10 of its 20 m in it; of the rest's half sky the hill
    # takes sin(45°)/2.
    assert transfer.covered_share[EAST] == pytest.approx(1 - up, abs=0.03)
    assert transfer.sky_view_factor[EAST] == pytest.approx(
        up * (0.5 - np.sin(np.pi / 4) / 2), abs=0.015
    )
    assert transfer.sky_view_factor[WEST] == pytest.approx(down * 0.5, abs=0.01)
    assert transfer.covered_share[WEST] < 0.03
    assert transfer.sky_view_factor[ROOF] == pytest.approx((1 + np.cos(np.pi / 4)) / 2, abs=0.015)
    assert transfer.visible_share[WEST, 1] == pytest.approx(1, abs=0.02)
    assert transfer.diffuse_relative[FLOOR] == 0


@pytest.mark.slow
def test_a_house_below_a_cliff():
    """100 m to the west, its top 25 m away: the west wall sees the sky above it, the east wall all
    of its own.
    """
    scene = stand(lambda x, y: np.where(x < -25, 100.0, 0.0), (-5, -5, 0), (5, 5, 10), step=10.0)
    transfer = trace(scene, far_ground=False)
    assert transfer.visible_share[WEST, 1] == 0  # sun at 12.5°, the cliff stands up to 81°
    assert transfer.visible_share[ROOF, 1] == 0
    # An endless wall whose top stands at angle β: (1 - sin β)/2 of the hemisphere.
    middle = np.mean([(1 - np.sin(np.arctan2(100 - z, 25))) / 2 for z in np.linspace(0, 10, 101)])
    assert transfer.sky_view_factor[WEST] == pytest.approx(middle, abs=0.004)
    assert transfer.sky_view_factor[EAST] == pytest.approx(0.5, abs=0.01)


@pytest.mark.slow
def test_a_house_on_the_edge_of_its_terrain():
    """Half of it stands beyond: the ground goes on through the feet, which is said; nothing is lit
    from below.
    """
    scene = stand(lambda x, y: 0 * x, (395, -5, 0), (405, 5, 10))
    transfer = trace(scene)
    assert any("gaps" in note for note in scene.report.notes)
    assert transfer.sky_view_factor[WALLS] == pytest.approx(0.5, abs=0.01)
    assert transfer.diffuse_relative[WALLS] == pytest.approx(0.5 + 0.125, abs=0.02)
    assert transfer.diffuse_relative[FLOOR] == 0


@pytest.mark.slow
@pytest.mark.parametrize("away", [500.0, -500.0])
def test_terrain_of_another_zero_level(away):
    """500 m above or below: said, finite, and no light from under the ground."""
    scene = stand(lambda x, y: 0 * x + away, (-5, -5, 0), (5, 5, 10))
    assert any("500.0 m" in note and "vertical datum" in note for note in scene.report.notes)
    transfer = trace(scene, samples=1024)
    for name in ("diffuse_relative", "direct_reflected", "diffuse_relative_standard_error"):
        assert np.isfinite(getattr(transfer, name)).all()
    if away > 0:  # the house lies in the earth
        assert transfer.diffuse_relative.max() < LEVEL
        assert transfer.visible_share.max() == 0
    else:  # on walls carried down 500 m
        assert transfer.visible_share[WEST, 1] == pytest.approx(1, abs=0.01)
        assert transfer.sky_view_factor[WALLS] == pytest.approx(0.5, abs=0.02)
        assert transfer.diffuse_relative[FLOOR] < LEVEL


@pytest.mark.slow
def test_terrain_with_gaps():
    """No heights under half of the house and in a wide band beside it: bridged by those around, and
    said. Where there is none under any house, it is refused."""

    def gone(x, y):
        return (np.abs(x - 60) < 60) & (np.abs(y) < 50)

    with pytest.raises(InputError, match="no height under any building"):
        stand(lambda x, y: 0 * x, (35, -5, 0), (45, 5, 10), gap=gone)
    scene = stand(lambda x, y: 0.1 * y, (-5, -5, 0), (5, 5, 10), gap=gone)
    assert any("gaps" in note for note in scene.report.notes)
    whole = stand(lambda x, y: 0.1 * y, (-5, -5, 0), (5, 5, 10))
    assert np.isfinite(scene.vertices).all()
    one, other = trace(scene), trace(whole)
    assert one.sky_view_factor[-6:] == pytest.approx(other.sky_view_factor[-6:], abs=0.01)
    assert one.diffuse_relative[-6:] == pytest.approx(other.diffuse_relative[-6:], abs=0.02)


@pytest.mark.slow
def test_a_town_on_a_hill_far_away():
    """The same at UTM coordinates and 3,072 m, whole squares of the ground away: not a vertex
    differs.
    """
    kept = [place for place, name in enumerate(draw_town(2)[1]) if name != "TINRelief"]
    polygons, thematic, building = ([rows[place] for place in kept] for rows in draw_town(2))
    hill = terrain(lambda x, y: np.round(30 * np.exp(-((x - 20) ** 2 + y**2) / 5e3), 3))
    scenes = []
    for away in (np.zeros(3), 10_240.0 * np.array([39, 568, 0.3])):
        city = city_of_polygons([points + away for points in polygons], thematic, building)
        layers = [Layer(layer.points + away, layer.triangles) for layer in hill.layers]
        scenes.append(
            build_scene(city, 52, 13, options=SceneOptions(terrain=Terrain("hill.asc", layers)))
        )
    one, other = scenes
    assert one.vertices.shape == other.vertices.shape
    assert np.array_equal(one.triangles, other.triangles)
    assert other.vertices == pytest.approx(one.vertices, abs=1e-6)
