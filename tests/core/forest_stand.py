"""Forest stands with measured light below the crowns, in the format of SamsaraLight (.inv), and
their simulation.

PACL: light at a sensor over light above the canopy, in the season with leaves.
"""

import gzip
from dataclasses import dataclass
from itertools import dropwhile, takewhile

import numpy as np
import shapely
import shapely.affinity

from citypv.core.city.crowns import cylinder, unit_sphere
from citypv.core.city.scene import Crowns
from citypv.core.city.site import Site
from citypv.core.commands.plain_scenes import join_parts, rectangle
from citypv.core.effects.foliage import NORTHERN
from citypv.core.run.study import compute_energy, read_year, trace_scene
from citypv.core.settings.request import Request

REACH = 140.0  # [m] around the sensors, up to which the stand is repeated
SENSOR = 0.05  # [m] its side
SECTIONS = ("# Inventory zone records", "# Sensor records", "# Tree records")
# [°] of both plots; one file gives latitude and longitude in each other's place
PLACE = (
    50.04,
    5.21,
)


@dataclass
class Stand:
    """A plot."""

    zone: shapely.Polygon  # in which all trees are recorded
    sensors: np.ndarray  # (m, 7): number, x, y, height [m], PACL total, diffuse, direct
    # (n, 14): id, species, x, y, dbh [cm], height, base, height of greatest radius [m], radii
    trees: np.ndarray
    # to north, east, south, west [m], openness, leaf area density [m²/m³]
    slope: float  # [°]
    aspect: float  # [°] downhill


def read_stand(path):
    """Stand of a file, plain or gzip-compressed."""
    data = path.read_bytes()
    text = (gzip.decompress(data) if path.suffix == ".gz" else data).decode("utf-8")
    tables = []
    for heading in SECTIONS:
        lines = [line for line in text.partition(heading)[2].splitlines() if line.strip()]
        rows = dropwhile(lambda line: line.startswith("#"), map(str.strip, lines))
        tables.append(
            np.array(
                [row.split() for row in takewhile(lambda row: not row.startswith("#"), rows)], float
            )
        )
    keys = dict(line.split(" = ") for line in text.splitlines() if " = " in line)
    return Stand(
        shapely.Polygon(tables[0]),
        tables[1],
        tables[2],
        float(keys["plotSlope"]),
        float(keys["plotAspect"]),
    )


def repeat_stand(stand):
    """Trees of the plot and of its copies around it, (k, 14): each copy fills what nearer ones have
    left free.
    """
    west, south, east, north = stand.zone.bounds
    steps = [(i, j) for i in range(-12, 13) for j in range(-12, 13)]
    steps.sort(
        key=lambda step: (np.hypot(step[0] * (east - west), step[1] * (north - south)), step)
    )
    near = shapely.MultiPoint(stand.sensors[:, 1:3]).convex_hull.buffer(REACH)
    filled, kept = shapely.Polygon(), []
    for i, j in steps:
        shift = np.array([i * (east - west) / 2, j * (north - south) / 2])
        copy = shapely.affinity.translate(stand.zone, *shift)
        if not copy.intersects(near):
            continue
        trees = stand.trees.copy()
        trees[:, 2:4] += shift
        places = shapely.points(trees[:, 2:4])
        free = ~shapely.contains(filled, places) & shapely.contains(near, places)
        kept.append(trees[free | ((i, j) == (0, 0))])
        filled = shapely.union(filled, copy)
    return np.concatenate(kept)


def ground_height(stand, places):
    """Height of the sloping ground, (k,) [m]; 0 in the middle of the plot."""
    middle = np.array(stand.zone.centroid.coords[0])
    turn = np.radians(stand.aspect)
    return -np.tan(np.radians(stand.slope)) * ((places - middle) @ [np.sin(turn), np.cos(turn)])


def crowns_of_stand(stand, trees):
    """Crowns of trees: eighths of ellipsoids; paraboloids where the greatest radius is the
    lowest.
    """
    sphere, faces = unit_sphere()
    middle = np.array(stand.zone.centroid.coords[0])
    vertices, triangles, trunk, start = [], [], [], 0
    for tree, foot in zip(trees, ground_height(stand, trees[:, 2:4]), strict=True):
        place = np.array([*(tree[2:4] - middle), foot])
        top, base, widest = tree[5:8]
        # east or west, north or south
        across = np.where(sphere[:, :2] > 0, tree[[9, 8]], tree[[11, 10]])
        shape = sphere.copy()
        if widest - base < 0.01 * top:
            # z = 1 - r² at the same r: the lower half of the sphere becomes the flat bottom.
            shape[:, 2] = np.where(sphere[:, 2] > 0, 1 - (sphere[:, :2] ** 2).sum(axis=1), 0)
            shape[:, 2] = np.maximum(shape[:, 2], 0)
        up = np.where(shape[:, 2] > 0, top - widest, widest - base)
        crown = place + np.column_stack([shape[:, :2] * across, widest + shape[:, 2] * up])
        mantle, sides = cylinder(place, tree[4] / 200, widest)
        vertices += [crown, mantle]
        triangles += [faces + start, sides + start + len(crown)]
        trunk += [np.zeros(len(faces), bool), np.ones(len(sides), bool)]
        start += len(crown) + len(mantle)
    own = np.repeat(np.arange(len(trees)), len(faces) + len(sides))
    return Crowns(
        vertices=np.concatenate(vertices),
        triangles=np.concatenate(triangles).astype(np.int32),
        tree=own.astype(np.int32),
        trunk=np.concatenate(trunk),
        names=[f"{int(tree[0])}" for tree in trees],
        height=trees[:, 5],
        evergreen=np.zeros(len(trees), bool),
        area_density=trees[:, 13],
    )


def predict_light(stand, samples=4096, shadow_samples=4, suns="days:24"):
    """PACL of the sensors: (m, 3) total, diffuse and direct, from May to October under the built-in
    climate.
    """
    places = stand.sensors[:, 1:4].copy()
    places[:, 2] += ground_height(stand, places[:, :2])
    places[:, :2] -= stand.zone.centroid.coords[0]
    scene = join_parts([rectangle(place, [SENSOR, 0, 0], [0, SENSOR, 0]) for place in places])
    scene.site = Site(*PLACE, 300.0, 0.0, None, (0.0, 0.0, 0.0))
    scene.trees = crowns_of_stand(stand, repeat_stand(stand))
    request = Request(
        samples=samples,
        shadow_samples=shadow_samples,
        suns=suns,
        max_bounces=0,
        far_ground=False,
        leaf_months="all",
        sky="isotropic",
        threads=1,
        effects={"sky-rays": True, "shadow-rays": True},
    )
    weather = read_year(scene.site, request)
    month = (weather.data.index + weather.interval / 2).month
    weather = weather.darken(~np.isin(month, NORTHERN))
    transfer = trace_scene(scene, weather, request)
    hours = weather.data
    poa = compute_energy(transfer, weather, request).poa_global_annual.reshape(-1, 2).mean(axis=1)
    diffuse = transfer.diffuse_relative.reshape(-1, 2).mean(axis=1)
    total, sky = (hours[name].sum() / 1000 for name in ("ghi", "dhi"))
    beam = (hours["dni"] * np.maximum(np.cos(np.radians(hours["apparent_zenith"])), 0)).sum() / 1000
    return np.column_stack([poa / total, diffuse, (poa - diffuse * sky) / beam])
