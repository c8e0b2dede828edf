"""Laws of reflection: Lambertian, mirror, glossy, glass.

Each is a dataclass. `cosine_direction` draws Lambert's directions; the others have

    sample(arriving, draws)      from (n, 3) float and (n, 2 or more) uniform random numbers: one
                                 sampled direction
                                 `leaving` per row, (n, 3) float64, and its sample weight `share`,
                                 (n,) float64

The share is reflected radiance · cosine / density: its mean is the directional reflectance.
`albedo` is its upper bound. Directions are unit vectors in the local frame of the surface, whose
normal is z; both point away from it: `arriving` points to where the light comes from.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Lambertian:
    """Same radiance in all directions."""

    albedo: float


MIRRORED = np.array([-1.0, -1.0, 1.0])


@dataclass(frozen=True)
class Mirror:
    """Specular reflection with the same reflectance at all angles."""

    albedo: float

    def sample(self, arriving, draws):
        """Specular direction: leaving (n, 3) and share (n,) float64."""
        return arriving * MIRRORED, np.full(len(arriving), float(self.albedo))


@dataclass(frozen=True)
class Glossy:
    """Microfacets of constant reflectance, with a GGX distribution of normals.

    Only single scattering is modelled, so that a rough surface reflects less than its facets: under
    an isotropic sky 3 % less at a roughness of 0.1, 15 % at 0.3, 59 % at 1.

    References
    ----------
    B. Walter et al. (2007), Microfacet models for refraction through rough surfaces,
    doi:10.2312/EGWR/EGSR07/195-206. E. Heitz (2014), Understanding the masking-shadowing function
    in microfacet-based BRDFs, JCGT 3(2). E. Heitz (2018), Sampling the GGX distribution of visible
    normals, JCGT 7(4).
    """

    albedo: float  # of each facet
    roughness: float  # α of GGX: 0 would be a mirror, 1 is nearly diffuse

    def sample(self, arriving, draws):
        """Reflect at sampled visible facets: leaving (n, 3) and share (n,) float64, 0 below the
        surface.
        """
        facet = _sample_facets(arriving, self.roughness, draws.astype(float))
        leaving = 2 * (arriving * facet).sum(axis=1, keepdims=True) * facet - arriving
        above = np.where(leaving[:, 2] > 0, leaving[:, 2], 1.0)
        masked, shadowed = _hidden(arriving[:, 2], self.roughness), _hidden(above, self.roughness)
        return leaving, np.where(
            leaving[:, 2] > 0, self.albedo * (1 + masked) / (1 + masked + shadowed), 0.0
        )


def _hidden(cosine, roughness):
    """Λ of Smith's masking function: hidden over visible facet area in a direction."""
    tangent_squared = (1 - cosine**2) / cosine**2
    return (np.sqrt(1 + roughness**2 * np.maximum(tangent_squared, 0)) - 1) / 2


def _sample_facets(seen_from, roughness, draws):
    """Sample the distribution of visible normals: (n, 3) float64.

    Stretching turns the facets into a hemisphere; its projection along the view direction is half a
    disk and half an ellipse. A point is sampled there and projected back to the sphere.
    """
    # Stretched so that facets of any roughness become a hemisphere; its frame looks along the view.
    stretched = seen_from * [roughness, roughness, 1]
    stretched /= np.linalg.norm(stretched, axis=1, keepdims=True)
    level = np.hypot(stretched[:, 0], stretched[:, 1])
    upright = level < 1e-12
    sideways = np.column_stack([-stretched[:, 1], stretched[:, 0], np.zeros(len(level))])
    sideways = np.where(
        upright[:, None], [1.0, 0, 0], sideways / np.where(upright, 1, level)[:, None]
    )
    upwards = np.cross(stretched, sideways)
    # An even point on a disk, one half of it pressed to the ellipse that is seen.
    radius, angle = np.sqrt(draws[:, 0]), 2 * np.pi * draws[:, 1]
    across, along = radius * np.cos(angle), radius * np.sin(angle)
    share = (1 + stretched[:, 2]) / 2
    along = (1 - share) * np.sqrt(np.maximum(1 - across**2, 0)) + share * along
    height = np.sqrt(np.maximum(1 - across**2 - along**2, 0))
    # Back on the sphere, and shrunk to the roughness again.
    facet = across[:, None] * sideways + along[:, None] * upwards + height[:, None] * stretched
    facet = facet * [roughness, roughness, 1]
    facet[:, 2] = np.maximum(facet[:, 2], 0)
    return facet / np.linalg.norm(facet, axis=1, keepdims=True)


@dataclass(frozen=True)
class Glass:
    """Specular reflection that increases towards grazing incidence."""

    refractive_index: float = 1.52  # of soda-lime glass in visible light
    # between glass and air: 1 for a solid block, 2 for a pane, 4 for double glazing
    interfaces: int = 2
    albedo: float = 1.0  # at grazing incidence

    def sample(self, arriving, draws):
        """Specular direction with Fresnel reflectance: leaving (n, 3) and share (n,) float64."""
        return arriving * MIRRORED, reflect_interfaces(
            arriving[:, 2], self.refractive_index, self.interfaces
        )


def reflect_interfaces(cosine, refractive_index, interfaces):
    """Reflectance of parallel interfaces between air and clear glass for unpolarised light.

    Multiple reflections between them add up without interference, for each polarisation: R_k = k R
    / (1 + (k - 1) R).

    Parameters
    ----------
    cosine : (n,) float
        Of the angle of incidence.
    refractive_index : float
    interfaces : int

    Returns
    -------
    (n,) float64

    References
    ----------
    G. G. Stokes (1862), On the intensity of the light reflected from or transmitted through a pile
    of plates, Proceedings of the Royal Society of London 11.
    """
    single = fresnel(cosine, refractive_index)
    return (interfaces * single / (1 + (interfaces - 1) * single)).mean(axis=0)


def fresnel(cosine, refractive_index):
    """Reflectance of one interface, for polarisation perpendicular and parallel to the plane of
    incidence.

    Returns
    -------
    (2, n) float64
    """
    outside = np.clip(np.asarray(cosine, float), 0, 1)
    inside = np.sqrt(1 - (1 - outside**2) / refractive_index**2)  # Snell's law
    perpendicular = (outside - refractive_index * inside) / (outside + refractive_index * inside)
    parallel = (refractive_index * outside - inside) / (refractive_index * outside + inside)
    return np.stack([perpendicular**2, parallel**2])
