"""The error budget in words."""

import math

SPREAD = "standard error: the true value lies within it in 68 % of cases, within twice as much in 95 %"
LIMITS = "Errors of the city model, the weather and the module model come on top, and are usually larger."


def list_errors(budget):
    """Each part of the error budget: what it is, and how much.

    Parameters
    ----------
    budget : dict
        `error_budget` of summary.json.

    Returns
    -------
    list of (str, str)
        Parts that are unknown say so.
    """
    suns = budget.get("sun_sampling") or {}
    return [
        ("Mean over all surfaces: standard error of sampling", signed(budget.get("sampling_total"))),
        ("Single surface: standard error, typical (median by area)", signed(budget.get("sampling_median"))),
        ("Single surface: standard error, exceeded on 5 % of the area only", signed(budget.get("sampling_95"))),
        (
            "Choice of sun positions: shift of the mean, against every hour's sun",
            "unknown" if suns.get("bias") is None else f"{suns['bias']:+.2f} %".replace("-", "−"),
        ),
        ("Choice of sun positions: effect on a single surface (rms)", signed(suns.get("rms"))),
        ("Reflections beyond the last one computed would add at most", plain(budget.get("bounces"))),
        ("Size of the patches that reflect light, in percent of the reflected light", plain(budget.get("patches"))),
    ]


def signed(value):
    """A percentage either way."""
    return "unknown" if value is None else f"± {percent(value)}"


def plain(value):
    """A percentage."""
    return "unknown" if value is None else percent(value)


def percent(value):
    """Two digits that count: 0.017 %, 2.4 %."""
    if not value > 0:
        return "0 %"
    decimals = max(0, 1 - math.floor(math.log10(value)))
    return f"{value:.{min(decimals, 4)}f} %"


def summarise_errors(budget):
    """The error budget in one sentence.

    The error of the mean is √(chance² + shift of the suns²). That of a single surface holds what the suns do, but in
    files that do not tell it by groups: there it is √(median² + rms of the suns²).
    """
    suns = budget.get("sun_sampling") or {}
    whole = combine(budget.get("sampling_total"), suns.get("bias"))
    single = combine(budget.get("sampling_median"), 0.0 if "groups" in suns else suns.get("rms"))
    if whole is None or single is None:
        return "This run does not tell all errors of ray tracing and of the choice of sun positions."
    bounces = budget.get("bounces")
    rest = f"; reflections that were left out would add at most {percent(bounces)}" if bounces else ""
    return (
        "As far as ray tracing and the choice of sun positions go, the mean over all surfaces is known to "
        f"± {percent(whole)} and the hours of a single surface typically to ± {percent(single)} (one standard error)"
        f"{rest}."
    )


def combine(*parts):
    """Root of the sum of squares; None where a part is unknown."""
    return None if any(part is None for part in parts) else math.hypot(*parts)
