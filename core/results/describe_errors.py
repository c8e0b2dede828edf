"""How sure a run is, in words and as rows of a table."""

import math

from .read_results import kind_title
from .words import number, say

SPREAD = (
    "standard error: the true value lies within it in 68 % of cases, within twice as much in 95 %"
)
OF_RECORDS = (
    "The error of the weather is larger: a single year differs from the mean of many by 1 to 8 %, "
    "and records of "
    "the light are off by some percent."
)
LIMITS = "Errors of the city model and the module model come on top, and are usually larger."


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
    # Parts in the order of what a reader asks first: the mean, a single surface, each other height
    # of windows that was tried, the suns, reflections that were cut, strings, patches.
    suns = budget.get("sun_sampling") or {}
    shift = suns.get("bias")
    return [
        (
            say("Mean over all surfaces: standard error of sampling"),
            percent(budget.get("sampling_total"), "± "),
        ),
        (
            say("Single surface: standard error, typical (median by area)"),
            percent(budget.get("sampling_median"), "± "),
        ),
        (
            say("Single surface: standard error, exceeded on 5 % of the area only"),
            percent(budget.get("sampling_95"), "± "),
        ),
        *(
            (
                say(
                    "Energy with windows of {band} m in each storey",
                    band=plain_number(one["window_band"]),
                ),
                f"{number(one['percent'], '+,.1f')} %",
            )
            for one in budget.get("windows") or ()
        ),
        (
            say("Choice of sun positions: shift of the mean, against many more suns"),
            say("unknown") if shift is None else f"{number(shift, '+,.2f')} %",
        ),
        (
            say("Choice of sun positions: effect on a single surface (rms)"),
            percent(suns.get("rms"), "± "),
        ),
        (say("Reflections beyond the last one computed would add at most"), _describe_cut(budget)),
        (
            say("Strings in shade lose more than single modules by"),
            percent(budget.get("string_shade")),
        ),
        (
            say("Size of the patches that reflect light, in percent of the reflected light"),
            percent(budget.get("patches")),
        ),
    ]


def _describe_cut(budget):
    """What cut reflections would add at most, to all surfaces and to the group that they add most
    to.
    """
    groups = {
        name: parts["cut_reflections"]["percent"]
        for name, parts in (budget.get("groups") or {}).items()
    }
    known = {name: most for name, most in groups.items() if most is not None}
    words = percent(budget.get("bounces"))
    if not known or budget.get("bounces") is None:
        return words
    name = max(known, key=known.get)
    kind, _, side = name.partition(" ")
    group = say(kind_title(kind)) + ("" if side in ("", "none") else f" ({say(side)})")
    return say(
        "{whole}; most of all to {group}: {share}",
        whole=words,
        group=group,
        share=percent(known[name]),
    )


def percent(value, sign=""):
    """Two digits that count: 0.017 %, 2.4 %; "unknown" of None."""
    if value is None:
        return say("unknown")
    if not value > 0:
        return f"{sign}0 %"
    decimals = max(0, 1 - math.floor(math.log10(value)))
    return f"{sign}{number(value, f'.{min(decimals, 4)}f')} %"


def summarise_errors(summary):
    """The error budget in one sentence, and how far off the weather may be, beside which it is
    small.

    The error of the mean is √(chance² + shift of the suns²). That of a single surface holds what
    the suns do.
    """
    budget = summary["error_budget"]
    # The built-in climate has an error of its own, other weather the error of records. See
    # benchmarks/results/climate.md, stations that do not contradict themselves.
    of_climate = (
        "The error of the weather is much larger: with the built-in climate unshaded walls "
        "are off by 7 % (north) to 17 % (east) at 12 stations (root mean square), and 5 to "
        "11 % too high on average."
    )
    weather = say(of_climate if "climatology" in summary["weather"]["label"] else OF_RECORDS)
    shift, typical = (budget.get("sun_sampling") or {}).get("bias"), budget.get("sampling_median")
    # Where one of these errors is not known, none is told, but the weather's still is.
    if None in (shift, typical, budget.get("sampling_total")):
        unknown = say(
            "This run does not tell all errors of ray tracing and of the choice of sun positions."
        )
        return f"{unknown} {weather}"
    mean = percent(math.hypot(budget["sampling_total"], shift))
    words = [
        say(
            "As far as ray tracing and the choice of sun positions go, the mean over all surfaces "
            "is "
            "known to ± {mean} and the hours of a single surface typically to ± {single} (one "
            "standard error).",
            mean=mean,
            single=percent(typical),
        )
    ]
    # What reflections that were left out would add follows, if there is any.
    if bounces := budget.get("bounces"):
        most = percent(bounces)
        words.append(say("Reflections that were left out would add at most {most}.", most=most))
    return " ".join([*words, weather])


def plain_number(value):
    """A setting's number with the digits that it has, in the language that is spoken: str."""
    return number(value, "g")
