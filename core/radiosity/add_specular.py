"""Add to gather what it cannot follow: light by way of mirrors, glossy faces and glass (`photons.specular_light`)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..transfer.incidence import projection_in_front
from .solve_radiosity import radiosity_factor, variance_of_replicates


class LightOfSuns(NamedTuple):
    """What p patches get of b suns without mirrors, glossy faces and glass."""

    visible_share: np.ndarray  # (p, b) float32
    reflected: np.ndarray  # (p, b) float32, without the first reflection of the far ground


@dataclass
class Specular:
    """Light by way of mirrors, glossy faces and glass."""

    of_suns: Callable  # of `photons.specular_light.SpecularLight`
    by_replicate: np.ndarray | float = 0.0  # (r, n) float64, weighted sum over the suns


def add_specular_sky(context, hemisphere, diffuse, specular):
    """Add light of the sky by way of mirrors, glossy faces and glass to that of gather, with its variance."""
    factor = radiosity_factor(context.patches, hemisphere.covered_share)
    found = specular.of_sky(factor * diffuse.by_replicate.mean(axis=1))
    diffuse.mean = diffuse.mean + found.mean(axis=0)
    diffuse.error.own = diffuse.error.own + variance_of_replicates(found.T)


def add_specular_suns(context, hemisphere, part, lights, block, *, found, specular):
    """Add light by way of mirrors, glossy faces and glass to a block of `found.reflected`.

    Parameters
    ----------
    part : SunBlock
    lights : LightOfSuns
    block : slice
        Of the suns.
    found : Direct
        Written.
    specular : Specular
        Written.
    """
    patches = context.patches
    radiosity = lights.reflected + lights.visible_share * projection_in_front(patches.normal, part.directions)
    if context.plan.far_ground:
        lit_ground = np.maximum(part.directions[:, 2], 0) * np.float32(context.request.ground_albedo)
        radiosity += np.outer(hemisphere.far_ground.mean(axis=1), lit_ground)
    radiosity *= radiosity_factor(patches, hemisphere.covered_share)[:, None]
    values, weighted = specular.of_suns(part, block.start, radiosity)
    found.reflected[:, block] += values
    specular.by_replicate = specular.by_replicate + weighted
