"""Faces that reflect like a mirror. See `brdf_lambertian` for the three functions."""

from dataclasses import dataclass

import numpy as np

MIRRORED = np.array([-1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Mirror:
    """One direction, and the same share of light from everywhere."""

    albedo: float

    def sample(self, arriving, draws):
        """The mirrored direction: leaving (n, 3) and share (n,) float64."""
        return arriving * MIRRORED, np.full(len(arriving), float(self.albedo))

    def pdf(self, arriving, leaving):
        """No density: (n,) zeros."""
        return np.zeros(len(leaving))

    def evaluate(self, arriving, leaving):
        """Nothing in any other direction: (n,) zeros."""
        return np.zeros(len(leaving))
