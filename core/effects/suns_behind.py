"""`suns-behind`: shadow rays to suns behind a patch, which cannot be seen from it."""

from .effect import Effect

KEY = "suns-behind"


def decide(inputs):
    """Off unless asked for: such rays only cost time."""
    if inputs.request.estimator == "forward":
        reason = "the forward estimator follows light from its source"
        return Effect(KEY, False, "photons that meet a back end there", reason, 0.0)
    if inputs.asked(KEY):
        return Effect(KEY, True, "a shadow ray for every sun", "switched on", 0.0)
    return Effect(KEY, False, "no shadow ray for a sun behind a face", "it cannot be seen", 0.0)
