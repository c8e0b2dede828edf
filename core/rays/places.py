"""Points on triangles: where rays hit them, and where light leaves them."""

from typing import NamedTuple

import numpy as np


class Places(NamedTuple):
    """Points on triangles, or on the patches that are these triangles."""

    triangle: np.ndarray  # (m,) int, -1 for none
    b1: np.ndarray  # (m,) float, barycentric coordinate for the second vertex; undefined for none
    b2: np.ndarray  # (m,) float, for the third vertex

    def take(self, chosen):
        """Some of them, or all in another shape: Places."""
        return Places(*(part[chosen] for part in self))
