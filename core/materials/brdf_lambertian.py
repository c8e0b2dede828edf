"""Lambertian (ideally diffuse) surfaces.

Every `brdf_` file has one BRDF as a dataclass with the same three functions. Directions are unit vectors in the local
frame of the surface, whose normal is z; both point away from it: `arriving` points to where the light comes from.

    sample(arriving, draws)      one sampled direction `leaving` per row, and its sample weight `share`
    pdf(arriving, leaving)       probability density of those directions [1/sr]; 0 for specular (delta) BRDFs
    evaluate(arriving, leaving)  reflected radiance over incident irradiance [1/sr]; 0 likewise

The share is evaluate · cos / pdf: its mean is the directional reflectance. `albedo` is its upper bound.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Lambertian:
    """Same radiance in all directions."""

    albedo: float

    def sample(self, arriving, draws):
        """Cosine-distributed directions.

        Parameters
        ----------
        arriving : (n, 3) float
        draws : (n, 2 or more) float
            Uniform random numbers.

        Returns
        -------
        leaving : (n, 3) float64
        share : (n,) float64
        """
        radius, angle = np.sqrt(draws[:, 0].astype(float)), 2 * np.pi * draws[:, 1].astype(float)
        leaving = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.sqrt(1 - radius**2)])
        return leaving, np.full(len(leaving), float(self.albedo))

    def pdf(self, arriving, leaving):
        """cos/π above the surface: (n,) float64 [1/sr]."""
        return np.maximum(leaving[:, 2], 0) / np.pi

    def evaluate(self, arriving, leaving):
        """ρ/π above the surface: (n,) float64 [1/sr]."""
        return np.where((arriving[:, 2] > 0) & (leaving[:, 2] > 0), self.albedo / np.pi, 0.0)
