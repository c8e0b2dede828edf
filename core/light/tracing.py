"""What all stages of the gather estimator share."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from ..request import Request
from .patches import Patches
from .plan_effects import EffectPlan
from .ray_scene import RayScene


@dataclass
class Tracing:
    """What all stages of one run share."""

    ray_scene: RayScene
    patches: Patches
    plan: EffectPlan
    request: Request
    merge: sparse.csr_matrix  # (n, p), averages patches over their surface
    eligible_area: np.ndarray  # (n,) float64 [m²], 0 for surfaces that are not eligible
    threads: int
    progress: Callable
