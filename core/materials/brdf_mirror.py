"""Mirrors (ideal specular reflection). See `brdf_lambertian` for the three functions."""

from dataclasses import dataclass

import numpy as np

MIRRORED = np.array([-1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Mirror:
    """Specular reflection with the same reflectance at all angles."""

    albedo: float

    def sample(self, arriving, draws):
        """Specular direction: leaving (n, 3) and share (n,) float64."""
        return arriving * MIRRORED, np.full(len(arriving), float(self.albedo))

    def pdf(self, arriving, leaving):
        """Zero, as the distribution is a delta function: (n,)."""
        return np.zeros(len(leaving))

    def evaluate(self, arriving, leaving):
        """Zero in all other directions: (n,)."""
        return np.zeros(len(leaving))
