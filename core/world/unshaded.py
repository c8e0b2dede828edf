"""Unshaded facades and roofs on open ground, by closed forms: the environment without buildings."""

import numpy as np

from ..effects.closed_form import ground_view_of_tilt, sky_view_of_tilt
from ..light.transfer import SourceLight, Transfer
from ..scene.scene import Site, Surfaces
from ..sky.light_sources import SOURCES
from ..sun.sky_grid import sky_grid_suns

ROOF_TILT = 35.0  # [°]; the paper's roofs have mean tilts of 28 to 42°
SIDES = {"north": 0.0, "east": 90.0, "south": 180.0, "west": 270.0}
FEWEST = 16  # directions of the sky grid: the visible share is 1 in all of them


def unshaded_transfer(ground_albedo=0.25):
    """Transfer of eight surfaces of 10 m², which see nothing but sky and open ground.

    Parameters
    ----------
    ground_albedo : float

    Returns
    -------
    Transfer
        Facades and roofs of 35° towards north, east, south and west (paper, Eq. 9 and 11).
    """
    tilt = np.repeat([90.0, ROOF_TILT], 4)
    azimuth = np.tile(list(SIDES.values()), 2)
    slope, turn = np.radians(tilt), np.radians(azimuth)
    normal = np.stack([np.sin(slope) * np.sin(turn), np.sin(slope) * np.cos(turn), np.cos(slope)], axis=1)
    kind, orientation = np.repeat(["facade", "roof"], 4), np.tile(list(SIDES), 2)
    names = ["_".join(pair) for pair in zip(kind, orientation, strict=True)]
    suns, count = sky_grid_suns(FEWEST), len(tilt)
    sky, ground = sky_view_of_tilt(normal), ground_view_of_tilt(normal)
    zero = np.zeros(count)
    return Transfer(
        surfaces=Surfaces(
            names, names, [""] * count, kind, orientation, np.ones(count, bool), zero + 10.0, tilt, azimuth, normal
        ),
        site=Site(0.0, 0.0, 0.0, 0.0, None, (0.0, 0.0, 0.0)),
        suns=suns,
        covered_share=zero,
        sky_view_factor=sky,
        far_ground_view_factor=ground,
        ground_albedo=ground_albedo,
        diffuse_relative=sky + ground_albedo * ground,  # Eq. 9
        diffuse_relative_standard_error=zero,
        visible_share=np.ones((count, len(suns)), np.float32),
        direct_reflected=np.zeros((count, len(suns)), np.float32),
        direct_annual_standard_error=zero,
        sources={name: unshaded_light(source, normal) for name, source in SOURCES.items()},
    )


def unshaded_light(source, normal):
    """SourceLight of unshaded surfaces by their normals, without reflections: beyond a source the ground is dark."""
    light = source.unshaded(normal)
    return SourceLight(light, light, np.zeros(len(normal)))
