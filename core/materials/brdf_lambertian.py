"""Faces that look equally bright from everywhere.

Every `brdf_` file holds one law of reflection as a dataclass with the same three functions. Directions are unit vectors
in the frame of the face, whose normal is z; both point away from the face: `arriving` to where light comes from.

    sample(arriving, draws)      one direction `leaving` for each row, and the share of the light that takes it
    pdf(arriving, leaving)       density of those directions [1/sr], 0 where a law knows one direction only
    evaluate(arriving, leaving)  reflected radiance over arriving irradiance [1/sr]; 0 likewise

The share is evaluate · cos / pdf: its mean is the share of all light that is reflected. `albedo` is the most it can be.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Lambertian:
    """The same radiance in all directions."""

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
        """cos/π above the face: (n,) float64 [1/sr]."""
        return np.maximum(leaving[:, 2], 0) / np.pi

    def evaluate(self, arriving, leaving):
        """ρ/π above the face: (n,) float64 [1/sr]."""
        return np.where((arriving[:, 2] > 0) & (leaving[:, 2] > 0), self.albedo / np.pi, 0.0)
