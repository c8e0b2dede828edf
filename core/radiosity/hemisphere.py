"""Types: what the hemisphere rays of patches found, and what follows from it for reflections."""

from dataclasses import dataclass

import numpy as np

from ..form_factors.form_factors import FormFactors
from ..rays.sample_points import HEMISPHERE_REPLICATES


@dataclass
class HemisphereRays:
    """Results of the hemisphere rays of p patches."""

    sky: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32, share of rays that reach the sky
    far_ground: np.ndarray  # (p, HEMISPHERE_REPLICATES) float32, share of rays that escape below the horizon
    form_factors: FormFactors | None  # from the rays that hit the front of another patch; None if not asked for
    covered: np.ndarray  # (p, CELL_DIVISIONS²) bool, cells that lie inside or under something
    ray_count: int
    unseen_share: float = 0.0  # of all hits, on patches that were left out
    seen: np.ndarray | None = None  # (p,) float64 [m²], area of receivers times their view factors of each patch

    @property
    def covered_share(self):
        """Share of each patch that lies inside or under something: (p,) float32."""
        return self.covered.mean(axis=1, dtype=np.float32)


@dataclass
class Hemisphere(HemisphereRays):
    """What p patches see, and how they re-emit it: kept until all light is gathered."""

    factor: np.ndarray | None = None  # (p, cells) float32, of `element_factors`; None without reflections


@dataclass
class ElementSky:
    """First light of the sky on the elements of p patches: needed until reflected skylight is known."""

    view: np.ndarray  # (p, cells) float32, share of rays from the open part of each element that reach the sky
    deviation: np.ndarray  # (p, cells, HEMISPHERE_REPLICATES) int16, of `Tally`


@dataclass
class ElementTallies:
    """Hemisphere rays of p patches by the elements in which they start: needed until the element factors are known."""

    sky: ElementSky
    far_ground: np.ndarray  # (p, cells) float32, share of all rays that start in the element and reach far ground
    open_share: np.ndarray  # (p, cells) float32, share of the rays of each element that start in the open


def empty_tallies(count, cells):
    """ElementTallies of `count` patches that sent no rays yet: they see nothing, and all of them is open."""
    return ElementTallies(
        sky=ElementSky(
            view=np.zeros((count, cells), np.float32),
            deviation=np.zeros((count, cells, HEMISPHERE_REPLICATES), np.int16),
        ),
        far_ground=np.zeros((count, cells), np.float32),
        open_share=np.ones((count, cells), np.float32),
    )
