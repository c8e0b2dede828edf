"""A first look: full load hours by few rays and four days, to be seen while the light is traced as the settings say."""

from dataclasses import replace

from ..core.settings.progress import CancelledError
from .compute_energy import WeighEnergy
from .job import share_of_step
from .step_state import forget_step
from .summarise import INTERRUPTED
from .trace_city import TraceCity, count_rays

LOOK = {"samples": 16, "shadow_samples": 4, "suns": "days:4", "estimator": "gather"}
WORTH = 8  # so many times its rays must a trace have for a look before it
STAGE = "first look"
TOLD = "First look, by 16 rays, 4 shadow points and 4 days. Trace light computes it as set in its step"


def settings_of_look(request):
    """Request of a look at a city, or None where tracing as asked for takes hardly longer.

    Parameters
    ----------
    request : core.request.Request

    Returns
    -------
    core.request.Request or None
    """
    look = replace(request, **LOOK, target_error=None, time_budget=None)
    worth = request.estimator == "forward" or sum(count_rays(request)) > WORTH * sum(count_rays(look))
    return look if worth else None


def take_look(session, request, progress):
    """Trace and weigh a city with few rays, as one stage of a longer task.

    Parameters
    ----------
    session : Session
        With its scene.
    request : core.request.Request
        Of `settings_of_look`.
    progress : callable
        See `core.progress`.

    Returns
    -------
    traced, weighed : tuple
        Of `TraceCity.work` and `WeighEnergy.work`.

    Raises
    ------
    CancelledError
        At any report: nothing of it is kept.
    """
    stages, share = TraceCity.expect(None, (session, request, None)) | WeighEnergy.stages, 0.0

    def report(stage, done, total, unit):
        nonlocal share
        share = share_of_step(stages, stage, done / total if total else 0.0, share)
        progress(STAGE, share, 1.0, "")

    traced = TraceCity.work((session, request, []), report)
    if traced[2].record.interrupted:
        raise CancelledError
    return traced, WeighEnergy.work((replace(session, transfer=traced[2]), None, request), report)


def tell_look(city):
    """Say on a city that its results are those of a first look: its light is still to be traced."""
    city[INTERRUPTED] = TOLD
    for step in ("trace", "energy"):
        forget_step(city, step)
