"""`aoi`: light lost by its angle of incidence, to reflection by the glass of the module."""

from .effect import Effect

KEY = "aoi"
LAWS = {"module": "by the module's own law", "physical": "by Fresnel's equations", "ashrae": "by ASHRAE's law"}


def decide(inputs):
    """On unless it is switched off; what it changes is measured with the weather."""
    if not inputs.asked(KEY, True):
        return Effect(KEY, False, "as at normal incidence", "switched off", None)
    return Effect(KEY, True, LAWS[inputs.request.iam], "light that falls in at an angle is lost to reflection", 0.0)
