"""Hard cases for the tracer: positions, shapes, suns and numbers that break ray tracers."""

import numpy as np

from ..city.build_scene import build_scene
from ..city.city import City
from .closed_form_checks import SINGLE, mean_of, sun_at, trace
from .plain_scenes import box, join_parts, rectangle, room

RAYS = {"sky-rays": True, "shadow-rays": True}
PLAIN = rectangle([-60, -60, 0], [120, 0, 0], [0, 120, 0], 12)  # 24 triangles
HOUSE = box((-5, -5, 0), (5, 5, 10))
SOUTH = 28 + np.arange(2)
TURN = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]  # about no axis in particular
TURN *= np.sign(np.linalg.det(TURN))


def hard_checks():
    """Name, expected value, allowance, and a function that finds value and standard error: list of
    tuple.
    """
    on_horizon = "sun on the horizon: visible share on the wall facing it"
    in_plane = "sun in the plane of two walls: visible share on them"
    return [
        ("town at UTM coordinates minus the same at the origin", 0.0, SINGLE, _moved_town),
        ("rotated closed room 3 km from the origin: irradiance inside", 0.0, SINGLE, _closed_room),
        ("incidence down to 0.1°: lowest visible share of the sun", 1.0, SINGLE, _grazing),
        ("small faces coplanar with one of 1 km: lowest irradiance", 1.0, SINGLE, _coplanar),
        ("house on 100 km of terrain: sky view factor of its walls", 0.5, SINGLE, _terrain),
        ("shaft 1 m wide, 50 m deep: sky view factor of its floor", 1.2729e-4, 1e-8, _shaft),
        ("slivers of aspect ratio 1e6: lowest visible share of the sun", 1.0, SINGLE, _slivers),
        ("face 0.1 µm above another: irradiance of the upper one", 1.0, SINGLE, _laid),
        (
            "sun at zenith: visible share on walls",
            0.0,
            0.0,
            lambda: _shares([[0, 0, 1]], SOUTH, np.max),
        ),
        (in_plane, 0.0, 0.0, lambda: _shares([[0, -0.8, 0.6]], 32 + np.arange(4), np.max)),
        (on_horizon, 1.0, SINGLE, lambda: _shares([[0, -1, 0]], SOUTH, np.min)),
        ("one thread minus four: largest difference", 0.0, 0.0, _threads),
    ]


def _moved_town():
    """Largest difference of any face's light in twelve boxes, at the origin and in the coordinates
    of a file.
    """
    generator, faces = np.random.default_rng(1), []
    for place in range(12):
        size = np.round(generator.uniform([6, 6, 4], [14, 14, 25]), 3)
        low = np.append(
            20.0 * np.array(divmod(place, 4)) + np.round(generator.uniform(0, 5, 2), 3), 0
        )
        faces += [points[[0, 2, 3, 1]] for points, _ in box(low, low + size)]
    points = np.concatenate(faces)
    count = len(points) // 4
    names, buildings = [f"face {k}" for k in range(count)], [f"b{k // 6}" for k in range(count)]
    rings = np.arange(0, 4 * count + 1, 4)
    lights = []
    # The town is moved by whole squares of the ground.
    for away in (np.zeros(3), np.array((389_120.0, 5_816_320.0, 30.0))):
        city = City(
            names, buildings, [""] * count, points + away, rings, np.arange(count + 1), None
        )
        scene = build_scene(city, 52.5, 13.4, ground="auto", patch_size=10.0)
        lights.append(trace(scene, sun_at([0.3, -0.8, 0.6], [-0.5, 0.6, 0.4]), samples=64))
    return _largest_difference(*lights), 0.0


def _closed_room():
    """Light on the brightest face."""
    scene = join_parts(room((0, 0, 0), (7, 3, 5)), TURN, (2000, -2000, 500))
    transfer = trace(
        scene, sun_at([0.3, -0.8, 0.6], [0, 0, 1]), samples=1 << 15, shadow_samples=1024
    )
    return float(max(transfer.diffuse_relative.max(), transfer.visible_share.max())), 0.0


def _grazing():
    """Suns from straight above a face down to 0.1° above its plane, all around it, 10 km from the
    origin.
    """
    angle, around = (
        grid.ravel()
        for grid in np.meshgrid(np.radians([90, 10, 1, 0.1]), np.radians(range(0, 360, 15)))
    )
    local = np.column_stack(
        [np.cos(angle) * np.cos(around), np.cos(angle) * np.sin(around), np.sin(angle)]
    )
    directions = local @ TURN.T
    scene = join_parts([rectangle([0, 0, 0], [10, 0, 0], [0, 10, 0], 10)], TURN, (7000, -7000, 100))
    suns = sun_at(*directions[directions[:, 2] > 1e-3])
    return float(
        trace(scene, suns, samples=64, shadow_samples=64, effects=RAYS).visible_share.min()
    ), 0.0


def _coplanar():
    """Sky and far ground of the small faces together."""
    parts = [rectangle([0, -500, 0], [1000, 0, 0], [0, 1000, 0])]
    parts += [
        rectangle([-0.01, 0.01 * place, 0], [0.01, 0, 0], [0, 0.01, 0]) for place in range(20)
    ]
    transfer = trace(join_parts(parts, TURN), samples=4096, effects=RAYS)
    return float((transfer.sky_view_factor + transfer.far_ground_view_factor)[2:].min()), 0.0


def _terrain():
    """A box of 10 m on a plain of 100 km, 30 km from its middle."""
    plain = rectangle([-8e4, -5e4, 0], [1e5, 0, 0], [0, 1e5, 0], 12)
    scene = join_parts([plain, *HOUSE], away=(3e4, 0, 0))
    transfer = trace(scene, samples=1 << 14, max_bounces=0)
    return mean_of(transfer, np.arange(24 + 4, 24 + 12), "sky_view_factor")


def _shaft():
    """Floor of a square court without a roof; opposite squares by Howell C-11."""
    scene = join_parts(room((0, 0, 0), (1, 1, 50))[1:])
    return mean_of(trace(scene, samples=1 << 20, max_bounces=0), np.arange(2), "sky_view_factor")


def _slivers():
    """A roof 100 m long, cut into strips of 0.1 mm."""
    scene = join_parts([rectangle([0, 0, 5], [100, 0, 0], [0, 2e-3, 0], 20)])
    suns = sun_at([0.5, -0.5, 0.7], [0, 0, 1])
    return float(trace(scene, suns, shadow_samples=64, effects=RAYS).visible_share.min()), 0.0


def _laid():
    """Least of sky and sun on the upper of two faces."""
    faces = [rectangle([0, 0, height], [10, 0, 0], [0, 10, 0]) for height in (5, 5 + 1e-7)]
    transfer = trace(join_parts(faces), sun_at([0.5, -0.5, 0.7]), samples=4096, effects=RAYS)
    return float(min(transfer.sky_view_factor[2:].min(), transfer.visible_share[2:].min())), 0.0


def _shares(directions, chosen, extreme):
    """Extreme visible share of some faces of the house under some suns."""
    transfer = trace(
        join_parts([PLAIN, *HOUSE]), sun_at(*directions), samples=64, shadow_samples=64
    )
    return float(extreme(transfer.visible_share[chosen])), 0.0


def _largest_difference(one, other):
    """Of any face's light in two Transfers: float."""
    names = (
        "diffuse_relative",
        "visible_share",
        "direct_reflected",
        "diffuse_relative_standard_error",
    )
    return max(float(np.abs(getattr(one, name) - getattr(other, name)).max()) for name in names)


def _threads():
    """Largest difference between results with one and four threads."""
    scene, suns = join_parts([PLAIN, *HOUSE]), sun_at([0.3, -0.8, 0.6], [-0.5, 0.6, 0.4])
    one, four = (trace(scene, suns, threads=count) for count in (1, 4))
    return _largest_difference(one, four), 0.0
