"""Which model of the sky weighs a Transfer."""

from .light_sources import model_traced

EFFECT = "perez"  # of the plan


def choose_sky(request, transfer):
    """Model of the sky: what is asked for, or else what the Transfer was traced for.

    Parameters
    ----------
    request : Request
        Its `sky` and `effects` count.
    transfer : Transfer

    Returns
    -------
    str
        A key of `sky_models.MODELS`.
    """
    asked = request.effects.get(EFFECT)
    if asked is None and request.sky != "auto":
        return request.sky
    if asked is None:
        return model_traced(transfer.sources)
    return "perez" if asked else "isotropic"
