"""Hard cases for the tracer: positions, shapes, suns and numbers that break ray tracers."""

import tempfile
from pathlib import Path

import numpy as np

from ..city.build_scene import build_scene
from ..city.city import City
from ..light.trace_gather import trace_gather
from ..read.read_city import read_city
from ..settings.errors import InputError
from ..settings.progress import silent
from ..settings.request import Request
from ..sun.suns import Suns
from .closed_form_checks import SINGLE, mean_of, sun_at, trace
from .plain_scenes import box, join_parts, rectangle, room

RAYS = {"sky-rays": True, "shadow-rays": True}
PLAIN = rectangle([-60, -60, 0], [120, 0, 0], [0, 120, 0], 12)  # 24 triangles
HOUSE = box((-5, -5, 0), (5, 5, 10))
ROOF, SOUTH, SIDE_WALLS = 24 + np.arange(2), 28 + np.arange(2), 32 + np.arange(4)
SUN_IN_PLANE, LOW_SUN = [[0, -0.8, 0.6]], [[0, -1, 0]]  # in the south
NO_SUN = np.zeros((0, 3)), np.zeros(0), *np.zeros((2, 0), np.int32)  # polar night
WHITE = {"albedo": 1.0, "ground_albedo": 1.0, "max_bounces": 50}  # no light is created if none is absorbed
# Underside of a square slab of 10 m, 3 m above open ground, three reflections: numeric radiosity in squares of 0.25 m.
UNDERSIDE = 0.1495
SLOT = (6 + 1.5 - np.hypot(1.5, 6)) / (2 * 6)  # crossed strings
UTM = (389_120.0, 5_816_320.0, 30.0)  # whole squares of the ground
TURN = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]  # about no axis in particular
TURN *= np.sign(np.linalg.det(TURN))
SIDES = ([4, 5, 6, 7], [0, 3, 2, 1], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7])


def hard_checks():
    """Name, expected value, allowance, and a function that finds value and standard error: list of tuple."""
    return [
        ("town at UTM coordinates minus the same at the origin", 0.0, SINGLE, moved_town),
        ("rotated closed room 3 km from the origin: irradiance inside", 0.0, SINGLE, closed_room),
        ("incidence down to 0.1°: lowest visible share of the sun", 1.0, SINGLE, grazing),
        ("small faces coplanar with one of 1 km: lowest irradiance", 1.0, SINGLE, coplanar),
        ("house on 100 km of terrain: sky view factor of its walls", 0.5, SINGLE, terrain),
        ("shaft 1 m wide, 50 m deep: sky view factor of its floor", 1.2729e-4, 1e-8, shaft),
        ("party wall of touching houses: irradiance", 0.0, SINGLE, party_wall),
        ("wall in a gap of 0.1 m, patches of 10 m: error within the stated one", 1.0, 0.0, narrow_gap),
        ("slivers of aspect ratio 1e6: lowest visible share of the sun", 1.0, SINGLE, slivers),
        ("face 0.1 µm above another: irradiance of the upper one", 1.0, SINGLE, laid),
        ("house without a roof: sky view factor of its walls", 0.5, SINGLE, open_house),
        ("slab of 10 m, 3 m above ground: irradiance of its underside", UNDERSIDE, 0.02 * UNDERSIDE, canopy),
        ("valley as one object, sides at 45°: sky view factor", np.sqrt(0.5), 0.001, valley),
        ("wall 1.5 m behind a sheet of 6 m: sky view factor", SLOT, 0.003, board),
        ("sun at zenith: visible share on walls", 0.0, 0.0, lambda: shares([[0, 0, 1]], SOUTH, np.max)),
        (
            "sun in the plane of two walls: visible share on them",
            0.0,
            0.0,
            lambda: shares(SUN_IN_PLANE, SIDE_WALLS, np.max),
        ),
        (
            "sun on the horizon: visible share on the wall facing it",
            1.0,
            SINGLE,
            lambda: shares(LOW_SUN, SOUTH, np.min),
        ),
        ("no sun: irradiance of the roof", 1.0, SINGLE, lambda: on_roof(Suns("hourly", *NO_SUN))),
        ("albedo 1, 50 reflections: irradiance of the roof", 1.0, SINGLE, lambda: on_roof(None, **WHITE)),
        ("one thread minus four: largest difference", 0.0, 0.0, threads),
        ("non-finite values: arrays refused, of four", 4.0, 0.0, refused),
    ]


def faces_of_box(low, high):
    """Six faces of a box: roof, floor, south, east, north, west: (6, 4, 3) float64."""
    base = [[0, 0], [1, 0], [1, 1], [0, 1]]
    corners = np.array([[*place, z] for z in (0, 1) for place in base]) * np.subtract(high, low) + low
    return corners[list(SIDES)]


def town(away):
    """Twelve boxes in the coordinates of a file, moved."""
    generator, boxes = np.random.default_rng(1), []
    for place in range(12):
        size = np.round(generator.uniform([6, 6, 4], [14, 14, 25]), 3)
        low = np.append(20.0 * np.array(divmod(place, 4)) + np.round(generator.uniform(0, 5, 2), 3), 0)
        boxes.append(faces_of_box(low, low + size) + away)
    return scene_of_faces(boxes, ground="auto")


def scene_of_faces(parts, patch_size=10.0, ground="none"):
    """Scene of rectangles, (4, 3) each: a list for each building."""
    faces = np.array([face for part in parts for face in part], float)
    count = len(faces)
    names, buildings = [f"face {k}" for k in range(count)], [f"b{k}" for k, part in enumerate(parts) for _ in part]
    rings = np.arange(0, 4 * count + 1, 4)
    city = City(names, buildings, [""] * count, faces.reshape(-1, 3), rings, np.arange(count + 1), None)
    return build_scene(city, 52.5, 13.4, ground=ground, patch_size=patch_size)


def canopy():
    """Light on the underside of a slab above a plain, drawn as its own object."""
    plain = [[[-30, -30, 0], [30, -30, 0], [30, 30, 0], [-30, 30, 0]]]
    scene = scene_of_faces([plain, faces_of_box((-5, -5, 3), (5, 5, 3.01))], 2.0)
    return mean_of(trace(scene, samples=256, max_bounces=3), [2])


def board():
    """Sky view of a wall behind a noise barrier of 400 m that faces away: the slot between their upper edges."""
    barrier = [[[-200, -1.5, 0], [200, -1.5, 0], [200, -1.5, 6], [-200, -1.5, 6]]]
    scene = scene_of_faces([barrier, faces_of_box((-5, 0, 0), (5, 8, 6))], None)
    return mean_of(trace(scene, samples=1 << 14, max_bounces=0), [3], "sky_view_factor")


def valley():
    """Sky of the two sides of a long valley that is read from a file; by crossed strings the cosine of their slope."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "valley.obj"
        corners = [(x, y, abs(x)) for x in (-10, 0, 10) for y in (-5000, 5000)]
        lines = ["o valley", *(f"v {x} {y} {z}" for x, y, z in corners), "f 1 3 4 2", "f 3 5 6 4"]
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        scene = build_scene(read_city(path), 52.5, 13.4, ground="none", patch_size=None)
    return mean_of(trace(scene, samples=1 << 14, max_bounces=0), np.arange(2), "sky_view_factor")


def moved_town():
    """Largest difference of any face's light."""
    suns = sun_at([0.3, -0.8, 0.6], [-0.5, 0.6, 0.4])
    here, there = (trace(town(away), suns, samples=64) for away in (np.zeros(3), np.array(UTM)))
    return largest_difference(here, there), 0.0


def closed_room():
    """Light on the brightest face."""
    scene = join_parts(room((0, 0, 0), (7, 3, 5)), TURN, (2000, -2000, 500))
    transfer = trace(scene, sun_at([0.3, -0.8, 0.6], [0, 0, 1]), samples=1 << 15, shadow_samples=1024)
    return float(max(transfer.diffuse_relative.max(), transfer.visible_share.max())), 0.0


def grazing():
    """Suns from straight above a face down to 0.1° above its plane, all around it, 10 km from the origin."""
    angle, around = (grid.ravel() for grid in np.meshgrid(np.radians([90, 10, 1, 0.1]), np.radians(range(0, 360, 15))))
    local = np.column_stack([np.cos(angle) * np.cos(around), np.cos(angle) * np.sin(around), np.sin(angle)])
    directions = local @ TURN.T
    scene = join_parts([rectangle([0, 0, 0], [10, 0, 0], [0, 10, 0], 10)], TURN, (7000, -7000, 100))
    suns = sun_at(*directions[directions[:, 2] > 1e-3])
    return float(trace(scene, suns, samples=64, shadow_samples=64, effects=RAYS).visible_share.min()), 0.0


def coplanar():
    """Sky and far ground of the small faces together."""
    parts = [rectangle([0, -500, 0], [1000, 0, 0], [0, 1000, 0])]
    parts += [rectangle([-0.01, 0.01 * place, 0], [0.01, 0, 0], [0, 0.01, 0]) for place in range(20)]
    transfer = trace(join_parts(parts, TURN), samples=4096, effects=RAYS)
    return float((transfer.sky_view_factor + transfer.far_ground_view_factor)[2:].min()), 0.0


def terrain():
    """A box of 10 m on a plain of 100 km, 30 km from its middle."""
    plain = rectangle([-8e4, -5e4, 0], [1e5, 0, 0], [0, 1e5, 0], 12)
    scene = join_parts([plain, *HOUSE], away=(3e4, 0, 0))
    transfer = trace(scene, samples=1 << 14, max_bounces=0)
    return mean_of(transfer, np.arange(24 + 4, 24 + 12), "sky_view_factor")


def shaft():
    """Floor of a square court without a roof; opposite squares by Howell C-11."""
    scene = join_parts(room((0, 0, 0), (1, 1, 50))[1:])
    return mean_of(trace(scene, samples=1 << 20, max_bounces=0), np.arange(2), "sky_view_factor")


def party_wall():
    """Light of the walls two houses share."""
    transfer = trace(join_parts([*HOUSE, *box((5, -5, 0), (15, 5, 10))]), sun_at([0.5, -0.5, 0.7]), samples=4096)
    walls = [8, 9, 12 + 10, 12 + 11]
    return float(max(transfer.diffuse_relative[walls].max(), transfer.visible_share[walls].max())), 0.0


def narrow_gap():
    """A wall of 10 m before a taller neighbour's: large patches spread light down the gap, and their error says so.

    1 where they differ from patches of 0.5 m by four stated errors at most, and these are smaller than the light.
    """
    transfers = []
    for pieces in (1, 20):
        walls = [
            rectangle([0, 0, 0], [0, 10, 0], [0, 0, 10], pieces),
            rectangle([0.1, 10, 0], [0, -10, 0], [0, 0, 15], pieces),
            rectangle([0.1, 0, 0], [-0.1, 0, 0], [0, 0, 10]),
            rectangle([0, 10, 0], [0.1, 0, 0], [0, 0, 10]),
            rectangle([0, 0, 0], [0.1, 0, 0], [0, 10, 0]),
        ]
        transfers.append((trace(join_parts(walls), samples=1024), np.arange(2 * pieces)))
    (coarse, coarse_error), (fine, fine_error) = (mean_of(*each) for each in transfers)
    within = abs(coarse - fine) <= 4 * np.hypot(coarse_error, fine_error)
    return float(within and coarse_error < coarse), 0.0


def slivers():
    """A roof 100 m long, cut into strips of 0.1 mm."""
    scene = join_parts([rectangle([0, 0, 5], [100, 0, 0], [0, 2e-3, 0], 20)])
    suns = sun_at([0.5, -0.5, 0.7], [0, 0, 1])
    return float(trace(scene, suns, shadow_samples=64, effects=RAYS).visible_share.min()), 0.0


def laid():
    """Least of sky and sun on the upper of two faces."""
    faces = [rectangle([0, 0, height], [10, 0, 0], [0, 10, 0]) for height in (5, 5 + 1e-7)]
    transfer = trace(join_parts(faces), sun_at([0.5, -0.5, 0.7]), samples=4096, effects=RAYS)
    return float(min(transfer.sky_view_factor[2:].min(), transfer.visible_share[2:].min())), 0.0


def open_house():
    """Walls of a house without a roof get no light through it."""
    transfer = trace(join_parts([PLAIN, *HOUSE[1:]]), samples=1 << 14, max_bounces=0)
    return mean_of(transfer, np.arange(24 + 2, 24 + 10), "sky_view_factor")


def shares(directions, chosen, extreme):
    """Extreme visible share of some faces of the house under some suns."""
    transfer = trace(join_parts([PLAIN, *HOUSE]), sun_at(*directions), samples=64, shadow_samples=64)
    return float(extreme(transfer.visible_share[chosen])), 0.0


def on_roof(suns, **settings):
    """Light on the roof of a house on a plain."""
    return mean_of(trace(join_parts([PLAIN, *HOUSE]), suns, **settings), ROOF)


def largest_difference(one, other):
    """Of any face's light in two Transfers: float."""
    names = ("diffuse_relative", "visible_share", "direct_reflected", "diffuse_relative_standard_error")
    return max(float(np.abs(getattr(one, name) - getattr(other, name)).max()) for name in names)


def threads():
    """Largest difference between results with one and four threads."""
    scene, suns = join_parts([PLAIN, *HOUSE]), sun_at([0.3, -0.8, 0.6], [-0.5, 0.6, 0.4])
    one, four = (trace(scene, suns, threads=count) for count in (1, 4))
    return largest_difference(one, four), 0.0


def refused():
    """Scenes with a coordinate that is NaN, infinite or 1e38, and a sun of NaN: number of those that are refused."""
    count = 0
    for number in (np.nan, np.inf, 1e38, None):
        scene, suns = join_parts([PLAIN, *HOUSE]), sun_at([0, 0, 1])
        if number is None:
            suns.direction[0, 0] = np.nan
        else:
            scene.vertices[3, 1] = number
        try:
            trace_gather(scene, suns, Request(), silent)
        except InputError:
            count += 1
    return float(count), 0.0
