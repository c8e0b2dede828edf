"""Result of tracing, independent of weather: relative irradiance of every surface, its errors, and
how it was made.
"""

from dataclasses import asdict, dataclass, field, fields, replace

import numpy as np

from ..city.building_facts import BuildingFacts
from ..city.grid_cells import Outlines
from ..city.scene import Surfaces
from ..city.site import Site
from ..settings.errors import build_from
from ..sky.horizon import TerrainHorizon
from ..sky.horizon_band import SOURCES
from ..sun.suns import Suns

OF_SOURCE = "_rays"  # after the name of a traced source: its entry in files


@dataclass(frozen=True)
class TraceRecord:
    """Record of one run of an estimator; None for what does not apply to it."""

    request: dict  # all settings by name
    effects: list  # of dict, decisions of the plan
    max_bounces: int
    brightest_albedo: float
    patches: int
    threads: int
    seconds: dict  # stage -> [s]
    embree_thread_seconds: float  # [s] sum over threads
    last_bounce_share_diffuse: float  # of all light
    last_bounce_share_direct: float
    processor_seconds: dict | None = None  # stage -> [s] sum over threads
    engine: str | None = None  # packets or rays
    hemisphere_rays: int | None = None
    # name of each traced source of light in the sky -> rays
    source_rays: dict = field(default_factory=dict)
    shadow_rays: int | None = None
    discretisation_error: dict | None = None  # diffuse, direct: see `radiosity.gather_diffuse`
    degrees_of_freedom: dict | None = None  # of the standard errors' replicates
    photons_per_source: int | None = None  # forward
    rays: int | None = None  # forward
    photons: dict | None = None  # forward: where the light of each source went
    interrupted: dict | None = None  # suns_traced, of: if fewer suns were kept than requested
    # as of `accuracy.sun_sampling.measure_ways`
    sun_sampling: dict | None = None
    rounds: int = 1  # samples of all rounds that were merged, in units of the first round's
    standard_error_unknown: str | None = None  # which standard error, and why
    # Kind and orientation, or "all" -> sky, each source and suns -> share of its light that further
    # reflections add at most, None: no bound is known. None: the run does not tell.
    cut_reflections: dict | None = None

    def as_dict(self):
        """Plain types by name, without what does not apply."""
        values = {name: value for name, value in asdict(self).items() if value is not None}
        rays = values.pop("source_rays")
        return values | {name + OF_SOURCE: count for name, count in rays.items()}

    @staticmethod
    def from_dict(values):
        """TraceRecord from the result of `as_dict`.

        Raises
        ------
        ValueError
            Names the missing or unknown key.
        """
        rays = {name: values[name + OF_SOURCE] for name in SOURCES if name + OF_SOURCE in values}
        values = {
            name: value
            for name, value in values.items()
            if name.removesuffix(OF_SOURCE) not in rays
        }
        return build_from(TraceRecord, values | {"source_rays": rays})


def note_interruption(kept, count):
    """Entry of the record if fewer suns were kept than requested: dict or None."""
    return {"suns_traced": kept, "of": count} if kept < count else None


@dataclass
class ErrorParts:
    """Parts of the standard errors of n surfaces that are not independent between surfaces.

    The rest of each standard error is noise of the surface's own rays. "Direct" is the mean
    weighted with the suns.
    """

    # (n, r) deviations of r replicates of the light that other surfaces re-emit
    diffuse_passed_on: np.ndarray
    direct_passed_on: np.ndarray  # (n, r)
    # (n,) signed, error from light that is uneven within cells of patches
    diffuse_discretisation: np.ndarray
    direct_discretisation: np.ndarray  # (n,)
    covariance: np.ndarray  # (n,) of own noise in diffuse and in direct light
    # (n,) the part of the variance of own noise in direct light that is from shadow points
    direct_points: np.ndarray

    def scale_direct(self, growth):
        """Error parts with the errors of direct light multiplied by `growth`."""
        return replace(
            self,
            direct_passed_on=growth * self.direct_passed_on,
            direct_discretisation=growth * self.direct_discretisation,
            covariance=growth * self.covariance,
            direct_points=growth**2 * self.direct_points,
        )


@dataclass
class SourceLight:
    """Relative irradiance of n surfaces by a traced source of light in the sky, in its unit
    (`sky.horizon_band`).
    """

    # (n,) without reflections, at most 1; where all of it is free, `HorizonBand.unshaded`
    view_factor: np.ndarray
    relative: np.ndarray  # (n,) reflections included
    standard_error: np.ndarray  # (n,) of `relative`


@dataclass
class Transfer:
    """Relative irradiance of n surfaces: diffuse per DHI, direct per DNI for each of s suns.

    The direct irradiance at any time is stored in three parts, since cosines can be computed
    exactly for every hour: `aoi_projection · visible_share` (direct sunlight),
    `far_ground_view_factor · ground_albedo · cos(zenith)` (from the open ground beyond the scene),
    and `direct_reflected` (all other reflections, as traced for the nearest suns).
    """

    surfaces: Surfaces
    site: Site
    suns: Suns
    covered_share: np.ndarray  # (n,) share of the surface that lies inside or under buildings
    sky_view_factor: np.ndarray  # (n,) cosine-weighted visible share of the sky
    # (n,) cosine-weighted visible share of the open ground; 0 without far ground
    far_ground_view_factor: np.ndarray
    ground_albedo: float
    diffuse_relative: np.ndarray  # (n,) per DHI, reflections included
    diffuse_relative_standard_error: np.ndarray  # (n,)
    # (n, s) float32, memory-mapped if large; sunlit share of the surface, by points
    visible_share: np.ndarray
    direct_reflected: np.ndarray  # (n, s) float32, the same; per DNI
    # (n,) of direct_relative weighted with suns.weight; NaN: unknown
    direct_annual_standard_error: np.ndarray
    record: TraceRecord | None = None  # how it was made; None: unknown
    # (n,) used for tracing; of non-diffuse surfaces the largest; None: unknown
    albedo: np.ndarray | None = None
    # (n,) str, material used for tracing, "" if only an albedo was given
    material: list | None = None
    # of dict: all albedos and materials, of `read_albedo.describe_albedo`
    albedos: list | None = None
    error_parts: ErrorParts | None = None  # None: the standard errors are own noise only
    # name -> SourceLight, for sources of `sky.sky_models` that were traced
    sources: dict = field(default_factory=dict)
    outlines: Outlines | None = None  # shapes of the surfaces, for plans; None: unknown
    # the same with deciduous trees without leaves; None: one state all year
    bare: "Transfer | None" = None
    leaf_months: tuple = ()  # 1 to 12, in which this state holds if there is a bare one
    # (n, k) share that is open, but looks at a face from less than each clearance
    no_room: np.ndarray | None = None
    clearances: tuple = ()  # (k,) [m]; none: unknown
    # (n, k) shapely geometries of what is covered or has no room, of `taken_parts.outline_taken`,
    # where a surface carries modules on the rest; None: unknown
    taken_parts: np.ndarray | None = None
    # (n,) share that has no room at the run's own clearance, whose light is not in the means; None:
    # its light is in them
    left_out: np.ndarray | None = None
    # (n, s, d) uint8, what strings lose at each sun, as of `string_shade.add_losses`; None: unknown
    string_loss: np.ndarray | None = None
    # hides suns, hour by hour; `visible_share` is without it; None: level
    terrain: TerrainHorizon | None = None
    # of the city before an edit, solved again with more light; None: as it was
    base: "Transfer | None" = None
    notes: tuple = ()  # of str: what its file, written by another version, lacks
    # what the files tell of buildings in words; None: nothing
    facts: BuildingFacts | None = None

    def sun_sampling_share(self, part):
        """Error of the choice of suns, as a share of full load hours: float; 0 if it was not
        measured.

        `part` is "rms" for a surface, "of_groups" for the mean of a kind and orientation.
        """
        measured_errors = (self.record and self.record.sun_sampling) or {}
        # Records of earlier versions have the shift of all surfaces together.
        return abs(measured_errors.get(part, measured_errors.get("bias", 0.0))) / 100

    @property
    def on_disk(self):
        """Whether its matrices of surfaces and suns are so large that they lie on disk."""
        return isinstance(self.visible_share, np.memmap)

    @property
    def shapes_known(self):
        """Whether the shapes of surfaces are known, and of what is taken of them."""
        return self.outlines is not None and self.taken_parts is not None

    def taken_at(self, clearance):
        """Shapes of what is covered or has no room at one of `clearances`: (n,)."""
        return self.taken_parts[:, self.clearances.index(clearance)]

    @property
    def edge_distance(self):
        """Of the surfaces, (n,) [m]: see `measure_edge_distance`; NaN where it is unknown, too."""
        known = self.surfaces.edge_distance
        return np.full(len(self.surfaces), np.nan) if known is None else known

    def take(self, rows):
        """Transfer of some surfaces only; outlines are left out.

        Parameters
        ----------
        rows : (k,) int

        Returns
        -------
        Transfer
        """
        taken = {
            name: _take_fields(getattr(self, name), rows) for name in ("surfaces", "error_parts")
        }
        taken["sources"] = {name: _take_fields(light, rows) for name, light in self.sources.items()}
        own = {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray)}
        taken |= {name: np.asarray(value[rows]) for name, value in own.items()}
        material = self.material and [self.material[k] for k in rows]
        bare = self.bare and self.bare.take(rows)
        return replace(self, **taken, material=material, bare=bare, outlines=None)

    @property
    def known_parts(self):
        """Parts of the standard errors: ErrorParts, of own noise only where they are not known."""
        count = len(self.surfaces)
        return self.error_parts or ErrorParts(
            np.zeros((count, 2)), np.zeros((count, 2)), *np.zeros((4, count))
        )

    @property
    def own_diffuse(self):
        """Variance of `diffuse_relative` from the surface's own rays: (n,) [–]."""
        parts = self.known_parts
        error = self.diffuse_relative_standard_error
        return _own_variance(error, parts.diffuse_passed_on, parts.diffuse_discretisation)

    @property
    def own_direct(self):
        """Variance of the annual mean of direct irradiance per DNI from own rays: (n,) [–]; NaN if
        it is unknown.
        """
        parts = self.known_parts
        error = self.direct_annual_standard_error
        return _own_variance(error, parts.direct_passed_on, parts.direct_discretisation)


def _own_variance(standard_error, transported, discretisation):
    """Variance from own rays: squared standard error, (n,), less the variance by replicates (n, r)
    and discretisation (n,).
    """
    whole = np.asarray(standard_error, float) ** 2
    return np.maximum(whole - variance_of_mean(transported) - discretisation**2, 0)


def variance_of_mean(replicates):
    """Variance of the mean of independent replicates, along the last axis, in the square of their
    unit.
    """
    return replicates.var(axis=-1, ddof=1, dtype=float) / replicates.shape[-1]


def _take_fields(part, rows):
    """Some rows of each field of a dataclass whose fields are arrays or lists with as many; None of
    None.
    """
    if part is None:
        return None
    values = {part_field.name: getattr(part, part_field.name) for part_field in fields(part)}
    lists = {
        name: [value[k] for k in rows] for name, value in values.items() if isinstance(value, list)
    }
    return replace(
        part, **{n: v[rows] for n, v in values.items() if isinstance(v, np.ndarray)}, **lists
    )
