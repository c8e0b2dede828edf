"""`spectrum`: the influence of the spectrum on the current."""

from .effect import Effect

KEY = "spectrum"


def decide(inputs):
    """On unless it is switched off; what it changes is measured with the weather."""
    if not inputs.asked(KEY, True):
        return Effect(KEY, False, "as under the standard spectrum", "switched off", None)
    return Effect(KEY, True, "Sandia's f₁ by air mass", "the current depends on the colour of the light", 0.0)
