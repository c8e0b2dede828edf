"""How a Transfer was made: what was asked, decided, traced and measured, so that the run can be judged and repeated."""

from dataclasses import asdict, dataclass, fields


@dataclass(frozen=True)
class TraceRecord:
    """Account of one run of an estimator; what does not apply to it is None."""

    request: dict  # all settings by name
    effects: list  # of dict, the plan's decisions
    max_bounces: int
    brightest_albedo: float
    patches: int
    threads: int
    seconds: dict  # stage -> [s]
    embree_thread_seconds: float  # [s] summed over the threads
    last_bounce_share_diffuse: float  # of all light
    last_bounce_share_direct: float
    engine: str | None = None  # packets or rays
    hemisphere_rays: int | None = None
    shadow_rays: int | None = None
    discretisation_error: dict | None = None  # diffuse, direct: see `radiosity.gather_diffuse`
    degrees_of_freedom: dict | None = None  # of the standard errors' replicates
    photons_per_source: int | None = None  # forward
    rays: int | None = None  # forward
    photons: dict | None = None  # forward: where the light of each source went
    interrupted: dict | None = None  # suns_traced, of: where fewer suns were kept than asked for
    sun_sampling: dict | None = None  # bias, rms [% of full load hours], patches; the same by groups
    standard_error_unknown: str | None = None  # which one, and why

    def as_dict(self):
        """Plain types by name, without what does not apply."""
        return {name: value for name, value in asdict(self).items() if value is not None}


def record_of_dict(values):
    """TraceRecord from what `as_dict` gave.

    Raises
    ------
    KeyError
        Names what is missing or unknown.
    """
    known = {one.name for one in fields(TraceRecord)}
    unknown = sorted(set(values) - known)
    if unknown:
        raise KeyError(unknown[0])
    try:
        return TraceRecord(**values)
    except TypeError as error:
        raise KeyError(str(error)) from error


def note_interruption(kept, count):
    """What the record says where fewer suns were kept than asked for: dict or None."""
    return {"suns_traced": kept, "of": count} if kept < count else None
