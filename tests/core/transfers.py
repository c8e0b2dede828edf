"""Transfers without a ray tracer: unshaded surfaces by closed forms, and random horizons."""

from copy import deepcopy
from functools import reduce

import numpy as np

from citypv.core.city.scene import Surfaces
from citypv.core.city.site import Site
from citypv.core.light.merge_transfers import merge_rounds
from citypv.core.light.transfer import TraceRecord, Transfer


def make_surfaces(surface_tilt, surface_azimuth, seed=0):
    """Surfaces by the paper's rule of kinds and orientations, with random areas [m²]."""
    tilt, azimuth = np.asarray(surface_tilt, float), np.asarray(surface_azimuth, float)
    count, rng = len(tilt), np.random.default_rng(seed)
    slope, turn = np.radians(tilt), np.radians(azimuth)
    normal = np.stack(
        [np.sin(slope) * np.sin(turn), np.sin(slope) * np.cos(turn), np.cos(slope)], axis=1
    )
    kind = np.select(
        [tilt < 15, tilt <= 60, tilt <= 89, tilt <= 91],
        ["flat", "roof", "steep", "facade"],
        "downward",
    )
    orientation = np.full(count, "none", dtype="<U5")
    for name, side in (("north", 0), ("east", 90), ("south", 180), ("west", 270)):
        orientation[(np.abs((azimuth - side + 180) % 360 - 180) <= 30) & (tilt >= 15)] = name
    area = rng.uniform(2, 100, count)
    eligible = (area >= 6.25) & (orientation != "none") & np.isin(kind, ("facade", "roof"))
    ids, buildings = [f"s{i}" for i in range(count)], [f"b{i // 7}" for i in range(count)]
    return Surfaces(
        ids, buildings, [""] * count, kind, orientation, eligible, area, tilt, azimuth, normal
    )


def unshaded_transfer(suns, surface_tilt, surface_azimuth, albedo=0.25):
    """Surfaces alone on far ground: paper, Eq. 9 and 11."""
    surfaces = make_surfaces(surface_tilt, surface_azimuth)
    count, cosine = len(surfaces), np.cos(np.radians(surfaces.surface_tilt))
    sky, ground = (1 + cosine) / 2, (1 - cosine) / 2  # Eq. 6, 7
    return Transfer(
        surfaces=surfaces,
        site=Site(52.5, 13.4, 34.0, 0.0, "EPSG:25833", (390000.0, 5818000.0, 30.0)),
        suns=suns,
        covered_share=np.zeros(count),
        no_room=np.zeros((count, 2)),
        clearances=(0.01, 0.3),
        sky_view_factor=sky,
        far_ground_view_factor=ground,
        ground_albedo=albedo,
        diffuse_relative=sky + albedo * ground,  # Eq. 9
        diffuse_relative_standard_error=np.zeros(count),
        visible_share=(surfaces.normal @ suns.direction.T > 0).astype(np.float32),
        direct_reflected=np.zeros((count, len(suns)), np.float32),
        direct_annual_standard_error=np.zeros(count),
        record=TraceRecord(
            request={"seed": 0},
            effects=[{"key": "reflections", "on": True}],
            max_bounces=1,
            brightest_albedo=albedo,
            patches=count,
            threads=1,
            seconds={"suns": 0.0},
            embree_thread_seconds=0.0,
            last_bounce_share_diffuse=0.0,
            last_bounce_share_direct=0.0,
        ),
    )


class Horizons:
    """Random skylines: what each surface sees of a sun, with a soft edge of 10°."""

    def __init__(self, count, seed=0):
        rng = np.random.default_rng(seed)
        self.tilt = np.where(rng.random(count) < 0.7, 90.0, rng.uniform(0, 60, count))
        self.azimuth = rng.uniform(0, 360, count)
        self.height = np.abs(rng.normal(0, 25, (count, 36))) * rng.random((count, 1))
        self.reflected = 0.1 * rng.random((count, 1))

    def visible(self, direction):
        """Visible share of suns (s, 3): (n, s)."""
        azimuth = np.degrees(np.arctan2(direction[:, 0], direction[:, 1])) % 360
        elevation = np.degrees(np.arcsin(np.clip(direction[:, 2], -1, 1)))
        place = azimuth / 10.0
        left = place.astype(int) % 36
        share = place - np.floor(place)
        skyline = self.height[:, left] * (1 - share) + self.height[:, (left + 1) % 36] * share
        return np.clip((elevation - skyline) / 10 + 0.5, 0, 1)

    def transfer(self, suns):
        """The Transfer a tracer would find."""
        result = unshaded_transfer(suns, self.tilt, self.azimuth)
        result.visible_share *= self.visible(suns.direction).astype(np.float32)
        result.direct_reflected += self.reflected.astype(np.float32)
        result.diffuse_relative = result.diffuse_relative * 0.7
        result.diffuse_relative_standard_error[:] = 0.002
        result.direct_annual_standard_error[:] = 0.003
        return result


def merge_all(transfers):
    """Mean of independent rounds, none of which is overwritten."""
    return reduce(merge_rounds, transfers[1:], deepcopy(transfers[0]))
