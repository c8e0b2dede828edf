"""How a Transfer was made: settings, decisions, counts and measurements, so that the run can be judged and repeated."""

from dataclasses import asdict, dataclass, field, fields

from ..sun.horizon_band import SOURCES

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
    source_rays: dict = field(default_factory=dict)  # name of each traced source of light in the sky -> rays
    shadow_rays: int | None = None
    discretisation_error: dict | None = None  # diffuse, direct: see `radiosity.gather_diffuse`
    degrees_of_freedom: dict | None = None  # of the standard errors' replicates
    photons_per_source: int | None = None  # forward
    rays: int | None = None  # forward
    photons: dict | None = None  # forward: where the light of each source went
    interrupted: dict | None = None  # suns_traced, of: if fewer suns were kept than requested
    sun_sampling: dict | None = None  # bias, rms [% of full load hours], patches; the same by groups
    rounds: int = 1  # samples of all rounds that were merged, in units of those of the first
    standard_error_unknown: str | None = None  # which standard error, and why

    def as_dict(self):
        """Plain types by name, without what does not apply."""
        values = {name: value for name, value in asdict(self).items() if value is not None}
        rays = values.pop("source_rays")
        return values | {name + OF_SOURCE: count for name, count in rays.items()}


def record_of_dict(values):
    """TraceRecord from the result of `as_dict`.

    Raises
    ------
    KeyError
        Names the missing or unknown key.
    """
    rays = {name: values[name + OF_SOURCE] for name in SOURCES if name + OF_SOURCE in values}
    values = {name: value for name, value in values.items() if name.removesuffix(OF_SOURCE) not in rays}
    known = {one.name for one in fields(TraceRecord)} - {"source_rays"}
    unknown = sorted(set(values) - known)
    if unknown:
        raise KeyError(unknown[0])
    try:
        return TraceRecord(**values, source_rays=rays)
    except TypeError as error:
        raise KeyError(str(error)) from error


def note_interruption(kept, count):
    """Entry of the record if fewer suns were kept than requested: dict or None."""
    return {"suns_traced": kept, "of": count} if kept < count else None
