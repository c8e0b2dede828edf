"""`trees`: crowns that let part of the light through, in leaf and bare."""

from ..city.foliage import choose_foliage
from .effect import Effect

KEY = "trees"


def decide(inputs):
    """On where the model has vegetation: no bound is known on what a tree takes from the wall behind it."""
    crowns, request = inputs.scene.trees, inputs.request
    if crowns is None:
        return Effect(KEY, False, "none", "there is no vegetation in the model", 0.0)
    if not inputs.asked(KEY, True):
        return Effect(KEY, False, f"none of {len(crowns):,} trees", "switched off", None)
    foliage = choose_foliage(crowns, request, inputs.scene.site.latitude)
    months = f"leaves in months {', '.join(map(str, foliage.months))}" if foliage.seasonal else "one state all year"
    extent = f"{len(crowns):,} trees, {months}"
    reason = "the model has vegetation; light that leaves scatter is left out"
    return Effect(KEY, True, extent, reason, None, setting=foliage)
