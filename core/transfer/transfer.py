"""Result of tracing, independent of weather: relative irradiance of every surface."""

from dataclasses import dataclass, field, replace

import numpy as np

from ..city.grid_cells import Outlines
from ..city.scene import Site, Surfaces
from ..sun.horizon import TerrainHorizon
from ..sun.suns import Suns
from .patch_light import PatchLight
from .trace_record import TraceRecord


@dataclass
class ErrorParts:
    """Parts of the standard errors of n surfaces that are not independent between surfaces.

    The rest of each standard error is noise of the surface's own rays. "Direct" is the mean weighted with the suns.
    """

    diffuse_passed_on: np.ndarray  # (n, r) deviations of r replicates of the light that other surfaces re-emit
    direct_passed_on: np.ndarray  # (n, r)
    diffuse_discretisation: np.ndarray  # (n,) signed, error from light that is uneven within cells of patches
    direct_discretisation: np.ndarray  # (n,)
    covariance: np.ndarray  # (n,) of own noise in diffuse and in direct light
    direct_points: np.ndarray  # (n,) the part of the variance of own noise in direct light that is from shadow points


def scale_direct(parts, growth):
    """Error parts with those of direct light multiplied by `growth`."""
    return replace(
        parts,
        direct_passed_on=growth * parts.direct_passed_on,
        direct_discretisation=growth * parts.direct_discretisation,
        covariance=growth * parts.covariance,
        direct_points=growth**2 * parts.direct_points,
    )


@dataclass
class SourceLight:
    """Relative irradiance of n surfaces by a traced source of light in the sky, in its unit (`sun.horizon_band`)."""

    view_factor: np.ndarray  # (n,) without reflections, at most 1; where all of it is free, `HorizonBand.unshaded`
    relative: np.ndarray  # (n,) reflections included
    standard_error: np.ndarray  # (n,) of `relative`


@dataclass
class Transfer:
    """Relative irradiance of n surfaces: diffuse per DHI, direct per DNI for each of s suns.

    The direct irradiance at any time is stored in three parts, since cosines can be computed exactly for every hour:
    `aoi_projection · visible_share` (direct sunlight), `far_ground_view_factor · ground_albedo · cos(zenith)` (from the
    open ground beyond the scene), and `direct_reflected` (all other reflections, as traced for the nearest suns).
    """

    surfaces: Surfaces
    site: Site
    suns: Suns
    covered_share: np.ndarray  # (n,) share of the surface that lies inside or under buildings
    sky_view_factor: np.ndarray  # (n,) cosine-weighted visible share of the sky
    far_ground_view_factor: np.ndarray  # (n,) cosine-weighted visible share of the open ground; 0 without far ground
    ground_albedo: float
    diffuse_relative: np.ndarray  # (n,) per DHI, reflections included
    diffuse_relative_standard_error: np.ndarray  # (n,)
    visible_share: np.ndarray  # (n, s) float32, memory-mapped if large; sunlit share of the surface, by points
    direct_reflected: np.ndarray  # (n, s) float32, the same; per DNI
    direct_annual_standard_error: np.ndarray  # (n,) of direct_relative weighted with suns.weight; NaN: unknown
    record: TraceRecord | None = None  # how it was made; None: unknown
    albedo: np.ndarray | None = None  # (n,) used for tracing; of non-diffuse surfaces the largest; None: unknown
    material: list | None = None  # (n,) str, material used for tracing, "" if only an albedo was given
    albedos: list | None = None  # of dict: all albedos and materials, of `read_albedo.describe_albedo`
    error_parts: ErrorParts | None = None  # None: the standard errors are own noise only
    sources: dict = field(default_factory=dict)  # name -> SourceLight, those of `sky.light_sources` that were traced
    outlines: Outlines | None = None  # shapes of the surfaces, for plans; None: unknown
    bare: "Transfer | None" = None  # the same with deciduous trees without leaves; None: one state all year
    leaf_months: tuple = ()  # 1 to 12, in which this state holds if there is a bare one
    patch_light: PatchLight | None = None  # for further rounds of the same run; not kept in files
    terrain: TerrainHorizon | None = None  # hides suns, hour by hour; `visible_share` is without it; None: level
