"""Glossy surfaces: microfacets with a GGX distribution of normals.

See `brdf_lambertian` for the three functions. Only single scattering is modelled, so that a rough surface reflects
less than its facets: under an isotropic sky 3 % less at a roughness of 0.1, 15 % at 0.3, 59 % at 1.

References
----------
B. Walter et al. (2007), Microfacet models for refraction through rough surfaces, doi:10.2312/EGWR/EGSR07/195-206.
E. Heitz (2014), Understanding the masking-shadowing function in microfacet-based BRDFs, JCGT 3(2).
E. Heitz (2018), Sampling the GGX distribution of visible normals, JCGT 7(4).
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Glossy:
    """Microfacets of constant reflectance."""

    albedo: float  # of each facet
    roughness: float  # α of GGX: 0 would be a mirror, 1 is nearly diffuse

    def sample(self, arriving, draws):
        """Reflect at sampled visible facets: leaving (n, 3) and share (n,) float64, 0 below the surface."""
        facet = sample_facets(arriving, self.roughness, draws.astype(float))
        leaving = 2 * (arriving * facet).sum(axis=1, keepdims=True) * facet - arriving
        above = np.where(leaving[:, 2] > 0, leaving[:, 2], 1.0)
        masked, shadowed = hidden(arriving[:, 2], self.roughness), hidden(above, self.roughness)
        return leaving, np.where(leaving[:, 2] > 0, self.albedo * (1 + masked) / (1 + masked + shadowed), 0.0)

    def pdf(self, arriving, leaving):
        """Density of visible normals times the Jacobian of reflection: (n,) float64 [1/sr]."""
        facet = halfway(arriving, leaving)
        density = facet_density(facet, self.roughness) / (1 + hidden(arriving[:, 2], self.roughness))
        return np.where(leaving[:, 2] > 0, density / (4 * arriving[:, 2]), 0.0)

    def evaluate(self, arriving, leaving):
        """ρ D G / (4 cos cos): (n,) float64 [1/sr]."""
        both = (arriving[:, 2] > 0) & (leaving[:, 2] > 0)
        one, other = np.where(both, arriving[:, 2], 1.0), np.where(both, leaving[:, 2], 1.0)
        open_share = 1 / (1 + hidden(one, self.roughness) + hidden(other, self.roughness))
        facets = facet_density(halfway(arriving, leaving), self.roughness)
        return np.where(both, self.albedo * facets * open_share / (4 * one * other), 0.0)


def halfway(arriving, leaving):
    """Half vector of two directions: (n, 3) float64."""
    facet = arriving + leaving
    return facet / np.maximum(np.linalg.norm(facet, axis=1, keepdims=True), np.finfo(float).tiny)


def facet_density(facet, roughness):
    """Distribution of normals D: facet area per solid angle of the normal [1/sr]."""
    squeezed = facet[:, 2] ** 2 * (roughness**2 - 1) + 1
    return np.where(facet[:, 2] > 0, roughness**2 / (np.pi * squeezed**2), 0.0)


def hidden(cosine, roughness):
    """Λ of Smith's masking function: hidden over visible facet area in a direction."""
    tangent_squared = (1 - cosine**2) / cosine**2
    return (np.sqrt(1 + roughness**2 * np.maximum(tangent_squared, 0)) - 1) / 2


def sample_facets(seen_from, roughness, draws):
    """Sample the distribution of visible normals: (n, 3) float64.

    Stretching turns the facets into a hemisphere; its projection along the view direction is half a disk and half an
    ellipse. A point is sampled there and projected back to the sphere.
    """
    stretched = seen_from * [roughness, roughness, 1]
    stretched /= np.linalg.norm(stretched, axis=1, keepdims=True)
    level = np.hypot(stretched[:, 0], stretched[:, 1])
    upright = level < 1e-12
    sideways = np.column_stack([-stretched[:, 1], stretched[:, 0], np.zeros(len(level))])
    sideways = np.where(upright[:, None], [1.0, 0, 0], sideways / np.where(upright, 1, level)[:, None])
    upwards = np.cross(stretched, sideways)
    radius, angle = np.sqrt(draws[:, 0]), 2 * np.pi * draws[:, 1]
    across, along = radius * np.cos(angle), radius * np.sin(angle)
    share = (1 + stretched[:, 2]) / 2
    along = (1 - share) * np.sqrt(np.maximum(1 - across**2, 0)) + share * along
    height = np.sqrt(np.maximum(1 - across**2 - along**2, 0))
    facet = across[:, None] * sideways + along[:, None] * upwards + height[:, None] * stretched
    facet = facet * [roughness, roughness, 1]
    facet[:, 2] = np.maximum(facet[:, 2], 0)
    return facet / np.linalg.norm(facet, axis=1, keepdims=True)
