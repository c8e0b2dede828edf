"""`temperature`: cells lose power as they get warm."""

from .effect import Effect

KEY = "temperature"


def decide(inputs):
    """On unless it is switched off; what it changes is measured with the weather."""
    if not inputs.asked(KEY, True):
        return Effect(KEY, False, "cells always at 25 °C", "switched off", None)
    return Effect(KEY, True, "cells warmed by air and light", "power falls as cells get warm", 0.0)
